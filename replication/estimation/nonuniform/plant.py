"""The sampled plant of eqs. (1)-(3): a continuous-time system, its range of sampling periods, its exact
discretisation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.api.plants import LinearPlant, Signals, parts_of
from replication.estimation.linear.periodic import balanced_units
from replication.estimation.validation import Array, StateSpace, as_array, as_matrix, positive_integer, positive_scalar

HURWITZ_MARGIN = 1e-12
"""An eigenvalue counts as stable if its real part is below minus this times the norm of A."""
LARGEST = 1e60
"""Largest entry of a matrix, and inverse of the least that its largest may be."""
OBSERVABILITY_TOLERANCE = 1e-9
"""Smallest singular value of the Popov-Belevitch-Hautus matrix, relative to the norm of A, that counts as
observable."""


@dataclass(frozen=True)
class PeriodRange:
    """The sampling periods [h_l, h_u] of eq. (2).

    Parameters
    ----------
    h_l : float
        Shortest sampling period, s.
    h_u : float
        Longest sampling period, s.

    Raises
    ------
    InvalidInputError
        Unless 0 < h_l <= h_u < inf.
    """

    h_l: float
    h_u: float

    def __post_init__(self) -> None:
        for name in ("h_l", "h_u"):
            object.__setattr__(self, name, positive_scalar(name, getattr(self, name), unit="s"))
        if self.h_l > self.h_u:
            raise InvalidInputError(f"h_l must not exceed h_u, got h_l = {self.h_l} > h_u = {self.h_u}; swap them")

    @property
    def middle(self) -> float:
        """(h_l + h_u) / 2, where Algorithm 1 starts."""
        return (self.h_l + self.h_u) / 2

    def nodes(self, count: int) -> Array:
        """Equally spaced sampling periods.

        Parameters
        ----------
        count : int
            How many, at least one.

        Returns
        -------
        array (count,)
            From h_l to h_u, s.
        """
        return np.linspace(self.h_l, self.h_u, positive_integer("the number of periods", count))


@dataclass(frozen=True)
class SampledPlant(LinearPlant):
    """Eq. (1): x' = Ax + Bw, y = Cx + Dw measured when sampled, z = Lx to be estimated; w is held between samples.

    Parameters
    ----------
    A : array (n, n)
        Hurwitz, in 1/s; otherwise no filter of form (4) has a bounded error.
    B : array (n, m)
        Effect of the disturbance w.
    C : array (r, n)
        Sensors.
    D : array (r, m)
        Effect of w on the sensors, their noise.
    L : array (s, n)
        What is estimated.

    Raises
    ------
    InvalidInputError
        A shape does not fit, an entry is not finite, a matrix is larger than LARGEST or smaller than its inverse, B or
        L is zero, A is not Hurwitz or (C, A) is not observable.
    """

    SHAPES: ClassVar[Mapping[str, str]] = {"A": "nn", "B": "nm", "C": "rn", "D": "rm", "L": "sn"}

    A: Array
    B: Array
    C: Array
    D: Array
    L: Array
    settles: ClassVar[bool] = True
    """Whether A must be Hurwitz."""
    weighted: ClassVar[bool] = False
    """Whether both squared norms are weighted by the lengths of the intervals."""

    def __post_init__(self) -> None:
        self.check()
        for name in self.SHAPES:
            matrix = getattr(self, name)
            if matrix.size == 0:
                raise InvalidInputError(f"{name} must not be empty, got shape {matrix.shape}")
            largest = float(np.max(np.abs(matrix)))
            if largest > LARGEST or 0 < largest < 1 / LARGEST:
                raise InvalidInputError(
                    f"{name} has {largest:.3g} for its largest entry, whose powers leave the range of floating point; "
                    "choose other units"
                )
        for name, meaning in (("B", "nothing disturbs the state"), ("L", "there is nothing to estimate")):
            if not np.any(getattr(self, name)):
                raise InvalidInputError(f"{name} must not be zero: {meaning}; check the entries")
        units = np.diag(balancing(self))  # the plant's own may hide a state from the sensors
        A, C = self.A * units[:, None] / units, self.C / units
        scale = float(np.linalg.norm(A, 2))
        eigenvalues = np.linalg.eigvals(A)
        worst = max(eigenvalues, key=lambda value: value.real)
        if self.settles and worst.real >= -HURWITZ_MARGIN * scale:
            raise InvalidInputError(
                f"A must be Hurwitz, but has the eigenvalue {worst:.6g}; a filter of form (4) cannot follow such a "
                "plant, one that takes the time stamps of the samples can (`design_stamped` with a `StampedPlant`)"
            )
        scale, size = scale or 1.0, float(np.linalg.norm(C, 2))
        sensor = C * (scale / size) if size > 0 else C
        for eigenvalue in eigenvalues:
            # The test of Popov, Belevitch and Hautus.
            pencil = np.vstack([A - eigenvalue * np.eye(len(A)), sensor])
            if np.linalg.svd(pencil, compute_uv=False)[-1] <= OBSERVABILITY_TOLERANCE * scale:
                raise InvalidInputError(
                    f"(C, A) is not observable: C does not see the mode {eigenvalue:.6g}; remove it or add a sensor"
                )

    @property
    def signals(self) -> Signals:
        """x[0], y[0], z[0] and so on."""
        return Signals.numbered(self.order, 0, len(self.C), len(self.L))

    @classmethod
    def from_statespace(cls, system: StateSpace, measured: int | Sequence[int | str]) -> Self:
        """From a continuous-time `control.StateSpace` with inputs w, first outputs y and the others z.

        Parameters
        ----------
        system : control.StateSpace
            Continuous-time, without feedthrough from w to z.
        measured : int, or sequence of int or str
            How many of the first outputs are y, or which ones, by index or name.

        Returns
        -------
        SampledPlant
            The same matrices, the outputs split.

        Raises
        ------
        InvalidInputError
            The system is not continuous-time, has no z, or z has direct feedthrough from w.
        """
        parts = parts_of(system, continuous=True, measured=measured)
        return cls(parts.A, parts.B_d, parts.C, parts.D_d, parts.W)

    def transitions(self, periods: Array) -> Array:
        """exp(h [[A, B], [0, 0]]), whose upper rows are [Phi(h), Gamma(h)], at each of several sampling periods.

        Parameters
        ----------
        periods : array (K,)
            Sampling periods, s.

        Returns
        -------
        array (K, n + m, n + m)
            State and held disturbance over one interval.
        """
        distinct, which = np.unique(periods, return_inverse=True)  # sequences repeat themselves
        return np.asarray(scipy.linalg.expm(distinct[:, None, None] * self.generator())[which])

    def generator(self) -> Array:
        """The plant with w held constant, as an autonomous system.

        Returns
        -------
        array (n + m, n + m)
            [[A, B], [0, 0]], in 1/s.
        """
        n, m = self.B.shape
        return np.block([[self.A, self.B], [np.zeros((m, n + m))]])

    def discretise(self, h: float) -> tuple[Array, Array]:
        """The plant between two samples, eq. (3), for w held over h.

        Parameters
        ----------
        h : float
            Sampling period, s.

        Returns
        -------
        (array (n, n), array (n, m))
            Phi(h) = e^{hA} and Gamma(h) = int_0^h e^{tA} dt B.
        """
        period = positive_scalar("h", h, unit="s")
        n, (whole,) = self.order, self.transitions(np.array([period]))
        return whole[:n, :n], whole[:n, n:]

    def in_coordinates(self, T: Array) -> Self:
        """The same plant with state T x.

        Parameters
        ----------
        T : array (n, n)
            Invertible.

        Returns
        -------
        SampledPlant
            Its w, y and z are the same.

        Raises
        ------
        InvalidInputError
            T is singular or of another shape.
        """
        T = as_matrix("T", T, rows=self.order, columns=self.order)
        if np.linalg.matrix_rank(T) < self.order:
            raise InvalidInputError(f"T must be invertible, but has rank {np.linalg.matrix_rank(T)} < {self.order}")
        inverse = np.linalg.inv(T)
        return type(self)(T @ self.A @ inverse, T @ self.B, self.C @ inverse, self.D, self.L @ inverse)


class DurationPlant(SampledPlant):
    """A `SampledPlant` whose gains are those of norms over time: an interval counts by its length."""

    weighted = True


def weights_of(plant: SampledPlant, periods: Array) -> Array:
    """w(h) of the squared norms at each of the sampling periods."""
    return periods if plant.weighted else np.ones_like(periods)


def balancing(plant: SampledPlant) -> Array:
    """Units of the states (powers of two, which change no digit) in which A, B, C, L are balanced and |B| is |A|."""
    A, B = plant.A, plant.B
    units = balanced_units(A, B, np.vstack([plant.C, plant.L]))
    rate = np.linalg.norm(A / units[:, None] * units)
    ratio = np.linalg.norm(B / units[:, None]) / rate if rate > 0 else 1.0
    return np.diag(1 / (units * np.exp2(np.round(np.log2(ratio)))))


def as_periods(name: str, value: Any) -> Array:
    """A sequence of sampling periods (K,) in seconds; raises InvalidInputError unless K >= 1 and all are positive."""
    count = np.size(value)
    periods = as_array(name, value, (count,), axes="(K,)")
    if count == 0 or np.any(periods <= 0):
        raise InvalidInputError(f"{name} must be one or more positive numbers (s), got {value!r}")
    return periods
