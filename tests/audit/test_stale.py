"""Whatever a result depends on is changed, one thing at a time: it is computed again, or named as not traced."""

# ruff: noqa: E501 - a case on a line
from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from lab import Lab, make_lab

pytestmark = pytest.mark.slow
"""Each runs the program in a process of its own."""

PAPER = """
from replication.audit.declare import Evidence, Part, experiment, paper
from papers.roe.experiments import make
PART = Part("All", reading="none")
@PART.order("value", place="Sec. 1", uses="made")
def value(results):
    "It is computed."
    return Evidence(method="by its experiment", cross_check="none", holds=True, margin=1.0 + 0 * len(str(results["made"])))
PAPER = paper(key="roe", title="T", authors=("A. Roe",), year=2020, venue="", doi="", summary="", bibtex="",
              parts=(PART,), experiments=(experiment("made", make),))
"""
PACKAGE = "mymath"


@dataclass
class Way:
    """A project and a change of it. code: the module of the experiment; files: others by path, `site/` is installed.

    change: what is done to the folder. environment: variables of the second run. named: words that must be said instead
    of computing again.
    """

    name: str
    code: str
    change: Callable[[Path], None] = lambda root: None
    files: dict[str, str] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=dict)
    named: str = ""
    reused: bool = False


def put(name: str, text: str) -> Callable[[Path], None]:
    def write(root: Path) -> None:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        if text.startswith("#!"):
            path.chmod(path.stat().st_mode | stat.S_IXUSR)

    return write


def install(version: str, value: str, needs: str = "", name: str = PACKAGE) -> dict[str, str]:
    info = f"site-packages/{name}-{version}.dist-info"
    required = f"Requires-Dist: {needs}\n" if needs else ""
    return {
        f"site-packages/{name}/__init__.py": value,
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{required}",
        f"{info}/RECORD": f"{name}/__init__.py,sha256={abs(hash(value))},1\n{info.partition('/')[2]}/METADATA,,\n",
        f"{info}/top_level.txt": f"{name}\n",
    }


def upgrade(version: str, value: str, name: str = PACKAGE) -> Callable[[Path], None]:
    def change(root: Path) -> None:
        for old in (root / "site-packages").glob(f"{name}*"):
            shutil.rmtree(old)
        for path, text in install(version, value, name=name).items():
            put(path, text)(root)

    return change


