"""Robust design for every sampling period in [h_l, h_u] with one Lyapunov function: exchange in place of a dense grid.

(10) is asked for a handful of periods; the period at which the solution violates it most joins them, until none does.
Unlike a grid it looks between the nodes, and every inequality that the solver sees matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.errors import SolverError
from replication.estimation.nonuniform.filter_lmi import (
    FilterDesign,
    LmiVariables,
    Normalised,
    design_for_periods,
    lmi10,
    normalise,
)
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.validation import Array, positive_integer

SCAN = 257
"""Equally spaced periods at which the violation is looked at before its peaks are polished."""
VIOLATION = 5e-7
"""Largest eigenvalue of (10), in normalised coordinates, that counts as satisfied: the level is then right to about
1e-6."""
INACTIVE = 1e-3
"""Share of the dual weight below which a period leaves the grid; it comes back if it is violated again."""
NEIGHBOURS = 0.25
"""Active periods closer than this share of the range are condensed."""


@dataclass(frozen=True)
class RobustDesign:
    """design: the last one; rounds: solver calls; violation: largest eigenvalue of (10) left over the whole range."""

    design: FilterDesign
    rounds: int
    violation: float


def violations(normalised: Normalised, v: LmiVariables, periods: Array) -> Array:
    """Largest eigenvalue of the matrix of (10) at each period; not above zero iff the inequality holds there."""
    return largest_eigenvalues(normalised.plant, v, normalised.plant.transitions(periods))


def largest_eigenvalues(plant: SampledPlant, v: LmiVariables, transitions: Array) -> Array:
    """The same for given stacks of transition matrices (K, n + m, n + m)."""
    n = plant.order
    return np.asarray(np.linalg.eigvalsh(lmi10(plant, transitions[:, :n, :n], transitions[:, :n, n:], v))[:, -1])


def worst_periods(
    normalised: Normalised, v: LmiVariables, candidates: Array, transitions: Array
) -> list[tuple[float, float]]:
    """(violation, period) at the local peaks of the violation over the sorted `candidates`, largest first.

    Each inner peak moves to the top of the parabola through it and its neighbours, if that is higher.
    """
    values = largest_eigenvalues(normalised.plant, v, transitions)
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    peaks = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:]))
    tops, heights = candidates[peaks], values[peaks]
    inner = (peaks > 0) & (peaks < len(candidates) - 1)
    if np.any(inner):
        rise, fall = (values[peaks[inner]] - values[peaks[inner] + side] for side in (-1, 1))
        tops[inner] += (rise - fall) / (rise + fall) / 2 * (candidates[1] - candidates[0])
        polished = violations(normalised, v, tops)
        lower = polished < heights
        tops[lower], heights = candidates[peaks[lower]], np.maximum(polished, heights)
    return sorted(zip(heights.tolist(), tops.tolist(), strict=True), reverse=True)


def condensed(design: FilterDesign, periods: PeriodRange) -> list[float]:
    """The grid without periods of no dual weight, inner neighbours replaced by their weighted mean.

    Two active periods side by side stand for one between them; the mean converges to it much faster than bisection.
    """
    total = sum(design.weights)
    active = [pair for pair in zip(design.periods, design.weights, strict=True) if pair[1] > INACTIVE * total]
    clusters: list[list[tuple[float, float]]] = []
    for h, weight in active:
        inner = periods.h_l < h < periods.h_u
        near = clusters and h - clusters[-1][-1][0] < NEIGHBOURS * (periods.h_u - periods.h_l)
        if inner and near and clusters[-1][-1][0] > periods.h_l:
            clusters[-1].append((h, weight))
        else:
            clusters.append([(h, weight)])
    return [sum(h * w for h, w in c) / sum(w for _, w in c) if len(c) > 1 else c[0][0] for c in clusters]


def halfway(grid: list[float], h: float, periods: PeriodRange) -> float:
    """The middle between `h` and an inner period of the grid beside it, where both estimate the same active period."""
    inner = [g for g in grid if periods.h_l < g < periods.h_u]
    nearest = min(inner, key=lambda g: abs(g - h), default=None)
    if nearest is None or abs(nearest - h) > NEIGHBOURS / 4 * (periods.h_u - periods.h_l):
        return h
    return (nearest + h) / 2


def robust_design(plant: SampledPlant, periods: PeriodRange, *, max_rounds: int = 40) -> RobustDesign:
    """Minimise gamma subject to (10) for every period of the range; the guarantee holds for every sampling sequence.

    Raises SolverError if the rounds run out or the solver does.
    """
    limit = positive_integer("max_rounds", max_rounds)
    normalised = normalise(plant, periods.middle)
    candidates = periods.nodes(SCAN)
    transitions = _equally_spaced(normalised.plant, candidates)
    working = sorted({periods.h_l, periods.middle, periods.h_u})
    for round_ in range(1, limit + 1):
        design = design_for_periods(plant, working, at=normalised)
        peaks = worst_periods(normalised, design.variables, candidates, transitions)
        new = [h for value, h in peaks if value > VIOLATION and h not in working]
        if not new:
            return RobustDesign(design, round_, peaks[0][0])
        grid = condensed(design, periods)
        working = sorted({*grid, halfway(grid, new[0], periods)})
    raise SolverError(
        f"the exchange method added periods for {limit} rounds, violation {peaks[0][0]:.3g} is left at "
        f"h = {peaks[0][1]:.6g} s and the level {design.level:.9g} holds on the last grid only; raise `max_rounds`, or "
        "use `dense_design` and check its filter with `guaranteed_level`"
    )


def _equally_spaced(plant: SampledPlant, periods: Array) -> Array:
    """`plant.transitions` for equally spaced periods by repeated products: two exponentials in place of one each."""
    step = plant.transition(float(periods[1] - periods[0]))
    stack = [plant.transition(float(periods[0]))]
    for _ in periods[1:]:
        stack.append(stack[-1] @ step)
    return np.array(stack)


def dense_design(plant: SampledPlant, periods: PeriodRange, nodes: int) -> FilterDesign:
    """The same over a grid of `nodes` equally spaced periods, all at once; nothing is known between them."""
    return design_for_periods(plant, periods.nodes(nodes).tolist(), at=normalise(plant, periods.middle))
