"""The filter that knows the time stamps, its least level, and the proof of that level for every sequence.

x^(k|k) = x^(k) + G_x v, w^(k) = G_w v with v = y(k) - C x^(k); x^(k+1) = Phi(h_k) x^(k|k) + Gamma(h_k) w^(k). This is
K = [Phi(h), Gamma(h)] G, a gain that depends on the coming period as the plant itself does. G depends on the period
before the sample, for the longer the filter had to predict, the more a sample tells: it is constant on each cell of the
range. The error follows e+ = [Phi(h), Gamma(h)] (I - G [C, D]) [e; w]: linear in the transition, so that what proves
levels for the robust filter proves them for this one. It does not depend on x: the plant may be unstable.

The range of periods is cut into cells. With V = e'X_c e, c the cell of the period before, a gain K that may depend on
that period's cell and on the coming period in any way has the level gamma iff X_c >= L'L and

    N' (diag(X_c, gamma^2 I) - [Phi, Gamma]' X_d [Phi, Gamma] - diag(L'L, 0)) N >= 0

for all cells c, d and all h in d, where the columns of N span the kernel of [C, D]: the gain is eliminated (Gahinet and
Apkarian, Int. J. Robust Nonlinear Control 4 (1994)). The unknowns are X_c and gamma^2 alone. One gain that meets it is
[Phi, Gamma] G_c, where G_c is that of the central filter (Hassibi, Sayed and Kailath, Indefinite-Quadratic Estimation
(1999), ch. 4) at the covariance gamma^2 X_c^-1. The periods at which it is asked for are found by exchange.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Self

import numpy as np
import scipy

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.conic import program
from replication.estimation.linear.riccati import symmetric
from replication.estimation.nonuniform.filters import Estimator
from replication.estimation.nonuniform.guarantee import UNPROVED, Guarantee, cell_needs
from replication.estimation.nonuniform.path_lyapunov import (
    ROUGH,
    ErrorSystem,
    Storage,
    least_storage,
    storage_inequalities,
)
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, balancing
from replication.estimation.nonuniform.robust import VIOLATION, scan, worst_periods
from replication.estimation.validation import Array, at_most

DEPENDENT = 1e-12
"""Eigenvalue of the correlation of the innovations that counts as zero."""


class StampedPlant(SampledPlant):
    """A `SampledPlant` for a filter that knows the periods: A need not be Hurwitz, the plant may integrate or be
    unstable.

    Raises
    ------
    InvalidInputError
        As `SampledPlant`, but for the eigenvalues of A.
    """

    settles = False


@dataclass(frozen=True, eq=False)
class StampedFilter(Estimator):
    """G (cells, n + m, r): what each innovation adds to the estimates of state and held disturbance, by the cell in
    which the period before the sample lies; edges (cells - 1,): where the cells meet, s."""

    G: Array
    edges: tuple[float, ...] = ()

    def gain(self, h: float | None) -> Array:
        """G (n + m, r) after the period h; at the first sample, which has none before it, that of the longest."""
        return np.asarray(self.G[-1 if h is None else np.searchsorted(self.edges, h, side="right")])

    def error_output(self, plant: SampledPlant) -> Array:
        """L."""
        shape = (len(self.edges) + 1, plant.order + plant.B.shape[1], len(plant.C))
        if self.G.shape != shape:
            raise InvalidInputError(f"G must have shape (cells, n + m, r) = {shape}, got shape {self.G.shape}")
        return plant.L

    def error_step(self, plant: SampledPlant, Phi: Array, Gamma: Array) -> tuple[Array, Array]:
        """The state and input matrices of the error of a filter of one cell."""
        step = np.concatenate([Phi, Gamma], axis=-1) @ self.entry(plant)
        return step[..., : plant.order], step[..., plant.order :]

    def entry(self, plant: SampledPlant) -> Array:
        """I - G [C, D] of a filter of one cell."""
        (G,) = self.G
        return np.asarray(np.eye(len(G)) - G @ np.hstack([plant.C, plant.D]))

    def steps_along(self, plant: SampledPlant, periods: Array) -> tuple[Array, Array]:
        """With the gain after the period before."""
        upper = plant.transitions(periods)[:, : plant.order]
        gains = np.array([self.gain(h) for h in (None, *periods[:-1])])
        steps = upper @ (np.eye(upper.shape[-1]) - gains @ np.hstack([plant.C, plant.D]))
        return steps[..., : plant.order], steps[..., plant.order :]

    def errors(self, plant: SampledPlant, periods: Array, w: Array) -> Array:
        """L e, where e = x - x^ is followed by itself: x may grow without bound."""
        error = np.zeros(plant.order)
        outputs = [plant.L @ error]
        for step, drive, disturbance in zip(*self.steps_along(plant, periods), w, strict=True):
            error = step @ error + drive @ disturbance
            outputs.append(plant.L @ error)
        return np.array(outputs)

    def in_coordinates(self, T: Array) -> Self:
        """The same for the plant with state T x."""
        n = len(T)
        return type(self)(np.concatenate([T @ self.G[:, :n], self.G[:, n:]], axis=1), self.edges)


def kalman_filter(plant: SampledPlant, h: float) -> StampedFilter | None:
    """The stationary Kalman predictor at a constant period, for white w of unit intensity, None if none need exist."""
    balanced = balancing(plant)
    moved = plant.in_coordinates(balanced)
    Phi, Gamma = remembered(moved, h)
    noise, crossed = moved.D @ moved.D.T, Gamma @ moved.D.T
    if np.linalg.matrix_rank(noise) < len(noise):
        return None
    try:
        P = scipy.linalg.solve_discrete_are(Phi.T, moved.C.T, Gamma @ Gamma.T, noise, s=crossed)
    except np.linalg.LinAlgError:
        return None
    return innovations_filter(moved, P).in_coordinates(np.asarray(np.linalg.inv(balanced)))


def remembered(plant: SampledPlant, h: float) -> tuple[Array, Array]:
    """`discretise` of a plant in balanced units without what is forgotten, in which scipy's balancing loses itself."""
    Phi, Gamma = plant.discretise(h)
    return np.where(np.abs(Phi) > FORGOTTEN, Phi, 0.0), Gamma


