"""No change that a sceptic would try on the library or the audit engine goes unnoticed by the tests."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import replace

import pytest
import sceptic

LISTED = sceptic.changes()
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
        ".".join(path.relative_to(sceptic.ROOT / "replication").parent.parts)
        for room in ("estimation", "audit")
        for path in (sceptic.ROOT / "replication" / room).rglob("*.py")
        if path.stem != "__init__"
    }
    assert sorted(rooms - {change.module.rpartition(".")[0] for change in LISTED}) == []


@pytest.mark.slow
def test_what_notices_them_passes_without_any_change() -> None:
    tests = sorted({change.test for change in TRIED})
    groups = [tests[start : start + TOGETHER] for start in range(0, len(tests), TOGETHER)]
    assert [test for group in groups if not sceptic.passes(*group) for test in group if not sceptic.passes(test)] == []


@pytest.mark.slow
@pytest.mark.parametrize("change", TRIED, ids=str)
def test_every_change_is_noticed(change: sceptic.Change) -> None:
    assert sceptic.noticed(change), f"{change.test} does not notice it"


@pytest.mark.slow
def test_what_changes_nothing_is_not_noticed_and_a_test_that_is_not_there_notices_nothing() -> None:
    change = sceptic.Change("audit.data", "import", "import", "audit/test_data.py")
    with pytest.raises(ValueError, match="name it anew"):
        change.source()
    same = replace(WANTED[0], becomes=WANTED[0].was)
    assert not sceptic.noticed(same)
    assert not sceptic.passes("audit/test_data.py::test_that_is_not_there")
