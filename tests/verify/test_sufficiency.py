"""That the conditions of a paper suffice: a sign, a transpose or a weight altered in one of them proves nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from replication.verify import run
from replication.verify.algebra.symbolic import Symbolic
from replication.verify.multirate import identities as multirate
from replication.verify.nonuniform import identities
from replication.verify.theorem import Refused

ROOT = Path(__file__).parents[2] / "certificates"
THEOREMS = ("okajima2023/theorem-1", "okajima2023/theorem-2", "mustafa/lemma-1", "mustafa/stability", "mustafa/level")
CONDITIONS = multirate._conditions


def proved(name: str) -> bool:
    return run.verify(ROOT / f"{name}.json").theorem is not None


@pytest.mark.parametrize(
    ("row", "column", "alter"),
    [(0, 0, lambda e: e - e - e), (0, 1, lambda e: e - e - e), (2, 1, lambda e: e.T), (1, 1, lambda e: e + e)],
)
@pytest.mark.parametrize("name", THEOREMS[:2])
def test_an_altered_matrix_20_proves_nothing(
    name: str, row: int, column: int, alter: Callable[..., object], monkeypatch: pytest.MonkeyPatch
) -> None:
    m, closed, theta = CONDITIONS()
    rows = [list(entries) for entries in theta.rows]
    rows[row][column] = alter(rows[row][column])
    altered = Symbolic(tuple(map(tuple, rows)))
    monkeypatch.setattr(multirate, "_conditions", lambda: (m, closed, altered))
    assert not proved(name)


@pytest.mark.parametrize("step", ["congruence", "recovery"])
def test_the_level_of_theorem_3_rests_on_both_identities(step: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> None:
        raise Refused("no identity")

    monkeypatch.setattr(identities, step, replace(getattr(identities, step), prove=refuse))
    assert not proved("mustafa/level") and proved("mustafa/lemma-1")


@pytest.mark.parametrize("name", THEOREMS[2:])
def test_each_rests_on_the_loss_along_the_error_system(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> None:
        raise Refused("no identity")

    monkeypatch.setattr(identities, "_dissipation", refuse)
    assert not proved(name)
