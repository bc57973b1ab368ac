"""The doors between the rooms: which package may import which, by reading every source file and by importing."""

import ast
import functools
import importlib
import itertools
import re
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

FORBIDDEN = {
    "replication/estimation": (
        "papers",
        "replication.audit",
        "replication.certify",
        "replication.verify",
        "matplotlib",
    ),
    "replication/audit": ("papers", "replication.estimation", "replication.certify", "control", "cvxpy", "clarabel"),
    "replication/certify": ("papers", "replication.audit", "matplotlib"),
    "replication/drawing": ("papers", "replication.audit", "replication.estimation", "replication.certify"),
    "replication/ownplant": ("papers", "matplotlib", "control", "cvxpy", "clarabel"),
}
"""What the files of each room must not import, anywhere in them."""

SHARED = ("replication.verify.algebra", "replication.verify.reading")
"""The parts of the verifier that makers of certificates may use: its algebra, and how it writes numbers."""
ASKS = "own.py"
"""The one module of theirs that asks the verifier: it hands out no certificate of an own plant that was not checked."""


@functools.cache
def imported(path: Path, package: str) -> list[tuple[int, str]]:
    """Line and full name of every import in the file, at any depth: statements, and calls with a literal name."""
    return list(_imported(ast.parse(path.read_text(encoding="utf-8")), package))


def _imported(tree: ast.AST, package: str) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, base] if base else above)
            # `from a import b` may import the module a.b.
            yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called in ("import_module", "__import__"):
                yield node.lineno, str(node.args[0].value)


def violations(root: Path) -> list[str]:
    """Every import at `root` through a door that is closed, as `file:line imports name`."""
    found = []
    for room, forbidden in FORBIDDEN.items():
        for path in sorted((root / room).rglob("*.py")):
            where = path.relative_to(root)
            package = ".".join(where.parent.parts)
            for line, name in imported(path, package):
                if any(name == other or name.startswith(f"{other}.") for other in forbidden):
                    found.append(f"{where.as_posix()}:{line} imports {name}")
    return found


def test_doors_hold() -> None:
    assert violations(ROOT) == []
    for room in FORBIDDEN:
        names = [
            name
            for path in (ROOT / room).rglob("*.py")
            for _, name in imported(path, path.relative_to(ROOT).parent.as_posix().replace("/", "."))
        ]
        assert any(name.startswith("replication.errors") for name in names), f"{room} is looked at"


@pytest.mark.parametrize(
    ("file", "source", "name"),
    [
        ("estimation/a.py", "import papers", "papers"),
        ("estimation/a.py", "import numpy, papers.toy as toy", "papers.toy"),
        ("estimation/a.py", "from papers import toy", "papers.toy"),
        ("estimation/a.py", "from replication import audit", "replication.audit"),
        ("estimation/a.py", "from replication.audit.model import Claim", "replication.audit.model.Claim"),
        ("estimation/a.py", "from .. import audit", "replication.audit"),
        ("estimation/a.py", "from ..audit import model", "replication.audit.model"),
        ("estimation/deep/a.py", "from ...audit.model import Claim", "replication.audit.model.Claim"),
        ("estimation/deep/__init__.py", "from ...audit import model", "replication.audit.model"),
        ("estimation/a.py", "def f():\n    import matplotlib.pyplot as plt", "matplotlib.pyplot"),
        ("estimation/a.py", "try:\n    import papers\nexcept ImportError:\n    pass", "papers"),
        ("estimation/a.py", "import importlib\nimportlib.import_module('papers.toy')", "papers.toy"),
        ("estimation/a.py", "__import__('papers')", "papers"),
        ("audit/a.py", "from replication import estimation", "replication.estimation"),
        ("audit/a.py", "from ..estimation import validation", "replication.estimation.validation"),
        ("audit/a.py", "import control", "control"),
        ("audit/a.py", "import cvxpy as cp", "cvxpy"),
        ("audit/a.py", "def f():\n    from replication.certify import own", "replication.certify.own"),
        ("estimation/a.py", "from ..verify import balls", "replication.verify.balls"),
        ("certify/a.py", "from papers.toy.data import A", "papers.toy.data.A"),
        ("certify/deep/a.py", "def f():\n    from ...audit import model", "replication.audit.model"),
        ("drawing/a.py", "if TYPE_CHECKING:\n    from replication.estimation import x", "replication.estimation.x"),
        (
            "estimation/a.py",
            "import papersize\nfrom replication.errors import E\nfrom . import audit\nimport numpy",
            "",
        ),
    ],
)
def test_a_planted_violation_is_found_and_what_is_allowed_is_not(
    file: str, source: str, name: str, tmp_path: Path
) -> None:
    path = tmp_path / "replication" / file
    path.parent.mkdir(parents=True)
    path.write_text(source, encoding="utf-8")
    assert [text.split(" imports ")[1] for text in violations(tmp_path)] == [name][: bool(name)]


