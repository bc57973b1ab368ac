"""The least level of a filter with time stamps, and the filter that has it.

The range of periods is cut into cells. With V = e'X_c e, c the cell of the period before, a gain K that may depend on
that period's cell and on the coming period in any way has the level gamma iff X_c >= L'L and

    N' (diag(X_c, gamma^2 I) - [Phi, Gamma]' X_d [Phi, Gamma] - diag(L'L, 0)) N >= 0

for all cells c, d and all h in d, where the columns of N span the kernel of [C, D]: the gain is eliminated (Gahinet and
Apkarian, Int. J. Robust Nonlinear Control 4 (1994)). The unknowns are X_c and gamma^2 alone. One gain that meets it is
[Phi, Gamma] G_c, where G_c is that of the central filter (Hassibi, Sayed and Kailath, Indefinite-Quadratic Estimation
(1999), ch. 4) at the covariance gamma^2 X_c^-1. The periods at which it is asked for are found by exchange.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
import scipy

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.clarabel import solve_clarabel
from replication.estimation.conic.program import Inequalities, program_under, symmetric_basis
from replication.estimation.conic.solvers import SolverReport
from replication.estimation.linear.riccati import symmetric
from replication.estimation.nonuniform.exchange import VIOLATION, scan, worst_periods
from replication.estimation.nonuniform.guarantee.guarantee import balancing
from replication.estimation.nonuniform.guarantee.path_lyapunov import ROUGH
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.stamped.stamped_filter import StampedFilter, innovations_filter
from replication.estimation.validation import Array, at_most

SLACKS = (3e-6, 1e-3)
"""Excess that a certificate needs: little, and where that proves nothing, more, which costs level."""
CELLS, MOST_CELLS = 8, 64
"""Cells of the range, for each of which the filter has a gain."""
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
class Storage:
    """X (cells, n, n), by the cell of the period before, and the squared level delta."""

    X: Array
    delta: float


@dataclass(frozen=True, eq=False)
class StampedDesign:
    """level: least one; filter: attains it; storage: its Lyapunov functions; edges (cells + 1,): of the cells, s;
    violation: largest left over the range; rounds: programs solved; report: what the solver said of the last."""

    level: float
    filter: StampedFilter
    storage: Storage
    edges: tuple[float, ...]
    violation: float
    rounds: int
    report: SolverReport


def stamped_design(
    plant: SampledPlant, periods: PeriodRange, *, cells: int = CELLS, slack: float = SLACKS[0]
) -> StampedDesign:
    """The filter of least level over the range.

    slack: excess that the solver is asked for, in coordinates in which X is about the identity.
    Raises InfeasibleError if the level cannot be told from zero or there is none, SolverError if the rounds run out.
    """
    count = at_most("cells", cells, MOST_CELLS) if periods.h_l < periods.h_u else 1
    edges = periods.nodes(count + 1)
    T, scale = _coordinates(plant, periods.middle)
    for _ in range(COORDINATES):
        moved = plant.in_coordinates(T)
        scaled = type(plant)(moved.A, moved.B, moved.C, moved.D, moved.L / scale)
        found, violation, rounds, report = _exchanged(scaled, edges, slack)
        if found.delta <= ZERO:
            raise InfeasibleError(NO_LEVEL)
        filter_ = central(scaled, found, edges).in_coordinates(np.asarray(np.linalg.inv(T)))
        level = scale * float(np.sqrt(found.delta))
        storage = Storage(scale**2 * T.T @ found.X @ T, level**2)
        T, scale = np.linalg.cholesky(np.mean(storage.X, axis=0) / storage.delta).T, level
    return StampedDesign(level, filter_, storage, tuple(edges.tolist()), violation, rounds, report)


def central(plant: SampledPlant, found: Storage, edges: Array) -> StampedFilter:
    """G = [QC'; D'] (CQC' + DD')^-1 with Q = (P^-1 - L'L / gamma^2)^-1 and P = gamma^2 X^-1, just above the level."""
    left = symmetric(found.X - plant.L.T @ plant.L) + MARGIN * found.X
    gains = [innovations_filter(plant, found.delta * one).G[0] for one in np.linalg.inv(left)]
    return StampedFilter(np.array(gains), tuple(edges[1:-1].tolist()))


def violations(plant: SampledPlant, kernel: Array, found: Storage, cell: int, transitions: Array) -> Array:
    """By how much the inequality is missed at each of a stack of transition matrices (K, n + m, n + m) of a cell, after
    the worst cell."""
    n, m = plant.B.shape
    steps = transitions[:, :n] @ kernel
    after = np.swapaxes(steps, 1, 2) @ found.X[cell] @ steps
    given = np.zeros((len(found.X), n + m, n + m))
    given[:, :n, :n] = found.X - plant.L.T @ plant.L
    given[:, n:, n:] = found.delta * np.eye(m)
    left = (kernel.T @ given @ kernel)[:, None] - after
    return np.asarray(-np.linalg.eigvalsh(left)[:, :, 0].min(axis=0))


def _exchanged(plant: SampledPlant, edges: Array, slack: float) -> tuple[Storage, float, int, SolverReport]:
    """The least level at a few periods of each cell, until no other one violates it."""
    kernel = scipy.linalg.null_space(np.hstack([plant.C, plant.D]))
    if kernel.shape[1] == 0:
        raise InfeasibleError(NO_LEVEL)
    scans = [scan(plant, PeriodRange(*ends)) for ends in pairwise(edges)]
    working = [sorted({a, (a + b) / 2, b}) for a, b in pairwise(edges.tolist())]
    for round_ in range(1, MAX_ROUNDS + 1):
        found, report = _least(plant, kernel, working, slack)
        worst, added = -np.inf, False
        for cell, (candidates, transitions) in enumerate(scans):
            missed = partial(violations, plant, kernel, found, cell)
            peaks = worst_periods(plant, missed, candidates, transitions)
            new = {h for value, h in peaks if value > VIOLATION * found.delta and h not in working[cell]}
            working[cell] = sorted({*working[cell], *new})
            worst, added = max(worst, peaks[0][0]), added or bool(new)
        if not added:
            return found, worst, round_, report
    raise SolverError(
        f"the exchange method added periods for {MAX_ROUNDS} rounds, a violation of {worst:.3g} is left; narrow the "
        "range"
    )


def _least(
    plant: SampledPlant, kernel: Array, working: list[list[float]], slack: float
) -> tuple[Storage, SolverReport]:
    """Minimise delta over X and delta at the periods `working` of each cell."""
    n = plant.order
    basis = symmetric_basis(n)
    terms, cells = len(basis), len(working)
    stored = np.einsum("ax,lab,by->lxy", kernel[:n], basis, kernel[:n])
    supplied = kernel[n:].T @ kernel[n:]
    weighted = plant.L.T @ plant.L
    demanded = kernel[:n].T @ weighted @ kernel[:n] + slack * np.eye(kernel.shape[1])
    own = 1 + np.arange(cells * terms).reshape(cells, terms)
    coefficients, variables = [], []
    for cell, periods in enumerate(working):
        steps = plant.transitions(np.array(periods))[:, :n] @ kernel
        for moved in np.einsum("kax,lab,kby->klxy", steps, basis, steps, optimize=True):
            for before in range(cells):
                coefficients.append(np.concatenate([supplied[None], stored, -moved]))
                variables.append([0, *own[before], *own[cell]])
    groups = (
        Inequalities(
            np.broadcast_to(-demanded, (len(variables), *demanded.shape)), np.array(coefficients), np.array(variables)
        ),
        Inequalities(
            np.broadcast_to(-(weighted + slack * np.eye(n)), (cells, n, n)),
            np.broadcast_to(basis, (cells, *basis.shape)),
            own,
        ),
        Inequalities(np.zeros((1, 1, 1)), np.ones((1, 1, 1, 1)), np.zeros((1, 1), dtype=np.intp)),
    )
    cost = np.zeros(1 + own.size)
    cost[0] = 1.0
    # What the solver says is not believed: the exchange and the proof look at the point itself.
    solution = solve_clarabel(program_under(cost, *groups), accept=ROUGH)
    x = solution.multipliers
    X = np.einsum("cl,lab->cab", x[1:].reshape(cells, terms), basis)
    return Storage(X, float(x[0])), solution.report


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
