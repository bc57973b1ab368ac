import hashlib
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replication.audit.model import SolverRecord
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
            "changed: inputs, lab/a.py, lab/b.py, lab/c.py (new) and 3 more",
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


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b"null", b"\xff\xfe", b'{"key": 1, "sha256": 2}', b"[" * 100_000]
)
def test_a_damaged_entry_is_not_used(cache: Cache, content: bytes) -> None:
    cache.store("e", entry())
    (cache.directory / "e.json").write_bytes(content)
    found = cache.lookup("e", dependencies())
    assert (found.entry, found.reason) == (None, UNREADABLE)


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
