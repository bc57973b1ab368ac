"""Whether the measurements of a plant have noise at all frequencies: without it an observer may differentiate, and the
least level is not attained."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.delay.exact.forms import plant_terms
from replication.estimation.delay.exact.terms import PlantTerms, axis
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.general.scaling import scaling_of
from replication.estimation.validation import Array

NONE = 1e-6
"""Least singular value, relative to rows of unit length, that counts as none."""
POINTS, DECADES, ROUNDS = 400, 4, 40


def require_noise(plant: DelayPlant) -> None:
    """Raise InvalidInputError where a combination of measurements is free of noise, at some frequency or at high ones.

    [j omega - A(j omega), B(j omega); C_2(j omega), D_21(j omega)] must have full row rank.
    """
    fast = _direct_noise(plant)
    if fast <= NONE:
        raise InvalidInputError(
            "a combination of measurements is free of noise at high frequencies (D_21 with its delayed parts loses "
            "rank there); add a disturbance of its own to each row of d21"
        )
    # Neither the unit of a state nor that of w makes noise small: in units of the errors.
    scaling = scaling_of(plant)
    omega, least = _weakest(scaling.plant(plant))
    omega /= scaling.time
    if least <= NONE:
        raise InvalidInputError(
            f"a combination of measurements is free of noise at {omega:.6g} rad/s; add a disturbance of its own to "
            "each row of d21, or drop a measurement"
        )


def _direct_noise(plant: DelayPlant) -> float:
    """The least singular value of D_21 + sum D_21i e^{-j omega tau_i} over frequencies beyond all dynamics."""
    sizes = np.linalg.norm(plant.d21, axis=1) + sum(np.linalg.norm(d, axis=1) for d in plant.d21_delayed)
    if plant.measurements > plant.inputs or np.any(sizes == 0.0):
        return 0.0

    def values(omega: Array) -> Array:
        total = np.tile(plant.d21.astype(complex), (len(omega), 1, 1))
        for delay, matrix in zip(plant.delays, plant.d21_delayed, strict=True):
            total += np.exp(-1j * omega * delay)[:, None, None] * matrix
        return np.asarray(np.linalg.svd(total / sizes[:, None], compute_uv=False)[:, -1])

    return _least(values, np.linspace(0.0, 40.0 * np.pi / plant.delays[0], 4000))[1]


def _weakest(plant: DelayPlant) -> tuple[float, float]:
    """The frequency where the pencil comes closest to losing a row, and how close."""
    terms, rate = plant_terms(plant), 1.0 / plant.delays[-1]
    grid = np.concatenate([[0.0], rate * np.logspace(-DECADES, DECADES / 2, POINTS), rate * np.linspace(0, 50, POINTS)])
    return _least(lambda omega: _sizes(terms, omega), np.unique(grid))


def _least(values: Callable[[Array], Array], omega: Array) -> tuple[float, float]:
    """Where a function is least, near the least of its values on a grid, and that value."""
    on_grid = values(omega)
    best = int(np.argmin(on_grid))
    left, right = omega[max(best - 1, 0)], omega[min(best + 1, len(omega) - 1)]
    for _ in range(ROUNDS):
        first, second = left + (right - left) / 3.0, right - (right - left) / 3.0
        low, high = values(np.array([first, second]))
        left, right = (left, second) if low < high else (first, right)
    middle = (left + right) / 2.0
    found = float(values(np.array([middle]))[0])
    return (middle, found) if found < on_grid[best] else (float(omega[best]), float(on_grid[best]))


def _sizes(terms: PlantTerms, omega: Array) -> Array:
    return np.asarray(np.linalg.svd(terms.pencil(omega, terms.terms.at(axis(omega))), compute_uv=False)[:, -1])
