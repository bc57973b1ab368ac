"""The extended Kalman filter at the instants of a base period, with the recursion of `ExtendedKalman`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.running import RunningObserver, gate_of
from replication.estimation.multirate.problem import SensingSchedule
from replication.estimation.nonuniform.stamped.extended import NonlinearPlant, extended, extended_c
from replication.estimation.nonuniform.stamped.kalman import Estimate
from replication.estimation.validation import Array


class ExtendedFilter(RunningObserver):
    """`step(u, y)` at every instant k; it gives x^(k|k). `missed`, `unscheduled` and `gated` count.

    A sample off its schedule is used. Samples that come late need time stamps: `ExtendedKalman`.

    Parameters
    ----------
    plant : NonlinearPlant
        Functions and noise; its dt is the base period.
    periods : sequence of int, one per sensor
        Sensing periods, in base periods.
    offsets : sequence of int, one per sensor
        First instants; zeros unless given.
    gate : float, optional
        Beyond which a measurement is left out: a probability below 1 with which a good one passes, or standard
        deviations from 1 on.

    Raises
    ------
    InvalidInputError
        The plant is of another kind, the schedule does not fit it, or the gate is none.
    """

    def __init__(
        self, plant: NonlinearPlant, periods: Sequence[int], offsets: Sequence[int] = (), gate: float | None = None
    ) -> None:
        if not isinstance(plant, NonlinearPlant):
            raise InvalidInputError(f"plant must be a NonlinearPlant, got {type(plant).__name__}")
        self.plant, self.schedule, self.gate = plant, SensingSchedule(tuple(periods), tuple(offsets)), gate_of(gate)
        if self.schedule.sensors != len(plant.sensors):
            raise InvalidInputError(
                f"periods are of {self.schedule.sensors}, the plant has {len(plant.sensors)} sensors"
            )
        self._run = extended(plant, self.gate)
        super().__init__(plant.order, plant.inputs, len(plant.sensors))

    def reset(self, estimate: Any = None) -> Array:
        """Go back to instant 0; the start is that of the plant unless given."""
        return super().reset(self.plant.x0 if estimate is None else estimate)

    @property
    def estimate(self) -> Array:
        """x^(k|k) of the last instant, (n,); the start before any."""
        return np.array(self._known.x)

    @property
    def covariance(self) -> Array:
        """What the filter takes for the covariance of its error, (n, n)."""
        return np.array(self._known.P)

    def _begin(self, start: Array) -> None:
        self.gated = 0
        self._known = self._prior = Estimate(0.0, start, self.plant.P0)

    def _advance(self, u: Array, y: Array) -> None:
        due, came = self.schedule.mask[self.instant % self.schedule.period], ~np.isnan(y)
        known = self._run.update(self._prior, y, u)
        self._prior = replace(self._run.predict(known, self.plant.dt), t=0.0)
        self._known = Estimate(known.t, known.mean, known.covariance)
        self.missed += int(np.sum(due & ~came))
        self.unscheduled += int(np.sum(came & ~due))
        self.gated += known.gated

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """The same file as of `ExtendedKalman`; its time stamps are k dt."""
        return extended_c(self.plant, self.gate, name, comment)
