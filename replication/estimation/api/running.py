"""Observers that run in a loop, one instant after the other: `reset`, then `step(u, y)`.

`step(u, y)` takes the known input u(k) and the measurements y(k) of the present instant k, and returns the estimate of
the state at the next one, x^(k+1); before the first step `estimate` is x^(0). So a controller may use x^(k) in u(k).
(Of a delayed plant, in continuous time, it returns the estimate at the same instant; of a filter (4), that of z.)

An entry of y that is None, NaN or masked although its sensor should measure is missing: the observer goes on as if it
were what it expects (no correction), and `missed` counts it. A number of a sensor that should not measure is a sample
off its schedule: `unscheduled` counts it. A filter that follows its covariance uses it; where gains are fixed it is
left out, with one warning. The guaranteed level holds for the schedule without misses.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from replication.errors import InvalidInputError
from replication.estimation.api.export import Phase, Recursion
from replication.estimation.api.plants import Signals, each_instant
from replication.estimation.api.portable import NOT_GIVEN, Portable
from replication.estimation.linear.periodic import Stage, lifted
from replication.estimation.validation import Array, StateSpace, as_array, positive_scalar

MOST_STATES = 2000
"""Of a linear system that a user is given."""


def statespace(phases: Sequence[Phase], signals: Signals | None) -> StateSpace:
    """The recursion of `phases` over one period, from (u, y) at all instants to the estimates x^ at them."""
    stages = []
    for phase in phases:
        drive = np.hstack([phase.input, phase.injection * phase.due])
        direct = np.zeros((len(phase.readout), drive.shape[1]))
        stages.append(Stage(phase.transition, drive, phase.readout, direct))
    dt = signals.dt if signals else None
    return _system(lifted(stages), True if dt is None else dt * len(phases), signals, len(phases))


def require_small(states: int) -> None:
    """Raise InvalidInputError if a linear system of so many states is of no use."""
    if states > MOST_STATES:
        raise InvalidInputError(
            f"as a linear system the observer has {states} states, more than {MOST_STATES}; choose a longer dt"
        )


def single(following: Array, estimate: Array, dt: float, signals: Signals | None) -> StateSpace:
    """One step of `dt`: rows of the following state and of x^, columns of the state and of (u, y)."""
    n = len(following)
    return _system(Stage(following[:, :n], following[:, n:], estimate[:, :n], estimate[:, n:]), dt, signals, 1)


def _system(whole: Stage, dt: float, signals: Signals | None, count: int) -> StateSpace:
    """With the names of inputs, measurements and estimates, `@k` for instant k of several."""
    import control

    system = control.StateSpace(*whole, dt)
    if signals is None:
        return system
    inputs = [*signals.inputs, *signals.measurements]
    outputs = [f"estimate of {name}" for name in signals.states[: system.noutputs // count]]
    system.set_inputs(each_instant(inputs, count) if count > 1 else inputs)
    if len(outputs) * count == system.noutputs:  # a controller's outputs are more than the states
        system.set_outputs(each_instant(outputs, count) if count > 1 else outputs)
    return system


Mask = NDArray[np.bool_]
LARGEST_GATE = 100.0


class UnscheduledSampleWarning(UserWarning):
    """A sensor gave a number at an instant at which it should not measure, and the gains have no place for it."""


def warn_unscheduled(before: int) -> None:
    """Warn of the first sample that is left out."""
    if not before:
        warnings.warn(
            "a sample came off its schedule and was left out, as the gains of this observer have no place for it "
            "(`unscheduled` counts them); give None where a sensor is not due, shift the offsets of the design, or "
            "take the Kalman filter from a start: design(goal='h2').filter(P0=..)",
            UnscheduledSampleWarning,
            stacklevel=4,
        )


def gate_of(gate: float | None) -> float:
    """The gate in standard deviations of an innovation, 0 for none.

    Below one it is the probability that a good sample passes (chi-square with one degree of freedom), from one on the
    standard deviations themselves. Raises InvalidInputError for what is neither.
    """
    if gate is None:
        return 0.0
    number = positive_scalar("gate", gate)
    if number > LARGEST_GATE:
        raise InvalidInputError(
            f"gate must be a probability below 1 or from 1 to {LARGEST_GATE:g} standard deviations, got {gate!r}"
        )
    return number if number >= 1 else float(ndtri((1 + number) / 2))


class RunningObserver(Portable, ABC):
    """An observer with its present state; `instant` counts the steps, `missed` the measurements that did not come.

    `unscheduled` counts samples of sensors that were not due.

    Parameters
    ----------
    states : int
        n, length of the start x^(0).
    inputs : int
        m, number of known inputs.
    measurements : int
        q, number of sensors.
    """

    def __init__(self, states: int, inputs: int, measurements: int) -> None:
        self.states, self.inputs, self.measurements = states, inputs, measurements
        self.reset()

    def reset(self, estimate: Any = None) -> Array:
        """Go back to instant 0.

        Parameters
        ----------
        estimate : array (n,), optional
            x^(0); zero unless given.

        Returns
        -------
        array
            The estimate at instant 0.

        Raises
        ------
        InvalidInputError
            `estimate` has another length, or is not finite.
        """
        start = np.zeros(self.states) if estimate is None else as_array("estimate", estimate, (self.states,))
        self.instant, self.missed, self.unscheduled = 0, 0, 0
        self._begin(start)
        return self.estimate

    def step(self, u: Any, y: Any = NOT_GIVEN) -> Array:
        """Take what is known at the present instant and go on to the next.

        Parameters
        ----------
        u : array (m,), dict, or None
            Known inputs u(k); None if the plant has none. A single number stands for a vector of one. Alone, a dict of
            inputs and measurements by name: `step({"encoder": 0.3})`.
        y : array (q,), dict, or None
            Measurements y(k); None, or None or NaN in an entry, where one did not come; so do names left out.

        Returns
        -------
        array (n,)
            x^(k+1).

        Raises
        ------
        InvalidInputError
            Another length or name, text, or infinities; the observer is then as before.
        """
        if y is NOT_GIVEN or isinstance(u, dict) or isinstance(y, dict):
            u, y = self._by_name(u, y)
        known = vector("u", u, self.inputs)
        if np.isnan(known).any():
            raise InvalidInputError(f"u must be {self.inputs} numbers, got {u!r}; an input is known at every instant")
        self._advance(known, vector("y", y, self.measurements))
        self.instant += 1
        return self.estimate

    @property
    @abstractmethod
    def estimate(self) -> Array:
        """x^(k), the estimate of the state at the present instant, (n,)."""

    @abstractmethod
    def _begin(self, start: Array) -> None: ...

    @abstractmethod
    def _advance(self, u: Array, y: Array) -> None: ...

    def _completed(self, y: Array, expected: Array, due: Any) -> Array:
        """y with what is not due or missing replaced by what is expected; counts both."""
        came = ~np.isnan(y)
        self._arrived(came, due)
        return np.where(came & due, y, expected)

    def _arrived(self, came: Mask, due: Mask) -> None:
        """Count samples that did not come, and those that came and were not due."""
        self.missed += int(np.sum(due & ~came))
        if extra := int(np.sum(came & ~due)):
            warn_unscheduled(self.unscheduled)
            self.unscheduled += extra


class PeriodicObserver(RunningObserver):
    """A periodic recursion; a missing measurement is replaced by the one that is expected.

    One that expects nothing waits: a sample that did not come changes nothing, one that is not complete is refused.

    Parameters
    ----------
    phases : sequence of Phase
        One for each instant of the period.
    expected : sequence of array (q, N)
        Measurements at each instant as the observer's own state o says: y = expected o + direct u.
    direct : array (q, m), optional
        Effect of the known inputs on the measurements; none unless given.
    starts : int, optional
        Length of the start; that of the estimate unless given.
    """

    def __init__(
        self, phases: Sequence[Phase], expected: Sequence[Array], direct: Array | None = None, starts: int | None = None
    ) -> None:
        self.phases, self.expected = tuple(phases), tuple(expected)
        sensors, inputs = phases[0].injection.shape[1], phases[0].input.shape[1]
        self.direct = np.zeros((sensors, inputs)) if direct is None else direct
        super().__init__(starts or len(phases[0].readout), inputs, sensors)

    @property
    def estimate(self) -> Array:
        """x^(k), (n,)."""
        return np.asarray(self.phases[self.instant % len(self.phases)].readout @ self._state)

    def _recursion(self) -> Recursion:
        return Recursion(self.phases, self.states, self.expected or None, self.direct)

    def to_statespace(self) -> StateSpace:
        """From u and y of all instants of a period to x^ at these; a sensor that is not due has no effect."""
        return statespace(self.phases, self.signals)

    def _begin(self, start: Array) -> None:
        # The observer's own state comes first; what it holds or has predicted so far is nothing.
        self._state = np.zeros(len(self.phases[0].transition))
        self._state[: self.states] = start

    def _advance(self, u: Array, y: Array) -> None:
        now = self.instant % len(self.phases)
        phase = self.phases[now]
        if self.expected:
            y = self._completed(y, self.expected[now] @ self._state + self.direct @ u, phase.due)
        elif np.all(missing := np.isnan(y)):
            self.missed += len(y)
            return
        elif np.any(missing):
            raise InvalidInputError(
                f"y must be complete or None, got {y.tolist()}; the filter takes all sensors at once"
            )
        self._state = phase.transition @ self._state + phase.input @ u + phase.injection @ y


def vector(name: str, value: Any, size: int) -> Array:
    """`value` as (size,) floats, NaN where an entry is None; None stands for all missing."""
    if type(value) is np.ndarray and value.dtype == float and value.shape == (size,) and not np.isinf(value).any():
        return value
    if value is None:
        return np.full(size, np.nan)
    if isinstance(value, np.ma.MaskedArray):
        value = value.tolist()  # None where it is masked
    entries = list(np.atleast_1d(np.asarray(value, dtype=object)).ravel())
    try:
        if any(isinstance(entry, (str, bytes, complex, np.complexfloating)) for entry in entries):
            raise TypeError
        vector = np.array([np.nan if entry is None else float(entry) for entry in entries])
    except (TypeError, ValueError):
        raise InvalidInputError(f"{name} must hold numbers (None where one is missing), got {value!r}") from None
    if len(vector) != size:
        raise InvalidInputError(f"{name} must have {size} entries, got {value!r}")
    if np.any(np.isinf(vector)):
        raise InvalidInputError(f"{name} must be finite, got {value!r}; a missing measurement is None or NaN")
    return vector
