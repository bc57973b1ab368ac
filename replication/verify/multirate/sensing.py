"""A plant under a sensing schedule, its error system, and the disturbances that no sensor shows.

x(k+1) = A x(k) + B_d d(k), measured C_k x(k) + D_k w(k) with the rows C_k, D_k of the sensors measured at k, z = W x.
With gains L_k: e(k+1) = A_k e(k) + B_k v(k), [A_k B_k] = [A B_d 0] - L_k [C_k 0 D_k], v = (d, w).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import lcm
from typing import Any

from flint import fmpq_mat

from replication.verify.algebra.linear import block, solved, take_rows, zeros
from replication.verify.reading import MAX_ENTRIES, fields, integer, matrices, matrix, positive, sequence, sized, square
from replication.verify.statement import Depends, Table
from replication.verify.theorem import require

LONGEST_PERIOD = 1000
Schedule = list[list[int]]
"""The sensors that are measured at each phase."""


@dataclass(frozen=True)
class Sensing:
    """The plant seen by a number of sensors, and per phase the rows C_k, D_k that are measured; L_k (n, q) if given."""

    A: fmpq_mat
    B_d: fmpq_mat
    W: fmpq_mat
    C: list[fmpq_mat]
    D: list[fmpq_mat]
    measured: Schedule
    sensors: int
    gains: Sequence[fmpq_mat] = ()

    @property
    def phases(self) -> int:
        """N, the number of instants after which the schedule repeats."""
        return len(self.C)

    @property
    def order(self) -> int:
        """n, the number of states."""
        return int(self.A.nrows())

    @property
    def noises(self) -> int:
        """The number of disturbances d and sensor noises w together."""
        (width,) = {self.B_d.ncols() + D.ncols() for D in self.D}
        return width

    def error_system(self, gains: Sequence[fmpq_mat]) -> list[fmpq_mat]:
        """[A_k B_k] of each phase for gains L_k (n, q), that is [A B_d 0] - L_k [C_k 0 D_k] over the measured rows.

        Columns of L_k of sensors that are not measured have no effect.
        """
        steps = []
        for k, L in enumerate(gains):
            driven, seen = self.open_loop(k)
            steps.append(driven - self.acting(k, L) * seen)
        return steps

    def open_loop(self, phase: int) -> tuple[fmpq_mat, fmpq_mat]:
        """[A B_d 0] and [C_k 0 D_k]: what becomes of (x, d, w), and what is measured of it."""
        C, D = self.C[phase], self.D[phase]
        driven = block([[self.A, self.B_d, zeros(self.order, D.ncols())]])
        return driven, block([[C, zeros(D.nrows(), self.B_d.ncols()), D]])

    def acting(self, phase: int, gain: fmpq_mat) -> fmpq_mat:
        """The columns of a gain (n, q) that belong to the sensors measured at a phase."""
        return take_rows(gain.transpose(), self.measured[phase]).transpose()

    def concealing(self, phase: int, x: fmpq_mat) -> fmpq_mat:
        """The smallest sensor noise for which the sensors measured at `phase` show zero: w = -D_k'(D_k D_k')^-1 C_k x.

        x (n, r) holds r states, one per column.
        """
        D = self.D[phase]
        if not D.nrows():
            return zeros(D.ncols(), x.ncols())
        without = f"a sensor measured at phase {phase} has no noise of its own"
        hidden: fmpq_mat = -D.transpose() * solved(D * D.transpose(), self.C[phase] * x, without)
        return hidden


PERIOD = sized(integer, 1)
TIMES: Table = {
    "periods": sized(sequence, PERIOD),
    "offsets": Depends(lambda given: sized(sequence, integer, len(given.periods))),
}
"""Of the sensors, in their order: sampled where (k - offset) mod period == 0."""
CHOSEN: Table = {
    "sensors": sized(sequence, integer),
    "periods": Depends(lambda given: sized(sequence, PERIOD, len(given.sensors))),
    "offsets": TIMES["offsets"],
    "relative": positive,
}
"""Which rows of C and D are the sensors, when they measure, and how near the bounds must be to each other."""


def schedule(periods: Sequence[int], offsets: Sequence[int]) -> Schedule:
    """Which of the sensors have (k - offset) mod period == 0, by their place in the list, at each phase k."""
    require(len(periods) > 0, "parameters.periods names no sensor, and nothing is ever measured")
    common = 1
    for N in periods:
        common = lcm(common, N)
        require(common <= LONGEST_PERIOD, f"the schedule repeats after more than {LONGEST_PERIOD} instants")
    require(
        common * len(periods) <= MAX_ENTRIES,
        f"the schedule has {common} instants x {len(periods)} sensors, more than {MAX_ENTRIES}",
    )
    entries = list(zip(periods, offsets, strict=True))
    return [[i for i, (N, theta) in enumerate(entries) if (k - theta) % N == 0] for k in range(common)]


def read_sensing(value: Any, path: str, chosen: Any, *gains: str) -> Sensing:
    """A plant seen by the sensors `chosen` (parameters `CHOSEN`), with the gains of this name if there is one."""
    measured = schedule(chosen.periods, chosen.offsets)
    seen, rest = read_plant(value, path, chosen.sensors, *gains)
    system = seen(measured)
    L = [matrices(part, f"{path}.L", system.order, system.sensors, len(measured)) for part in rest]
    return replace(system, gains=L[0]) if L else system


def read_plant(
    value: Any, path: str, sensors: Sequence[int], *more: str
) -> tuple[Callable[[Schedule], Sensing], list[Any]]:
    """A plant seen by these sensors, under a schedule that is still to be given, and further fields as they stand."""
    _, *parts = fields(value, path, "name", "A", "B_d", "C", "D", "W", *more)
    A = square(parts[0], f"{path}.A")
    n = A.nrows()
    C = matrix(parts[2], f"{path}.C", columns=n)
    D = matrix(parts[3], f"{path}.D", rows=C.nrows())
    require(all(i < C.nrows() for i in sensors), f"parameters.sensors names a sensor that is not there: {sensors}")
    require(len({*sensors}) == len(sensors), f"parameters.sensors names a sensor twice: {sensors}")
    B_d, W = matrix(parts[1], f"{path}.B_d", rows=n), matrix(parts[4], f"{path}.W", columns=n)
    return partial(select, A, B_d, W, take_rows(C, sensors), take_rows(D, sensors)), parts[5:]


def select(A: fmpq_mat, B_d: fmpq_mat, W: fmpq_mat, C: fmpq_mat, D: fmpq_mat, measured: Schedule) -> Sensing:
    """A plant whose sensors are the rows of C and D, under a schedule."""
    C_k, D_k = ([take_rows(M, rows) for rows in measured] for M in (C, D))
    return Sensing(A, B_d, W, C_k, D_k, measured, C.nrows())


def without_noise(A: fmpq_mat, C: fmpq_mat, measured: Schedule) -> Sensing:
    """A plant as far as stability goes: nothing disturbs it, and nothing is weighted."""
    nothing = take_rows(A, [])
    return select(A, nothing.transpose(), nothing, C, take_rows(C.transpose(), []).transpose(), measured)