def test_makers_of_certificates_use_the_algebra_of_the_verifier_only() -> None:
    for path in (ROOT / "replication" / "certify").rglob("*.py"):
        package = ".".join(path.relative_to(ROOT).parent.parts)
        for line, name in imported(path, package):
            if name.startswith("replication.verify") and path.name != ASKS:
                assert name.startswith(SHARED), f"{path}:{line} imports {name}"


def test_the_verifier_imports_python_flint_and_itself_only() -> None:
    room = ROOT / "replication" / "verify"
    allowed = {*sys.stdlib_module_names, "flint"}
    # The plants of the papers are loaded by it, each from its file alone.
    plants = sorted((ROOT / "papers").glob("*/plants.py"))
    assert len(plants) == 4
    for path in (*room.rglob("*.py"), *plants):
        package = ".".join(path.relative_to(ROOT).parent.parts)
        for line, name in imported(path, package):
            assert name.startswith("replication.verify.") or name.split(".")[0] in allowed, f"{path}:{line} {name}"


def modules_of(room: str) -> list[str]:
    """The names of all modules below a folder."""
    paths = sorted((ROOT / "replication" / room).rglob("*.py"))
    return [".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in paths]


METHODS = ("multirate", "nonuniform", "dualrate", "delay")
FOUR = f"from replication.estimation import {', '.join(METHODS)}\n"
WHOLE = "import importlib\nfor name in {}: importlib.import_module(name)"
HEAVY = ("numpy", "scipy", "control", "cvxpy", "clarabel", "sdpap", "matplotlib", "rich", "jinja2", "joblib", "msgspec")
LOADED: dict[str, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
    "the verifier comes without what makes certificates": (
        "import replication.verify.run",
        ("flint",),
        ("numpy", "scipy", "cvxpy", "clarabel", "msgspec", "papers", "replication.errors", "replication.audit"),
    ),
    **{
        f"the room {room} opens no closed door": (WHOLE.format(modules_of(room)), (modules_of(room)[-1],), closed)
        for room, closed in (
            ("estimation", ("papers", "replication.audit")),
            ("audit", ("papers", "replication.estimation", "control", "cvxpy")),
        )
    },
    "the methods come without anything heavy until they are used": (f"{FOUR}import replication.cli", (), HEAVY),
    # Plants as arrays need no python-control (whose import draws matplotlib in), no figure and no modeller.
    "their functions come without what they need not": (
        f"{FOUR}for door in ({', '.join(METHODS)}):\n    for name in door.__all__: getattr(door, name)",
        ("numpy", *(f"replication.estimation.{method}.facade" for method in METHODS)),
        ("control", "matplotlib", "cvxpy", "joblib", "rich", "msgspec"),
    ),
    "nor does a design for arrays need it": (
        f"{FOUR}plant = multirate.MultiratePlant(A=[[0.5]], B_d=[[1]], C=[[1]], D=[[1]])\n"
        "multirate.design(plant, periods=(2,))",
        ("scipy",),
        ("control", "matplotlib", "cvxpy", "rich"),
    ),
}
"""What is run, what must be loaded then, and what must not."""


@pytest.mark.parametrize("what", LOADED)
def test_what_is_loaded_and_what_is_not(what: str) -> None:
    code, wanted, closed = LOADED[what]
    program = f"import sys\n{code}\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    loaded = set(done.stdout.split())
    assert loaded >= set(wanted)
    assert [name for name in loaded if any(name == door or name.startswith(f"{door}.") for door in closed)] == []


Graph = dict[str, dict[str, int]]
"""By module, the modules that it imports, each with the line."""


def import_graph(root: Path, packages: tuple[str, ...] = ("replication", "papers")) -> Graph:
    """Which module of the packages imports which: at the top, inside functions, for type checking, by a literal name.

    A name that is taken from a package leads to the submodule of that name, or to the package where it is none. That
    importing a.b runs a/__init__ first is no import that anybody wrote, and is left out.
    """
    paths = {
        ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__"): path
        for package in packages
        for path in sorted((root / package).rglob("*.py"))
    }
    graph: Graph = {}
    for module, path in paths.items():
        package = ".".join(path.relative_to(root).parent.parts)
        edges: dict[str, int] = graph.setdefault(module, {})
        for line, name in imported(path, package):
            found = next((part for part in (name, name.rpartition(".")[0]) if part in paths), None)
            if found is not None:
                edges.setdefault(found, line)
    return graph


def circle(graph: Graph) -> str:
    """One way from a module over imports back to it, if there is any."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        ways = itertools.pairwise(reversed(error.args[1]))
        return ", ".join(sorted(f"{one}:{graph[one][other]} imports {other}" for one, other in ways))
    return ""


def test_no_import_leads_back_to_its_module() -> None:
    graph = import_graph(ROOT)
    assert len(graph) > 250 and sum(map(len, graph.values())) > 1000
    assert circle(graph) == ""


TOP = "from replication.b import x\n"


@pytest.mark.parametrize(
    ("back", "line"),
    [
        ("from replication.a import y", 1),
        ("from replication import a", 1),
        ("import replication.a as other", 1),
        ("from .a import y", 1),
        ("def f():\n    from replication.a import y", 2),
        ("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from replication.a import y", 3),
        ("import importlib\ndef f():\n    return importlib.import_module('replication.a')", 3),
        ("try:\n    from . import a\nexcept ImportError:\n    pass", 2),
    ],
)
def test_a_planted_circle_is_found(back: str, line: int, tmp_path: Path) -> None:
    for name, text in (("__init__", ""), ("a", TOP), ("b", back)):
        (tmp_path / "replication").mkdir(exist_ok=True)
        (tmp_path / "replication" / f"{name}.py").write_text(text, encoding="utf-8")
    told = circle(import_graph(tmp_path))
    assert told == f"replication.a:1 imports replication.b, replication.b:{line} imports replication.a"


def test_a_package_that_offers_its_modules_is_no_circle_unless_they_take_from_it(tmp_path: Path) -> None:
    for source, steps in (("import json", 0), ("from replication.room import x", 2)):
        room = tmp_path / str(steps) / "replication" / "room"
        room.mkdir(parents=True)
        (room / "__init__.py").write_text("from replication.room.a import x", encoding="utf-8")
        (room / "a.py").write_text(source, encoding="utf-8")
        assert circle(import_graph(tmp_path / str(steps))).count(" imports ") == steps


BRINGS_CODE = re.compile(
    r"\b(?:c?pickle|cloudpickle|dill|shelve|marshal|joblib\.(?:load|Memory)|np\.load|numpy\.load|allow_pickle|yaml\.load"
    r"|exec\(|eval\()"
)
ALLOWED = {"replication/estimation/conic/sdpa.py"}
"""Its pickle comes through a pipe from a process that it forked itself."""


def test_no_file_is_read_that_may_bring_code_along() -> None:
    sources = [path for room in ("replication", "papers") for path in (ROOT / room).rglob("*.py")]
    found = {str(path.relative_to(ROOT)) for path in sources if BRINGS_CODE.search(path.read_text(encoding="utf-8"))}
    assert found == ALLOWED
    assert BRINGS_CODE.search("joblib.Memory(folder)") and not BRINGS_CODE.search("joblib.Parallel(2)")


@pytest.mark.parametrize("path", sorted((ROOT / "benchmarks").glob("*.py")), ids=lambda path: path.stem)
def test_a_benchmark_finds_what_it_imports(path: Path) -> None:
    """No test runs most of them."""
    importlib.import_module(f"benchmarks.{path.stem}")
