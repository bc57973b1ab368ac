"""Ranges of delays where the plant is marginal, and for every goal; units of the disturbance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from replication.estimation.delay import DelayPlant, design

LATE: dict[str, Any] = {
    "delays": [0.5], "b": [[1.0, 0.0]], "c10": [[1.0]], "c2": [[0.0]], "c2_delayed": [[[1.0]]], "d21": [[0.0, 1.0]]
}  # fmt: skip
GOALS = ("hinf", "h2", "mixed")


def test_over_ranges_an_integrator_is_left_open_with_the_reason() -> None:
    found = design(DelayPlant(a0=[[0.0]], ranges=[(0.49, 0.51)], **LATE))
    worst = found.fact("worst gain over the ranges")
    assert worst.value == "open" and "imaginary axis" in worst.method
    assert np.isfinite(found.value)


@pytest.mark.parametrize("goal", GOALS)
def test_every_goal_says_what_its_gains_are_worth_over_the_ranges(goal: str) -> None:
    found = design(DelayPlant(a0=[[-1.0]], ranges=[(0.4, 0.6)], **LATE), goal=goal)
    worst, attained = (found.fact(name).value for name in ("worst gain over the ranges", "attained there"))
    assert isinstance(worst, float) and isinstance(attained, float)
    # The nominal delay lies in the range, where the gain is at least as large as the lower end of the bracket.
    assert found.bracket.lower * (1 - 2e-3) <= worst and attained <= worst


@pytest.mark.parametrize("goal", GOALS)
@pytest.mark.parametrize("unit", [1e-9, 1e-6, 1e6])
def test_the_unit_of_the_disturbance_scales_the_level_and_nothing_else(goal: str, unit: float) -> None:
    def level(unit: float) -> float:
        scaled = {**LATE, "b": [[unit, 0.0]], "d21": [[0.0, unit]]}
        return design(DelayPlant(a0=[[-1.0]], **scaled), goal=goal).value

    assert level(unit) / unit == pytest.approx(level(1.0), rel=1e-6)
