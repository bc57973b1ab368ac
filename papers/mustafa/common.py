"""An irregular sensor on the common plant: what a filter guarantees that does not know the next sampling period."""

from __future__ import annotations

from typing import Any

import numpy as np

from replication.audit.parts import CommonLevel
from replication.estimation import nonuniform

IRREGULAR = "irregular: 1 to m instants apart"


def levels(plant: dict[str, Any], multiples: list[int], leaves: int, horizon: int) -> list[list[float]]:
    """Bracket of the gain of the robust design over all sequences of periods in [h, m h], for each multiple m."""
    A, B, C = (np.array(plant[name]) for name in "ABC")
    system = nonuniform.SampledPlant(A, np.hstack([B, 0 * B]), C, np.array([[0.0, plant["noise"]]]), C)
    return [_bracket(system, plant["h"], m, leaves, horizon) for m in multiples]


def _bracket(system: nonuniform.SampledPlant, h: float, m: int, leaves: int, horizon: int) -> list[float]:
    if m == 1:
        from replication.estimation.nonuniform.nominal import riccati_level  # slow to load

        level = riccati_level(system, h).level
        return [level, level]
    found = nonuniform.design(system, periods=(h, m * h), leaves=leaves, horizon=horizon).bracket
    return [found.lower, found.upper]


def common(brackets: list[list[float]], multiples: list[int]) -> tuple[CommonLevel, ...]:
    """The rows of the report."""
    return tuple(
        CommonLevel(sensor=IRREGULAR, multiple=m, lower=low, upper=high, measure="l2 gain to the position's error")
        for m, (low, high) in zip(multiples, brackets, strict=True)
    )