def kalman_filters(plant: SampledPlant, periods: Sequence[float]) -> list[StampedFilter]:
    """One made for each period; none if there is none at one of them."""
    filters = [filter_ for h in periods if (filter_ := kalman_filter(plant, h)) is not None]
    return filters if len(filters) == len(periods) else []


def innovations_filter(plant: SampledPlant, P: Array) -> StampedFilter:
    """G = [P C'; D'] (C P C' + D D')^-1, for errors of covariance P (n, n) and white w of unit intensity."""
    spread = np.vstack([P @ plant.C.T, plant.D.T])
    innovation = plant.C @ P @ plant.C.T + plant.D @ plant.D.T
    size = np.sqrt(np.diag(innovation))
    # Sensors that repeat each other without noise share what they tell.
    inverse = np.linalg.pinv(innovation / np.outer(size, size), rcond=DEPENDENT, hermitian=True) / np.outer(size, size)
    return StampedFilter((spread @ inverse)[None])


SLACKS = (3e-6, 1e-3)
"""Excess that a certificate needs: little, and where that proves nothing, more, which costs level."""
CELLS, MOST_CELLS = 8, 64
"""Cells of the range, for each of which the filter has a gain."""
MAX_ROUNDS = 40
REGULAR = 1e-6
"""Noise added, relative to the disturbance, for a first guess of the error covariance where there may be none."""
MARGIN = 1e-6
"""Relative distance above the least squared level at which the filter is taken: at it, gains may be infinite."""
FORGOTTEN = 1e-20
"""Share of a state that is left at the next sample, in balanced units, that counts as none."""
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
    """level: least one; filter: attains it; storage: its Lyapunov functions X, by the cell of the period before; edges
    (cells + 1,): of the cells, s; violation: largest left over the range."""

    level: float
    filter: StampedFilter
    storage: Storage
    edges: tuple[float, ...]
    violation: float


