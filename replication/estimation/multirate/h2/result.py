"""The periodic Kalman filter as a result: gains, covariances, running forms, and what its mean error is worth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from replication.estimation.api.design import Solution
from replication.estimation.multirate.h2.filtering import filter_gains
from replication.estimation.multirate.h2.running import KalmanFilter
from replication.estimation.multirate.h2.starting import StartingFilter
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.multirate.result import MultirateResult, mean_error_facts
from replication.estimation.validation import Array, at_most, positive_integer

LONGEST_LAG = 1000
AXES = {
    "L": "(phase, state, sensor)",
    "K": "(phase, state, sensor)",
    "P": "(phase, state, state)",
    "F": "(phase, state, state)",
    "V": "(phase, sensor, sensor)",
}


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class KalmanResult(MultirateResult):
    """A periodic Kalman filter.

    Its gains are L of the prediction x^(k+1|k) = A x^(k|k-1) + B_u u + L v with the innovation v, and K of the filtered
    estimate x^(k|k) = x^(k|k-1) + K v; P and F are the covariances of the errors of both, x^(k|k-1) and x^(k|k), and V
    is that of v (zero for sensors that do not measure).

    Attributes
    ----------
    start : array (n, n) or None
        Covariance P0 of the error of the start, if it was given.
    """

    axes: Mapping[str, str] = field(default_factory=AXES.copy)
    start: Array | None = None

    @classmethod
    def solve(cls, problem: MultirateProblem, *given: Any, **aims: Any) -> Solution:
        """The steady state of the filter, with its covariances."""
        kalman = kalman_design(problem)
        gains = filter_gains(problem, kalman.X)
        arrays = {
            "L": kalman.gains,
            "K": gains.K[:, 0],
            "P": gains.predicted,
            "F": gains.filtered,
            "V": gains.innovation,
        }
        return Solution(arrays, mean_error_facts(problem, kalman.gains))

    def filter(self, *, lag: int = 0, P0: Any = None, gate: float | None = None) -> KalmanFilter | StartingFilter:
        """The filter to run in a loop; its `step` gives x^(k|k), x^(k+1|k), their covariances and the innovation.

        Parameters
        ----------
        lag : int
            It also looks back: x^(k-lag|k).
        P0 : array (n, n), optional
            Covariance of the error of the start; that of the design unless given.
        gate : float, optional
            Beyond which a measurement is left out, and counted by `gated`: below 1 the probability with which a good
            one passes, from 1 on standard deviations of its innovation.

        Returns
        -------
        KalmanFilter or StartingFilter
            With the gains of the steady state, or with those that begin at P0.

        Raises
        ------
        InvalidInputError
            P0 is no covariance, the lag is no whole number from 0 to 1000, or the gate neither of the two.
        """
        count = (
            0 if isinstance(lag, int) and not isinstance(lag, bool) and lag == 0 else at_most("lag", lag, LONGEST_LAG)
        )
        start = self.start if P0 is None else P0
        if start is not None:
            return StartingFilter(self.problem, start, count, gate).named(self.signals)
        gains = filter_gains(self.problem, self.gains["P"], count)
        return KalmanFilter(self.problem, gains, gate).named(self.signals)

    def covariances(self, steps: int, *, P0: Any = None) -> tuple[Array, Array]:
        """Covariances of the errors over time, from the start on.

        Parameters
        ----------
        steps : int
            Number of instants.
        P0 : array (n, n), optional
            Covariance of the error of the start; that of the design, or the steady state, unless given.

        Returns
        -------
        predicted, filtered : array (steps, n, n)
            Of x^(k|k-1) and x^(k|k), k = 0, 1, ...

        Raises
        ------
        InvalidInputError
            P0 is no covariance, or `steps` no whole positive number.
        """
        count = positive_integer("steps", steps)
        start = self.start if P0 is None else P0
        run = StartingFilter(self.problem, self.gains["P"][0] if start is None else start)
        known, mask = np.zeros(self.problem.plant.B_u.shape[1]), self.problem.schedule.mask
        done = [run.step(known, np.where(mask[k % len(mask)], 0.0, np.nan)) for k in range(count)]
        predicted = [run.start, *(step.predicted_covariance for step in done[:-1])]
        return np.stack(predicted), np.stack([step.covariance for step in done])
