"""Numbers that a finding or an alternative text only types are told; those that come from results or prints are not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import pytest

from replication.audit.judge.typed import require_found
from replication.errors import AuditError

RESULTS = {"model": {"rate": 1.0, "mean": 12.345, "all": [1.5, 2.5, 4.5], "n": 1005, "rows": [0.0] * 240, "on": True}}
Ask = Callable[[Any], Sequence[str]]


@pytest.mark.parametrize(
    "ask",
    [
        lambda given: [f"The mean is {given['model']['mean']:.1f} hours."],
        lambda given: [f"Together {sum(given['model']['all']):.2f}, at most {max(given['model']['all']):.3f}."],
        lambda given: [f"Stable up to {given['model']['n'] - 1}, of {given['model']['n']:,}."],
        lambda given: ["One of 240 draws, the last 239 of them."],
        lambda given: ["Printed as 0.75, at 1.2 s, in Theorem 3 with 24 cases."],
        lambda given: ["It rises 12-fold."],
        lambda given: [f"{'More' if given['model']['mean'] > 1 else 'Less'} than 24."],
    ],
)  # fmt: skip
def test_a_number_of_results_or_prints_may_stand(ask: Ask) -> None:
    require_found("finding", ask, RESULTS, ["0.75", "(1.2, 3.4)"])


@pytest.mark.parametrize(
    ("ask", "number"),
    [
        (lambda given: ["The mean is 99.9 hours."], "99.9"),
        (lambda given: [f"The mean is {given['model']['mean']:.1f}, not 12.4 hours."], "12.4"),
        (lambda given: ["Of 7,635,996 settings none does."], "7,635,996"),
        (lambda given: ["It is .75 of that.", f"Mean {given['model']['mean']:.1f}."], ".75"),
        (lambda given: ["Patients: 242."], "242"),
        (lambda given: [f"From {given['model']['rate']:g} on, the mean is 99.9 hours."], "99.9"),
    ],
)
def test_a_number_that_is_typed_is_told(ask: Ask, number: str) -> None:
    with pytest.raises(AuditError, match=rf"^the finding '.*' says {number}, which the paper does not print"):
        require_found("finding", ask, RESULTS, ["0.74", "(1.2, 3.4)"])


def test_what_fails_on_moved_numbers_decides_nothing() -> None:
    def ask(given: Any) -> list[str]:
        if given != RESULTS:
            raise ValueError
        return ["The mean is 99.9 hours."]

    require_found("finding", ask, RESULTS, [])
