"""The least level of a filter with time stamps and one Lyapunov function, and the filter that has it.

A gain K(h), whatever it does with the period h, has the level gamma with V = e'Xe iff X >= L'L and

    N' (diag(X, gamma^2 I) - [Phi, Gamma]' X [Phi, Gamma] - diag(L'L, 0)) N >= 0    for all h,

where the columns of N span the kernel of [C, D]: the gain is eliminated (Gahinet and Apkarian, Int. J. Robust Nonlinear
Control 4 (1994)). The unknowns are X and gamma^2 alone. One gain that meets it is [Phi, Gamma] G, where G is that of
the central filter (Hassibi, Sayed and Kailath, Indefinite-Quadratic Estimation (1999), ch. 4) at the covariance gamma^2
X^-1. The periods at which it is asked for are found by exchange.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.clarabel import ALMOST, solve_clarabel
from replication.estimation.conic.program import Inequalities, program_under, symmetric_basis
from replication.estimation.conic.solvers import SolverReport
from replication.estimation.linear.riccati import symmetric
from replication.estimation.nonuniform.exchange import VIOLATION, scan, worst_periods
from replication.estimation.nonuniform.guarantee.guarantee import balancing, guaranteed_level
from replication.estimation.nonuniform.guarantee.path_lyapunov import ErrorSystem
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.stamped.stamped_filter import StampedFilter, innovations_filter
from replication.estimation.validation import Array

SLACKS = (3e-6, 1e-3)
"""Excess that a certificate needs: little, and where that proves nothing, more, which costs level."""
NODES = 9
"""Periods at the start of the exchange; the program is small."""
MAX_ROUNDS = 40
REGULAR = 1e-6
"""Noise added, relative to the disturbance, for a first guess of the error covariance where there may be none."""
MARGIN = 1e-6
"""Relative distance above the least squared level at which the filter is taken: at it, gains may be infinite."""
LOST = 1e13
"""Condition of the first guess from which on some error is not bounded."""
NO_LEVEL = (
    "the least level for these periods cannot be told from zero, and no filter attains zero: a sensor without noise of "
    "its own may reveal the disturbance; widen the range or describe the noise by D"
)
ZERO = 1e-9
"""Squared level, in units of the variance of a Kalman filter's error, that may be rounding."""
COORDINATES = 2
"""Times that the program is solved, the second one in the coordinates in which the first one's X is the identity."""


@dataclass(frozen=True, eq=False)
class StampedDesign:
    """level: least one with one Lyapunov function; filter: attains it; T (n, n): that function is |T e|^2 level^2;
    violation: largest left over the range; rounds: programs solved; report: what the solver said of the last."""

    level: float
    filter: StampedFilter
    T: Array
    violation: float
    rounds: int
    report: SolverReport

    def error(self, plant: SampledPlant) -> ErrorSystem:
        """The error of the filter in coordinates in which its Lyapunov function is the identity."""
        return ErrorSystem(plant, self.filter, self.T, self.level, False, np.ones(plant.order))


@dataclass(frozen=True, eq=False)
class Storage:
    """X (n, n) and the squared level delta."""

    X: Array
    delta: float


def stamped_design(plant: SampledPlant, periods: PeriodRange, *, slack: float = SLACKS[0]) -> StampedDesign:
    """The filter of least level over the range, by one Lyapunov function.

    slack: excess that the solver is asked for, in coordinates in which X is about the identity.
    Raises InfeasibleError if the level cannot be told from zero or there is none, SolverError if the rounds run out.
    """
    T, scale = _coordinates(plant, periods.middle)
    for _ in range(COORDINATES):
        moved = plant.in_coordinates(T)
        scaled = type(plant)(moved.A, moved.B, moved.C, moved.D, moved.L / scale)
        found, violation, rounds, report = _exchanged(scaled, periods, slack)
        if found.delta <= ZERO:
            raise InfeasibleError(NO_LEVEL)
        filter_ = central(scaled, found).in_coordinates(np.asarray(np.linalg.inv(T)))
        level = scale * float(np.sqrt(found.delta))
        T, scale = np.linalg.cholesky(found.X / found.delta).T @ T, level
    return StampedDesign(level, filter_, T, violation, rounds, report)


def certified_design(plant: SampledPlant, periods: PeriodRange) -> StampedDesign:
    """The design with the least slack for which a level is proved over the whole range; errors as `stamped_design`."""
    found = stamped_design(plant, periods)
    try:
        guaranteed_level(plant, found.filter, periods, max_leaves=1, start=found.error(plant))
    except SolverError:
        return stamped_design(plant, periods, slack=SLACKS[-1])
    return found


