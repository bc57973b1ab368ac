"""Kalman filters that run in a loop: `step(u, y)` gives x^(k|k), x^(k+1|k), covariances and innovation.

`KalmanFilter` has the gains of the steady state; `StartingFilter` has those from the covariance of the start on.
A measurement that is None or NaN although its sensor is due is left out: the first then goes on without a correction
by it, the other also says so in its covariance. The other takes a sample off its schedule, too; the first has no gain
for it. With a gate, a measurement whose innovation exceeds so many standard deviations is left out likewise.
"""

from abc import abstractmethod
from typing import Any, NamedTuple

import numpy as np

from replication.estimation.api.export import Phase, Recursion
from replication.estimation.api.portable import NOT_GIVEN
from replication.estimation.api.running import Mask, RunningObserver, gate_of, warn_unscheduled
from replication.estimation.linear.riccati import solve
from replication.estimation.multirate.kalman import Correction, FilterGains, Sensing, corrected, read_only, sensing
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array, covariance


class KalmanStep(NamedTuple):
    """What is known after the measurements of one instant k.

    Attributes
    ----------
    filtered : array (n,)
        x^(k|k).
    covariance : array (n, n)
        Of its error.
    prediction : array (n,)
        x^(k+1|k).
    predicted_covariance : array (n, n)
        Of its error.
    innovation : array (q,)
        y(k) - C x^(k|k-1); NaN where nothing was measured.
    smoothed : array (n,)
        x^(k-lag|k): of the past; x^(k|k) for lag 0, and NaN before instant `lag`.
    smoothed_covariance : array (n, n)
        Of its error.
    """

    filtered: Array
    covariance: Array
    prediction: Array
    predicted_covariance: Array
    innovation: Array
    smoothed: Array
    smoothed_covariance: Array


class RunningKalman(RunningObserver):
    """A filter of a plant with its schedule; `gated` counts measurements beyond the gate.

    Its `step` gives a `KalmanStep` where other observers give an estimate; `estimate` is x^(k|k-1).
    """

    takes_any: bool = False
    """Whether a sample off its schedule is used."""

    def __init__(self, problem: MultirateProblem, lag: int, gate: float | None) -> None:
        plant = problem.plant
        self.gate = gate_of(gate)
        self.problem, self.lag = problem, lag
        self._A, self._B, self._C, self._mask = plant.A, plant.B_u, plant.C, problem.schedule.mask
        self._direct = plant.D_u if np.any(plant.D_u) else None
        self._due = [int(due.sum()) for due in self._mask]
        super().__init__(plant.order, plant.B_u.shape[1], plant.sensors)

    def step(self, u: Any, y: Any = NOT_GIVEN) -> KalmanStep:  # type: ignore[override]
        """As in `RunningObserver`, with filtered and smoothed estimates, covariances and innovation.

        Returns
        -------
        KalmanStep
            What is known after the measurements of this instant.
        """
        super().step(u, y)
        return self._latest

    @property
    def estimate(self) -> Array:
        """x^(k|k-1), the estimate of the state at the present instant from what came before, (n,)."""
        return np.array(self._past[0])

    def _begin(self, start: Array) -> None:
        self.gated = 0
        # Row i is x^(k-i|k-1).
        self._past = np.full((self.lag + 1, self.states), np.nan)
        self._past[0] = start

    def _advance(self, u: Array, y: Array) -> None:
        phase = self.instant % len(self._mask)
        driven = self._B @ u if len(u) else 0.0
        innovation = y - self._C.dot(self._past[0])
        if self._direct is not None:
            innovation -= self._direct @ u
        due, arrivals = self._mask[phase], innovation == innovation  # NaN is not itself
        came, gated = (arrivals if self.takes_any else due & arrivals), 0
        missed, extra = self._due[phase] - int(np.count_nonzero(due & arrivals)), int(np.count_nonzero(arrivals & ~due))
        if self.gate:
            passed = came & (innovation**2 <= self.gate**2 * self._variances(phase))
            gated, came = int(np.count_nonzero(came & ~passed)), passed
        if extra and not self.takes_any:
            warn_unscheduled(self.unscheduled)
        shown = innovation
        if not came.all():
            shown, innovation = np.where(came, innovation, np.nan), np.where(came, innovation, 0.0)
        irregularity = missed or gated or (extra and self.takes_any)
        self._latest = self._update(phase, innovation, came if irregularity else None, driven, shown)
        self.missed += missed
        self.unscheduled += extra
        self.gated += gated

    @abstractmethod
    def _variances(self, phase: int) -> Array:
        """Of the innovation of each sensor, (q,)."""

    @abstractmethod
    def _update(
        self, phase: int, innovation: Array, came: Mask | None, driven: Array | float, shown: Array
    ) -> KalmanStep:
        """innovation: zero where nothing came, and NaN there in `shown`; came: which came, None if all that are due."""

    def _shifted(self, K: Array, L: Array, innovation: Array, driven: Array | float) -> Array:
        """Correct all that is carried along, x^(k-i|k), and predict; K (lag + 1, n, q), or (n, q) without a lag."""
        corrected = self._past + K.dot(innovation)
        following = np.empty_like(self._past)
        following[0] = self._A.dot(self._past[0]) + L.dot(innovation) + driven
        if self.lag:
            following[1:] = corrected[:-1]
        following.flags.writeable = False  # a part of it is handed out
        self._past = following
        return np.asarray(corrected)


