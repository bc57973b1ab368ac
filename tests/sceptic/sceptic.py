"""Changes that a sceptic would try on the library and on the audit engine, each with a test that notices it.

`changes.toml` lists them: a sign, an index, a transposition, a dropped term, a skipped check. A change is made in a
process of its own, which imports everything of the project anew with the changed source in the place of the module's,
and calls the test. So nothing that was computed or imported before hides it.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType

import hypothesis
import pytest
from mutants import SECONDS, told_by_a_child

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OWN = ("replication", "papers", "tests")
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
    return (
        int(pytest.main(["-qx", "-n0", "-p", "no:cacheprovider", *(f"{ROOT}/tests/{test}" for test in tests)]))
        or "none"
    )


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
