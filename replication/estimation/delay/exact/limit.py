"""The least level that any causal observer of a delay plant has, without an LMI: a limit of delay-free models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from replication.errors import InfeasibleError
from replication.estimation.delay.exact.central import (
    FilterModel,
    hamiltonian,
    ladder_model,
    normal_states,
    scaling_of,
    stable_space,
    whitened,
)
from replication.estimation.delay.exact.response import decided
from replication.estimation.delay.exact.smoothing import smoother_bound, smoother_gains
from replication.estimation.delay.exact.terms import PlantTerms, plant_terms
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.spectrum import require_seen
from replication.estimation.validation import Array, positive_scalar

# The least H-infinity level of a filter for a delay-free model, by the filter Riccati equation; D_11 and D_21 at will.
#
# At level g, with z in units of g, C = [C_z; C_y], D = [D_z; D_y] and R = D D' - diag(I, 0): a filter exists iff R has
# the inertia (p negative, q positive) and the Riccati equation A Y + Y A' + B B' = (Y C' + B D') R^-1 (C Y + D B') has
# a stabilising solution Y >= 0. Two things end this as g falls: an eigenvalue of the Hamiltonian matrix on the
# imaginary axis, the limit of smoothers too; or an eigenvalue of Y that goes to infinity, the price of causality.


AXIS, RANK, ANGLE = 1e-5, 1e-10, 1e-7
"""Relative distance from the axis that counts as on it; ranks; angle of a solution below zero that is rounding."""
DIGITS, NOISE = 1e-11, 1e-8
"""Relative width at which the search ends, and by which a level has to differ from another one to be told from it."""
MOST_ROUNDS, SWEEP = 60, 8.0
NEXT_TO_NONE = 1e-300
NOTHING, HIGHEST = 1e-7, 1e9
"""Levels below and beyond it, in units of |C_z| |B| / |A| + |D_z|, count as zero and as infinite."""


def filter_level(model: FilterModel, start: float = 0.0) -> float:
    """The least level of the model, 0 where it cannot be told from zero; `start` is a level from which to look."""
    model = regular(model)
    if not len(model.a):
        return _direct(model)
    model = normal_states(whitened(model))[0]
    unit = float(np.hypot(np.linalg.norm(model.cz), np.linalg.norm(model.dz))) or 1.0
    return unit * _filter_level(replace(model, cz=model.cz / unit, dz=model.dz / unit), start / unit)


def _filter_level(model: FilterModel, start: float) -> float:
    parts = [float(np.linalg.norm(part)) for part in (model.a, model.b, model.cz, model.dz)]
    size = parts[1] * parts[2] / (parts[0] or 1.0) + parts[3]
    if size == 0.0:
        return 0.0
    smoother = _smoother(model, NOTHING * size)
    least = max(smoother * (1.0 + NOISE), NOTHING * size)
    refused = least
    if _angle(model, least) > 0.0:
        # Far below the least level Y < 0 comes near zero and may pass for a solution: no level up to `size` may fail.
        count = 1 + int(np.ceil(np.log(max(size, start, least) / least) / np.log(SWEEP)))
        failing = [level for level in least * SWEEP ** np.arange(1.0, count) if _angle(model, level) <= 0.0]
        if not failing:
            return smoother if least > NOTHING * size else 0.0
        refused = float(failing[-1])
    low, high = _bracket(model, refused, max(start, refused * (1.0 + NOISE)), smoother + size)
    # Where there is no stabilising solution the sign is all that is known.
    while high - low > DIGITS * high and _angle(model, low) == -1.0:
        middle = (low + high) / 2.0
        low, high = (low, middle) if _angle(model, middle) > 0.0 else (middle, high)
    if high - low > DIGITS * high:
        high = float(scipy.optimize.brentq(lambda level: _angle(model, level), low, high, rtol=DIGITS, xtol=1e-300))
    return high


def _bracket(model: FilterModel, least: float, start: float, size: float) -> tuple[float, float]:
    """A level without a filter and one with, around `start` if it is near; none at `least`."""
    step, low, high = NOISE, least, start
    while _angle(model, high) <= 0.0:
        low, high, step = high, high * (1.0 + step), min(8.0 * step, 1.0)
        if high > HIGHEST * size:
            raise InfeasibleError(
                f"no finite level found below {high:.3g}: y does not see an unstable mode, or has no noise at some "
                "frequency; measure more, or let noise act on each measurement"
            )
    while low < high / (1.0 + step):
        nearer = high / (1.0 + step)
        if _angle(model, nearer) <= 0.0:
            return nearer, high
        high, step = nearer, min(8.0 * step, 1.0)
    return low, high


def regular(model: FilterModel) -> FilterModel:
    """The model without noise-free outputs: what they show is known, and their derivatives are measured instead."""
    while len(model.cy):
        left, values, _ = np.linalg.svd(model.dy / _row_sizes(model))
        rank = int(np.sum(values > RANK))
        if rank == len(model.cy):
            return model
        rows = left.T / _row_sizes(model).T
        cy, dy = rows @ model.cy, (rows @ model.dy)[:rank]
        shown = cy[rank:]
        values, right = np.linalg.svd(shown)[1:]
        count = int(np.sum(values > RANK * max(1.0, float(np.linalg.norm(shown)))))
        known, hidden = right[:count].T, right[count:].T
        a = model.a @ hidden
        model = FilterModel(
            hidden.T @ a,
            hidden.T @ model.b,
            model.cz @ hidden,
            model.dz,
            np.vstack([cy[:rank] @ hidden, known.T @ a]),
            np.vstack([dy, known.T @ model.b]),
        )
    return model


def _row_sizes(model: FilterModel) -> Array:
    """The size of each measurement (q, 1): a unit of y decides no rank."""
    sizes = np.linalg.norm(np.hstack([model.cy, model.dy]), axis=1, keepdims=True)
    return np.where(sizes > 0.0, sizes, 1.0)


def _direct(model: FilterModel) -> float:
    """The level without states: of D_z on what y does not show."""
    rank = len(model.cy)
    free = np.linalg.svd(model.dy)[2][rank:].T if rank else np.eye(model.dz.shape[1])
    return float(np.linalg.norm(model.dz @ free, 2)) if free.size else 0.0


def _angle(model: FilterModel, level: float) -> float:
    """Positive iff a filter exists at `level`: pi/2 less the largest angle of Y, whose eigenvalues are tangents.

    It rises with the level, smoothly; -1 where there is no stabilising solution.
    """
    try:
        u, v = stable_space(model, level)
    except np.linalg.LinAlgError:
        return -1.0
    basis = u + 1j * v
    # The basis spans a Lagrangian space: it is unitary, and basis·basis' has the eigenvalues e^{2j angle}.
    angles = np.angle(np.linalg.eigvals(basis @ basis.T)) / 2.0
    angles = np.where(angles < -ANGLE, angles + np.pi, angles)
    return float(np.pi / 2.0 - angles.max())


def _smoother(model: FilterModel, least: float) -> float:
    """The least level at which the Hamiltonian matrix has no eigenvalue on the axis: of G_z on the kernel of G_y."""
    poles = np.linalg.eigvals(model.a)
    tried = np.unique(np.concatenate([[0.0], np.abs(poles), np.abs(poles.imag)]))
    best = max(float(_gains(model, tried).max()), _direct(model))
    for _ in range(MOST_ROUNDS):
        level = max(best * (1.0 + 1e-10), least)
        matrix = hamiltonian(model, level)
        if matrix is None:
            return best
        values = np.linalg.eigvals(matrix).astype(complex)
        crossings = np.unique(np.abs(values.imag[np.abs(values.real) <= AXIS * (1.0 + np.abs(values))]))
        if not crossings.size:
            return best
        edges = np.unique(np.concatenate([[0.0], crossings, [2.0 * crossings[-1] + 1.0]]))
        reached = float(_gains(model, np.concatenate([crossings, (edges[1:] + edges[:-1]) / 2.0])).max())
        if reached <= level:
            return max(best, reached)
        best = reached
    return best


def _gains(model: FilterModel, omega: Array) -> Array:
    """The norm of G_z on the kernel of G_y at each frequency (M,)."""
    return np.minimum(smoother_gains(model.terms, omega), 1.0 / NEXT_TO_NONE)


ORDERS = (2, 3, 4, 7, 8, 11, 14, 19, 26, 35, 48)
"""Odd and even ones by turns: Pade's approximants of odd order change the sign at infinity."""
LARGEST = 240
"""States of a model."""
FEWEST = 3
"""Rungs that are climbed however large."""


