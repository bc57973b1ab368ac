"""Units of time and of the states in which the matrices of a plant are of moderate size: what solvers need.

Σ|A_i|, then |B| and |C_1| are balanced by a diagonal change of the states, and time is counted in the inverse of the
spectral radius of Σ|A_i|, which no diagonal change moves and which bounds every root with Re s >= 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from replication.estimation.delay.system import DelaySystem, time_scaled, transformed
from replication.estimation.validation import Array

STEP = 64.0
"""Units are powers of it: changes of units are exact, and a plant of moderate size keeps its own."""


@dataclass(frozen=True)
class Units:
    """The plant in its units: x' = change·x, change (n, n) diagonal; t' = t/time."""

    system: DelaySystem
    change: Array
    time: float


def natural_units(system: DelaySystem) -> Units:
    """The plant in balanced units, or as it is where these are within a factor √STEP of its own."""
    rate = reach(system)
    time = rounded(1.0 / rate if rate > 0.0 else system.delays[-1])
    states = np.array([rounded(float(value)) for value in _balance(time_scaled(system, time))])
    if np.all(states == 1.0) and time == 1.0:
        return Units(system, np.eye(system.states), 1.0)
    return Units(time_scaled(transformed(system, np.diag(states)), time), np.diag(states), time)


def _balance(system: DelaySystem) -> Array:
    """Factors of the states: Σ|A_i| decides, B and C_1 where states are apart, and the largest of both are equal."""
    size = _size(system)
    np.fill_diagonal(size, 0.0)  # no change of units moves it
    scale = scipy.linalg.matrix_balance(size, permute=False, separate=True)[1][0]
    drive = np.abs(system.b).max(axis=1, initial=0.0) / scale
    output = np.max([np.abs(c).max(axis=0, initial=0.0) for c in (system.c10, *system.c1)], axis=0) * scale
    if not (np.any(drive) and np.any(output)):
        return np.asarray(1.0 / scale)
    row, column = drive / drive.max(), output / output.max()  # beside rates of about one
    node = np.block([[size / scale[:, None] * scale, row[:, None]], [column[None, :], np.zeros((1, 1))]])
    further = scipy.linalg.matrix_balance(node, permute=False, separate=True)[1][0]
    further = further[:-1] / further[-1]
    drive, output = drive / further, output * further
    return np.asarray(np.sqrt(output.max() / drive.max()) / (scale * further))


def reach(system: DelaySystem) -> float:
    """Spectral radius of Σ|A_i|: the absolute value of no root with Re s >= 0 is larger."""
    return float(np.abs(np.linalg.eigvals(_size(system))).max())


def _size(system: DelaySystem) -> Array:
    """Σ|A_i| entry by entry."""
    return np.asarray(np.sum([np.abs(a) for a in (system.a0, *system.a)], axis=0))


def rounded(value: float) -> float:
    """The nearest power of STEP."""
    return float(STEP ** np.round(np.log(value) / np.log(STEP)))
