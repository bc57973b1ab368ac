"""What serves this paper alone: (8) and (9), Algorithm 1, its matrix inequalities printed and made whole."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy

from replication.estimation.conic import program
from replication.estimation.linear.norms import hinf_norm
from replication.estimation.linear.periodic import Stage
from replication.estimation.nonuniform import robust
from replication.estimation.nonuniform.filters import Filter
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, as_periods
from replication.estimation.validation import Array, ComplexArray

MU_ZERO = 1e-14
"""Logarithmic norms smaller than this times the norm of A count as zero: cases L1 and U1 of (9)."""


def responses(plant: SampledPlant, h: float, filter_: Filter, points: ComplexArray) -> tuple[Any, Any]:
    """Of the filter's state (points, n, m) and of z (points, s, m) to w, at a constant period."""
    (Phi, Gamma), z = plant.discretise(h), points[:, None, None]
    x = np.linalg.solve(z * np.eye(plant.order) - Phi, Gamma)
    measurement = filter_.B @ (plant.C @ x + plant.D)
    return np.linalg.solve(z * np.eye(len(filter_.A)) - filter_.A, measurement), plant.L @ x


class UpperEnd(StrEnum):
    """Which logarithmic norm stands in the logarithm of case U3 of (9): mu(-A), or mu(A), as the proof needs."""

    PRINTED = "printed"
    CORRECTED = "corrected"


class Interval(NamedTuple):
    """The open interval (lower, upper) of sampling periods in seconds; upper may be infinite."""

    lower: float
    upper: float


def logarithmic_norm(A: Array) -> float:
    """mu(A) = largest eigenvalue of (A + A') / 2, the logarithmic norm of Lemma 3."""
    return float(np.linalg.eigvalsh((A + A.T) / 2)[-1])


def uncertainty_channel(plant: SampledPlant, h: float, delta: Array | None = None) -> Stage:
    """Sigma_11 of Lemma 2, A Phi(h) (zI - Phi(h))^-1, at the constant period h; times `delta`, if it is given.

    It does not depend on the filter, because Sigma_11 sees the plant's states only.
    """
    Phi, _ = plant.discretise(h)
    identity = np.eye(plant.order)
    return Stage(Phi, identity if delta is None else delta, plant.A @ Phi, 0 * identity)


def small_gain_alpha(plant: SampledPlant, h: float) -> float:
    """alpha(h) = ||Sigma_11||_inf, by Lemma 2, Theorem 1 and eq. (9)."""
    return hinf_norm(*uncertainty_channel(plant, h)).value


def delta_block(plant: SampledPlant, theta: float) -> Array:
    """Delta(theta) = int_0^theta e^{tA} dt of Lemma 2, for theta of either sign; equals A^-1 (e^{theta A} - I)."""
    n = plant.order
    generator = np.block([[plant.A, np.eye(n)], [np.zeros((n, 2 * n))]])
    return np.asarray(scipy.linalg.expm(theta * generator)[:n, n:])


def covered_interval(plant: SampledPlant, h: float, gain: float, upper: UpperEnd = UpperEnd.CORRECTED) -> Interval:
    """H(h, gain) of eq. (9), cases L1-L3 and U1-U3, intersected with the positive periods; `gain` is alpha or its
    root."""
    below, above = logarithmic_norm(-plant.A), logarithmic_norm(plant.A)
    zero = MU_ZERO * float(np.linalg.norm(plant.A, 2))
    lower = h - _reach(below, below, gain, zero)
    printed = below if upper is UpperEnd.PRINTED else above
    return Interval(max(0.0, lower), h + _reach(above, printed, gain, zero))


def _reach(mu: float, in_logarithm: float, gain: float, zero: float) -> float:
    """log(1 + mu / gain) / mu, its limit 1 / gain at mu = 0, infinite for mu <= -gain; `in_logarithm` allows a
    misprint."""
    if abs(mu) <= zero:
        return 1 / gain
    if mu <= -gain:
        return float("inf")
    # The misprinted U3 may have an argument that is not positive; it then covers nothing.
    argument = 1 + in_logarithm / gain
    return float(np.log(argument) / mu) if argument > 0 else float("-inf")


