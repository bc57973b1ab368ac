"""Robust design for every sampling period in [h_l, h_u] with one Lyapunov function: exchange in place of a dense grid.

(10) is asked for a handful of periods; the period at which the solution violates it most joins them, until none does.
Unlike a grid it looks between the nodes, and every inequality that the solver sees matters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from replication.errors import ReplicationError, SolverError
from replication.estimation.nonuniform.filter_lmi import (
    FilterDesign,
    LmiSolution,
    LmiVariables,
    Normalised,
    Solver,
    lmi10,
    normalise,
    solve_for_periods,
    with_filter,
)
from replication.estimation.nonuniform.guarantee.guarantee import guaranteed_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.validation import Array, positive_integer

SCAN = 257
"""Periods at which the violation is looked at before its peaks are polished."""
WIDE = 10.0
"""Ranges longer than so many of the fastest time constants are looked at in equal ratios, others in equal steps."""
VIOLATION = 5e-7
"""Largest eigenvalue of (10), in normalised coordinates, that counts as satisfied if it costs the level little."""
NEGLIGIBLE = 2e-6
"""The largest `shortfall` that counts as little: an estimate from above, in the cases met about twice the truth."""
FLOOR = 1e-9
"""Violations below this are the solver's own: a period more does not mend them."""
POLISHING = 6
"""Rounds that are spent on what satisfied inequalities cost the level; `shortfall` then says what they still do."""
PEAKS = 8
"""Peaks of the violation that are polished; the lower ones are far from counting."""
INACTIVE = 1e-5
"""Share of the dual weight below which a period leaves the grid; it comes back if it is violated again."""
PROGRESS = 1e-5
"""Relative growth of the level below which no period leaves the grid any more: periods could come and go for ever."""
NEIGHBOURS = 0.25
"""Active periods closer than this share of the range are condensed."""


@dataclass(frozen=True)
class RobustDesign:
    """design: the last one; rounds: solver calls; violation: largest eigenvalue of (10) left over the whole range.

    shortfall: how far `design.level` may lie, relative to itself, below the least level that holds for the whole range
    with one Lyapunov function, by this violation; see `shortfall`.
    """

    design: FilterDesign
    rounds: int
    violation: float
    shortfall: float


def violations(normalised: Normalised, v: LmiVariables, periods: Array) -> Array:
    """Largest eigenvalue of the matrix of (10) at each period; not above zero iff the inequality holds there."""
    return largest_eigenvalues(normalised.plant, v, normalised.plant.transitions(periods))


def largest_eigenvalues(plant: SampledPlant, v: LmiVariables, transitions: Array) -> Array:
    """The same for given stacks of transition matrices (K, n + m, n + m)."""
    n = plant.order
    return np.asarray(np.linalg.eigvalsh(lmi10(plant, transitions[:, :n, :n], transitions[:, :n, n:], v))[:, -1])


def worst_periods(
    plant: SampledPlant, violation: Callable[[Array], Array], candidates: Array, transitions: Array
) -> list[tuple[float, float]]:
    """(violation, period) at the PEAKS highest local peaks of the violation over sorted `candidates`, largest first.

    violation: of a stack of transition matrices (K, n + m, n + m). Each inner peak moves to the top of the parabola
    through it and its neighbours, if that is higher.
    """
    values = violation(transitions)
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    peaks = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:]))
    peaks = peaks[np.argsort(-values[peaks], kind="stable")[:PEAKS]]
    tops, heights = candidates[peaks], values[peaks]
    inner = (peaks > 0) & (peaks < len(candidates) - 1)
    if np.any(inner):
        rise, fall = (values[peaks[inner]] - values[peaks[inner] + side] for side in (-1, 1))
        shifted = peaks[inner] + (rise - fall) / (rise + fall) / 2
        tops[inner] = np.interp(shifted, np.arange(len(candidates)), candidates)
        polished = violation(plant.transitions(tops))
        lower = polished < heights
        tops[lower], heights = candidates[peaks[lower]], np.maximum(polished, heights)
    return sorted(zip(heights.tolist(), tops.tolist(), strict=True), reverse=True)


def condensed(solution: LmiSolution, periods: PeriodRange) -> list[float]:
    """The grid without periods of no dual weight, inner neighbours replaced by their weighted mean.

    Two active periods side by side stand for one between them; the mean converges to it much faster than bisection.
    """
    total = sum(solution.weights)
    active = [pair for pair in zip(solution.periods, solution.weights, strict=True) if pair[1] > INACTIVE * total]
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


