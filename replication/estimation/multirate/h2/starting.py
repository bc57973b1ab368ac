"""A Kalman filter that begins with the covariance of its start, and follows it as measurements come or do not come."""

from __future__ import annotations

from typing import Any

import numpy as np

from replication.estimation.api.running import Mask
from replication.estimation.linear.covariances import covariance
from replication.estimation.linear.riccati import solve
from replication.estimation.multirate.h2.running import KalmanStep, RunningKalman
from replication.estimation.multirate.kalman import Correction, Sensing, corrected, sensing
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array

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

    def _begin(self) -> None:
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
        K, own = step.K, [step.filtered]
        if self.lag:
            K, own = self._smoothed(sensors, step)
        self._cross[0] = step.following
        self._own = [step.following, *own[:-1]]
        now = self._shifted(K, step.L, innovation, driven)
        return KalmanStep(now[0], step.filtered, self._past[0], step.following, shown, now[-1], own[-1])

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
        K, own = [step.K], [step.filtered]
        for cross, before in zip(self._cross[1:], self._own[1:], strict=True):
            gain = solve(step.innovation, sensors.C @ cross.T).T
            K.append(gain)
            own.append(before - gain @ step.innovation @ gain.T)
        closed = self._A - step.L @ sensors.C
        self._cross[1:] = [cross @ closed.T for cross in self._cross[:-1]]
        return np.stack(K), own
