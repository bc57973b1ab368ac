"""Linear systems with several state delays, system (1) of the delay paper, as validated frozen data.

ẋ(t) = A_0 x(t) + Σ_i A_i x(t-τ_i) + B w(t),  z(t) = C_10 x(t) + Σ_i C_1i x(t-τ_i),  y(t) = C_2 x(t).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.validation import Array, as_matrix, positive_scalar


class PlantSizes:
    """The sizes of a plant with the fields a0, delays, b, c10 and c2."""

    a0: Array
    delays: tuple[float, ...]
    b: Array
    c10: Array
    c2: Array

    @property
    def states(self) -> int:
        """Number of states n."""
        return int(self.a0.shape[0])

    @property
    def delay_count(self) -> int:
        """Number of delays K."""
        return len(self.delays)

    @property
    def inputs(self) -> int:
        """Number of disturbances r."""
        return int(self.b.shape[1])

    @property
    def outputs(self) -> int:
        """Number of outputs to estimate p."""
        return int(self.c10.shape[0])

    @property
    def measurements(self) -> int:
        """Number of measurements q."""
        return int(self.c2.shape[0])


@dataclass(frozen=True)
class DelaySystem(PlantSizes):
    """Plant of eq. (1) with n states, r disturbances, p outputs to estimate, q measurements and K delays.

    Build it with `delay_system`, which checks everything.

    Attributes
    ----------
    a0 : array (n, n)
        A_0, in 1/s.
    a : tuple of K arrays (n, n)
        A_1 ... A_K, in 1/s.
    delays : tuple of K floats
        Increasing and positive, s.
    b : array (n, r)
        B.
    c10 : array (p, n)
        C_10.
    c1 : tuple of K arrays (p, n)
        C_11 ... C_1K.
    c2 : array (q, n)
        C_2.
    """

    a0: Array
    a: tuple[Array, ...]
    delays: tuple[float, ...]
    b: Array
    c10: Array
    c1: tuple[Array, ...]
    c2: Array


def delay_system(
    a0: Any,
    a: Sequence[Any],
    delays: Sequence[float],
    b: Any,
    c10: Any,
    c2: Any,
    c1: Sequence[Any] | None = None,
) -> DelaySystem:
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
    DelaySystem
        The matrices as read-only arrays.

    Raises
    ------
    InvalidInputError
        Non-positive, equal or unordered delays, wrong shapes, no disturbance or output, entries that are not finite, or
        dependent rows of C_2 (then a measurement is redundant or zero).
    """
    state = as_matrix("a0", a0)
    size = state.shape[0]
    state = as_matrix("a0", a0, rows=size, columns=size)
    if size < 1:
        raise InvalidInputError("a0 must have at least one state, got shape (0, 0)")
    times = checked_delays(delays)
    delayed = _per_delay("a", a, len(times), (size, size))
    drive, output = as_matrix("b", b, rows=size), as_matrix("c10", c10, columns=size)
    rows = output.shape[0]
    if rows < 1 or drive.shape[1] < 1:
        raise InvalidInputError(
            f"c10 must have a row and b a column, got shapes {output.shape} and {drive.shape}; for none use zeros"
        )
    late = [np.zeros((rows, size))] * len(times) if c1 is None else c1
    late_outputs = _per_delay("c1", late, len(times), (rows, size))
    sensor = as_matrix("c2", c2, columns=size)
    rank = int(np.linalg.matrix_rank(sensor)) if sensor.size else 0
    if sensor.shape[0] < 1 or rank < sensor.shape[0]:
        raise InvalidInputError(
            f"c2 must have full row rank, got {sensor.shape[0]} rows of rank {rank}; drop redundant measurements"
        )
    return DelaySystem(state, delayed, times, drive, output, late_outputs, sensor)


def checked_delays(delays: Any) -> tuple[float, ...]:
    """At least one, positive and increasing (s); raises InvalidInputError otherwise."""
    times = tuple(positive_scalar(f"delays[{i}]", value, unit="s") for i, value in enumerate(listed("delays", delays)))
    if not times:
        raise InvalidInputError("delays must hold at least one delay; for none use a zero matrix and any delay")
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise InvalidInputError(f"delays must increase strictly, got {times}; sort them together with their matrices")
    return times


def _per_delay(name: str, matrices: Any, count: int, shape: tuple[int, int]) -> tuple[Array, ...]:
    """The matrices, one per delay and each of `shape`."""
    given = listed(name, matrices)
    if len(given) != count:
        raise InvalidInputError(f"{name} must hold one matrix per delay: {count} delays, {len(given)} matrices")
    return tuple(as_matrix(f"{name}[{i}]", m, rows=shape[0], columns=shape[1]) for i, m in enumerate(given))


def listed(name: str, value: Any) -> list[Any]:
    """The entries of what is given for each delay; raises InvalidInputError if it has none to list."""
    try:
        return list(value)
    except TypeError as error:
        raise InvalidInputError(f"{name} must be a list with one entry per delay, got {value!r}") from error


def transformed(system: DelaySystem, change: Any) -> DelaySystem:
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


def time_scaled(system: DelaySystem, factor: float) -> DelaySystem:
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


def gain_scaled(system: DelaySystem, unit: float) -> DelaySystem:
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


def measured_last(system: DelaySystem) -> tuple[DelaySystem, Array]:
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
    sensor.flags.writeable = False
    return (
        DelaySystem(rotated.a0, rotated.a, rotated.delays, rotated.b, rotated.c10, rotated.c1, sensor),
        change,
    )


# Units of time and of the states in which the matrices of a plant are of moderate size: what solvers need.
#
# Σ|A_i|, then |B| and |C_1| are balanced by a diagonal change of the states, and time is counted in the inverse of the
# spectral radius of Σ|A_i|, which no diagonal change moves and which bounds every root with Re s >= 0.


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
