"""Benchmarks of two runs are compared by their ratios."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from benchmarks.slower import NOTABLE, changes, costs, main
from benchmarks.table import document

PAGE = Path(__file__).parents[2] / "benchmarks" / "results.md"


def entry(seconds: float, name: str = "test_it", group: str | None = None, **info: object) -> dict[str, object]:
    stats = {"median": seconds, "rounds": 1}
    return {"name": name, "fullname": f"bench_x.py::{name}", "group": group, "stats": stats, "extra_info": info}


def page(ours: float = 1.0, machine: float = 1.0, **notes: float) -> str:
    """A page as it is written after a run: ours beside a peer that takes two seconds, on a machine so many times
    slower."""
    designs = [entry(machine * 2.0, group="Designs", row="n = 3", column="peer")]
    designs += [entry(machine * ours, group="Designs", row="n = 3", column="ours")]
    run = {"python_version": "3", "machine": "m", "cpu": {}}
    return document({"machine_info": run, "benchmarks": [*designs, entry(machine * ours, **notes)]})


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


def test_the_committed_page_is_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert len(costs(text)) >= text.count("(×") - text.count("(×1)") - 2
    assert main(str(PAGE), str(PAGE)) == 0
    slow = tmp_path / "slow.md"
    slow.write_text(re.sub(r"times faster(.*?) [\d.]+", r"times faster\1 0.001", text, count=1), encoding="utf-8")
    capsys.readouterr()
    assert main(str(PAGE), str(slow)) == 1
    assert "times the peer before" in capsys.readouterr().out
