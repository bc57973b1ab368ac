"""Gains of multi-rate observers: Theorem 1 of the multi-rate paper in exact arithmetic.

Error system e(k+1) = A_k e(k) + B_k v(k), z(k) = W e(k), with A_k = A - L_k C_k, B_k = [B_d, -L_k D_k] and the rows
C_k, D_k of the sensors measured at k; v = (d, w). The gain is the least g with ||z|| <= g ||v|| from e(0) = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import lcm
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.linear import block, identity, require_positive_definite, take_rows, zeros
from replication.verify.printed import above
from replication.verify.reading import fields, integer, matrices, matrix, positive, sequence, symmetric
from replication.verify.theorem import Theorem


@dataclass(frozen=True)
class Sensing:
    """A plant under a sensing schedule: C_k and D_k hold the rows measured at phase k."""

    A: fmpq_mat
    B_d: fmpq_mat
    W: fmpq_mat
    C: list[fmpq_mat]
    D: list[fmpq_mat]
    rows: list[list[int]]

    @property
    def order(self) -> int:
        """n, the number of states."""
        return int(self.A.nrows())

    def error_system(self, gains: list[fmpq_mat]) -> list[tuple[fmpq_mat, fmpq_mat]]:
        """(A_k, B_k) of each phase for gains L_k (n, q); columns of sensors that are not measured have no effect."""
        stages = []
        for C, D, rows, L in zip(self.C, self.D, self.rows, gains, strict=True):
            acting = take_rows(L.transpose(), rows).transpose()
            stages.append((self.A - acting * C, block([[self.B_d, -acting * D]])))
        return stages


def sensing(plant: Mapping[str, Any], parameters: Any) -> Sensing:
    """The plant (A, B_d, C, D, W), of whose sensors those in `sensors` measure at (k - offset) mod period == 0."""
    chosen, periods, offsets = fields(parameters, "parameters", "sensors", "periods", "offsets")
    A = matrix(plant["A"], "plant.A")
    C = matrix(plant["C"], "plant.C", columns=A.ncols())
    D = matrix(plant["D"], "plant.D", rows=C.nrows())
    sensors = sequence(chosen, "parameters.sensors", integer)
    N = sequence(periods, "parameters.periods", lambda value, path: integer(value, path, 1), len(sensors))
    theta = sequence(offsets, "parameters.offsets", integer, len(sensors))
    measured = [
        [i for i, period, offset in zip(sensors, N, theta, strict=True) if (k - offset) % period == 0]
        for k in range(lcm(*N))
    ]
    return Sensing(
        A,
        matrix(plant["B_d"], "plant.B_d", rows=A.nrows()),
        matrix(plant["W"], "plant.W", columns=A.ncols()),
        [take_rows(C, rows) for rows in measured],
        [take_rows(D, rows) for rows in measured],
        measured,
    )


def gain_upper(certificate: Mapping[str, Any]) -> Theorem:
    """An upper bound of the gain of the given gains L_k."""
    _, A, B_d, C, D, W, L = fields(certificate["plant"], "plant", "name", "A", "B_d", "C", "D", "W", "L")
    system = sensing({"A": A, "B_d": B_d, "C": C, "D": D, "W": W}, certificate["parameters"])
    (P,) = fields(certificate["witness"], "witness", "P")
    level = _upper(certificate, system, L, "plant.L", P)
    return Theorem(
        sentence=f"For every disturbance, the error system of the given gains has an l2 gain of at most "
        f"{above(level)}: P_0 .. P_{len(system.C) - 1} satisfy the inequality of Theorem 1.",
        upper=level,
    )


def optimum_upper(certificate: Mapping[str, Any]) -> Theorem:
    """An upper bound of the smallest achievable gain: that of some gains."""
    _, A, B_d, C, D, W = fields(certificate["plant"], "plant", "name", "A", "B_d", "C", "D", "W")
    system = sensing({"A": A, "B_d": B_d, "C": C, "D": D, "W": W}, certificate["parameters"])
    L, P = fields(certificate["witness"], "witness", "L", "P")
    level = _upper(certificate, system, L, "witness.L", P)
    return Theorem(
        sentence=f"Some observer has, for every disturbance, an l2 gain of at most {above(level)}.",
        upper=level,
    )


def _upper(certificate: Mapping[str, Any], system: Sensing, gains: Any, path: str, given: Any) -> fmpq:
    """The level, after checking P_k > 0 and diag(P_k - W'W, g^2 I) - [A_k B_k]' P_(k+1) [A_k B_k] > 0 at every k.

    The second says that e'P_k e decreases by more than |z|^2 - g^2 |v|^2; summed from e(0) = 0 this is the bound.
    """
    (stated,) = fields(certificate["bound"], "bound", "upper")
    level = positive(stated, "bound.upper")
    n, count = system.order, len(system.C)
    L = matrices(gains, path, n, max(map(max, filter(None, system.rows))) + 1, count)
    P = sequence(given, "witness.P", lambda value, where: symmetric(value, where, n), count)
    weight = system.W.transpose() * system.W
    for k, (A, B) in enumerate(system.error_system(L)):
        require_positive_definite(P[k], f"P_{k}")
        step = block([[A, B]])
        room = block(
            [
                [P[k] - weight, zeros(n, B.ncols())],
                [zeros(B.ncols(), n), identity(B.ncols()) * level**2],
            ]
        )
        change = step.transpose() * P[(k + 1) % count] * step
        require_positive_definite(room - change, f"the inequality of Theorem 1 at phase {k}, level {above(level)},")
    return level


STATEMENTS: Mapping[str, Callable[[Mapping[str, Any]], Theorem]] = {
    "multirate.gain-upper": gain_upper,
    "multirate.optimum-upper": optimum_upper,
}