def central(plant: SampledPlant, found: Storage) -> StampedFilter:
    """G = [QC'; D'] (CQC' + DD')^-1 with Q = (P^-1 - L'L / gamma^2)^-1 and P = gamma^2 X^-1, just above the level."""
    left = symmetric(found.X - plant.L.T @ plant.L) + MARGIN * found.X
    return innovations_filter(plant, np.asarray(found.delta * np.linalg.inv(left)))


def violations(plant: SampledPlant, kernel: Array, found: Storage, transitions: Array) -> Array:
    """By how much the inequality is missed at each of a stack of transition matrices (K, n + m, n + m)."""
    n = plant.order
    given = scipy.linalg.block_diag(found.X - plant.L.T @ plant.L, found.delta * np.eye(plant.B.shape[1]))
    steps = transitions[:, :n] @ kernel
    left = kernel.T @ given @ kernel - np.swapaxes(steps, 1, 2) @ found.X @ steps
    return np.asarray(-np.linalg.eigvalsh(left)[:, 0])


def _exchanged(plant: SampledPlant, periods: PeriodRange, slack: float) -> tuple[Storage, float, int, SolverReport]:
    """The least level at a few periods, until no other one violates it."""
    kernel = scipy.linalg.null_space(np.hstack([plant.C, plant.D]))
    if kernel.shape[1] == 0:
        raise InfeasibleError(NO_LEVEL)
    candidates, transitions = scan(plant, periods)
    working = sorted(set(periods.nodes(NODES).tolist()))
    for round_ in range(1, MAX_ROUNDS + 1):
        found, report = _least(plant, kernel, working, slack)
        peaks = worst_periods(plant, partial(violations, plant, kernel, found), candidates, transitions)
        new = [h for value, h in peaks if value > VIOLATION * found.delta and h not in working]
        if not new:
            return found, peaks[0][0], round_, report
        working = sorted({*working, *new})
    raise SolverError(
        f"the exchange method added periods for {MAX_ROUNDS} rounds, violation {peaks[0][0]:.3g} is left at "
        f"h = {peaks[0][1]:.6g} s; narrow the range"
    )


def _least(plant: SampledPlant, kernel: Array, working: list[float], slack: float) -> tuple[Storage, SolverReport]:
    """Minimise delta over X and delta at the periods `working`."""
    n, m = plant.B.shape
    basis = symmetric_basis(n)
    wide = np.zeros((1 + len(basis), n + m, n + m))
    wide[0, n:, n:] = np.eye(m)
    wide[1:, :n, :n] = basis
    steps = plant.transitions(np.array(working))[:, :n] @ kernel
    stored = np.einsum("ax,lab,by->lxy", kernel, wide, kernel)
    coefficients = np.broadcast_to(stored, (len(working), *stored.shape)).copy()
    coefficients[:, 1:] -= np.einsum("kax,lab,kby->klxy", steps, basis, steps, optimize=True)
    weighted = plant.L.T @ plant.L
    demanded = kernel[:n].T @ weighted @ kernel[:n] + slack * np.eye(kernel.shape[1])
    variables = np.arange(1 + len(basis))
    groups = (
        Inequalities(
            np.broadcast_to(-demanded, (len(working), *demanded.shape)),
            coefficients,
            np.broadcast_to(variables, (len(working), len(variables))),
        ),
        Inequalities(-(weighted + slack * np.eye(n))[None], basis[None], variables[None, 1:]),
        Inequalities(np.zeros((1, 1, 1)), np.ones((1, 1, 1, 1)), variables[None, :1]),
    )
    cost = np.zeros(len(variables))
    cost[0] = 1.0
    solution = solve_clarabel(program_under(cost, *groups), accept=ALMOST)
    x = solution.multipliers
    return Storage(np.einsum("l,lab->ab", x[1:], basis), float(x[0])), solution.report


def _coordinates(plant: SampledPlant, h: float) -> tuple[Array, float]:
    """T and a unit of z in which the covariance of a Kalman filter's error at the period h is the identity."""
    balanced = balancing(plant)
    moved = plant.in_coordinates(balanced)
    Phi, Gamma = moved.discretise(h)
    driven = Gamma @ Gamma.T
    driven += REGULAR * np.trace(driven) / len(driven) * np.eye(len(driven))
    noise = moved.D @ moved.D.T
    noise += REGULAR * np.diag(np.diag(noise) + np.diag(moved.C @ driven @ moved.C.T))
    try:
        P = scipy.linalg.solve_discrete_are(Phi.T, moved.C.T, driven, noise)
        lost = np.linalg.cond(P) > LOST
        T = np.linalg.inv(np.linalg.cholesky(P))
    except np.linalg.LinAlgError:
        lost = True
    if lost:
        raise InfeasibleError(
            f"no filter settles at the period {h:.6g} s: the samples do not see every mode that grows; sample faster"
        )
    scale = float(np.sqrt(np.linalg.eigvalsh(moved.L @ P @ moved.L.T)[-1]))
    return T @ balanced, scale or 1.0