def stamped_design(
    plant: SampledPlant, periods: PeriodRange, *, cells: int = CELLS, slack: float = SLACKS[0]
) -> StampedDesign:
    """The filter of least level over the range; slack: excess that the solver is asked for, where X is about I.

    Raises InfeasibleError if the level cannot be told from zero or there is none, SolverError if the rounds run out.
    """
    count = min(at_most("cells", cells, MOST_CELLS), MOST_CELLS if periods.h_l < periods.h_u else 1)
    edges = periods.nodes(count + 1)
    T, scale = _coordinates(plant, periods.middle)
    for _ in range(COORDINATES):
        moved = plant.in_coordinates(T)
        scaled = type(plant)(moved.A, moved.B, moved.C, moved.D, moved.L / scale)
        inner, violation = _exchanged(scaled, edges, slack)
        if inner.delta <= ZERO:
            raise InfeasibleError(NO_LEVEL)
        filter_ = central(scaled, inner, edges).in_coordinates(np.asarray(np.linalg.inv(T)))
        level = scale * float(np.sqrt(inner.delta))
        storage = replace(inner, delta=level**2, P=scale**2 * T.T @ inner.P @ T)
        T, scale = np.linalg.cholesky(np.mean(storage.P, axis=0) / storage.delta).T, level
    return StampedDesign(level, filter_, storage, tuple(edges.tolist()), violation)


def central(plant: SampledPlant, storage: Storage, edges: Array) -> StampedFilter:
    """G = [QC'; D'] (CQC' + DD')^-1 with Q = (P^-1 - L'L / gamma^2)^-1 and P = gamma^2 X^-1, just above the level."""
    left = symmetric(storage.P - plant.L.T @ plant.L) + MARGIN * storage.P
    gains = [innovations_filter(plant, storage.delta * inverse).G[0] for inverse in np.linalg.inv(left)]
    return StampedFilter(np.array(gains), tuple(edges[1:-1].tolist()))


def violations(plant: SampledPlant, kernel: Array, storage: Storage, cell: int, transitions: Array) -> Array:
    """By how much the inequality is missed at each of a stack of transition matrices (K, n + m, n + m) of a cell, after
    the worst cell."""
    n, m = plant.B.shape
    steps = transitions[:, :n] @ kernel
    after = np.swapaxes(steps, 1, 2) @ storage.P[cell] @ steps
    supplied = np.zeros((len(storage.P), n + m, n + m))
    supplied[:, :n, :n] = storage.P - plant.L.T @ plant.L
    supplied[:, n:, n:] = storage.delta * np.eye(m)
    left = (kernel.T @ supplied @ kernel)[:, None] - after
    return np.asarray(-np.linalg.eigvalsh(left)[:, :, 0].min(axis=0))


def _exchanged(plant: SampledPlant, edges: Array, slack: float) -> tuple[Storage, float]:
    """The least level at a few periods of each cell, until no other one violates it."""
    kernel = scipy.linalg.null_space(np.hstack([plant.C, plant.D]))
    if kernel.shape[1] == 0:
        raise InfeasibleError(NO_LEVEL)
    scans = [scan(plant, PeriodRange(*ends)) for ends in pairwise(edges)]
    working = [sorted({a, (a + b) / 2, b}) for a, b in pairwise(edges.tolist())]
    for _ in range(MAX_ROUNDS):
        storage = _least(plant, kernel, working, slack)
        worst, added = -np.inf, False
        for cell, (candidates, transitions) in enumerate(scans):
            missed = partial(violations, plant, kernel, storage, cell)
            peaks = worst_periods(plant, missed, candidates, transitions)
            new = {h for value, h in peaks if value > VIOLATION * storage.delta and h not in working[cell]}
            working[cell] = sorted({*working[cell], *new})
            worst, added = max(worst, peaks[0][0]), added or bool(new)
        if not added:
            return storage, worst
    raise SolverError(
        f"the exchange method added periods for {MAX_ROUNDS} rounds, a violation of {worst:.3g} is left; narrow the "
        "range"
    )


