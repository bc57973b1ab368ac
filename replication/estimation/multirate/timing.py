"""When to measure: the offsets that give the smallest achievable gain, for one or many pairs of sensing periods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from replication.estimation.multirate.optimum import Optimum, optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.multirate.schedule import SensingSchedule, distinct_offsets


@dataclass(frozen=True)
class TimingSearch:
    """Optimum of every distinct set of offsets for given periods; `best` is the first of the smallest."""

    periods: tuple[int, ...]
    optima: dict[tuple[int, ...], Optimum]

    @property
    def best(self) -> tuple[int, ...]:
        """The offsets with the smallest optimum."""
        return min(self.optima, key=lambda offsets: self.optima[offsets].value)

    @property
    def synchronous(self) -> Optimum:
        """The optimum when all sensors measure at instant 0."""
        return self.optima[(0,) * len(self.periods)]


def search_timing(plant: MultiratePlant, periods: Sequence[int]) -> TimingSearch:
    """Optimum for each set of offsets that is more than a shift of the origin; two sensors have gcd(N_1, N_2)."""
    optima = {
        offsets: optimum(MultirateProblem(plant, SensingSchedule(tuple(periods), offsets)))
        for offsets in distinct_offsets(periods)
    }
    return TimingSearch(tuple(periods), optima)
