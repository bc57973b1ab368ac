"""Gains and covariances of a periodic Kalman filter that looks back a fixed lag: x^(k+1|k), x^(k|k), x^(k-l|k)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.estimation.linear.riccati import RiccatiMap, settled, solve
from replication.estimation.multirate.kalman import Correction, Sensing, corrected, sensing
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array


@dataclass(frozen=True, eq=False)
class FilterGains:
    """The filter for white noise of unit intensity, with one entry for each of N phases.

    Attributes
    ----------
    L : array (N, n, q)
        x^(k+1|k) = A x^(k|k-1) + B_u u(k) + L v(k), with the innovation v = y - C x^(k|k-1).
    K : array (N, lag + 1, n, q)
        x^(k-i|k) = x^(k-i|k-1) + K_i v(k).
    predicted, filtered, smoothed : array (N, n, n)
        Covariances of the error of x^(k|k-1), of x^(k|k) and of x^(k-lag|k).
    innovation : array (N, q, q)
        Covariance of v(k); zero for sensors that do not measure.
    """

    L: Array
    K: Array
    predicted: Array
    filtered: Array
    smoothed: Array
    innovation: Array

    @property
    def lag(self) -> int:
        """How many instants it looks back."""
        return int(self.K.shape[1]) - 1


def filter_gains(problem: MultirateProblem, predicted: Array, lag: int = 0) -> FilterGains:
    """The filter at the stationary covariances `predicted` (N, n, n) of `kalman_design`, and its smoother."""
    mask = problem.schedule.mask
    sensors, step = _step(problem, predicted)
    closed = problem.plant.A - step.L @ sensors.C
    gains: list[Array] = [step.K]
    smoothed, cross = step.filtered, predicted
    for _ in range(lag):
        # Covariance of the error of x^(k-i|k-1) with that of x^(k|k-1); the innovation v(k) tells of both.
        cross = np.roll(cross @ closed.mT, 1, axis=0)
        K = solve(step.innovation, sensors.C @ cross.mT).mT
        smoothed = np.roll(smoothed, 1, axis=0) - K @ step.innovation @ K.mT
        gains.append(K)
    due = mask[:, :, None] & mask[:, None, :]
    parts = step.L, np.stack(gains, axis=1), predicted, step.filtered, smoothed, step.innovation * due
    return FilterGains(*(read_only(part) for part in parts))


def read_only(array: Array) -> Array:
    """The same numbers, which nobody who is handed them can change."""
    array = array.view()
    array.flags.writeable = False
    return array


def smoothing_limit(problem: MultirateProblem, predicted: Array) -> Array:
    """Covariances (N, n, n) of the error of x^ given all measurements, past and future; no lag does better."""
    sensors, step = _step(problem, predicted)
    closed = problem.plant.A - step.L @ sensors.C
    told = sensors.C.mT @ np.linalg.solve(step.innovation, sensors.C)
    # What later innovations tell, backwards in time: Z(k) = told(k) + closed(k)' Z(k+1) closed(k).
    after = settled(RiccatiMap(closed[::-1].mT, np.zeros_like(closed), told[::-1]))  # Z(N), Z(N-1), ... Z(1)
    if after is None:
        return predicted
    later = np.roll(after[::-1], 1, axis=0)  # Z(0) = Z(N), Z(1), ...
    return np.asarray(predicted - predicted @ later @ predicted)


def _step(problem: MultirateProblem, predicted: Array) -> tuple[Sensing, Correction]:
    sensors, plant = sensing(problem, problem.schedule.mask), problem.plant
    return sensors, corrected(plant.A, plant.drive @ plant.drive.T, sensors, predicted)
