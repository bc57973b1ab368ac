"""The least level that any causal observer of a delay plant has, without an LMI: a limit of delay-free models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.delay.exact.filtering import filter_level
from replication.estimation.delay.exact.forms import plant_terms
from replication.estimation.delay.exact.ladder import FilterModel, ladder_model
from replication.estimation.delay.exact.loop import decided
from replication.estimation.delay.exact.smoothing import smoother_bound
from replication.estimation.delay.exact.terms import PlantTerms
from replication.estimation.delay.general.plant import DelayPlant, plant_of
from replication.estimation.delay.general.scaling import scaling_of
from replication.estimation.delay.system import DelaySystem
from replication.estimation.validation import positive_scalar

ORDERS = (2, 3, 4, 7, 8, 11, 14, 19, 26, 35, 48)
"""Odd and even ones by turns: Pade's approximants of odd order change the sign at infinity."""
LARGEST = 240
"""States of a model."""
FEWEST, SEEN = 3, 11
"""Rungs that are climbed however large; the one whose unstable roots are tested."""
UNSEEN = 1e-7


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
def limit(plant: DelayPlant | DelaySystem, tolerance: float = 1e-8) -> Limit:
    """The least level, by the filter Riccati equation on models of rising order until its digits stand.

    Parameters
    ----------
    plant : DelayPlant or DelaySystem
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
    general = plant_of(plant) if isinstance(plant, DelaySystem) else plant
    scaling = scaling_of(general)
    scaled = plant_terms(scaling.plant(general))
    require_seen(scaled, scaling.time)
    least = limit_of(scaled, tolerance)
    return replace(least, frequency=least.frequency / scaling.time)


def limit_of(plant: PlantTerms, tolerance: float) -> Limit:
    """As `limit`, of a plant that is written as terms and whose unstable modes y sees."""
    bound = smoother_bound(plant)
    rungs, moving = climbed(plant, lambda model, near: filter_level(model, near).value, bound.level, tolerance)
    level = max(rungs[-1][1], bound.level)
    return Limit(level, moving, moving <= tolerance * level, bound.level, bound.frequency, rungs)


def climbed(
    plant: PlantTerms, value: Callable[[FilterModel, float], float], floor: float, tolerance: float
) -> tuple[tuple[tuple[int, float], ...], float]:
    """The value of models of rising order until it moves by less than `tolerance`, relative, over two rungs.

    value: called with a model and a value near it. floor: no value is below it. Returns (order, value) of each rung,
    and how much the value still moves.
    """
    rungs: list[tuple[int, float]] = []
    changes = (np.inf, np.inf)
    for order in ORDERS:
        model = ladder_model(plant, order)
        if len(model.a) > LARGEST and len(rungs) >= FEWEST:
            break
        found = value(model, rungs[-1][1] if rungs else floor)
        changes = (changes[1], abs(found - rungs[-1][1]) if rungs else np.inf)
        rungs.append((order, found))
        if max(*changes, floor - found) <= tolerance * found:
            break
    return tuple(rungs), float(max(*changes, floor - rungs[-1][1]))


def require_seen(plant: PlantTerms, time: float) -> None:
    """Raise InvalidInputError if y does not see an unstable mode, tested at its root with true exponentials.

    time: the unit of time of `plant`, s.
    """
    n = plant.sizes[0]
    states, _, measured = plant.rows
    values = np.linalg.eigvals(ladder_model(plant, SEEN).a)
    for root in values[values.real >= -UNSEEN * (1.0 + np.abs(values))]:
        point = complex(max(root.real, 0.0), root.imag)
        matrix = plant.terms.at(np.array([point]))[0][:, :n]
        pencil = np.vstack([matrix[states] - point * np.eye(n), matrix[measured]])
        sizes = np.linalg.norm(pencil, axis=1, keepdims=True)
        if np.linalg.svd(pencil / np.where(sizes > 0.0, sizes, 1.0), compute_uv=False)[-1] <= UNSEEN:
            raise InvalidInputError(
                f"the plant is not detectable: y does not see the root {root / time:.6g}; measure more"
            )
