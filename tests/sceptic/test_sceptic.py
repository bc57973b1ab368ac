"""No change that a sceptic would try on the library or the audit engine goes unnoticed by the tests.

`changes.toml` lists them: a sign, an index, a transposition, a dropped term, a skipped check. A change is made in a
process of its own, which imports everything of the project anew with the changed source in the place of the module's,
and calls the test. So nothing that was computed or imported before hides it.
"""

import ast
import importlib.util
import itertools
import os
import sys
import tomllib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType

import hypothesis
import pytest
from mutants import SECONDS, told_by_a_child

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OWN = ("replication", "papers", "tests", "benchmarks")
"""The packages that are imported anew."""
HEAVY = ("clarabel", "control", "cvxpy", "jinja2", "matplotlib.pyplot", "scipy.optimize", "scipy.signal")
"""Packages that take long to import."""


@dataclass(frozen=True)
class Change:
    """was, becomes: a part of the source of a module, and what a sceptic makes of it; test: which notices it, as
    FILE::NAME; equivalent: why none need.
    """

    module: str
    was: str
    becomes: str
    test: str = ""
    equivalent: str = ""

    def __str__(self) -> str:
        return f"{self.module}: {self.was} -> {self.becomes}"

    @property
    def path(self) -> Path:
        """The file of the module."""
        return ROOT / (self.name.replace(".", "/") + ".py")

    @property
    def name(self) -> str:
        """The full name of the module."""
        return self.module if self.module.startswith("papers.") else f"replication.{self.module}"

    def source(self) -> str:
        """The changed source; raises ValueError unless the part stands there exactly once."""
        text = self.path.read_text(encoding="utf-8")
        if text.count(self.was) != 1:
            raise ValueError(f"{self}: the part stands {text.count(self.was)} times in the module; name it anew")
        return text.replace(self.was, self.becomes)


def changes() -> list[Change]:
    """All changes, in the order of the list."""
    listed = tomllib.loads((HERE / "changes.toml").read_text(encoding="utf-8"))
    return [Change(module, **entry) for module, entries in listed.items() for entry in entries]


def noticed(change: Change) -> bool:
    """Whether its test fails under a change; a change that ends in the import, or never, is noticed too."""
    _import_what_stays()
    return told_by_a_child(lambda: _fails([change.test], change)) is not None


def passes(*tests: str) -> bool:
    """Whether tests pass in such a process without any change: one that fails anyway notices nothing."""
    _import_what_stays()
    return told_by_a_child(lambda: _fails(tests, None), SECONDS * len(tests)) is None


def _import_what_stays() -> None:
    """What tests need and no change touches, once for all processes."""
    for name in HEAVY:
        importlib.import_module(name)


def _fails(tests: Sequence[str], change: Change | None) -> int | str:
    afresh(change)
    # Whether they pass is all that is asked: no plugin, no words on what failed.
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    quiet = ("-qx", "--tb=no", "--assert=plain", "-p", "no:cacheprovider", "-p", "no:unraisableexception")
    return int(pytest.main([*quiet, *(f"{ROOT}/tests/{test}" for test in tests)])) or "none"


def afresh(change: Change | None) -> None:
    """Forget all modules of the project, and import them with the change from now on."""
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None) or ""
        if name.partition(".")[0] in OWN or file.startswith(f"{ROOT}/tests/"):
            del sys.modules[name]
    if change is not None:
        sys.meta_path.insert(0, _Finder(change))
    # What fails is looked for, not its smallest example.
    phases = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
    hypothesis.settings.register_profile("sceptic", phases=phases, database=None, derandomize=True, deadline=None)
    os.environ["HYPOTHESIS_PROFILE"] = "sceptic"


class _Finder(MetaPathFinder):
    """Finds the changed module alone."""

    def __init__(self, change: Change) -> None:
        self.name, self.change = change.name, change

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != self.name:
            return None
        file = str(self.change.path)
        return importlib.util.spec_from_file_location(fullname, file, loader=_Loader(self.change, file))


class _Loader(SourceFileLoader):
    def __init__(self, change: Change, file: str) -> None:
        super().__init__(change.name, file)
        self.change = change

    def get_code(self, fullname: str) -> CodeType:
        return compile(self.change.source(), str(self.change.path), "exec")


LISTED = changes()
WANTED = [change for change in LISTED if not change.equivalent]
TOGETHER = 20
"""Tests that one process runs."""
EVERY = 1 if os.environ.get("MUTANTS") == "all" else 40
"""One change of so many is tried, evenly spread over the rooms; all of them with MUTANTS=all (`make mutants`)."""
TRIED = WANTED[::EVERY]


def test_the_list_says_for_each_change_what_notices_it_or_why_nothing_need() -> None:
    assert [str(change) for change in LISTED if bool(change.test) == bool(change.equivalent)] == []
    assert [part for part, count in Counter(map(str, LISTED)).items() if count > 1] == []
    assert [str(change) for change in LISTED if change.source() == change.path.read_text(encoding="utf-8")] == []
    for change in LISTED:
        compile(change.source(), str(change), "exec")


def test_the_changes_are_spread_over_all_rooms() -> None:
    rooms = {
        ".".join(path.relative_to(ROOT / "replication").parent.parts)
        for room in ("estimation", "audit")
        for path in (ROOT / "replication" / room).rglob("*.py")
        if path.stem != "__init__"
    }
    assert sorted(rooms - {change.module.rpartition(".")[0] for change in LISTED}) == []


def test_every_test_that_is_named_is_there() -> None:
    """One that is not would seem to notice everything."""
    for file, names in itertools.groupby(
        sorted({change.test for change in WANTED}), lambda test: test.partition("::")[0]
    ):
        tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
        there = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert {name.partition("::")[2].partition("[")[0] for name in names} <= there, file


@pytest.mark.slow
@pytest.mark.skipif(EVERY > 1, reason="they are tests of this suite; `make mutants` calls them as it does for changes")
def test_what_notices_them_passes_without_any_change() -> None:
    tests = sorted({change.test for change in TRIED})
    groups = [tests[start : start + TOGETHER] for start in range(0, len(tests), TOGETHER)]
    assert [test for group in groups if not passes(*group) for test in group if not passes(test)] == []


@pytest.mark.slow
@pytest.mark.parametrize("change", TRIED, ids=str)
def test_every_change_is_noticed(change: Change) -> None:
    assert noticed(change), f"{change.test} does not notice it"


@pytest.mark.slow
def test_what_changes_nothing_is_not_noticed_and_a_test_that_is_not_there_notices_nothing() -> None:
    change = Change("audit.data", "import", "import", "audit/test_data.py")
    with pytest.raises(ValueError, match="name it anew"):
        change.source()
    quick = next(one for one in WANTED if one.module == "estimation.validation")
    same = replace(quick, becomes=quick.was)
    assert not noticed(same)
    assert not passes("audit/test_data.py::test_that_is_not_there")