@dataclass(frozen=True)
class Limit:
    """The least level of a plant.

    Attributes
    ----------
    level : float
        No causal observer has a smaller gain, and some come as near as is wanted. 0 if it cannot be told from zero.
    moving : float
        The largest change over the last two rungs, or what the last one lacks of `smoother`: what is still uncertain.
    settled : bool
        Whether that is within the tolerance.
    smoother : float
        What no estimator goes below, not even one that knows the future; with true exponentials.
    frequency : float
        Where that is attained, rad/s.
    rungs : tuple of (int, float)
        Moments of each signal on each piece of the past, and the level of that model.
    """

    level: float
    moving: float
    settled: bool
    smoother: float
    frequency: float
    rungs: tuple[tuple[int, float], ...]

    @property
    def causality(self) -> float:
        """How much of the level is the price of not knowing the future: level less smoother, at least 0."""
        return max(self.level - self.smoother, 0.0)


@decided
def limit(plant: DelayPlant, tolerance: float = 1e-8) -> Limit:
    """The least level, by the filter Riccati equation on models of rising order until its digits stand.

    Parameters
    ----------
    plant : DelayPlant
        The plant, at its nominal delays.
    tolerance : float
        Relative change over two rungs at which the climb ends.

    Returns
    -------
    Limit
        The level, what is still moving, and the bound without causality.

    Raises
    ------
    InvalidInputError
        `tolerance` is not positive, or y does not see an unstable mode.
    InfeasibleError
        A model has no finite level: y has no noise at some frequency, or hardly sees an unstable mode.

    Notes
    -----
    Between the delays, and their differences, the past is replaced by N moments of each signal (Legendre-tau method,
    on each piece Pade's approximant [N/N]). Errors fall faster than geometrically once N exceeds half the phase, in
    rad, of a piece at the frequency that decides the level. Measurements without noise are replaced by their
    derivatives. It may not settle where the level is decided at high frequencies, by delayed noise for example: a model
    keeps the delays up to some frequency only.

    Examples
    --------
    A measurement that comes 0.5 s late, of a disturbed integrator: the future costs something.

    >>> late = DelayPlant([[0.0]], [0.5], [[1.0, 0.0]], [[1.0]], [[0.0]], c2_delayed=[[[1.0]]], d21=[[0.0, 1.0]])
    >>> found = limit(late)
    >>> found.settled and found.level > found.smoother
    True
    """
    positive_scalar("tolerance", tolerance)
    scaling = scaling_of(plant)
    scaled = scaling.plant(plant)
    require_seen(scaled, scaling.time)
    terms = plant_terms(scaled)
    bound = smoother_bound(terms)
    rungs, moving = climbed(terms, filter_level, bound.level, tolerance)
    level = max(rungs[-1][1], bound.level)
    return Limit(level, moving, moving <= tolerance * level, bound.level, bound.frequency / scaling.time, rungs)


def climbed(
    plant: PlantTerms, value: Callable[[FilterModel, float], float], floor: float, tolerance: float
) -> tuple[tuple[tuple[int, float], ...], float]:
    """(order, value) of models of rising order until the value, `floor` at least, settles; and what it still moves."""
    rungs: list[tuple[int, float]] = []
    changes = (np.inf, np.inf)
    for order in ORDERS:
        model = ladder_model(plant, order)
        if len(model.a) > LARGEST and len(rungs) >= FEWEST:
            break
        rung = value(model, rungs[-1][1] if rungs else floor)
        changes = (changes[1], abs(rung - rungs[-1][1]) if rungs else np.inf)
        rungs.append((order, rung))
        if max(*changes, floor - rung) <= tolerance * rung:
            break
    return tuple(rungs), float(max(*changes, floor - rungs[-1][1]))