def _least(plant: SampledPlant, kernel: Array, working: list[list[float]], slack: float) -> Storage:
    """Minimise delta over X and delta at the periods `working` of each cell."""
    n = plant.order
    basis = program.symmetric_basis(n)
    terms, cells = len(basis), len(working)
    weighted = plant.L.T @ plant.L
    demanded = kernel[:n].T @ weighted @ kernel[:n] + slack * np.eye(kernel.shape[1])
    columns = 1 + np.arange(cells * terms).reshape(cells, terms)
    steps = plant.transitions(np.concatenate(working))[:, :n] @ kernel
    ends = [cell for cell, periods in enumerate(working) for _ in periods]
    edges = [(before, cell, i) for i, cell in enumerate(ends) for before in range(cells)]
    groups = (
        storage_inequalities(basis, kernel[:n], steps, kernel[n:].T @ kernel[n:], demanded, edges),
        program.Inequalities(
            np.broadcast_to(-(weighted + slack * np.eye(n)), (cells, n, n)),
            np.broadcast_to(basis, (cells, *basis.shape)),
            columns,
        ),
        program.Inequalities(np.zeros((1, 1, 1)), np.ones((1, 1, 1, 1)), np.zeros((1, 1), dtype=np.intp)),
    )
    # What the solver says is not believed: the exchange and the proof look at the point itself.
    return least_storage(basis, cells, *groups, accept=ROUGH)[0]


def _coordinates(plant: SampledPlant, h: float) -> tuple[Array, float]:
    """T and a unit of z in which the covariance of a Kalman filter's error at the period h is the identity."""
    balanced = balancing(plant)
    moved = plant.in_coordinates(balanced)
    Phi, Gamma = remembered(moved, h)
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
            f"no filter settles at the period {h:.6g} s: the samples do not see every mode that grows, or rounding "
            f"loses the others where one grows by {np.abs(np.linalg.eigvals(Phi)).max():.3g}; sample faster"
        )
    scale = float(np.sqrt(np.linalg.eigvalsh(moved.L @ P @ moved.L.T)[-1]))
    return T @ balanced, scale or 1.0


LOOSE = 1e-3
"""Relative distance of the proved level from that of the design above which pieces of a cell are halved."""


def prove(plant: SampledPlant, design: StampedDesign) -> Guarantee:
    """The level that the storage of a design proves, whatever solver it came from.

    For all cells c and d: |e|^2 + e+' X_d e+ <= e' X_c e + level^2 |w|^2 over d, in coordinates in which X_c is the
    identity. Raises SolverError if it proves none.
    """
    # The hulls are measured in the plant's coordinates.
    balanced = balancing(plant)
    units, plant, filter_ = np.diag(balanced), plant.in_coordinates(balanced), design.filter.in_coordinates(balanced)
    X, worst = design.storage.P / np.outer(units, units) / design.storage.delta, 0.0
    for before, G in zip(X, filter_.G, strict=True):
        T = np.linalg.cholesky(before).T
        inverse = np.linalg.inv(T)
        system = ErrorSystem(plant, type(filter_)(G[None]), T, design.level, 1 / units)
        for after, ends in zip(X, pairwise(design.edges), strict=True):
            following = inverse.T @ after @ inverse
            needs, _ = cell_needs(system, np.eye(plant.order)[None], following[None], ends, (1 + LOOSE) ** 2)
            worst = max(worst, float(needs[0]))
    if not worst < UNPROVED:
        raise SolverError(
            f"the level {design.level:.6g} of the design holds at finitely many periods, not for certain at all others;"
            " narrow the range of sampling periods"
        )
    level = design.level * float(np.sqrt(worst * (1 + 1e-9)))
    return Guarantee(level, design.storage.P, design.edges, [[0] * len(X)], design.storage.report)


def proved_design(plant: SampledPlant, periods: PeriodRange, *, cells: int = CELLS) -> tuple[StampedDesign, Guarantee]:
    """The design with the least slack that proves a level; errors as `stamped_design` and `prove`."""
    design = stamped_design(plant, periods, cells=cells)
    try:
        return design, prove(plant, design)
    except SolverError:
        design = stamped_design(plant, periods, cells=cells, slack=SLACKS[-1])
        return design, prove(plant, design)
