"""Sweeps of a dual-rate design: the stable sets of the period T and of the ratio M, and plants that differ from it.

The stable set of T need not be an interval: sampling folds a fast mode of the plant, so it is searched on a grid and
its ends are refined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from replication.estimation.dualrate.loop import MARGINAL, DualRateLoop, close_loop, stability_radius
from replication.estimation.dualrate.observers import Builder
from replication.estimation.dualrate.problem import DualRateDesign, Plant
from replication.estimation.dualrate.tracking import reference, tracking_error_ratio
from replication.estimation.validation import Array, increasing_grid

if TYPE_CHECKING:
    import control

Interval = tuple[float, float]


def radii_over_periods(design: DualRateDesign, builder: Builder, periods: Sequence[float]) -> Array:
    """Monodromy radius for each fast period T (s), at the ratio M of the design."""
    return np.array([_radius(design, builder, period) for period in periods])


def radii_over_ratios(design: DualRateDesign, builder: Builder, ratios: Sequence[int]) -> Array:
    """Monodromy radius for each ratio M, at the fast period of the design."""
    return np.array([stability_radius(close_loop(replace(design, ratio=ratio), builder)) for ratio in ratios])


def stable_periods(
    design: DualRateDesign, builder: Builder, periods: Sequence[float], *, tolerance: float = 1e-9
) -> tuple[Interval, ...]:
    """Intervals of T (s) with a stable loop, between the first and the last of the increasing grid `periods`.

    Two ends closer together than the grid may be missed. Raises InvalidInputError unless the grid increases from a
    positive start.
    """
    grid = increasing_grid("periods", periods)
    excess = radii_over_periods(design, builder, list(grid)) - 1.0
    ends = [float(grid[0])] if excess[0] < 0 else []
    for k in range(grid.size - 1):
        if (excess[k] < 0) != (excess[k + 1] < 0):
            ends.append(
                float(brentq(lambda t: _radius(design, builder, t) - 1.0, grid[k], grid[k + 1], xtol=tolerance))
            )
    if excess[-1] < 0:
        ends.append(float(grid[-1]))
    return tuple(zip(ends[::2], ends[1::2], strict=True))


def over_plants(
    nominal: DualRateLoop, builder: Builder, plants: Sequence[control.StateSpace | Plant]
) -> list[tuple[float, float | None]]:
    """(radius, tracking error ratio or None if there is no steady state) of the nominal loop around each true plant.

    The observer, the gains and the command stay those of the model. Raises InvalidInputError for a plant that does
    not fit, or a loop without a reference.
    """
    harmonic, found = reference(nominal), []
    for plant in plants:
        loop = close_loop(nominal.design, builder, plant=plant, harmonic=harmonic)
        radius = stability_radius(loop)
        found.append((radius, tracking_error_ratio(loop) if radius < 1.0 - MARGINAL else None))
    return found


def _radius(design: DualRateDesign, builder: Builder, period: float) -> float:
    return stability_radius(close_loop(replace(design, period=period), builder))
