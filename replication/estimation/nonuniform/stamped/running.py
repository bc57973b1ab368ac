"""A Kalman filter that runs on time stamps: `step(y, t=...)` for each sample, in order, at once, or late."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.running import gate_of
from replication.estimation.nonuniform.stamped.kalman import (
    Estimate,
    Instant,
    NoisyPlant,
    Recursion,
    Transition,
    c_form,
)
from replication.estimation.nonuniform.stamped.observer import StampedEstimator, as_finite, as_sample
from replication.estimation.validation import Array, as_array, covariance, positive_scalar


class StampedKalman(StampedEstimator):
    """The Kalman filter of a plant whose samples carry time stamps, at any distances, of some or all of its sensors.

    A sample that comes late changes the estimate exactly as if it had come in time: the filter keeps what it knew at
    the samples of the last `horizon` seconds, and runs again from there.

    Parameters
    ----------
    plant : NoisyPlant
        Dynamics, sensors and noise.
    horizon : float
        How late a sample may come, s; 0 keeps nothing.
    gate : float, optional
        Beyond which a number is left out, sensor by sensor, and counted by `gated`: below 1 the probability with which
        a good one passes (chi-square), from 1 on standard deviations of its innovation.

    Raises
    ------
    InvalidInputError
        The horizon is negative, or the gate neither of the two; or either is given although noise is held, which needs
        all samples in order.

    Examples
    --------
    >>> cart = NoisyPlant([[0, 1], [0, 0]], [[1, 0], [0, 1]], Q=[[0, 0], [0, 0.1]], R=[0.01, 0.04], sensors=["x", "v"])
    >>> observer = StampedKalman(cart, horizon=0.5, gate=5)
    >>> first = observer.step({"x": 1.0}, t=0.0)
    >>> second = observer.step({"v": 0.5}, t=0.13)
    >>> late = observer.step({"x": 1.05}, t=0.1)
    >>> observer.predict(0.2).x.shape
    (2,)
    """

    kind: ClassVar[type[Any]] = NoisyPlant
    _run_of: ClassVar[Callable[[Any, float], Recursion]] = Recursion.of

    def __init__(self, plant: Any, *, horizon: float = 0.0, gate: float | None = None) -> None:
        if not isinstance(plant, self.kind):
            raise InvalidInputError(f"plant must be a {self.kind.__name__}, got {type(plant).__name__}")
        self.plant, self.sensors, self.inputs = plant, tuple(plant.sensors), plant.inputs
        self.horizon = positive_scalar("horizon", horizon, unit="s") if horizon else 0.0
        if self.horizon and plant.S is not None:
            raise InvalidInputError("held noise (S) has one value from sample to sample: late samples need white noise")
        self.gate = gate_of(gate)
        if self.gate and plant.S is not None:
            raise InvalidInputError("held noise (S) is told by every sample: a gate needs white noise, without S")
        self._run = type(self)._run_of(plant, self.gate)
        self.reset()

    def reset(self, estimate: Any = None, P0: Any = None, *, t: float | None = None) -> None:
        """Forget all samples.

        Parameters
        ----------
        estimate : array (n,), optional
            x^(0); zero unless given.
        P0 : array (n, n), optional
            Covariance of its error; that of the plant unless given.
        t : float, optional
            When that holds, s; at the first sample unless given.

        Raises
        ------
        InvalidInputError
            A shape does not fit, P0 is no covariance, or t is no finite number.
        """
        n = self.plant.order
        x = np.zeros(n) if estimate is None else as_array("estimate", estimate, (n,))
        P = self.plant.P0 if P0 is None else covariance("P0", P0, n)
        self._instants: tuple[Instant, ...] = ()
        self._gated = 0
        start = Estimate(np.nan if t is None else as_finite("t", t), np.array(x), np.array(P))
        self._start = start
        if t is not None:
            self._instants = (self._run.update(start, np.full(len(self.sensors), np.nan), np.zeros(self.inputs)),)

    def _sample(self, y: Any) -> Array:
        return as_sample(y, self.sensors, complete=self.plant.S is not None)

    def predict(self, t: float) -> Estimate:
        """x^(t) and the covariance P of its error."""
        newest, time = self._newest(), as_finite("t", t)
        if time < newest.t:
            raise InvalidInputError(f"t = {time:.9g} s lies before the newest sample, {newest.t:.9g} s; see `smoothed`")
        return self._run.predict(newest, time)

    def smoothed(self) -> list[Estimate]:
        """The estimates at the samples of the last `horizon` seconds from all samples until now: fixed-lag smoothing.

        Returns
        -------
        list of Estimate
            The oldest first; the last one is `estimate`.

        Raises
        ------
        InvalidInputError
            There is no sample yet.
        """
        newest = self._newest()
        estimates = self._run.smooth(self._instants)
        return [instant for instant in estimates if instant.t >= newest.t - self.horizon]

    @property
    def estimate(self) -> Array:
        """x^(k|k), (n,); the start before any sample."""
        return np.array(self._instants[-1].mean[: self.plant.order] if self._instants else self._start.x)

    @property
    def covariance(self) -> Array:
        """Covariance of the error of `estimate`, (n, n)."""
        n = self.plant.order
        return np.array(self._instants[-1].covariance[:n, :n] if self._instants else self._start.P)

    @property
    def gated(self) -> int:
        """How many numbers were beyond the gate; late samples may change what is within."""
        return self._gated + sum(instant.gated for instant in self._instants)

    @property
    def innovation(self) -> tuple[Array, Array]:
        """What the sensors of the newest sample gave beyond what was expected, and its covariance."""
        newest = self._newest()
        return np.array(newest.innovation), np.array(newest.spread)

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """The filter as one C99 file, for samples in order, NAN where a sensor did not measure.

        `NAME_init`, `NAME_step` and `NAME_predict` do what `reset`, `step` and `predict` do. A filter of held noise has
        none.
        """
        plant = self.plant
        if plant.S is not None:
            raise InvalidInputError("a filter of held noise (S) has no C form; describe the noise as white, without S")
        transition = Transition.of(plant.A, plant.B_u, plant.Q)
        tables = {"noise": plant.R, "start": plant.P0, "gate": np.array([self.gate])}
        return c_form(name, comment, transition, plant.C, plant.inputs, tables)

    def _newest(self) -> Instant:
        if not self._instants:
            raise InvalidInputError("there is no sample yet: call step, or reset with the time t of the start")
        return self._instants[-1]

    def _take(self, sample: Array, t: float, u: Array | None) -> None:
        known, run = self._instants, self._run
        if not known:
            input_ = np.zeros(self.inputs) if u is None else u
            self._instants = (run.update(replace(self._start, t=t), sample, input_),)
            return
        place = bisect_right([instant.t for instant in known], t)
        if place < len(known):
            self._require_in_time(t, place, u)
        before, after = known[:place], known[place:]
        if before[-1].t == t:
            same = before[-1]
            if np.any(~np.isnan(sample) & ~np.isnan(same.y)):
                raise InvalidInputError(
                    f"a sensor has measured at t = {t:.9g} s before: time stamps of one sensor must increase"
                )
            merged = np.where(np.isnan(sample), same.y, sample)
            instants = [*before[:-1], run.update(same.prior, merged, same.u if u is None else u)]
        else:
            instants = [*before, run.update(run.predict(before[-1], t), sample, before[-1].u if u is None else u)]
        for instant in after:
            instants.append(run.update(run.predict(instants[-1], instant.t), instant.y, instant.u))
        while len(instants) > 1 and instants[1].t <= instants[-1].t - self.horizon:
            self._gated += instants.pop(0).gated
        self._instants = tuple(instants)

    def _require_in_time(self, t: float, place: int, u: Array | None) -> None:
        newest = self._instants[-1].t
        if t < newest - self.horizon:
            raise InvalidInputError(
                f"t = {t:.9g} s lies {newest - t:.3g} s before the newest sample, more than the horizon of "
                f"{self.horizon:g} s: leave the sample out, or make the observer with a longer horizon"
            )
        if place == 0:
            raise InvalidInputError(f"t = {t:.9g} s lies before the start, {self._instants[0].t:.9g} s; reset earlier")
        if u is not None:
            raise InvalidInputError("an input cannot be changed by a late sample; give u with the samples as they come")
