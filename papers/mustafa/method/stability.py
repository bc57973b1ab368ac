"""Robust stability of the error system (5): by the small-gain condition (8) around a period h_0, and exactly.

By Lemma 2, Theorem 1 and eq. (9): alpha = ||A Phi(h_0) (zI - Phi(h_0))^-1||_inf does not depend on the filter, because
Sigma_11 sees the plant's states only.

Exactly: A-bar(h) is block triangular with Phi(h) = e^{hA} and the constant A_f. The Phi commute, so a product of them
is e^{A tau} with tau the elapsed time; it tends to zero for every sequence iff A is Hurwitz. Hence (5) is (uniformly,
exponentially) stable for all h_k in [h_l, h_u] iff A is Hurwitz and A_f has its eigenvalues inside the unit circle.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from replication.estimation.linear.norms import hinf_norm
from replication.estimation.nonuniform.filters import Filter
from replication.estimation.nonuniform.plant import SampledPlant
from replication.estimation.validation import Array

MU_ZERO = 1e-14
"""Logarithmic norms smaller than this times the norm of A count as zero: cases L1 and U1 of (9)."""


class UpperEnd(StrEnum):
    """Which logarithmic norm stands in the logarithm of case U3 of (9)."""

    PRINTED = "mu(-A), as printed"
    CORRECTED = "mu(A), as the proof needs"


@dataclass(frozen=True)
class Interval:
    """The open interval (lower, upper) of sampling periods in seconds; upper may be infinite."""

    lower: float
    upper: float

    def covers(self, h_l: float, h_u: float) -> bool:
        """Whether the closed interval [h_l, h_u] lies inside."""
        return self.lower < h_l and h_u < self.upper


def logarithmic_norm(A: Array) -> float:
    """mu(A) = largest eigenvalue of (A + A') / 2, the logarithmic norm of Lemma 3."""
    return float(np.linalg.eigvalsh((A + A.T) / 2)[-1])


def small_gain_alpha(plant: SampledPlant, h: float) -> float:
    """alpha(h) = ||Sigma_11||_inf, the peak gain of A Phi(h) (zI - Phi(h))^-1."""
    Phi, _ = plant.discretise(h)
    n = plant.order
    return hinf_norm(Phi, np.eye(n), plant.A @ Phi, np.zeros((n, n))).value


def delta_block(plant: SampledPlant, theta: float) -> Array:
    """Delta(theta) = int_0^theta e^{tA} dt of Lemma 2, for theta of either sign; equals A^-1 (e^{theta A} - I)."""
    from scipy.linalg import expm  # slow to load

    n = plant.order
    generator = np.block([[plant.A, np.eye(n)], [np.zeros((n, 2 * n))]])
    return np.asarray(expm(theta * generator)[:n, n:])


def covered_interval(plant: SampledPlant, h: float, gain: float, upper: UpperEnd = UpperEnd.CORRECTED) -> Interval:
    """H(h, gain) of eq. (9), cases L1-L3 and U1-U3, intersected with the positive periods; `gain` is alpha or its
    root."""
    below, above = logarithmic_norm(-plant.A), logarithmic_norm(plant.A)
    zero = MU_ZERO * float(np.linalg.norm(plant.A, 2))
    lower = h - _reach(below, below, gain, zero)
    printed = below if upper is UpperEnd.PRINTED else above
    return Interval(max(0.0, lower), h + _reach(above, printed, gain, zero))


def _reach(mu: float, in_logarithm: float, gain: float, zero: float) -> float:
    """log(1 + mu / gain) / mu, its limit 1 / gain at mu = 0, infinite for mu <= -gain; `in_logarithm` allows a
    misprint."""
    if abs(mu) <= zero:
        return 1 / gain
    if mu <= -gain:
        return float("inf")
    # The misprinted U3 may have an argument that is not positive; it then covers nothing.
    argument = 1 + in_logarithm / gain
    return float(np.log(argument) / mu) if argument > 0 else float("-inf")


@dataclass(frozen=True)
class StabilityTest:
    """plant_abscissa: largest real part of the eigenvalues of A (1/s); filter_radius: spectral radius of A_f."""

    plant_abscissa: float
    filter_radius: float

    @property
    def stable(self) -> bool:
        """Whether the error settles for every sampling sequence."""
        return self.plant_abscissa < 0 and self.filter_radius < 1


def stability(plant: SampledPlant, filter_: Filter) -> StabilityTest:
    """The two numbers that decide it; raises InvalidInputError if the filter does not fit the plant."""
    filter_.error_output(plant)
    return StabilityTest(float(np.max(np.linalg.eigvals(plant.A).real)), filter_.spectral_radius())