# Algorithm 1: a grid of sampling periods whose small-gain intervals cover [h_l, h_u], literal and corrected.
#
# Neither (9) nor alpha involves the filter, so the grid is found first; `design_for_periods` is step 2.

TOUCH = 1e-12
"""Gaps shorter than this, in seconds, are closed by a common end point."""


End = Literal["COVERED", "STALLED", "LIMIT"]
"""How the algorithm ended: the intervals cover [h_l, h_u]; step 4 adds nothing although step 3 fails, so that this
reading cannot end; or the grid has reached the limit N_0 of step 1, and there is no filter."""


class Step4(StrEnum):
    """What the line of step 4, which has lost a sign in our copy, does with the range and the intervals."""

    SET_MINUS = "set-minus"
    CUT = "union cut to the range"
    UNCUT = "union"


@dataclass(frozen=True)
class Reading:
    """How to read Algorithm 1. upper: case U3 of (9); root: sqrt(alpha) in step 4; step_4: what its line does."""

    upper: UpperEnd
    root: bool
    step_4: Step4

    @property
    def name(self) -> str:
        """The three choices in words, such as `corrected, alpha, set-minus`."""
        return ", ".join((self.upper, "root" if self.root else "alpha", self.step_4))


AS_PRINTED = {step_4: tuple(Reading(upper, True, step_4) for upper in UpperEnd) for step_4 in Step4}
"""With the root that step 4 prints, by what its line does, each with case U3 as printed and corrected."""
CORRECT = Reading(UpperEnd.CORRECTED, root=False, step_4=Step4.SET_MINUS)


@dataclass(frozen=True)
class Grid:
    """periods: the grid, increasing (s); intervals: H(h_i, alpha_i); rounds: passes of steps 1-4."""

    periods: tuple[float, ...]
    intervals: tuple[Interval, ...]
    end: End
    rounds: int


def build_grid(plant: SampledPlant, periods: PeriodRange, reading: Reading = CORRECT, *, limit: int = 64) -> Grid:
    """Steps 0, 1, 3 and 4 of Algorithm 1; ends when covered, when step 4 leaves the grid as it is, or at `limit` =
    N_0."""
    grid, alphas, rounds = {periods.middle}, dict[float, float](), 0
    while True:
        rounds += 1
        ordered = tuple(sorted(grid))
        alphas |= {h: small_gain_alpha(plant, h) for h in ordered if h not in alphas}
        covered = [covered_interval(plant, h, alphas[h], reading.upper) for h in ordered]
        if len(grid) >= limit:
            return Grid(ordered, tuple(covered), "LIMIT", rounds)
        if not gaps(covered, periods):
            return Grid(ordered, tuple(covered), "COVERED", rounds)
        gains = {h: float(np.sqrt(alphas[h])) if reading.root else alphas[h] for h in ordered}
        marked = [covered_interval(plant, h, gain, reading.upper) for h, gain in gains.items()]
        # An interval without an upper end has no middle.
        new = {(a + b) / 2 for a, b in _pieces(reading.step_4, marked, periods) if np.isfinite(b)}
        new = {h for h in new if min(abs(h - old) for old in grid) > TOUCH}
        if not new:
            return Grid(ordered, tuple(covered), "STALLED", rounds)
        grid |= new


def _pieces(step_4: Step4, marked: list[Interval], periods: PeriodRange) -> list[tuple[float, float]]:
    """The intervals (L_j, U_j) of step 4."""
    if step_4 is Step4.SET_MINUS:
        return gaps(marked, periods)
    united = [(periods.h_l, periods.h_u)]
    if step_4 is Step4.CUT:
        return united  # with the intervals it stays one piece, beyond which nothing is kept
    for low, high in sorted(interval for interval in marked if interval.lower < interval.upper):
        met = [piece for piece in united if low < piece[1] and piece[0] < high]
        joined = (min(low, *(a for a, _ in met)), max(high, *(b for _, b in met))) if met else (low, high)
        united = [*(piece for piece in united if piece not in met), joined]
    return united


