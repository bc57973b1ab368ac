"""Kept results and the sources that they rest on: every dependency counts and is named, damage is noticed."""

import functools
import hashlib
import json
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replication.audit.model import SolverRecord
from replication.audit.run.tracing import ABSENT, state
from replication.audit.store.cache import (
    NEVER_RAN,
    NOT_ASKED,
    UNREADABLE,
    Cache,
    Dependencies,
    Entry,
    encode,
    solvers_in,
)
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError

BASE: dict[str, Any] = {
    "sources": {"lab/a.py": "1", "lab/b.py": "2"},
    "function": "lab.a:f",
    "inputs": '{"x":1}',
    "lock": "l",
    "python": "3.11",
    "packages": {"numpy": "2.4"},
    "kernel": "Haswell",
}


def dependencies(**changed: Any) -> Dependencies:
    return Dependencies(**{**BASE, **changed})


def entry(result: Any = 1.5, **changed: Any) -> Entry:
    solvers = (SolverRecord(name="abacus", version="1", status="optimal", options={"depth": 3}, iterations=2),)
    return Entry(dependencies=dependencies(**changed), seconds=2.5, solvers=solvers, result=result)


@pytest.fixture
def cache(tmp_path: Path) -> Cache:
    return Cache(tmp_path / "kept")


def test_what_was_stored_comes_back(cache: Cache) -> None:
    assert cache.lookup("e", dependencies()).reason == NEVER_RAN
    for result in ("another", {"b": [1, -0.0], "a": None}):
        cache.store("e", entry(result))
    assert [path.name for path in cache.directory.iterdir()] == ["e.json"], "no other file is left behind"
    found = cache.lookup("e", dependencies())
    assert found.entry == entry({"b": [1, -0.0], "a": None})
    assert list(found.entry.result) == ["b", "a"]
    assert found.last_seconds == 2.5


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"sources": {"lab/a.py": "9", "lab/b.py": "2"}}, "changed: lab/a.py"),
        ({"sources": {"lab/a.py": "1"}}, "changed: lab/b.py (no longer used)"),
        ({"sources": {**BASE["sources"], "lab/c.py": "3"}}, "changed: lab/c.py (new)"),
        ({"function": "lab.a:g"}, "changed: function"),
        ({"inputs": '{"x":2}'}, "changed: inputs"),
        ({"lock": "m"}, "changed: lock"),
        ({"python": "3.12"}, "changed: python"),
        ({"kernel": "SkylakeX"}, "changed: kernel"),
        ({"packages": {"numpy": "2.5"}}, "changed: numpy"),
        ({"inputs": "{}", "lock": "m"}, "changed: inputs, lock"),
        (
            {"sources": {f"lab/{letter}.py": "9" for letter in "abcdef"}, "inputs": "{}"},
            "changed: inputs, lab/a.py, lab/b.py and 4 more",
        ),
    ],
)
def test_every_dependency_counts_and_is_named(cache: Cache, changed: dict[str, Any], reason: str) -> None:
    cache.store("e", entry())
    found = cache.lookup("e", dependencies(**changed))
    assert (found.entry, found.reason, found.last_seconds) == (None, reason, 2.5)
    assert dependencies(**changed).key != dependencies().key


def test_a_cache_that_is_not_read_still_stores(cache: Cache) -> None:
    blind = Cache(cache.directory, read=False)
    blind.store("e", entry())
    assert blind.lookup("e", dependencies()).reason == NOT_ASKED
    assert cache.lookup("e", dependencies()).entry == entry()


def test_every_cut_and_every_changed_digit_is_noticed(cache: Cache) -> None:
    cache.store("e", entry(0.123456789))
    path = cache.directory / "e.json"
    whole = path.read_bytes()
    for length in range(len(whole) - 1):
        path.write_bytes(whole[:length])
        assert cache.lookup("e", dependencies()).reason == UNREADABLE
    for position, byte in enumerate(whole):
        if chr(byte).isdigit():
            path.write_bytes(whole[:position] + (b"1" if byte != ord("1") else b"2") + whole[position + 1 :])
            assert cache.lookup("e", dependencies()).entry is None