READS = "from pathlib import Path\nROOT = Path(__file__).parents[2]\ndef make():\n    return "
STARTS = "import subprocess\ndef make():\n    return subprocess.run({}, capture_output=True, text=True).stdout"
WAYS = [
    Way("module beside papers", "from model.core import f\ndef make(): return f", put("model/core.py", "f = 2"),
        {"model/core.py": "f = 1", "model/__init__.py": ""}),
    Way("module imported by that", "from model.core import f\ndef make(): return f", put("model/deep.py", "f = 2"),
        {"model/core.py": "from .deep import f", "model/deep.py": "f = 1", "model/__init__.py": ""}),
    Way("namespace package", "from model.core import f\ndef make(): return f", put("model/core.py", "f = 2"),
        {"model/core.py": "f = 1"}),
    Way("single module", "import helper\ndef make(): return helper.f", put("helper.py", "f = 2"), {"helper.py": "f = 1"}),
    Way("module of the paper", "from papers.roe.m import f\ndef make(): return f", put("papers/roe/m.py", "f = 2"),
        {"papers/roe/m.py": "f = 1"}),
    Way("module by sys.path", "import sys\nfrom pathlib import Path\nsys.path.insert(0, str(Path(__file__).parents[2] / 'lib'))"
        "\nimport tool\ndef make(): return tool.f", put("lib/tool.py", "f = 2"), {"lib/tool.py": "f = 1"}),
    Way("import by computed name", "import importlib\ndef make(): return importlib.import_module('model.' + 'core').f",
        put("model/core.py", "f = 2"), {"model/core.py": "f = 1"}),
    Way("import by computed name at import", "import importlib\nM = importlib.import_module('model.' + 'core')\n"
        "def make(): return M.f", put("model/core.py", "f = 2"), {"model/core.py": "f = 1"}),
    Way("script run by path", "import runpy\nfrom pathlib import Path\ndef make(): return runpy.run_path("
        "str(Path(__file__).parents[2] / 's.py'))['f']", put("s.py", "f = 2"), {"s.py": "f = 1"}),
    Way("lazy import", "def make():\n    from model.core import f\n    return f", put("model/core.py", "f = 2"),
        {"model/core.py": "f = 1"}),
    Way("module outside the project", "import afar\ndef make(): return afar.f", put("../outside/afar.py", "f = 2"),
        {"../outside/afar.py": "f = 1"}),
    Way("package upgraded", f"import {PACKAGE}\ndef make(): return {PACKAGE}.f", upgrade("2.0", "f = 2"),
        install("1.0", "f = 1")),
    Way("package rebuilt under its version", f"import {PACKAGE}\ndef make(): return {PACKAGE}.f", upgrade("1.0", "f = 2"),
        install("1.0", "f = 1")),
    Way("package that a package requires", f"import {PACKAGE}\ndef make(): return {PACKAGE}.f",
        upgrade("2.0", "f = 2", "deeper"),
        {**install("1.0", "from deeper import f", "deeper>=1"), **install("1.0", "f = 1", name="deeper")}),
    Way("package by computed name", "import importlib\ndef make(): return importlib.import_module('my' + 'math').f",
        upgrade("2.0", "f = 2"), install("1.0", "f = 1")),
    Way("data file", READS + "(ROOT / 'data/a.csv').read_text()", put("data/a.csv", "2"), {"data/a.csv": "1"}),
    Way("data file read by import", "from pathlib import Path\nA = (Path(__file__).parents[2] / 'data' / 'a.csv').read_text()"
        "\ndef make(): return A", put("data/a.csv", "2"), {"data/a.csv": "1"}),
    Way("hidden data file", READS + "(ROOT / '.data/a.csv').read_text()", put(".data/a.csv", "2"), {".data/a.csv": "1"}),
    Way("data outside the project", READS + "(ROOT.parent / 'a.csv').read_text()", put("../a.csv", "2"), {"../a.csv": "1"}),
    Way("a file more in a folder", READS + "[p.name for p in sorted((ROOT / 'data').glob('*'))]", put("data/b.csv", "2"),
        {"data/a.csv": "1"}),
    Way("a file that was not there", "from pathlib import Path\ndef make():\n    try:\n        return (Path(__file__)"
        ".parents[2] / 'extra.txt').read_text()\n    except OSError:\n        return 'none'", put("extra.txt", "2")),
    Way("data file removed", "from pathlib import Path\ndef make():\n    try:\n        return (Path(__file__)"
        ".parents[2] / 'extra.txt').read_text()\n    except OSError:\n        return 'none'",
        lambda root: (root / "extra.txt").unlink(), {"extra.txt": "1"}),
    Way("data base", "import sqlite3\nfrom pathlib import Path\ndef make():\n    return sqlite3.connect(Path(__file__)"
        ".parents[2] / 'a.db').execute('pragma user_version').fetchall()",
        lambda root: subprocess.run([sys.executable, "-c", "import sqlite3; c = sqlite3.connect('a.db'); "
            "c.execute('pragma user_version = 2'); c.execute('create table t (x)'); c.commit()"],
            cwd=root, check=True) and None),
    Way("environment variable", "import os\ndef make(): return os.environ.get('MODEL')", environment={"MODEL": "2"}),
    Way("environment variable at import", "import os\nM = os.getenv('MODEL')\ndef make(): return M",
        environment={"MODEL": "2"}),
    Way("environment variable asked for", "import os\ndef make(): return 'MODEL' in os.environ", environment={"MODEL": "2"}),
    Way("environment variable read by a package", f"import {PACKAGE}\ndef make(): return {PACKAGE}.f()",
        files=install("1.0", "import os\ndef f(): return os.environ.get('MODEL')"), environment={"MODEL": "2"}),
    Way("language", "import locale\ndef make(): return [locale.setlocale(locale.LC_ALL, ''), locale.getpreferredencoding()]",
        environment={"LC_ALL": "C", "LANG": "C"}, reused=True),
    Way("time zone", "import time\ndef make(): return time.localtime(0).tm_hour", environment={"TZ": "Asia/Tokyo"}, reused=True),
    Way("lock", "def make(): return 1", put("requirements.lock", "numpy==0\n")),
    Way("program by subprocess", STARTS.format("['sh', '-c', 'echo 1']"), named="program sh"),
    Way("program by os.system", "import os\ndef make(): return os.system('true')", named="program true"),
    Way("program of its own", STARTS.format("['./tool']"), put("tool", "#!/bin/sh\necho 2\n"),
        {"tool": "#!/bin/sh\necho 1\n"}, named="program tool"),
    Way("network", "import socket\ndef make():\n    try:\n        socket.create_connection(('127.0.0.1', 9), 1)\n"
        "    except OSError:\n        return 'none'", named="network"),
    Way("declaration of the paper", "def make(): return 1", put("papers/roe/__init__.py", PAPER.replace('"made", make)', '"made", make, )'))),
]  # fmt: skip


