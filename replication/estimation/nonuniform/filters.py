"""Filters of form (4), the error system (5) that they make with the plant, and its exact gain for given periods."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.linear.norms import GainBracket, l2_gain
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.linear.riccati import gramians
from replication.estimation.nonuniform.plant import SampledPlant
from replication.estimation.validation import Array, StateSpace, as_matrix


class Estimator(ABC):
    """What the gain of an error is found from, be the filter of form (4) or one that takes time stamps.

    The error follows steps [Phi, Gamma] `entry` of the plant, to which rows that do not depend on the period may be
    added; entry has the shape (n + m, N + m) for an error of N states.
    """

    @abstractmethod
    def error_output(self, plant: SampledPlant) -> Array:
        """The error e as rows of its states; raises InvalidInputError if filter and plant do not fit."""

    @abstractmethod
    def error_step(self, plant: SampledPlant, Phi: Array, Gamma: Array) -> tuple[Array, Array]:
        """State and input matrices of the error, for Phi (..., n, n) and Gamma (..., n, m)."""

    @abstractmethod
    def entry(self, plant: SampledPlant) -> Array:
        """What the transition of the plant is multiplied by from the right."""

    def steps_along(self, plant: SampledPlant, periods: Array, upper: Array) -> tuple[Array, Array]:
        """`error_step` for each of a sequence of periods, with the upper rows (K, n, n + m) of its transitions."""
        return self.error_step(plant, upper[..., : plant.order], upper[..., plant.order :])

    def at(self, h: float) -> Self:
        """The filter as it is at a constant period h."""
        return self

    @abstractmethod
    def errors(self, plant: SampledPlant, periods: Array, w: Array) -> Array:
        """e_0 ... e_K from rest for a sequence of periods, one after the other."""

    def require_settling(self, plant: SampledPlant) -> None:
        """Raise InvalidInputError if the filter does not fit the plant, InfeasibleError if it settles at no period."""
        self.error_output(plant)

    def in_coordinates(self, T: Array) -> Self:
        """The same for the plant with state T x: itself, unless it knows of that state."""
        return self

    def in_units(self, units: Array) -> Self:
        """The same with its own states divided by units: itself, unless it has some."""
        return self


@dataclass(frozen=True)
class Filter(Estimator):
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

    def __post_init__(self) -> None:
        A = as_matrix("A_f", self.A)
        A = as_matrix("A_f", A, rows=A.shape[0], columns=A.shape[0])
        B = as_matrix("B_f", self.B, rows=A.shape[0])
        C = as_matrix("C_f", self.C, columns=A.shape[0])
        for name, matrix in zip("ABC", (A, B, C), strict=True):
            if matrix.size == 0:
                raise InvalidInputError(f"{name}_f must not be empty, got shape {matrix.shape}")
            object.__setattr__(self, name, matrix)

    def to_statespace(self, dt: float | bool = True) -> StateSpace:
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

    def error_output(self, plant: SampledPlant) -> Array:
        """[L, -C_f] of eq. (5)."""
        if self.B.shape[1] != len(plant.C) or len(self.C) != len(plant.L):
            raise InvalidInputError(
                f"the filter maps {self.B.shape[1]} measurements to {len(self.C)} estimates, but the plant has "
                f"{len(plant.C)} and {len(plant.L)}; check B_f and C_f"
            )
        return np.hstack([plant.L, -self.C])

    def error_step(self, plant: SampledPlant, Phi: Array, Gamma: Array) -> tuple[Array, Array]:
        """The state and input matrices of the error system (5)."""
        n, nf, m = plant.order, len(self.A), plant.B.shape[1]
        state, drive = np.zeros((*Phi.shape[:-2], n + nf, n + nf)), np.zeros((*Phi.shape[:-2], n + nf, m))
        state[..., :n, :n], drive[..., :n, :] = Phi, Gamma
        state[..., n:, :n], drive[..., n:, :] = self.B @ plant.C, self.B @ plant.D
        state[..., n:, n:] = self.A
        return state, drive

    def entry(self, plant: SampledPlant) -> Array:
        """The plant goes on by itself: x and w enter, x^ does not."""
        n, nf, m = plant.order, len(self.A), plant.B.shape[1]
        return np.hstack([np.eye(n + m, n), np.zeros((n + m, nf)), np.eye(n + m, m, -n)])

    def errors(self, plant: SampledPlant, periods: Array, w: Array) -> Array:
        """Plant and filter side by side; periods (.., K) of several sequences, which see the same w, at once."""
        n, output = plant.order, self.error_output(plant)
        distinct, which = np.unique(periods, return_inverse=True)
        transitions = np.moveaxis(plant.transitions(distinct)[which.reshape(periods.shape)], -3, 0)
        drives, noises = transitions[..., :n, n:], plant.D @ w[:, :, None]
        states = np.zeros((len(transitions) + 1, *transitions.shape[1:-2], n + len(self.A), 1))
        for k, (step, drive, noise) in enumerate(zip(transitions[..., :n, :n], drives, noises, strict=True)):
            x, estimate = states[k, ..., :n, :], states[k, ..., n:, :]
            states[k + 1, ..., n:, :] = self.A @ estimate + self.B @ (plant.C @ x + noise)
            states[k + 1, ..., :n, :] = step @ x + drive @ w[k, :, None]
        return np.asarray(np.moveaxis((output @ states)[..., 0], 0, -2))

    def require_settling(self, plant: SampledPlant) -> None:
        """A_f must be Schur stable."""
        super().require_settling(plant)
        radius = self.spectral_radius()
        if radius >= 1:
            raise InfeasibleError(
                f"A_f has spectral radius {radius:.6g} >= 1: the error does not settle; its gain is infinite"
            )

    def in_units(self, units: Array) -> Self:
        """With states x^ / units."""
        return replace(self, A=self.A / units[:, None] * units, B=self.B / units[:, None], C=self.C * units)

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


def error_system(plant: SampledPlant, filter_: Estimator, h: float) -> Stage:
    """One stage of eq. (5) with period h, state [x; x^]; where durations count, e is scaled by sqrt(h), w by its
    inverse."""
    output = filter_.error_output(plant)
    state, drive = filter_.error_step(plant, *plant.discretise(h))
    root = np.sqrt(h) if plant.weighted else 1.0
    return Stage(state, drive / root, root * output, np.zeros((len(output), drive.shape[1])))


def gramian(A: Array, B: Array) -> Array:
    """W = A W A' + B B' (n, n) of a Schur stable A (n, n)."""
    reached = gramians([(A, B)])
    if reached is None:
        raise SolverError("the Gramian did not settle; a pole lies too near the unit circle")
    return np.asarray(reached[0])


def periodic_gain(plant: SampledPlant, filter_: Estimator, periods: Sequence[float]) -> GainBracket:
    """Exact l2 gain from w to e when the sampling periods repeat `periods` for ever; one period is the H-infinity norm.

    Raises InfeasibleError if the error system is unstable.
    """
    if len(periods) == 0:
        raise InvalidInputError("periods must not be empty: give the sampling periods that repeat, in seconds")
    stages = {h: error_system(plant, filter_, h) for h in set(periods)}
    return l2_gain(PeriodicSystem(tuple(stages[h] for h in periods)))


def gains_at(plant: SampledPlant, filters: Sequence[Estimator], periods: Sequence[float]) -> Array:
    """The gain of each filter at a constant period of its own."""
    pairs = zip(filters, periods, strict=True)
    return np.array([periodic_gain(plant, filter_.at(h), [h]).value for filter_, h in pairs])