def test_result_of_another_key_cannot_be_passed_off(cache: Cache) -> None:
    cache.store("e", entry(1.0))
    path = cache.directory / "e.json"
    content = json.loads(path.read_bytes())
    key, _ = content.pop("key"), content.pop("sha256")
    assert _forged(content, key) == path.read_text(encoding="utf-8")
    content["dependencies"]["inputs"] = '{"x":2}'
    path.write_text(_forged(content, key), encoding="utf-8")
    assert cache.lookup("e", dependencies(inputs='{"x":2}')).reason == UNREADABLE
    path.write_text(_forged(content, dependencies(inputs='{"x":2}').key), encoding="utf-8")
    assert cache.lookup("e", dependencies(inputs='{"x":2}')).entry is not None


def _forged(content: Any, key: str) -> str:
    """An entry whose checksum is right."""
    text = json.dumps(content, separators=(",", ":"))
    return f'{{"key":"{key}","sha256":"{hashlib.sha256(text.encode()).hexdigest()}",{text[1:]}\n'


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_floats_survive_bit_for_bit(value: float) -> None:
    back = json.loads(encode("x", [value]))[0]
    assert struct.pack("<d", back) == struct.pack("<d", value)


@given(st.integers() | st.text() | st.booleans() | st.none())
def test_other_values_survive(value: object) -> None:
    assert json.loads(encode("x", {"v": value})) == {"v": value}
    assert json.loads(encode("x", np.float64(0.1))) == 0.1
    assert encode("x", {"a": 1, "b": 2}, sort=True) == encode("x", {"b": 2, "a": 1}, sort=True)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"a": [1.0, float("nan")]}, r"x\.a\[1\] is nan"),
        (float("inf"), "x is inf"),
        ({"a": 1j}, r"x\.a is a complex"),
        ({1: 2}, "x has the key 1"),
        ({"a": {"b"}}, r"x\.a is a set"),
        ([object()], r"x\[0\] is a object"),
        (np.eye(2), r"x is a numpy\.ndarray"),
    ],
)
def test_what_json_cannot_hold_is_refused_with_its_place(value: object, message: str) -> None:
    with pytest.raises(AuditError, match=message):
        encode("x", value)


def test_solvers_are_found_at_any_depth_and_checked() -> None:
    record = {"name": "abacus", "version": "1", "status": "optimal"}
    result = {"cells": [{"solvers": [record]}, {"deep": {"solvers": [record, record]}}], "solvers": []}
    assert solvers_in("r", result) == (SolverRecord(name="abacus", version="1", status="optimal"),) * 3
    with pytest.raises(AuditError, match=r"r: an entry of `solvers` is not a solver record.*version"):
        solvers_in("r", {"solvers": [{"name": "abacus", "status": "optimal"}]})


@pytest.fixture
def tree(tmp_path: Path) -> SourceTree:
    return SourceTree({"lab": tmp_path / "lab"})


def write(tmp_path: Path, **files: str) -> None:
    """Modules of the package `lab`, two underscores for a folder; each folder is a package, empty unless given."""
    for name, text in {"init": "", **files}.items():
        path = tmp_path / "lab" / (name.replace("__", "/") + ".py")
        path = path.with_name("__init__.py") if path.stem == "init" else path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


DEEP = {"top": "", "deep__init": "", "deep__side": "x = 1", "deep__deeper__init": "", "deep__deeper__near": ""}