class KalmanFilter(RunningKalman):
    """The periodic steady state of the filter; its covariances hold once the start is forgotten.

    Parameters
    ----------
    problem : MultirateProblem
        Plant and schedule.
    gains : FilterGains
        Of `filter_gains`.
    gate : float, optional
        Beyond which a measurement is left out: a probability below 1 with which a good one passes, or standard
        deviations from 1 on.
    """

    def __init__(self, problem: MultirateProblem, gains: FilterGains, gate: float | None = None) -> None:
        self.gains = gains
        self._next = read_only(np.roll(gains.predicted, -1, axis=0))
        super().__init__(problem, gains.K.shape[1] - 1, gate)

    def _variances(self, phase: int) -> Array:
        return np.diagonal(self.gains.innovation[phase])

    def _update(
        self, phase: int, innovation: Array, came: Mask | None, driven: Array | float, shown: Array
    ) -> KalmanStep:
        gains = self.gains
        now = self._shifted(gains.K[phase], gains.L[phase], innovation, driven)
        return KalmanStep(
            now[0], gains.filtered[phase], self._past[0], self._next[phase], shown, now[-1], gains.smoothed[phase]
        )

    def to_c(self, name: str = "kalman", comment: str = "") -> str:
        """The filter as one C99 file: `NAME_step` writes x^(k+1|k), then x^(k|k), x^(k-1|k) and so on to x^(k-lag|k).

        They are n numbers each; those of instants before the first are without meaning.
        """
        return super().to_c(name, comment)

    def to_matlab(self, name: str = "kalman", comment: str = "") -> str:
        """The filter as a MATLAB function; its estimate is laid out as in `to_c`."""
        return super().to_matlab(name, comment)

    def _recursion(self) -> Recursion:
        """One phase for each instant, of the state (x^(k+1|k), x^(k|k), ..., x^(k-lag|k))."""
        n, q = self.states, self.measurements
        blocks = self.lag + 2
        output = np.hstack([self._C, np.zeros((q, n * (blocks - 1)))])
        direct, phases = self.problem.plant.D_u, []
        for K, L, due in zip(self.gains.K, self.gains.L, self._mask, strict=True):
            injection = np.vstack([L, *K])
            transition = np.kron(np.eye(blocks, k=-1), np.eye(n)) - injection @ output
            transition[:n, :n] += self._A
            known = np.vstack([self._B, np.zeros((n * (blocks - 1), self._B.shape[1]))]) - injection @ direct
            phases.append(Phase(transition, known, injection, np.eye(n * blocks), due))
        limits = self.gate * np.sqrt(np.diagonal(self.gains.innovation, axis1=1, axis2=2)) if self.gate else None
        return Recursion(phases, n, [output] * len(phases), direct, limits)