def gaps(intervals: list[Interval], periods: PeriodRange) -> list[tuple[float, float]]:
    """The parts (L_j, U_j) of [h_l, h_u] that no interval covers: what step 4 must mean, with a set-minus.

    An end of the range that lies on the boundary of an open interval makes no gap of positive length and is ignored
    only within TOUCH.
    """
    pieces, reached = [], periods.h_l
    for lower, upper in (*sorted(span for span in intervals if span.lower < span.upper), (np.inf, np.inf)):
        end = min(lower, periods.h_u)
        if end > reached + TOUCH:
            pieces.append((reached, end))
        reached = max(reached, upper)
    return pieces


def passes(covered: Callable[[float], Interval], periods: PeriodRange) -> Iterator[list[float]]:
    """What each pass adds to the grid: the middle of the range, then that of each gap, until nothing is left out."""
    new, intervals = [periods.middle], list[Interval]()
    while new:
        yield new
        intervals += map(covered, new)
        new = [(a + b) / 2 for a, b in gaps(intervals, periods)]


# Theorem 3 as printed, through cvxpy: (10) block by block beside the paper; a second transcription, a second modeller

ACCEPTED = ("optimal", "optimal_inaccurate")


def printed_design(plant: SampledPlant, periods: Sequence[float]) -> robust.LmiSolution:
    """Minimise delta = gamma^2 subject to (10) at all `periods` (s); the filter by (11). Status in the report.

    Raises InvalidInputError for periods that are not positive, InfeasibleError or SolverError by the solver's status.
    """
    import cvxpy  # slow to load

    grid = as_periods("periods", periods).tolist()
    normalised = robust.normalise(plant, float(np.mean(grid)))
    p = normalised.plant
    n, m, r, s = p.order, p.B.shape[1], len(p.C), len(p.L)
    Z, Y = (cvxpy.Variable((n, n), symmetric=True) for _ in range(2))
    F, G, Q = cvxpy.Variable((n, r)), cvxpy.Variable((s, n)), cvxpy.Variable((n, n))
    delta = cvxpy.Variable((1, 1))
    matrices = []
    for h in grid:
        Phi, Gamma = p.discretise(h)
        o_s, o_m = np.zeros((n, s)), np.zeros((n, m))
        a, b = Y @ Phi + F @ p.C + Q, Y @ Phi + F @ p.C
        c = Y @ Gamma + F @ p.D
        rows = [
            [-Z, -Z, o_s, Z @ Phi, Z @ Phi, Z @ Gamma],
            [-Z, -Y, o_s, a, b, c],
            [o_s.T, o_s.T, -np.eye(s), p.L - G, p.L, np.zeros((s, m))],
            [Phi.T @ Z, a.T, (p.L - G).T, -Z, -Z, o_m],
            [Phi.T @ Z, b.T, p.L.T, -Z, -Y, o_m],
            [Gamma.T @ Z, c.T, np.zeros((m, s)), o_m.T, o_m.T, -cvxpy.kron(np.eye(m), delta)],
        ]
        matrices.append(-cvxpy.bmat(rows))
    report = program.minimise_modelled(delta[0, 0], matrices, ACCEPTED)
    values = {name: np.asarray(x.value) for name, x in zip("ZYFGQ", (Z, Y, F, G, Q), strict=True)}
    v = robust.LmiVariables(**values, delta=np.asarray(delta.value[0, 0]))
    return robust.LmiSolution(normalised, v, tuple(grid), (), report)


# The robust LMI (13), reconstructed: the text omits it, so it is derived here from (7), with one multiplier per cell.
#
# Cell i has the nominal period h_i; xi = Delta(theta) eta with ||Delta(theta)|| <= delta_i on the cell. With the
# storage of Theorem 3, V+ - V + |e|^2 - gamma^2 |w|^2 + lambda_i (delta_i^2 |eta|^2 - |xi|^2) < 0 becomes, by the
# paper's congruence, an LMI in blocks (Z, Y | e | eta | Z, Y | xi | w), linear in all variables and in lambda_i > 0.
# Asking both channels for the same gamma, as the text says, would force gamma >= alpha; the free multiplier does not.


