"""The extended Kalman filter of a nonlinear plant with slow sensors: late, lost, asynchronous samples, a gate, C99.

On time stamps, or at the instants of a base period with sensors that have periods of their own.

It linearises about its estimate, and guarantees nothing: neither that the error stays bounded, nor that the covariance
is that of the error. Source: A. H. Jazwinski, Stochastic Processes and Filtering Theory (1970), ch. 8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.export import c_file, source
from replication.estimation.api.running import RunningObserver, gate_of
from replication.estimation.linear.riccati import symmetric
from replication.estimation.multirate.problem import SensingSchedule
from replication.estimation.nonuniform.stamped.kalman import USAGE, Estimate, Instant, Recursion, settle_noise
from replication.estimation.nonuniform.stamped.running import StampedKalman
from replication.estimation.validation import Array, as_array, covariance, positive_scalar

STEP, ALIKE = 1e-6, 1e-3
"""Share of a state by which it is moved to compare a Jacobian, and of the largest entry by which it may differ."""


@dataclass(frozen=True, eq=False)
class NonlinearPlant:
    """x(t + d) = f(x, u, d) + noise of covariance Q(d), y = h(x) + noise of covariance R; u is held.

    Parameters
    ----------
    f : function (x (n,), u (m,), d) -> array (n,)
        The state d seconds later: the solution of x' = .. by one Runge-Kutta step, say.
    F : function (x, u, d) -> array (n, n)
        Its Jacobian by x.
    h : function (x) -> array (q,)
        What the sensors measure.
    H : function (x) -> array (q, n)
        Its Jacobian.
    Q : array (n, n), or function (d) -> array (n, n)
        Intensity of white process noise, of which F (P + Q d/2) F' + Q d/2 is taken; or its covariance over d seconds.
    R : array (q, q) or (q,)
        Covariance of the sensors' noise, positive definite; a vector holds variances.
    x0 : array (n,)
        The start, at which the Jacobians are compared with f and h.
    P0 : array (n, n), optional
        Covariance of its error; the identity unless given.
    inputs : int
        m, number of known inputs.
    sensors : sequence of str, optional
        Names of the q sensors; y[0], y[1] and so on unless given.
    dt : float
        A usual time between samples, s, for that comparison; the base period of a multi-rate filter.

    Raises
    ------
    InvalidInputError
        A function returns another shape, or numbers that are not finite, at x0; a Jacobian is not that of its function;
        Q, R or P0 is no covariance.

    Examples
    --------
    >>> pendulum = NonlinearPlant(
    ...     f=lambda x, u, d: np.array([x[0] + d * x[1], x[1] - d * np.sin(x[0])]),
    ...     F=lambda x, u, d: np.array([[1, d], [-d * np.cos(x[0]), 1]]),
    ...     h=lambda x: np.array([np.sin(x[0])]),
    ...     H=lambda x: np.array([[np.cos(x[0]), 0.0]]),
    ...     Q=np.diag([0, 0.01]), R=[0.04], x0=[0.3, 0.0],
    ... )
    >>> ExtendedKalman(pendulum, gate=5).step([0.3], t=0.0).shape
    (2,)
    """

    f: Callable[[Array, Array, float], Any]
    F: Callable[[Array, Array, float], Any]
    h: Callable[[Array], Any]
    H: Callable[[Array], Any]
    Q: Any
    R: Any
    x0: Any
    P0: Any = None
    inputs: int = 0
    sensors: Any = None
    dt: float = 0.1

    S: ClassVar[None] = None
    """Its noise is white."""

    def __post_init__(self) -> None:
        if not all(callable(function) for function in (self.f, self.F, self.h, self.H)):
            raise InvalidInputError(
                "f, F, h and H must be functions: state, its Jacobian, measurements, their Jacobian"
            )
        x0 = as_array("x0", self.x0, (np.size(self.x0),))
        n, dt, rest = len(x0), positive_scalar("dt", self.dt, unit="s"), np.zeros(self.inputs)
        output = self.h(x0)
        q = len(as_array("what h returns", output, (np.size(output),)))
        settle_noise(self, np.zeros((n, n)), n, q, "entry of h")
        Q = self.Q if callable(self.Q) else covariance("Q", self.Q, n)
        for name, value in {"x0": x0, "dt": dt, "Q": Q}.items():
            object.__setattr__(self, name, value)
        covariance("Q(d)", self._spread(np.eye(n), dt), n)
        _compare("F", self.F(x0, rest, dt), lambda x: as_array("what f returns", self.f(x, rest, dt), (n,)), x0)
        _compare("H", self.H(x0), lambda x: as_array("what h returns", self.h(x), (q,)), x0)

    @property
    def order(self) -> int:
        """n, the number of states."""
        return len(self.x0)

    def _spread(self, F: Array, d: float) -> Array:
        """Covariance of the process noise over d seconds with the Jacobian F."""
        if callable(self.Q):
            return np.asarray(self.Q(d), dtype=float)
        return symmetric(F @ self.Q @ F.T + self.Q) * (d / 2)


def _compare(name: str, jacobian: Any, function: Callable[[Array], Array], x: Array) -> None:
    """Refuse a Jacobian of another shape, or one that is not that of the function at x."""
    matrix = as_array(f"what {name} returns", jacobian, (len(function(x)), len(x)))
    steps = STEP * np.maximum(np.abs(x), 1.0)
    columns = [(function(x + d) - function(x - d)) / (2 * d.sum()) for d in np.diag(steps)]
    apart = np.abs(matrix - np.column_stack(columns))
    if np.any(apart > ALIKE * np.maximum(1.0, np.abs(matrix).max())):
        i, j = (int(k) for k in np.unravel_index(np.argmax(apart), apart.shape))
        raise InvalidInputError(
            f"{name} is not the Jacobian of {name.lower()} at x0: entry ({i}, {j}) is {matrix[i, j]:.6g}, the "
            f"difference quotient {columns[j][i]:.6g}"
        )


def _finite(name: str, value: Any, x: Array) -> Array:
    """What a function returned at x; raises InvalidInputError unless it is finite."""
    array = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(array)):
        raise InvalidInputError(
            f"{name} is not finite at x = {x.tolist()}: the filter is lost; reset it nearer the truth"
        )
    return array


class ExtendedRecursion(Recursion):
    """The same recursion, about the estimate."""

    plant: Any

    def output(self, x: Array) -> tuple[Array, Array]:
        """h and H at x."""
        return _finite("h", self.plant.h(x), x), _finite("H", self.plant.H(x), x)

    def predict(self, known: Instant, t: float) -> Estimate:
        """f at the estimate; at its own time the estimate itself."""
        d, plant = t - known.t, self.plant
        if d == 0:
            return Estimate(t, known.mean, known.covariance)
        x = _finite("f", plant.f(known.mean, known.u, d), known.mean)
        F = _finite("F", plant.F(known.mean, known.u, d), known.mean)
        return Estimate(t, x, symmetric(F @ known.covariance @ F.T) + plant._spread(F, d))

    def smooth(self, instants: Sequence[Instant]) -> list[Estimate]:
        """There is none."""
        raise InvalidInputError(
            "an extended filter has no smoother here; late samples change its estimates all the same"
        )


def extended(plant: NonlinearPlant, gate: float) -> ExtendedRecursion:
    """Its recursion, which has no table of transitions."""
    return ExtendedRecursion(plant, None, gate)  # type: ignore[arg-type]


class ExtendedKalman(StampedKalman):
    """An extended Kalman filter on time stamps; it guarantees nothing.

    It takes samples as `StampedKalman` does: of some or all sensors, at any distances, late by at most `horizon`
    seconds. It is right to first order about its estimate; a start far from the truth, or samples so rare that f bends
    between them, may lead it astray for ever, without a sign in its covariance. `replay` tells on a log.

    Parameters
    ----------
    plant : NonlinearPlant
        Functions and noise.
    horizon : float
        How late a sample may come, s; 0 keeps nothing.
    gate : float, optional
        As in `StampedKalman`.

    Raises
    ------
    InvalidInputError
        The plant is of another kind, the horizon is negative, or the gate is none.
    """

    kind = NonlinearPlant
    _run_of = extended

    def reset(self, estimate: Any = None, P0: Any = None, *, t: float | None = None) -> None:
        """Forget all samples; the start is that of the plant unless given."""
        super().reset(self.plant.x0 if estimate is None else estimate, P0, t=t)

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """The filter as one C99 file that calls two functions of yours, `NAME_f` and `NAME_h`, which it declares.

        `NAME_init`, `NAME_step` and `NAME_predict` do what `reset`, `step` and `predict` do, for samples in order. Q
        must be a matrix.
        """
        return extended_c(self.plant, self.gate, name, comment)


def extended_c(plant: NonlinearPlant, gate: float, name: str, comment: str) -> str:
    """The C form, with a gate in standard deviations; raises InvalidInputError where Q is a function."""
    if callable(plant.Q):
        raise InvalidInputError("the C form needs Q as a matrix, the intensity of white noise")
    n = plant.order
    sizes = {"estimates": n, "inputs": plant.inputs, "measurements": len(plant.R)}
    sizes |= {"mean": n, "gaps": 1, "spread": n * n}
    tables = {"q": plant.Q, "noise": plant.R, "origin": plant.x0, "start": plant.P0, "gate": np.array([gate])}
    return c_file(name, comment, YOURS + USAGE, source("stamped.c", "weighed.c", "extended.c"), sizes, tables)


YOURS = """\
It is an extended Kalman filter, and guarantees nothing. You write OBS_f(x, u, d, next, jacobian): the state d seconds
   after x under the input u that is held, and its Jacobian by x, OBS_ESTIMATES rows; and OBS_h(x, y, jacobian): what
   the sensors measure, and its Jacobian, OBS_MEASUREMENTS rows. Numbers of theirs that are not finite are refused, too.
   """


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
