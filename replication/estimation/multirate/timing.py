"""When to measure: the offsets that give the smallest achievable gain, for one or many pairs of sensing periods."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from replication.estimation.multirate.optimum import Optimum, kalman_design, optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule, distinct_offsets

Offsets = tuple[int, ...]
Apply = Callable[[Callable[[Offsets], Optimum], Sequence[Offsets]], Iterable[Optimum]]
"""`map`, or what does its work elsewhere: the values of a function for a sequence, in its order."""


@dataclass(frozen=True)
class TimingSearch:
    """Optimum of every distinct set of offsets for given periods.

    Attributes
    ----------
    periods : tuple of int
        Sensing periods N_i, in base periods.
    optima : dict
        `Optimum` by offsets; `best` is the first of the smallest.
    """

    periods: tuple[int, ...]
    optima: dict[Offsets, Optimum]

    @property
    def best(self) -> Offsets:
        """The offsets with the smallest optimum."""
        return min(self.optima, key=lambda offsets: self.optima[offsets].value)

    @property
    def synchronous(self) -> Optimum:
        """The optimum when all sensors measure at instant 0."""
        return self.optima[(0,) * len(self.periods)]


def search_timing(plant: MultiratePlant, periods: Sequence[int], *, apply: Apply = map) -> TimingSearch:
    """Compare the optima of all offsets that are more than a shift of the origin; two sensors have gcd(N_1, N_2).

    Parameters
    ----------
    plant : MultiratePlant
        The plant.
    periods : sequence of int, one per sensor
        Sensing periods N_i, in base periods.
    apply : callable
        Computes the optima; the `map` of a `concurrent.futures.ProcessPoolExecutor` uses every core, and gives the
        same.

    Returns
    -------
    TimingSearch
        The optimum of each set of offsets, and the best of them.

    Raises
    ------
    InvalidInputError
        A period is not whole, there are too many sets of offsets, or the problem is not well posed.
    SolverError
        Rounding spoils the recursion of `optimum`.
    """
    tried = tuple(distinct_offsets(periods))
    optima = apply(partial(_optimum_at, plant, tuple(periods)), tried)
    return TimingSearch(tuple(periods), dict(zip(tried, optima, strict=True)))


def _optimum_at(plant: MultiratePlant, periods: tuple[int, ...], offsets: Offsets) -> Optimum:
    return optimum(MultirateProblem(plant, SensingSchedule(periods, offsets)))


def least_error_offsets(plant: MultiratePlant, periods: Sequence[int]) -> Offsets:
    """The offsets for which the Kalman filter has the least mean square of W e."""

    def variance(offsets: Offsets) -> float:
        problem = MultirateProblem(plant, SensingSchedule(tuple(periods), offsets))
        return float(np.mean(np.trace(plant.W @ kalman_design(problem).X @ plant.W.T, axis1=1, axis2=2)))

    return min(distinct_offsets(periods), key=variance)
