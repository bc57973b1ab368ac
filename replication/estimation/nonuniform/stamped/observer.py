"""The filter with time stamps as it runs: `step(y, t=...)` for each sample."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.portable import Portable, known_names
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.stamped.design import StampedFilter
from replication.estimation.nonuniform.stamped.kalman import Transition, c_form
from replication.estimation.validation import Array, as_array, finite_vector


def as_finite(name: str, value: Any, kind: str = "time (s)") -> float:
    """A finite number; raises InvalidInputError. A driver hands over many, so that the check is a short one."""
    plain = value.item() if isinstance(value, (np.ndarray, np.generic)) and value.ndim == 0 else value
    if not isinstance(plain, (float, int)) or isinstance(plain, bool) or not isfinite(plain):
        raise InvalidInputError(f"{name} must be a finite {kind}, got {value!r}")
    return float(plain)


def as_sample(value: Any, sensors: Sequence[str], *, complete: bool) -> Array:
    """A sample (q,) with NaN where a sensor did not measure.

    complete: all sensors must have. Raises InvalidInputError for a sensor that is not known, or a number that is none.
    """
    if isinstance(value, Mapping):
        known_names(value, sensors, "sensor")
        entries = [value.get(name) for name in sensors]
    else:
        entries = list(np.atleast_1d(np.asarray(value, dtype=object)).ravel())
    if len(entries) != len(sensors):
        raise InvalidInputError(
            f"y must have {len(sensors)} entries (None where a sensor did not measure), or name its sensors, got "
            f"{value!r}"
        )
    sample = np.full(len(sensors), np.nan)
    for i, entry in enumerate(entries):
        if entry is not None:
            sample[i] = as_finite(
                f"the sample of {sensors[i]}", entry, "number (None where the sensor did not measure)"
            )
        elif complete:
            raise InvalidInputError(
                f"the sample of {sensors[i]} is missing: this estimator needs all sensors at once; where they measure "
                "apart, take a `StampedKalman`"
            )
    return sample


class StampedEstimator(Portable, ABC):
    """One sample after the other, each with its time stamp."""

    sensors: Sequence[str]
    inputs: int
    """How many inputs are known."""

    def step(self, y: Any, *, t: float, u: Any = None, now: float | None = None) -> Array:
        """Take a sample, or only a new input.

        Parameters
        ----------
        y : mapping of str to float, array (q,), or None
            What each sensor measured, by name or in order, None for those that did not. `{}` only tells u.
        t : float
            When, s.
        u : array (m,), optional
            Known input from t on; the one before goes on unless given.
        now : float, optional
            The present time, s, if time stamps that lie after it are to be refused.

        Returns
        -------
        array (n,)
            x^(k|k), the estimate of the state at the newest sample.

        Raises
        ------
        InvalidInputError
            A sensor that is not known, a number that is not finite, or a time stamp in the future, or in no order that
            the estimator can take; nothing has changed.
        """
        sample, time = self._sample(y), as_finite("t", t)
        if now is not None and time > as_finite("now", now):
            raise InvalidInputError(
                f"t = {time:.9g} s lies in the future, now is {now:.9g} s; check the sensor's clock"
            )
        held = None if u is None else finite_vector("u", [u] if np.ndim(u) == 0 else u, self.inputs)
        self._take(sample, time, held)
        return self.estimate

    @abstractmethod
    def predict(self, t: float) -> Any:
        """The estimate at a time that is not before the newest sample, if the input goes on.

        Parameters
        ----------
        t : float
            When, s; that of the next sample gives x^(k+1|k).

        Returns
        -------
        array (n,) or Estimate
            x^(t) from all samples until now; of a Kalman filter with its covariance.

        Raises
        ------
        InvalidInputError
            There is no sample yet, or t lies before the newest one.
        """

    @property
    @abstractmethod
    def estimate(self) -> Array:
        """x^(k|k), (n,); the start before any sample."""

    @abstractmethod
    def _sample(self, y: Any) -> Array | None:
        """(q,), or None if there is only an input."""

    @abstractmethod
    def _take(self, sample: Any, t: float, u: Array | None) -> None: ...


class StampedObserver(StampedEstimator):
    """One sample after the other, all sensors at once; `outside` counts the periods for which no level is known.

    The level is that of z^ at the time of a sample, from the samples before it: `predict(t)`.

    Parameters
    ----------
    plant : SampledPlant
        The plant of the design.
    filter_ : StampedFilter
        Its gain.
    periods : PeriodRange
        The periods for which the level holds, s.
    known : array (n, p)
        Effect of known inputs, held from sample to sample.
    sensors : sequence of str
        Names of the measurements.
    """

    def __init__(
        self, plant: SampledPlant, filter_: StampedFilter, periods: PeriodRange, known: Array, sensors: Sequence[str]
    ) -> None:
        self.plant, self.filter, self.periods, self.sensors = plant, filter_, periods, tuple(sensors)
        self.inputs = known.shape[1]
        n = plant.order
        self.transition = Transition.of(plant.A, np.hstack([known, plant.B]), np.zeros((n, n)))
        self.reset()

    def reset(self, estimate: Any = None) -> None:
        """Forget all samples; `estimate` (n,) is x^ at the first one, zero unless given. Raises InvalidInputError."""
        n = self.plant.order
        start = np.zeros(n) if estimate is None else as_array("estimate", estimate, (n,))
        # The state at `_since`, the disturbance since the sample at `_time`, and the input since then.
        self._mean = np.concatenate([start, np.zeros(self.plant.B.shape[1])])
        self._input, self._time, self._since = np.zeros(self.inputs), None, None
        self.outside = 0

    _time: float | None
    _since: float | None

    def _sample(self, y: Any) -> Array | None:
        only = y is None or (isinstance(y, Mapping) and not y)
        return None if only else as_sample(y, self.sensors, complete=True)

    def _take(self, sample: Any, time: float, u: Array | None) -> None:
        only = sample is None
        if only and u is None:
            raise InvalidInputError("step needs a sample y, or an input u that changes at t; got neither")
        if self._since is not None and self._time is not None and self._time < self._since and time < self._since:
            raise InvalidInputError(
                f"t = {time:.9g} s lies before the newest input, {self._since:.9g} s; give both in order"
            )
        if self._time is not None and (time < self._time if only else time <= self._time):
            raise InvalidInputError(
                f"t = {time:.9g} s is not after the sample before, {self._time:.9g} s: time stamps must increase; "
                "samples that come late need a `StampedKalman`"
            )
        input_ = self._input if u is None else u
        n = self.plant.order
        before = self._mean[:n] if self._time is None else self.predict(time)
        if sample is None:
            # Before the first sample nothing is known of the time at which the start holds.
            self._input, self._since = input_, None if self._time is None else time
            self._mean = np.concatenate([before, self._mean[n:]])
            return
        h = None if self._time is None else time - self._time
        if h is not None:
            rounding = 4 * np.finfo(float).eps * max(abs(time), abs(time - h))
            self.outside += not self.periods.h_l - rounding <= h <= self.periods.h_u + rounding
        corrected = self.filter.gain(h) @ (sample - self.plant.C @ before)
        corrected[:n] += before
        self._mean, self._input, self._time, self._since = corrected, input_, time, time

    def predict(self, t: float) -> Array:
        """x^(t); L times it is z^, at the time of the next sample that of the level."""
        time = as_finite("t", t)
        if self._since is None or time < self._since:
            newest = "there is none yet" if self._since is None else f"{self._since:.9g} s"
            raise InvalidInputError(f"t = {time:.9g} s must not be before the newest sample ({newest})")
        Phi, Gamma, _ = self.transition.at(time - self._since)
        n = self.plant.order
        return np.asarray(Phi @ self._mean[:n] + Gamma @ np.concatenate([self._input, self._mean[n:]]))

    @property
    def estimate(self) -> Array:
        """x^(k|k), (n,); the start before any sample."""
        return np.array(self._mean[: self.plant.order])

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """The filter as one C99 file: `NAME_init`, `NAME_step`, `NAME_predict` are `reset`, `step`, `predict`."""
        return c_form(
            name,
            comment,
            self.transition,
            self.plant.C,
            self.inputs,
            {"gain": self.filter.G, "edges": np.array([*self.filter.edges, self.periods.h_u])},
        )