def shortfall(solution: LmiSolution, peaks: list[tuple[float, float]]) -> float:
    """Growth of the level, relative to it, that the violations at `peaks` ask for, to first order.

    By duality delta grows by the sum of dual trace times violation. How much of the dual moves to a peak is not known:
    all that lies on the periods of the grid on both sides of it is counted there.
    """
    owed = np.zeros(len(solution.periods))
    for violation, h in peaks:
        above = int(np.searchsorted(solution.periods, h))
        sides = [i for i in (above - 1, above) if 0 <= i < len(owed)]
        owed[sides] = np.maximum(owed[sides], violation)
    return float(owed @ np.array(solution.weights) / (2 * solution.variables.delta))


def robust_design(plant: SampledPlant, periods: PeriodRange, *, max_rounds: int = 40) -> RobustDesign:
    """Minimise gamma subject to (10) for every period of the range; the guarantee holds for every sampling sequence.

    Raises SolverError if the rounds run out or the solver does.
    """
    limit = positive_integer("max_rounds", max_rounds)
    normalised = normalise(plant, periods.middle)
    candidates, transitions = scan(normalised.plant, periods)
    working, reached = sorted({periods.h_l, periods.middle, periods.h_u}), 0.0
    satisfied: list[tuple[LmiSolution, int, float, float]] = []
    for round_ in range(1, limit + 1):
        try:
            solution = solve_for_periods(normalised, working, solver=Solver.SDPA)
        except SolverError:
            if not satisfied:
                raise
            # The last periods were to make it more accurate only; its shortfall says how accurate it is without them.
            return _ended(normalised, *satisfied[-1])
        left = partial(largest_eigenvalues, normalised.plant, solution.variables)
        peaks = worst_periods(normalised.plant, left, candidates, transitions)
        violation, owed = peaks[0][0], shortfall(solution, peaks)
        if violation <= VIOLATION:
            satisfied.append((solution, round_, violation, owed))
        enough = owed <= NEGLIGIBLE or len(satisfied) > POLISHING or round_ == limit
        new = [h for value, h in peaks if value > (VIOLATION if enough else FLOOR) and h not in working]
        if not new:
            return _ended(normalised, solution, round_, violation, owed)
        if solution.level > reached * (1 + PROGRESS):
            working = sorted({*(grid := condensed(solution, periods)), halfway(grid, new[0], periods)})
        else:
            working = sorted({*working, *new})
        reached = max(reached, solution.level)
    raise SolverError(
        f"the exchange method added periods for {limit} rounds, violation {peaks[0][0]:.3g} is left at "
        f"h = {peaks[0][1]:.6g} s and the level {solution.level:.9g} holds on the last grid only; "
        f"{_certified(plant, normalised, solution, periods)}; raise `max_rounds`, or narrow the range"
    )


def _ended(normalised: Normalised, solution: LmiSolution, rounds: int, violation: float, owed: float) -> RobustDesign:
    return RobustDesign(with_filter(normalised, solution), rounds, violation, owed)


def _certified(plant: SampledPlant, normalised: Normalised, solution: LmiSolution, periods: PeriodRange) -> str:
    """What is proved of a filter whose design did not end, for the message that says so."""
    try:
        filter_ = with_filter(normalised, solution).filter
        level = guaranteed_level(plant, filter_, periods, max_leaves=1).level
    except ReplicationError as error:
        return f"its filter has no certificate either ({error})"
    return f"its filter is guaranteed {level:.9g} over the whole range"


def scan(plant: SampledPlant, periods: PeriodRange) -> tuple[Array, Array]:
    """SCAN sorted periods from end to end and their transition matrices."""
    if (periods.h_u - periods.h_l) * np.linalg.norm(plant.A, 2) > WIDE:
        ratios = np.geomspace(periods.h_l, periods.h_u, SCAN)
        return ratios, plant.transitions(ratios)
    steps = periods.nodes(SCAN)
    # Repeated products: two exponentials in place of one each.
    stack, step = [plant.transition(periods.h_l)], plant.transition(float(steps[1] - steps[0]))
    for _ in steps[1:]:
        stack.append(stack[-1] @ step)
    return steps, np.array(stack)
