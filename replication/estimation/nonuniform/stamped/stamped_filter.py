"""The filter that knows the time stamps: one gain for the sample, then the plant's own dynamics over the known period.

x^(k|k) = x^(k) + G_x v, w^(k) = G_w v with v = y(k) - C x^(k); x^(k+1) = Phi(h_k) x^(k|k) + Gamma(h_k) w^(k). This is
K = [Phi(h), Gamma(h)] G, a gain that depends on the coming period as the plant itself does. G depends on the period
before the sample, for the longer the filter had to predict, the more a sample tells: it is constant on each cell of the
range. The error follows e+ = [Phi(h), Gamma(h)] (I - G [C, D]) [e; w]: linear in the transition, so that what proves
levels for the robust filter proves them for this one. It does not depend on x: the plant may be unstable.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.nonuniform.filters import Estimator
from replication.estimation.nonuniform.plant import SampledPlant
from replication.estimation.validation import Array

DEPENDENT = 1e-12
"""Eigenvalue of the correlation of the innovations that counts as zero."""


class StampedPlant(SampledPlant):
    """A `SampledPlant` for a filter that knows the periods: A need not be Hurwitz, the plant may integrate or be
    unstable.

    Raises
    ------
    InvalidInputError
        As `SampledPlant`, but for the eigenvalues of A.
    """

    settles = False


@dataclass(frozen=True, eq=False)
class StampedFilter(Estimator):
    """G (cells, n + m, r): what each innovation adds to the estimates of state and held disturbance, by the cell in
    which the period before the sample lies; edges (cells - 1,): where the cells meet, s."""

    G: Array
    edges: tuple[float, ...] = ()

    def gain(self, h: float | None) -> Array:
        """G (n + m, r) after the period h; at the first sample, which has none before it, that of the longest."""
        return np.asarray(self.G[-1 if h is None else np.searchsorted(self.edges, h, side="right")])

    def at(self, h: float) -> StampedFilter:
        """One cell."""
        return StampedFilter(self.gain(h)[None])

    def error_output(self, plant: SampledPlant) -> Array:
        """L."""
        wanted = (len(self.edges) + 1, plant.order + plant.B.shape[1], len(plant.C))
        if self.G.shape != wanted:
            raise InvalidInputError(f"G must have shape (cells, n + m, r) = {wanted}, got shape {self.G.shape}")
        return plant.L

    def error_step(self, plant: SampledPlant, Phi: Array, Gamma: Array) -> tuple[Array, Array]:
        """The state and input matrices of the error of a filter of one cell."""
        step = np.concatenate([Phi, Gamma], axis=-1) @ self.entry(plant)
        return step[..., : plant.order], step[..., plant.order :]

    def entry(self, plant: SampledPlant) -> Array:
        """I - G [C, D] of a filter of one cell."""
        (G,) = self.G
        return np.asarray(np.eye(len(G)) - G @ np.hstack([plant.C, plant.D]))

    def steps_along(self, plant: SampledPlant, periods: Array, upper: Array) -> tuple[Array, Array]:
        """With the gain after the period before."""
        gains = np.array([self.gain(h) for h in (None, *periods[:-1])])
        steps = upper @ (np.eye(upper.shape[-1]) - gains @ np.hstack([plant.C, plant.D]))
        return steps[..., : plant.order], steps[..., plant.order :]

    def errors(self, plant: SampledPlant, periods: Array, w: Array) -> Array:
        """L e, where e = x - x^ is followed by itself: x may grow without bound."""
        steps, drives = self.steps_along(plant, periods, plant.transitions(periods)[:, : plant.order])
        error = np.zeros(plant.order)
        found = [plant.L @ error]
        for step, drive, disturbance in zip(steps, drives, w, strict=True):
            error = step @ error + drive @ disturbance
            found.append(plant.L @ error)
        return np.array(found)

    def require_settling(self, plant: SampledPlant) -> None:
        """The gain must fit; whether the error settles depends on the periods."""
        self.error_output(plant)

    def in_coordinates(self, T: Array) -> Self:
        """The same for the plant with state T x."""
        n = len(T)
        return type(self)(np.concatenate([T @ self.G[:, :n], self.G[:, n:]], axis=1), self.edges)

    def in_units(self, units: Array) -> Self:
        """Itself: its state is the estimate of the plant's."""
        return self


def kalman_filter(plant: SampledPlant, h: float) -> StampedFilter | None:
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
    return innovations_filter(plant, P)


def innovations_filter(plant: SampledPlant, P: Array) -> StampedFilter:
    """G = [P C'; D'] (C P C' + D D')^-1, for errors of covariance P (n, n) and white w of unit intensity."""
    spread = np.vstack([P @ plant.C.T, plant.D.T])
    innovation = plant.C @ P @ plant.C.T + plant.D @ plant.D.T
    size = np.sqrt(np.diag(innovation))
    # Sensors that repeat each other without noise share what they tell.
    inverse = np.linalg.pinv(innovation / np.outer(size, size), rcond=DEPENDENT, hermitian=True) / np.outer(size, size)
    return StampedFilter((spread @ inverse)[None])
