"""Benchmarks of two runs are compared by their ratios."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from benchmarks.table import NOTABLE, changes, costs, document, main

PAGE = Path(__file__).parents[2] / "benchmarks" / "results.md"


def entry(seconds: float, name: str = "test_it", group: str | None = None, **info: object) -> dict[str, object]:
    stats = {"median": seconds, "rounds": 1}
    return {"name": name, "fullname": f"bench_x.py::{name}", "group": group, "stats": stats, "extra_info": info}


def run_of(ours: float = 1.0, machine: float = 1.0, **notes: float) -> dict[str, object]:
    """Ours beside a peer that takes two seconds, on a machine so many times slower."""
    designs = [entry(machine * 2.0, group="Designs", row="n = 3", column="peer")]
    designs += [entry(machine * ours, group="Designs", row="n = 3", column="ours")]
    run = {"python_version": "3", "machine": "m", "cpu": {}}
    return {"machine_info": run, "benchmarks": [*designs, entry(machine * ours, **notes)]}


def page(ours: float = 1.0, machine: float = 1.0, **notes: float) -> str:
    """The page of a run."""
    return document(run_of(ours, machine, **notes))


def test_each_ratio_is_ours_over_that_of_a_peer() -> None:
    found = costs(page(times_slower=4.0, of_dlqe=3.0, starts=5.0, gap=0.5))
    assert found == {
        "Designs, n = 3: peer": 0.5,
        "X, it: times slower": 0.25,
        "X, it: of dlqe": 3.0,
        "X, it: starts": 5.0,
    }


@pytest.mark.parametrize("machine", [0.1, 10.0])
def test_another_machine_is_no_change(machine: float) -> None:
    assert changes(costs(page(of_dlqe=2.0)), costs(page(machine=machine, of_dlqe=2.0))) == []


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (page(), page(ours=NOTABLE * 1.01)),
        (page(of_dlqe=2.0), page(of_dlqe=2.0 * NOTABLE * 1.01)),
        (page(times_slower=9.0), page(times_slower=9.0 / NOTABLE / 1.01)),
    ],
)
def test_what_got_slower_is_told_and_what_got_faster_is_not(before: str, after: str) -> None:
    assert [re.sub(".*: ", "", text) for text in changes(costs(before), costs(after))] != []
    assert changes(costs(after), costs(before)) == []


def test_what_is_not_measured_any_more_is_told() -> None:
    assert changes(costs(page(of_dlqe=2.0)), costs(page())) == ["X, it: of dlqe: not measured any more"]
    assert changes(costs(page()), costs(page(of_dlqe=2.0))) == ["X, it: of dlqe: new"]


def test_the_committed_page_is_read() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert len(costs(text)) >= text.count("(×") - text.count("(×1)") - 2
    slow = re.sub(r"times faster(.*?) [\d.]+", r"times faster\1 0.001", text, count=1)
    assert ["times the peer before" in told for told in changes(costs(text), costs(slow))] == [True]


@pytest.mark.parametrize(("slower", "told"), [(1.0, "0 changes in 2 ratios"), (2.0, "times the peer before")])
def test_the_page_is_written_and_the_changes_are_told(
    slower: float, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, old, new = (tmp_path / name for name in ("run.json", "old.md", "new.md"))
    run.write_text(json.dumps(run_of(ours=slower, of_dlqe=slower)), encoding="utf-8")
    old.write_text(page(of_dlqe=1.0), encoding="utf-8")
    assert main(str(run), str(old), str(new)) == int(slower > 1)
    assert told in capsys.readouterr().out and new.read_text(encoding="utf-8") == page(slower, of_dlqe=slower)