SETTLED = 1e-15
"""Relative change of a covariance over one period below which it counts as steady."""


class StartingFilter(RunningKalman):
    """The filter from a known start: its gains follow the covariance, and tend to those of `KalmanFilter`.

    Parameters
    ----------
    problem : MultirateProblem
        Plant and schedule.
    P0 : array (n, n)
        Covariance of the error of the start, positive semidefinite.
    lag : int
        How many instants it looks back.
    gate : float, optional
        As in `KalmanFilter`.

    Raises
    ------
    InvalidInputError
        P0 has another shape, is not symmetric or indefinite.
    """

    def __init__(self, problem: MultirateProblem, P0: Any, lag: int = 0, gate: float | None = None) -> None:
        plant = problem.plant
        self.start = covariance("P0", P0, plant.order)
        self._Q = plant.drive @ plant.drive.T
        whole = sensing(problem, problem.schedule.mask)
        self._sensors = [whole.at(k) for k in range(problem.schedule.period)]
        # A sample off its schedule is used unless sensors that never measure together may share their noise.
        self.takes_any = bool(np.linalg.matrix_rank(plant.D) == plant.sensors)
        self._noise = np.sum(plant.D**2, axis=1)
        super().__init__(problem, lag, gate)

    def _begin(self, start: Array) -> None:
        super()._begin(start)
        # Of x^(k-i|k-1): covariance with the error of x^(k|k-1), and its own.
        unknown = [np.full_like(self.start, np.nan)] * self.lag
        self._cross, self._own = [self.start, *unknown], [self.start, *unknown]
        self._kept: dict[int, tuple[Array, Correction | None]] = {}

    def _update(
        self, phase: int, innovation: Array, came: Mask | None, driven: Array | float, shown: Array
    ) -> KalmanStep:
        sensors = self._sensors[phase] if came is None else sensing(self.problem, came)
        step = self._settled(phase) if came is None else None
        if step is None:
            step = corrected(self._A, self._Q, sensors, self._cross[0])
            step.filtered.flags.writeable = step.following.flags.writeable = False  # they are handed out
            if came is None:
                self._kept[phase] = self._cross[0], step
        K, covariances = step.K, [step.filtered]
        if self.lag:
            K, covariances = self._smoothed(sensors, step)
        self._cross[0] = step.following
        self._own = [step.following, *covariances[:-1]]
        now = self._shifted(K, step.L, innovation, driven)
        return KalmanStep(now[0], step.filtered, self._past[0], step.following, shown, now[-1], covariances[-1])

    def _variances(self, phase: int) -> Array:
        return np.asarray(np.einsum("qa,ab,qb->q", self._C, self._cross[0], self._C) + self._noise)

    def _settled(self, phase: int) -> Correction | None:
        """The correction of a period ago if the covariance has not changed since: in the steady state it never does."""
        P = self._cross[0]
        before, step = self._kept.get(phase, (None, None))
        if before is not None and P is not before:
            if np.abs(P - before).max() > SETTLED * np.abs(P).max():
                return None
            self._kept[phase] = P, step
        return step

    def _smoothed(self, sensors: Sensing, step: Correction) -> tuple[Array, list[Array]]:
        """Gains (lag + 1, n, q) and covariances of x^(k-i|k); what is carried along goes on to the next instant."""
        K, covariances = [step.K], [step.filtered]
        for cross, before in zip(self._cross[1:], self._own[1:], strict=True):
            gain = solve(step.innovation, sensors.C @ cross.T).T
            K.append(gain)
            covariances.append(before - gain @ step.innovation @ gain.T)
        closed = self._A - step.L @ sensors.C
        self._cross[1:] = [cross @ closed.T for cross in self._cross[:-1]]
        return np.stack(K), covariances
