"""Theorem 3: robust design for every sampling period in [h_l, h_u], by a grid or by exchange.

(10) is asked for a handful of periods; the period at which the solution violates it most joins them, until none does.
Unlike a grid it looks between the nodes, and every inequality that the solver sees matters.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

import numpy as np

from replication.errors import ReplicationError, SolverError
from replication.estimation.conic import program
from replication.estimation.conic.sdpa import minimise_refined
from replication.estimation.linear.norms import hinf_norm
from replication.estimation.nonuniform.filters import Filter, gramian
from replication.estimation.nonuniform.guarantee import guaranteed_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, as_periods
from replication.estimation.validation import Array, positive_integer


class Solver(StrEnum):
    """Which solver (10) is given to; there is no fallback from one to the other."""

    CLARABEL = "few states, one period: converges where the optimum is not attained"
    SDPA = "many states, several periods: cost grows with the unknowns, not with the entries of (10)"


@dataclass(frozen=True)
class LmiVariables:
    """The unknowns of (10): Z, Y symmetric (n, n), F (n, r), G (s, n), Q (n, n), delta = gamma^2 (scalar).

    Every array may carry leading axes: the inequality is then formed for each entry of the stack.
    """

    Z: Array
    Y: Array
    F: Array
    G: Array
    Q: Array
    delta: Array


@dataclass(frozen=True)
class Normalised:
    """`plant` with state T x, outputs y / sensor (r,) and z / scale: its unknowns are of the order of one."""

    plant: SampledPlant
    T: Array
    scale: float
    sensor: Array

    def restore(self, filter_: Filter) -> Filter:
        """The filter for the original plant; its state estimates the original state."""
        inverse = np.linalg.inv(self.T)
        return Filter(inverse @ filter_.A @ self.T, inverse @ filter_.B / self.sensor, self.scale * filter_.C @ self.T)


@dataclass(frozen=True)
class LmiSolution:
    """variables: of (10), in the coordinates of `normalised`; report: what the solver said.

    periods: the grid; weights: trace of the dual of each period's inequality, 0 if it could be left out.
    """

    normalised: Normalised
    variables: LmiVariables
    periods: tuple[float, ...]
    weights: tuple[float, ...]
    report: program.SolverReport

    @property
    def level(self) -> float:
        """gamma of the LMI."""
        return self.normalised.scale * float(np.sqrt(max(float(self.variables.delta), 0.0)))

    @property
    def filter(self) -> Filter:
        """By (11), for the original plant; raises SolverError as `recover` does."""
        return self.normalised.restore(recover(self.variables))


def normalise(plant: SampledPlant, h: float) -> Normalised:
    """Coordinates in which the controllability Gramian at period h is about the identity, z in units of its own
    gain."""
    Phi, Gamma = plant.discretise(h)
    reached = gramian(Phi, Gamma)
    reached += 1e-6 * np.trace(reached) / plant.order * np.eye(plant.order)
    T = np.linalg.inv(np.linalg.cholesky(reached))
    moved = plant.in_coordinates(T)
    scale = hinf_norm(Phi, Gamma, plant.L, np.zeros((len(plant.L), Gamma.shape[1]))).value or 1.0
    # Powers of two change no digit.
    sensor = np.exp2(np.round(np.log2(np.linalg.norm(np.hstack([moved.C, moved.D]), axis=1))))
    C, D = (matrix / sensor[:, None] for matrix in (moved.C, moved.D))
    return Normalised(SampledPlant(moved.A, moved.B, C, D, moved.L / scale), T, scale, sensor)


def lmi10(plant: SampledPlant, Phi: Array, Gamma: Array, v: LmiVariables) -> Array:
    """The matrix of (10), order 4n + s + m, blocks (Z, Y | e | Z, Y | w); negative definite iff (6) is solvable.

    Phi (n, n) and Gamma (n, m) belong to one period h; either they or `v` may be a stack.
    """
    C, D, L = plant.C, plant.D, plant.L
    n, m, s = plant.order, Gamma.shape[-1], len(L)
    corner = _blocks(
        [
            [v.Z @ Phi, v.Z @ Phi, v.Z @ Gamma],
            [v.Y @ Phi + v.F @ C + v.Q, v.Y @ Phi + v.F @ C, v.Y @ Gamma + v.F @ D],
            [L - v.G, L, np.zeros((s, m))],
        ]
    )
    # [[Z, Z], [Z, Y]] is the congruence J1' P J1 of the paper's proof.
    pair, level = _blocks([[v.Z, v.Z], [v.Z, v.Y]]), np.asarray(v.delta)[..., None, None] * np.eye(m)
    left = _blocks([[pair, np.zeros((2 * n, s))], [np.zeros((s, 2 * n)), np.eye(s)]])
    right = _blocks([[pair, np.zeros((2 * n, m))], [np.zeros((m, 2 * n)), level]])
    return _blocks([[-left, corner], [np.swapaxes(corner, -1, -2), -right]])


def _blocks(rows: Sequence[Sequence[Array]]) -> Array:
    """The matrices made of these blocks, some of which are stacks of matrices."""
    stack = np.broadcast_shapes(*(part.shape[:-2] for row in rows for part in row))
    return np.block([[np.broadcast_to(part, (*stack, *part.shape[-2:])) for part in row] for row in rows])


def variable_basis(plant: SampledPlant) -> LmiVariables:
    """The unit directions of all unknowns as a stack, preceded by the zero point; the order is delta, Z, Y, F, G, Q."""
    n, r, s = plant.order, len(plant.C), len(plant.L)
    symmetric = program.symmetric_basis(n)
    blocks = [("delta", np.ones(1)), ("Z", symmetric), ("Y", symmetric)]
    blocks += [(name, np.eye(a * b).reshape(-1, a, b)) for name, a, b in (("F", n, r), ("G", s, n), ("Q", n, n))]
    total = 1 + sum(len(block) for _, block in blocks)
    fields, start = {}, 1
    for name, block in blocks:
        stack = np.zeros((total, *block.shape[1:]))
        stack[start : start + len(block)] = block
        fields[name] = stack
        start += len(block)
    return LmiVariables(**fields)


def combine(basis: LmiVariables, x: Array) -> LmiVariables:
    """The unknowns with coordinates x in `basis`."""
    return LmiVariables(**{name: np.tensordot(x, part[1:], axes=1) for name, part in vars(basis).items()})


def inequalities(plant: SampledPlant, periods: Sequence[float], basis: LmiVariables) -> program.Inequalities:
    """-(10) >= 0 for every period, as affine functions of the coordinates in `basis`."""
    stacks = np.array([-lmi10(plant, *plant.discretise(h), basis) for h in periods])
    constant = stacks[:, 0]
    count, unknowns = len(periods), stacks.shape[1] - 1
    variables = np.broadcast_to(np.arange(unknowns), (count, unknowns))
    return program.Inequalities(constant, stacks[:, 1:] - constant[:, None], variables)


def recover(v: LmiVariables) -> Filter:
    """Eq. (11): A_f = -Y^-1 Q (I - Y^-1 Z)^-1, B_f = -Y^-1 F, C_f = G (I - Y^-1 Z)^-1.

    Raises SolverError if Y or Y - Z is numerically singular, as at an optimum that no filter attains.
    """
    gap = v.Y - v.Z
    if np.linalg.cond(v.Y) > 1e14 or np.linalg.cond(gap) > 1e14:
        raise SolverError(
            "Y or Y - Z is singular at the solution of (10): the optimum is not attained; use a larger level"
        )
    # (I - Y^-1 Z)^-1 = (Y - Z)^-1 Y.
    factor = np.linalg.solve(gap, v.Y)
    return Filter(-np.linalg.solve(v.Y, v.Q) @ factor, np.asarray(-np.linalg.solve(v.Y, v.F)), v.G @ factor)


def design_for_periods(
    plant: SampledPlant, periods: Sequence[float], *, at: Normalised | None = None, solver: Solver = Solver.CLARABEL
) -> LmiSolution:
    """Step 2 of Algorithm 1: minimise delta = gamma^2 subject to (10) at all `periods` (seconds).

    The guarantee of the LMI is for these periods only. The status is in the report; evaluate the filter with
    `periodic_gain`, which shares nothing with this design. Raises InvalidInputError for periods that are not positive,
    InfeasibleError or SolverError by the solver's status.
    """
    grid = as_periods("periods", periods).tolist()
    normalised = at or normalise(plant, float(np.mean(grid)))
    basis = variable_basis(normalised.plant)
    group = inequalities(normalised.plant, grid, basis)
    cost = np.zeros(group.coefficients.shape[1])
    cost[0] = 1.0
    if solver is Solver.SDPA:
        x, duals, report = minimise_refined(cost, group)
    else:
        solution = program.solve_clarabel(program.program_under(cost, group), accept=program.ALMOST)
        x, duals, report = solution.multipliers, np.array(solution.blocks), solution.report
    weights = np.trace(duals, axis1=1, axis2=2)
    return LmiSolution(normalised, combine(basis, x), tuple(grid), tuple(weights.tolist()), report)


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

    design: LmiSolution
    rounds: int
    violation: float
    shortfall: float


def largest_eigenvalues(plant: SampledPlant, v: LmiVariables, transitions: Array) -> Array:
    """Of the matrix of (10) for each of a stack of transitions (K, n + m, n + m); not above zero iff it holds."""
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
    satisfied: list[RobustDesign] = []
    for round_ in range(1, limit + 1):
        try:
            solution = design_for_periods(plant, working, at=normalised, solver=Solver.SDPA)
        except SolverError:
            if not satisfied:
                raise
            # The last periods were to make it more accurate only; its shortfall says how accurate it is without them.
            return satisfied[-1]
        left = partial(largest_eigenvalues, normalised.plant, solution.variables)
        peaks = worst_periods(normalised.plant, left, candidates, transitions)
        violation, owed = peaks[0][0], shortfall(solution, peaks)
        if violation <= VIOLATION:
            satisfied.append(RobustDesign(solution, round_, violation, owed))
        enough = owed <= NEGLIGIBLE or len(satisfied) > POLISHING or round_ == limit
        new = [h for value, h in peaks if value > (VIOLATION if enough else FLOOR) and h not in working]
        if not new:
            return RobustDesign(solution, round_, violation, owed)
        if solution.level > reached * (1 + PROGRESS):
            working = sorted({*(grid := condensed(solution, periods)), halfway(grid, new[0], periods)})
        else:
            working = sorted({*working, *new})
        reached = max(reached, solution.level)
    raise SolverError(
        f"the exchange method added periods for {limit} rounds, violation {peaks[0][0]:.3g} is left at "
        f"h = {peaks[0][1]:.6g} s and the level {solution.level:.9g} holds on the last grid only; "
        f"{_certified(plant, solution, periods)}; raise `max_rounds`, or narrow the range"
    )


def _certified(plant: SampledPlant, solution: LmiSolution, periods: PeriodRange) -> str:
    """What is proved of a filter whose design did not end, for the message that says so."""
    try:
        level = guaranteed_level(plant, solution.filter, periods, max_leaves=1).level
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
    start, step = plant.transitions(np.array([periods.h_l, steps[1] - steps[0]]))
    stack = [start]
    for _ in steps[1:]:
        stack.append(stack[-1] @ step)
    return steps, np.array(stack)