@pytest.mark.parametrize(
    ("files", "module", "found"),
    [
        *(
            ({"a": text, "b": "f = 1"}, "a", ["__init__.py", "a.py", "b.py"])
            for text in (
                *("import lab.b", "import lab.b as other", "from lab import b", "from . import b", "from .b import f"),
                *("from lab.b import *", "def f():\n    from lab import b", "if True:\n    import lab.b"),
                "try:\n    from lab.b import f\nexcept ImportError:\n    raise",
            )
        ),
        # Transitive, without what is not used.
        (
            {"a": "from lab.b import f\nimport numpy", "b": "from . import c", "c": "x = 1", "unused": "import lab.a"},
            "a",
            ["__init__.py", "a.py", "b.py", "c.py"],
        ),
        (
            DEEP | {"deep__deeper__a": "from ... import top\nfrom ..side import x\nfrom . import near"},
            "deep.deeper.a",
            ["__init__.py", "deep/__init__.py", "deep/deeper/__init__.py", "deep/deeper/a.py", "deep/deeper/near.py",
             "deep/side.py", "top.py"],
        ),
        # An enclosing package counts, its imports only if a name is taken from it.
        ({"init": "from lab.c import C", "c": "C = ()", "a": "from lab import b", "b": ""}, "a",
         ["__init__.py", "a.py", "b.py"]),
        ({"init": "from lab.c import C", "c": "C = ()", "a": "from lab import C"}, "a",
         ["__init__.py", "a.py", "c.py"]),
        # A package that binds the name of a submodule is followed, and a circle ends.
        ({"init": "from lab.other import b", "a": "from lab import b", "b": "", "other": "import lab.a\nb = 1"}, "a",
         ["__init__.py", "a.py", "b.py", "other.py"]),
    ],
)  # fmt: skip
def test_the_files_of_a_module_are_all_that_it_imports(
    tmp_path: Path, tree: SourceTree, files: dict[str, str], module: str, found: list[str]
) -> None:
    write(tmp_path, **files)
    assert [file.removeprefix("lab/") for file in tree.files_of(f"lab.{module}")] == found


def test_checksums_follow_the_content(tmp_path: Path, tree: SourceTree) -> None:
    write(tmp_path, a="x = 1")
    before = tree.files_of("lab.a")
    assert state("lab/a.py", tree) == before["lab/a.py"]
    write(tmp_path, a="x = 2")
    assert state("lab/a.py", tree) not in (ABSENT, before["lab/a.py"])
    after = SourceTree({"lab": tmp_path / "lab"}).files_of("lab.a")
    assert after["lab/a.py"] != before["lab/a.py"]
    (tmp_path / "lab" / "a.py").unlink()
    assert state("lab/a.py", tree) == ABSENT


def test_unknown_module_and_broken_file_are_named(tmp_path: Path, tree: SourceTree) -> None:
    write(tmp_path, a="def f(:")
    with pytest.raises(AuditError, match="json is not a file of lab"):
        tree.files_of("json")
    with pytest.raises(AuditError, match=r"a\.py cannot be read as Python.*correct the file"):
        tree.files_of("lab.a")


def test_location_of_functions_partials_and_callable_objects(
    tmp_path: Path, tree: SourceTree, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "import functools\n\ndef f(x=0):\n    return x\n\nclass C:\n    def __call__(self):\n        return 1\n"
    text += "\n@functools.wraps(f)\ndef wrapped():\n    return f()\n"
    write(tmp_path, located=text)
    monkeypatch.syspath_prepend(str(tmp_path / "lab"))
    import located

    monkeypatch.delitem(sys.modules, "located")
    assert tree.location(located.f) == "lab/located.py:3"
    assert tree.location(functools.partial(functools.partial(located.f), x=1)) == "lab/located.py:3"
    assert tree.location(located.C()) == "lab/located.py:7"
    assert tree.location(located.wrapped) == "lab/located.py:3"
    assert tree.location(Path.cwd) == ""
    assert tree.location(len) == ""


def test_last_line_is_the_innermost_of_the_project(
    tmp_path: Path, tree: SourceTree, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, failing="import json\n\ndef outer():\n    inner()\n\ndef inner():\n    json.loads('')\n")
    monkeypatch.syspath_prepend(str(tmp_path / "lab"))
    import failing

    monkeypatch.delitem(sys.modules, "failing")
    with pytest.raises(ValueError, match="Expecting value") as caught:
        failing.outer()
    assert tree.last_line(caught.value.__traceback__) == "lab/failing.py:7"