def modal_transform(A: Array) -> Array:
    """T such that T A T^-1 is real block diagonal and normal, for an A that has as many eigenvectors as states."""
    values, vectors = np.linalg.eig(A)
    _, real_vectors = scipy.linalg.cdf2rdf(values.astype(complex), vectors.astype(complex))
    return np.asarray(np.linalg.inv(real_vectors))


def modal(plant: SampledPlant) -> SampledPlant:
    """The plant in coordinates in which A is block diagonal and normal."""
    return plant.in_coordinates(modal_transform(plant.A))


def delta_radius(A: Array, half_width: float) -> float:
    """Bound of ||Delta(theta)|| for |theta| <= half_width from Lemma 3: (e^{mu t} - 1) / mu for both signs of theta."""
    norms = logarithmic_norm(A), logarithmic_norm(-A)
    return max(half_width if abs(mu * half_width) < 1e-12 else float(np.expm1(mu * half_width)) / mu for mu in norms)


def robust_lmi_design(plant: SampledPlant, periods: PeriodRange, cells: int) -> robust.LmiSolution:
    """Minimise gamma subject to (13) on `cells` equal cells around the periods of the design, for every sequence.

    Delta is measured in modal coordinates.
    """
    width = (periods.h_u - periods.h_l) / cells
    centres = [periods.h_l + width * (i + 0.5) for i in range(cells)]
    radius = delta_radius(modal(plant).A, width / 2)
    normalised = robust.normalise(plant, periods.middle)
    frame, basis = modal_transform(plant.A) @ np.linalg.inv(normalised.T), robust.variable_basis(normalised.plant)
    stacks = np.array([-lmi13(normalised.plant, h, basis, frame, radius) for h in centres])
    constant, unknowns = stacks[:, 0], len(basis.delta) - 1
    # The unknowns are those of (10) and then the multipliers.
    variables = np.array([[*range(unknowns), unknowns + i] for i in range(cells)])
    group = program.Inequalities(constant, stacks[:, 1:] - constant[:, None], variables)
    cost = np.eye(unknowns + cells)[0]
    solution = program.solve_clarabel(program.program_under(cost, group), accept=program.ALMOST)
    v = robust.combine(basis, solution.multipliers[:unknowns])
    return robust.LmiSolution(normalised, v, tuple(centres), (), solution.report)


def lmi13(plant: SampledPlant, h: float, basis: robust.LmiVariables, frame: Array, radius: float) -> Array:
    """The matrix of (13), order 6n + s + m, for the cell around h: at each entry of the basis, and at the multiplier.

    It is affine in them. frame (n, n): Delta is measured in coordinates frame @ x.
    """
    v = robust.LmiVariables(**{name: np.concatenate([x, np.zeros_like(x[:1])]) for name, x in vars(basis).items()})
    n, s, (Phi, Gamma) = plant.order, len(plant.L), plant.discretise(h)
    base, multiplier = robust.lmi10(plant, Phi, Gamma, v), np.eye(len(v.delta))[-1][:, None, None]
    size = base.shape[-1]
    # (10) bordered by eta and xi, which then move behind e and behind the second (Z, Y).
    eta, xi = slice(size, size + n), slice(size + n, size + 2 * n)
    matrix = np.zeros((len(base), size + 2 * n, size + 2 * n))
    matrix[:, :size, :size] = base
    matrix[:, eta, eta] = matrix[:, xi, xi] = -multiplier * np.eye(n)
    drift = np.hstack([plant.A @ Phi, plant.A @ Phi, plant.A @ Gamma + plant.B])
    matrix[:, eta, 2 * n + s : size] = multiplier * radius * (frame @ drift)
    matrix[:, xi, : 2 * n] = (np.concatenate([v.Z, v.Y], axis=1) @ np.linalg.inv(frame)).mT
    matrix[:, :size, size:] = matrix[:, size:, :size].mT
    order = np.r_[: 2 * n + s, eta, 2 * n + s : 4 * n + s, xi, 4 * n + s : size]
    return matrix[:, order[:, None], order]
