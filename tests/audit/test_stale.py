"""Whatever a result depends on is changed, one thing at a time: it is computed again, or named as not traced.

All ways of changing something live in one project, a paper each, with names of their own: then a run in which those of
every other paper change must compute these again, and no other.
"""

# ruff: noqa: E501 - a case on a line
import json
import os
import re
import sqlite3
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from lab import Lab, emptied, make_lab

pytestmark = pytest.mark.slow
"""Each runs the program in a process of its own."""

PAPER = """
from replication.audit.declare import Evidence, Part, experiment, paper
from papers.roe.experiments import make
PART = Part("All", reading="none")
@PART.order("value", place="Sec. 1")
def value(results):
    "It is computed."
    return Evidence(method="by its experiment", cross_check="none", holds=True, margin=1.0 + 0 * len(str(results["made"])))
PAPER = paper(key="roe", title="T", authors=("A. Roe",), year=2020, venue="", doi="", summary="", bibtex="",
              parts=(PART,), experiments=(experiment("made", make),))
"""
PACKAGE = "mymath"

Files = dict[str, str | bytes | None]
"""Texts by path in the project, `site-packages/` is installed; None for a file that is to go."""


@dataclass
class Way:
    """A paper and a change of what its result depends on. code: the module of the experiment; files: others.

    environment: variables that change. named: words that must be said instead of computing again.
    reused: whether the change is none of those on which a result depends.
    """

    name: str
    code: str
    change: Files = field(default_factory=dict)
    files: Files = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=dict)
    named: str = ""
    reused: bool = False


def install(version: str, value: str, needs: str = "", name: str = PACKAGE) -> Files:
    info = f"site-packages/{name}-{version}.dist-info"
    required = f"Requires-Dist: {needs}\n" if needs else ""
    return {
        f"site-packages/{name}/__init__.py": value,
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{required}",
        f"{info}/RECORD": f"{name}/__init__.py,sha256={value.encode().hex()},1\n{info.partition('/')[2]}/METADATA,,\n",
        f"{info}/top_level.txt": f"{name}\n",
    }


def upgrade(value: str, name: str = PACKAGE) -> Files:
    """Another version; the folder of the old one stays, empty, as after an installation that was interrupted."""
    old = dict.fromkeys(path for path in install("1.0", "", name=name) if "dist-info" in path)
    return {**old, **install("2.0", value, name=name)}


def data_base() -> bytes:
    with sqlite3.connect(":memory:") as base:
        base.execute("pragma user_version = 2")
        base.execute("create table t (x)")
    return base.serialize()


WAYS = [
    *(Way(**way) for way in tomllib.loads(Path(__file__).with_name("ways.toml").read_text(encoding="utf-8"))["way"]),
    Way("package upgraded", f"import {PACKAGE}\ndef make(): return {PACKAGE}.f", upgrade("f = 2"),
        install("1.0", "f = 1")),
    Way("package rebuilt under its version", f"import {PACKAGE}\ndef make(): return {PACKAGE}.f", install("1.0", "f = 2"),
        install("1.0", "f = 1")),
    Way("package that a package requires", f"import {PACKAGE}\ndef make(): return {PACKAGE}.f",
        upgrade("f = 2", "deeper"),
        {**install("1.0", "from deeper import f", "deeper>=1"), **install("1.0", "f = 1", name="deeper")}),
    Way("package by computed name", "import importlib\ndef make(): return importlib.import_module('my' + 'math').f",
        upgrade("f = 2"), install("1.0", "f = 1")),
    Way("data file removed", "from pathlib import Path\ndef make():\n    try:\n        return (Path(__file__)"
        ".parents[2] / 'extra.txt').read_text()\n    except OSError:\n        return 'none'",
        {"extra.txt": None}, {"extra.txt": "1"}),
    Way("data base", "import sqlite3\nfrom pathlib import Path\ndef make():\n    return sqlite3.connect(Path(__file__)"
        ".parents[2] / 'a.db').execute('pragma user_version').fetchall()",
        {"a.db": data_base()}),
    Way("environment variable read by a package", f"import {PACKAGE}\ndef make(): return {PACKAGE}.f()",
        files=install("1.0", "import os\ndef f(): return os.environ.get('MODEL')"), environment={"MODEL": "2"}),
    Way("declaration of the paper", "def make(): return 1", {"papers/roe/__init__.py": PAPER.replace('"made", make)', '"made", make, )')}),
]  # fmt: skip


OWN = re.compile(r"\b(?:roe|model|MODEL|(?:my)?math|helper|tool|afar|deeper|data|extra|a(?=\.(?:csv|db))|s(?=\.py))\b")
"""Names that each paper of a project has for itself."""


def named(text: str, number: int) -> str:
    return OWN.sub(lambda match: f"{match[0]}{number}", text)


def key(number: int) -> str:
    return named("roe", number)


def put(lab: Lab, files: Files, number: int) -> None:
    for name, content in files.items():
        path = lab.root / named(name, number)
        if content is None:
            path.unlink()
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else named(content, number).encode())
        if content[:2] == "#!":
            path.chmod(0o755)


