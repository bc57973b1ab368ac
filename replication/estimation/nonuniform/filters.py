"""Filters of form (4), the error system (5) that they make with the plant, and its exact gain for given periods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import scipy.linalg

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.linear.norms import GainBracket, l2_gain
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.nonuniform.plant import SampledPlant
from replication.estimation.validation import Array, as_matrix

if TYPE_CHECKING:
    import control

DOUBLINGS = 50


@dataclass(frozen=True)
class Filter:
    """Eq. (4): x^(k+1) = A x^(k) + B y(k), z^(k) = C x^(k).

    Parameters
    ----------
    A : array (nf, nf)
        State transition from sample to sample, whatever the period.
    B : array (nf, r)
        Effect of the measurements.
    C : array (s, nf)
        The estimate.

    Raises
    ------
    InvalidInputError
        The shapes do not fit or an entry is not finite.
    """

    A: Array
    B: Array
    C: Array

    if TYPE_CHECKING:
        # Type checkers see that lists do; the fields themselves are arrays.
        def __init__(self, A: npt.ArrayLike, B: npt.ArrayLike, C: npt.ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        """Check and freeze the matrices."""
        A = as_matrix("A_f", self.A)
        A = as_matrix("A_f", A, rows=A.shape[0], columns=A.shape[0])
        B = as_matrix("B_f", self.B, rows=A.shape[0])
        C = as_matrix("C_f", self.C, columns=A.shape[0])
        for name, matrix in zip("ABC", (A, B, C), strict=True):
            if matrix.size == 0:
                raise InvalidInputError(f"{name}_f must not be empty, got shape {matrix.shape}")
            object.__setattr__(self, name, matrix)

    def to_statespace(self, dt: float | bool = True) -> control.StateSpace:
        """The filter from y to z^.

        Parameters
        ----------
        dt : float or True
            Sampling period, s; True means an unspecified one.

        Returns
        -------
        control.StateSpace
            Discrete-time and strictly proper.
        """
        import control

        return control.StateSpace(self.A, self.B, self.C, np.zeros((len(self.C), self.B.shape[1])), dt)

    def spectral_radius(self) -> float:
        """Stable for every sampling sequence iff it is below one.

        Returns
        -------
        float
            Largest modulus of the eigenvalues of A_f.
        """
        return float(np.max(np.abs(np.linalg.eigvals(self.A))))


def observer(plant: SampledPlant, h: float, K: Array) -> Filter:
    """The filter x^(k+1) = Phi(h) x^(k) + K (y(k) - C x^(k)), z^ = L x^; K (n, r)."""
    Phi, _ = plant.discretise(h)
    gain = as_matrix("K", K, rows=plant.order, columns=len(plant.C))
    return Filter(Phi - gain @ plant.C, gain, plant.L)


def kalman_filter(plant: SampledPlant, h: float) -> Filter | None:
    """The stationary Kalman predictor at a constant period, for white w of unit intensity.

    None where the sensors' noise D D' is singular or a mode is not disturbed, and no such filter need exist.
    """
    Phi, Gamma = plant.discretise(h)
    noise, crossed = plant.D @ plant.D.T, Gamma @ plant.D.T
    if np.linalg.matrix_rank(noise) < len(noise):
        return None
    try:
        P = scipy.linalg.solve_discrete_are(Phi.T, plant.C.T, Gamma @ Gamma.T, noise, s=crossed)
    except np.linalg.LinAlgError:
        return None
    K = np.linalg.solve(plant.C @ P @ plant.C.T + noise, (Phi @ P @ plant.C.T + crossed).T).T
    return observer(plant, h, K)


def error_output(plant: SampledPlant, filter_: Filter) -> Array:
    """[L, -C_f] of eq. (5), of shape (s, n + nf); raises InvalidInputError if filter and plant do not fit."""
    if filter_.B.shape[1] != len(plant.C) or len(filter_.C) != len(plant.L):
        raise InvalidInputError(
            f"the filter maps {filter_.B.shape[1]} measurements to {len(filter_.C)} estimates, but the plant has "
            f"{len(plant.C)} and {len(plant.L)}; check B_f and C_f"
        )
    return np.hstack([plant.L, -filter_.C])


def require_settling(plant: SampledPlant, filter_: Filter) -> None:
    """Raise InvalidInputError if the filter does not fit the plant, InfeasibleError if A_f is not Schur stable."""
    error_output(plant, filter_)
    radius = filter_.spectral_radius()
    if radius >= 1:
        raise InfeasibleError(
            f"A_f has spectral radius {radius:.6g} >= 1: the error does not settle; its gain is infinite"
        )


def error_step(plant: SampledPlant, filter_: Filter, Phi: Array, Gamma: Array) -> tuple[Array, Array]:
    """The state and input matrices of the error system (5) for given Phi (..., n, n) and Gamma (..., n, m)."""
    n, nf, m = plant.order, len(filter_.A), plant.B.shape[1]
    state, drive = np.zeros((*Phi.shape[:-2], n + nf, n + nf)), np.zeros((*Phi.shape[:-2], n + nf, m))
    state[..., :n, :n], drive[..., :n, :] = Phi, Gamma
    state[..., n:, :n], drive[..., n:, :] = filter_.B @ plant.C, filter_.B @ plant.D
    state[..., n:, n:] = filter_.A
    return state, drive


def error_system(plant: SampledPlant, filter_: Filter, h: float, *, per_duration: bool = False) -> Stage:
    """One stage of eq. (5) with period h, state [x; x^]; per_duration scales e by sqrt(h) and w by 1/sqrt(h)."""
    output = error_output(plant, filter_)
    state, drive = error_step(plant, filter_, *plant.discretise(h))
    root = np.sqrt(h) if per_duration else 1.0
    return Stage(state, drive / root, root * output, np.zeros((len(output), drive.shape[1])))


def gramian(A: Array, B: Array) -> Array:
    """W = A W A' + B B' (n, n) of a Schur stable A (n, n), by doubling the horizon: units do not matter."""
    W = B @ B.T
    for _ in range(DOUBLINGS):
        added = A @ W @ A.T
        W, A = W + added, A @ A
        if np.all(np.abs(added) <= np.finfo(float).eps * np.sqrt(np.outer(np.diag(W), np.diag(W)))):
            return np.asarray((W + W.T) / 2)
    raise SolverError(f"the Gramian did not settle in {DOUBLINGS} doublings; a pole lies too near the unit circle")


def periodic_gain(
    plant: SampledPlant, filter_: Filter, periods: Sequence[float], *, per_duration: bool = False
) -> GainBracket:
    """Exact l2 gain from w to e when the sampling periods repeat `periods` for ever; one period is the H-infinity norm.

    per_duration weighs both squared norms by the length of each sampling interval. Raises InfeasibleError if the error
    system is unstable.
    """
    if len(periods) == 0:
        raise InvalidInputError("periods must not be empty: give the sampling periods that repeat, in seconds")
    stages = {h: error_system(plant, filter_, h, per_duration=per_duration) for h in set(periods)}
    return l2_gain(PeriodicSystem(tuple(stages[h] for h in periods)))
