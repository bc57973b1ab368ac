"""The matrices S_k of the examples, from the rule that sensor i measures every N_i instants."""

from __future__ import annotations

from papers.okajima2023.problem import Json
from replication.estimation.multirate.schedule import SensingSchedule


def selections(periods: list[int], offsets: list[int]) -> Json:
    """The diagonals of S_0 ... S_{N-1}, eq. (4), one row per phase."""
    schedule = SensingSchedule(tuple(periods), tuple(offsets))
    return {"period": schedule.period, "diagonals": schedule.mask.astype(float).tolist()}