def project(root: Path, ways: Sequence[Way]) -> Lab:
    lab = emptied(make_lab(root / "lab"))
    for number, way in enumerate(ways):
        put(lab, {"papers/roe/__init__.py": PAPER, "papers/roe/experiments.py": way.code, **way.files}, number)
    return lab


def places(lab: Lab) -> dict[str, str]:
    ours = [str(lab.root / "site-packages"), str(lab.root.parent / "outside"), lab.environment()["PYTHONPATH"]]
    return {"PYTHONPATH": os.pathsep.join(ours)}


def run(lab: Lab, **environment: str) -> str:
    done = lab.cli("run", "--jobs", "1", **places(lab), **environment)
    assert done.returncode == 0 and not done.stderr, done.stdout + done.stderr
    return done.stdout


def computed(said: str) -> set[str]:
    return set(re.findall(r"computed (\w+)\.made", said))


FOLLOWED = [way for way in WAYS if not way.named]
UNFOLLOWED = [way for way in WAYS if way.named]
ALONE = [Way("", f"import os, {PACKAGE}\nM = os.getenv('MODEL')\ndef make(): return M", files=install("1.0", "f = 1"))]


def test_no_result_is_stale(tmp_path: Path) -> None:
    """First every second way changes, then the others; each time these alone are computed again."""
    lab = project(tmp_path, FOLLOWED)
    assert computed(run(lab)) == {key(number) for number, _ in enumerate(FOLLOWED)}
    environment: dict[str, str] = {}
    for turn in (0, 1):
        changed = list(enumerate(FOLLOWED))[turn::2]
        for number, way in changed:
            put(lab, way.change, number)
            environment |= {named(name, number): value for name, value in way.environment.items()}
        again = computed(run(lab, **environment))
        names = {key(number): way.name for number, way in enumerate(FOLLOWED)}
        expected = {key(number) for number, way in changed if (way.change or way.environment) and not way.reused}
        assert {names[one] for one in again} == {names[one] for one in expected}
    assert computed(run(lab, **environment)) == set()


def test_a_run_that_finds_one_thing_changed_is_not_taken_for_the_last(tmp_path: Path) -> None:
    """A variable that a module reads when it is imported, then the lock, which is set against what is installed."""
    lab = project(tmp_path, ALONE)
    put(lab, {"requirements.lock": f"{PACKAGE}==0.9\n"}, 0)
    first = run(lab)
    assert "1 computed, 0 reused" in first and f"note: not as locked: {named(PACKAGE, 0)} 1.0 (locked 0.9), " in first
    assert (lab.root / ".cache" / "replication" / "last-run.json").is_file()
    assert "0 computed, 1 reused" in run(lab)
    assert "1 computed, 0 reused" in run(lab, MODEL0="2")
    put(lab, {"requirements.lock": "numpy==0\n"}, 0)
    assert "1 computed, 0 reused" in run(lab, MODEL0="2")


def test_what_cannot_be_followed_is_named_and_computed_again(tmp_path: Path) -> None:
    lab = project(tmp_path, UNFOLLOWED)
    run(lab)
    results = json.loads((lab.root / "report" / "results.json").read_text())
    for number, way in enumerate(UNFOLLOWED):
        put(lab, way.change, number)
    again = run(lab)
    untraced = {one["name"]: one["untraced"] for one in results["experiments"]}
    reasons = {one["claim"]["id"]: one["judgement"]["reason"] for one in results["claims"]}
    for number, way in enumerate(UNFOLLOWED):
        words = named(way.named, number)
        if way.name == "file left for other programs":
            Path(words.removeprefix("writes ")).unlink()
        assert untraced[f"{key(number)}.made"] == [words]
        assert f"Not traced: {words}" in reasons[f"{key(number)}.value"]
        assert re.search(rf"computed {key(number)}\.made .*\(cannot be followed: {words}\)", again)


def test_what_differs_the_second_time_fails(tmp_path: Path) -> None:
    ways = [Way("", "import random\ndef make(): return random.Random().random()"), Way("", "def make(): return 1")]
    lab = project(tmp_path, ways)
    done = lab.cli("run", "--twice")
    assert done.returncode == 1
    assert "twice: 1 of 2 results differ: roe0.made" in done.stdout
    assert not list(lab.root.rglob("roe0.made.json")) and list(lab.root.rglob("roe1.made.json"))
    same = lab.cli("run", "--twice", "roe1")
    assert same.returncode == 0 and "none of 1 results differs" in same.stdout


def test_an_experiment_that_hangs_is_ended(tmp_path: Path) -> None:
    codes = ["while True: pass", "import time; time.sleep(600)",
             "while True:\n        try: __import__('time').sleep(9)\n        except Exception: pass"]  # fmt: skip
    done = project(tmp_path, [Way("", f"def make():\n    {code}") for code in codes]).cli("run", "--timeout", "0.5")
    assert done.returncode == 3
    for number, _ in enumerate(codes):
        assert f"error: experiment roe{number}.made: it took longer than 0.5 s" in done.stdout
