"""Linear systems with several state delays, system (1) of the delay paper, as validated frozen data.

ẋ(t) = A_0 x(t) + Σ_i A_i x(t-τ_i) + B w(t),  z(t) = C_10 x(t) + Σ_i C_1i x(t-τ_i),  y(t) = C_2 x(t).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.delay.general.plant import DelayPlant, checked_delays, listed
from replication.estimation.validation import Array, as_matrix, positive_scalar


def delay_system(
    a0: Any,
    a: Sequence[Any],
    delays: Sequence[float],
    b: Any,
    c10: Any,
    c2: Any,
    c1: Sequence[Any] | None = None,
) -> DelayPlant:
    """The plant of eq. (1), checked.

    Parameters
    ----------
    a0 : array (n, n)
        A_0, in 1/s.
    a : sequence of K arrays (n, n)
        A_1 ... A_K, in 1/s.
    delays : sequence of K floats
        Increasing and positive, s.
    b : array (n, r)
        Effect of the disturbance w.
    c10 : array (p, n)
        What of the present state is to be estimated.
    c2 : array (q, n)
        Measurements, of full row rank.
    c1 : sequence of K arrays (p, n), optional
        What of the delayed states is to be estimated; nothing unless given.

    Returns
    -------
    DelayPlant
        The matrices as read-only arrays.

    Raises
    ------
    InvalidInputError
        Non-positive, equal or unordered delays, wrong shapes, no disturbance or output, entries that are not finite, or
        dependent rows of C_2 (then a measurement is redundant or zero).
    """
    terms: dict[str, Any] = {"delays": checked_delays(delays), "a": listed("a", a)}
    if c1 is not None:
        terms["c1"] = listed("c1", c1)
    for name, matrices in terms.items():
        if name != "delays" and not matrices:
            raise InvalidInputError(f"{name} must hold one matrix per delay, got none; for none use zeros")
    plant = DelayPlant(a0=a0, b=b, c10=c10, c2=c2, **terms)
    require_independent(plant.c2)
    return plant


def require_independent(c2: Array) -> None:
    """Raise InvalidInputError unless the measurements, free of noise, have full row rank."""
    rank = int(np.linalg.matrix_rank(c2))
    if rank < len(c2):
        raise InvalidInputError(
            f"c2 must have full row rank, got {len(c2)} rows of rank {rank}; drop redundant measurements"
        )


def transformed(system: DelayPlant, change: Any) -> DelayPlant:
    """The same system in the coordinates `change`·x; shape (n, n), invertible. Raises InvalidInputError otherwise."""
    size = system.states
    matrix = as_matrix("change", change, rows=size, columns=size)
    if np.linalg.matrix_rank(matrix) < size:
        raise InvalidInputError("change must be invertible; its rank is smaller than its order")
    inverse = np.linalg.inv(matrix)
    return delay_system(
        matrix @ system.a0 @ inverse,
        [matrix @ a @ inverse for a in system.a],
        system.delays,
        matrix @ system.b,
        system.c10 @ inverse,
        system.c2 @ inverse,
        [c @ inverse for c in system.c1],
    )


def time_scaled(system: DelayPlant, factor: float) -> DelayPlant:
    """The same system in time t' = t/factor: A_0, A_i and B are multiplied by `factor`, the delays divided by it.

    w and z keep their values, so the gain does not change.
    """
    return delay_system(
        factor * system.a0,
        [factor * a for a in system.a],
        [delay / factor for delay in system.delays],
        factor * system.b,
        system.c10,
        system.c2,
        system.c1,
    )


def gain_scaled(system: DelayPlant, unit: float) -> DelayPlant:
    """The same system with w and z in units that divide every gain from w to z by `unit`: B/√unit, C_1/√unit."""
    root = positive_scalar("unit", unit) ** 0.5
    return delay_system(
        system.a0,
        system.a,
        system.delays,
        system.b / root,
        system.c10 / root,
        system.c2,
        [c / root for c in system.c1],
    )


def measured_last(system: DelayPlant) -> tuple[DelayPlant, Array]:
    """The system in orthogonal coordinates where C_2 = [0 c], with the matrix T of x' = T x.

    The first n-q states are unmeasured, the last q are measured; T (n, n) is orthogonal. Coordinates that already have
    this form are kept, and with them the zeros of the matrices: a sparse program is a cheap one.
    """
    if not np.any(system.c2[:, : system.states - system.measurements]):
        return system, np.eye(system.states)
    _, _, right = np.linalg.svd(system.c2)
    q = system.measurements
    change = np.vstack([right[q:], right[:q]])
    rotated = transformed(system, change)
    sensor = rotated.c2.copy()
    sensor[:, : system.states - q] = 0.0
    return replace(rotated, c2=sensor), change


# Units of time and of the states in which the matrices of a plant are of moderate size: what solvers need.
#
# Σ|A_i|, then |B| and |C_1| are balanced by a diagonal change of the states, and time is counted in the inverse of the
# spectral radius of Σ|A_i|, which no diagonal change moves and which bounds every root with Re s >= 0.


STEP = 64.0
"""Units are powers of it: changes of units are exact, and a plant of moderate size keeps its own."""


@dataclass(frozen=True)
class Units:
    """The plant in its units: x' = change·x, change (n, n) diagonal; t' = t/time."""

    system: DelayPlant
    change: Array
    time: float


def natural_units(system: DelayPlant) -> Units:
    """The plant in balanced units, or as it is where these are within a factor √STEP of its own."""
    rate = reach(system)
    time = rounded(1.0 / rate if rate > 0.0 else system.delays[-1])
    states = np.array([rounded(float(value)) for value in _balance(time_scaled(system, time))])
    if np.all(states == 1.0) and time == 1.0:
        return Units(system, np.eye(system.states), 1.0)
    return Units(time_scaled(transformed(system, np.diag(states)), time), np.diag(states), time)


def _balance(system: DelayPlant) -> Array:
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


def reach(system: DelayPlant) -> float:
    """Spectral radius of Σ|A_i|: the absolute value of no root with Re s >= 0 is larger."""
    return float(np.abs(np.linalg.eigvals(_size(system))).max())


def _size(system: DelayPlant) -> Array:
    """Σ|A_i| entry by entry."""
    return np.asarray(np.sum([np.abs(a) for a in (system.a0, *system.a)], axis=0))


def rounded(value: float) -> float:
    """The nearest power of STEP."""
    return float(STEP ** np.round(np.log(value) / np.log(STEP)))
