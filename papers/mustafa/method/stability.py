"""Exact stability of the error system (5) for every sampling sequence: no grid, no small gain.

A-bar(h) is block triangular with Phi(h) = e^{hA} and the constant A_f. The Phi commute, so a product of them is e^{A
tau}
with tau the elapsed time; it tends to zero for every sequence iff A is Hurwitz. Hence (5) is (uniformly, exponentially)
stable for all h_k in [h_l, h_u] iff A is Hurwitz and A_f has its eigenvalues inside the unit circle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.estimation.nonuniform.filters import Filter, error_output
from replication.estimation.nonuniform.plant import SampledPlant


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
    error_output(plant, filter_)
    return StabilityTest(float(np.max(np.linalg.eigvals(plant.A).real)), filter_.spectral_radius())
