"""The stationary covariances of a periodic Kalman filter, of all phases at once; None where they need more care.

The states of all phases come from `linear.riccati`; one step by covariances, which shares no formula with it, corrects
and judges them.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replication.estimation.linear.riccati import RiccatiMap, from_zero, product, solve, symmetric
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array

REPEATS = 1e-11
"""Change over one step, in units of the standard deviations, up to which a solution is believed."""

DEPENDENT = 1e-6
"""Least eigenvalue of the correlations of the sensor noise, below which R is not worked with."""


class Sensing(NamedTuple):
    """Sensors of which some measure: C (..., q, n), covariance R (..., q, q) of their noise, S (..., n, q) with d.

    Of a sensor that does not measure the rows are zero and its noise is one, so that its gains come out as zero. S is
    None where plant and sensors have no common noise.
    """

    C: Array
    R: Array
    S: Array | None

    def at(self, index: Any) -> Sensing:
        """Those of some instants."""
        return Sensing(self.C[index], self.R[index], None if self.S is None else self.S[index])


class Correction(NamedTuple):
    """Gains and covariances (..., n, n) of one instant: x^(k|k) = x^ + K v, x^(k+1) = A x^ + L v, v = y - C x^."""

    K: Array
    L: Array
    innovation: Array
    filtered: Array
    following: Array


class SteadyState(NamedTuple):
    """Covariances P (N, n, n) of x - x^ before each instant, and gains L (N, n, q) of the filter that predicts."""

    P: Array
    L: Array


def sensing(problem: MultirateProblem, due: NDArray[np.bool_]) -> Sensing:
    """The sensors of the plant, of which those measure that are due (..., q); S = B_w D'."""
    plant = problem.plant
    used = due.astype(float)
    R = plant.D @ plant.D.T * used[..., :, None] * used[..., None, :] + _diagonal(1.0 - used)
    S = plant.B_w @ plant.D.T * used[..., None, :] if plant.correlated else None
    return Sensing(plant.C * used[..., None], R, S)


@cache
def _identity(size: int) -> Array:
    identity = np.eye(size)
    identity.flags.writeable = False
    return identity


def _diagonal(entries: Array) -> Array:
    return entries[..., None] * np.eye(entries.shape[-1])


def corrected(A: Array, Q: Array, sensors: Sensing, P: Array) -> Correction:
    """Measurement and time update of the covariance P (..., n, n); A (n, n), Q (n, n) of the whole process noise."""
    C, R, S = sensors
    times = product(P)
    CP = times(C, P)
    innovation = times(CP, C.mT) + R
    K = solve(innovation, CP).mT
    # Joseph's form: a sum of squares, so that rounding leaves it semidefinite.
    kept = _identity(len(A)) - times(K, C)
    filtered = times(times(kept, P), kept.mT) + times(times(K, R), K.mT)
    if S is None:
        return Correction(K, times(A, K), innovation, filtered, times(times(A, filtered), A.T) + Q)
    L = solve(innovation, CP @ A.T + S.mT).mT
    closed, cross = A - L @ C, L @ S.mT
    return Correction(K, L, innovation, filtered, closed @ P @ closed.mT + L @ R @ L.mT + Q - cross - cross.mT)


def steady_state(problem: MultirateProblem) -> SteadyState | None:
    """Covariances and gains for white noise of unit intensity, or None where the recursion from zero does not do."""
    plant, mask = problem.plant, problem.schedule.mask
    Q = plant.drive @ plant.drive.T
    found: dict[bytes, int] = {}
    which = [found.setdefault(due.tobytes(), len(found)) for due in mask]
    first = [which.index(kind) for kind in range(len(found))]
    different = sensing(problem, mask[first])
    if _nearly_dependent(different.R):
        return None
    P = from_zero(RiccatiMap(*(part[which] for part in _maps(plant.A, Q, different))))
    if P is None:
        return None
    step = corrected(plant.A, Q, different.at(which), P)
    following = symmetric(np.roll(step.following, 1, axis=0))
    deviation = np.sqrt(np.maximum(np.diagonal(following, axis1=1, axis2=2), 0.0))
    if np.any(np.abs(following - P) > REPEATS * deviation[:, :, None] * deviation[:, None, :]):
        return None
    return SteadyState(following, step.L)


def _nearly_dependent(R: Array) -> bool:
    """Whether noises of several sensors nearly determine each other, so that R has lost digits that D still has."""
    units = np.sqrt(np.diagonal(R, axis1=-2, axis2=-1))
    correlation = R / units[..., :, None] / units[..., None, :]
    if np.count_nonzero(correlation) == correlation.shape[0] * correlation.shape[1]:
        return False
    return bool(np.linalg.eigvalsh(correlation).min() < DEPENDENT)


def _maps(A: Array, Q: Array, sensors: Sensing) -> RiccatiMap:
    """P -> following P, in stacks; what the measurements tell of correlated noise is taken out of the plant."""
    C, R, S = sensors
    seen = np.linalg.solve(R, C)
    if S is None:
        shape = (len(C), *A.shape)
        return RiccatiMap(np.broadcast_to(A, shape), C.mT @ seen, np.broadcast_to(Q, shape))
    told = np.linalg.solve(R, S.mT)
    return RiccatiMap(A - S @ seen, C.mT @ seen, Q - S @ told)