def project(root: Path, way: Way) -> Lab:
    lab = make_lab(root / "lab")
    shutil.rmtree(lab.root / "papers" / "toy2020")
    (lab.root / "papers" / "other2021.py").unlink()
    files = {"papers/roe/__init__.py": PAPER, "papers/roe/experiments.py": way.code, **way.files}
    for name, text in files.items():
        put(name, textwrap.dedent(text))(lab.root)
    return lab


def run(lab: Lab, *options: str, **environment: str) -> str:
    places = [str(lab.root / "site-packages"), str(lab.root.parent / "outside"), lab.environment()["PYTHONPATH"]]
    cleared = {name: value for name, value in environment.items() if value}
    done = lab.cli("run", *options, **{"PYTHONPATH": os.pathsep.join(places), **cleared})
    assert done.returncode == 0 and not done.stderr, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.name)
def test_no_result_is_stale(tmp_path: Path, way: Way) -> None:
    lab = project(tmp_path, way)
    assert "1 computed, 0 reused" in run(lab)
    before = (lab.root / "report" / "results.json").read_text()
    if way.named:
        assert f"Not traced: {way.named}" in before and f'"untraced": [\n        "{way.named}"' in before
    else:
        assert "0 computed, 1 reused" in run(lab)
    way.change(lab.root)
    again = run(lab, **way.environment)
    assert ("0 computed, 1 reused" if way.reused else "1 computed, 0 reused") in again, again
    if way.named:
        assert f"(cannot be followed: {way.named})" in again


def test_what_is_installed_is_set_against_the_lock(tmp_path: Path) -> None:
    lab = project(tmp_path, Way("", f"import {PACKAGE}\ndef make(): return {PACKAGE}.f", files=install("1.0", "f = 1")))
    put("requirements.lock", f"{PACKAGE}==0.9\n")(lab.root)
    assert f"note: not as locked: {PACKAGE} 1.0 (locked 0.9), numpy " in run(lab)


@pytest.mark.parametrize(("code", "differs"), [("import random\ndef make(): return random.Random().random()", True),
                                               ("def make(): return 1", False)])  # fmt: skip
def test_what_differs_the_second_time_fails(tmp_path: Path, code: str, differs: bool) -> None:
    done = project(tmp_path, Way("", code)).cli("run", "--twice")
    assert done.returncode == (1 if differs else 0)
    assert ("twice: 1 of 1 results differ: roe.made" in done.stdout) == differs


@pytest.mark.parametrize("code", ["while True: pass", "import time; time.sleep(600)",
                                  "while True:\n        try: __import__('time').sleep(9)\n        except Exception: pass"])  # fmt: skip
def test_an_experiment_that_hangs_is_ended(tmp_path: Path, code: str) -> None:
    done = project(tmp_path, Way("", f"def make():\n    {code}")).cli("run", "--timeout", "0.5")
    assert done.returncode == 3
    assert "error: experiment roe.made: it took longer than 0.5 s" in done.stdout


def test_a_time_out_is_a_positive_number(tmp_path: Path) -> None:
    lab = project(tmp_path, Way("", "def make(): return 1"))
    for text in ("0", "-1", "inf", "nan", "x"):
        assert "is no positive number of seconds" in lab.cli("run", "--timeout", text).stderr
