"""The sampled plant and filter of the nonuniform-sampling paper, eqs. (1)-(5), in rationals and balls.

A time is a pair (a, b) of rationals and stands for a + b pi seconds, since one of the printed periods is pi/25.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.linear import block, is_schur, require_hurwitz, require_order, zeros
from replication.verify.reading import fields, matrix, rational, sequence, text
from replication.verify.theorem import Refused, require

PRECISION = 128
"""Bits of the balls."""

Time = tuple[fmpq, fmpq]
PERIODS = ("h_l", "middle", "h_u")
"""Names of the periods of a range, in increasing order."""


@dataclass(frozen=True)
class Plant:
    """Eq. (1): A (n, n), B (n, m), C (r, n), D (r, m), L (s, n), and the ends of the range of sampling periods."""

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat
    D: fmpq_mat
    L: fmpq_mat
    h_l: Time
    h_u: Time

    def period(self, name: Any, path: str) -> Time:
        """The period that goes by this name."""
        periods = dict(zip(PERIODS, (self.h_l, along(self.h_l, self.h_u, fmpq(1, 2)), self.h_u), strict=True))
        chosen = text(name, path)
        require(chosen in periods, f"{path} must be one of {', '.join(periods)}, got {chosen!r:.20}")
        return periods[chosen]

    def generator(self) -> arb_mat:
        """N = [[A, B], [0, 0]], whose exponential at h holds Phi(h) and Gamma(h) in its upper rows."""
        n, m = self.B.nrows(), self.B.ncols()
        return arb_mat(block([[self.A, self.B], [zeros(m, n + m)]]))


@dataclass(frozen=True)
class Filter:
    """Eq. (4): A (nf, nf), B (nf, r), C (s, nf)."""

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat


def read_plant(value: Any) -> Plant:
    """The plant of a certificate, shapes checked; other fields, such as a printed filter, are left to the caller."""
    names = ("A", "B", "C", "D", "L", "h_l", "h_u")
    require(isinstance(value, dict), "plant must be an object")
    A, B, C, D, L, h_l, h_u = fields({name: value[name] for name in names if name in value}, "plant", *names)
    states = matrix(A, "plant.A")
    n = states.nrows()
    require(n == states.ncols(), "plant.A must be square")
    require_order(n, "plant.A")
    drive = matrix(B, "plant.B", rows=n)
    sensor = matrix(C, "plant.C", columns=n)
    plant = Plant(
        states, drive, sensor, matrix(D, "plant.D", sensor.nrows(), drive.ncols()), matrix(L, "plant.L", columns=n),
        read_time(h_l, "plant.h_l"), read_time(h_u, "plant.h_u"),
    )  # fmt: skip
    require(seconds(plant.h_l) > 0, "plant.h_l must be positive")
    require(seconds(plant.h_u) > seconds(plant.h_l), "plant.h_u must exceed plant.h_l")
    return plant


def read_filter(value: Any, path: str, plant: Plant) -> Filter:
    """A filter that fits the plant."""
    A, B, C = fields(value, path, "A", "B", "C")
    states = matrix(A, f"{path}.A")
    n = states.nrows()
    require(n == states.ncols(), f"{path}.A must be square")
    require_order(n, f"{path}.A")
    return Filter(
        states, matrix(B, f"{path}.B", n, plant.C.nrows()), matrix(C, f"{path}.C", plant.L.nrows(), n)
    )  # fmt: skip


def read_time(value: Any, path: str) -> Time:
    """A time from the strings of its two rationals."""
    a, b = sequence(value, path, rational, 2)
    return a, b


def seconds(time: Time) -> arb:
    """A ball that holds a + b pi."""
    return arb(time[0]) + arb(time[1]) * arb.pi()


def along(start: Time, stop: Time, share: fmpq) -> Time:
    """The time that divides the way from start to stop, exactly."""
    return start[0] + share * (stop[0] - start[0]), start[1] + share * (stop[1] - start[1])


def step_at(plant: Plant, h: arb) -> arb_mat:
    """[Phi(h), Gamma(h)] of eq. (3) for every h in a ball, (n, n + m)."""
    return upper_rows((plant.generator() * h).exp(), plant.A.nrows())


def chord_remainder(plant: Plant, start: arb, length: arb) -> arb_mat:
    """Bounds of the moduli of [Phi, Gamma](h) minus their chord over start <= h <= start + length.

    A function differs from its chord by at most length^2 / 8 times the largest second derivative, here N^2 e^{Nh}.
    """
    N = plant.generator()
    bend = upper_rows(N * N * (N * start).exp() * (N * arb(0).union(length)).exp(), plant.A.nrows())
    return arb_mat(bend.nrows(), bend.ncols(), [(length * length / 8 * entry).abs_upper() for entry in bend.entries()])


def widened(M: arb_mat, bounds: arb_mat) -> arb_mat:
    """Balls that hold every matrix whose entries differ from those of M by at most these bounds."""
    entries = [
        (M[i, j] - bounds[i, j]).union(M[i, j] + bounds[i, j]) for i in range(M.nrows()) for j in range(M.ncols())
    ]
    return arb_mat(M.nrows(), M.ncols(), entries)


def upper_rows(M: arb_mat, count: int) -> arb_mat:
    """The first rows of a matrix."""
    return arb_mat(M.tolist()[:count])


def error_step(plant: Plant, filter_: Filter, step: arb_mat) -> arb_mat:
    """[A-bar, B-bar] of eq. (5) for [Phi, Gamma] in a ball: (n + nf, n + nf + m)."""
    n, nf = plant.A.nrows(), filter_.A.nrows()
    upper = [[*row[:n], *[arb(0)] * nf, *row[n:]] for row in step.tolist()]
    lower = arb_mat(block([[filter_.B * plant.C, filter_.A, filter_.B * plant.D]])).tolist()
    return arb_mat(upper + lower)


def error_output(plant: Plant, filter_: Filter) -> fmpq_mat:
    """C-bar = [L, -C_f] of eq. (5)."""
    return block([[plant.L, -filter_.C]])


def require_stable(plant: Plant, filter_: Filter) -> None:
    """Refuse unless A is Hurwitz and A_f Schur: then (5) is exponentially stable for every sampling sequence.

    A-bar(h) is block triangular; a product of the Phi(h_k) is e^{A t} with t the sum of the h_k >= h_l > 0, and decays.
    """
    require_hurwitz(plant.A, "the plant")
    require(is_schur(filter_.A.charpoly()), "the filter is not Schur stable")


def beside(left: arb_mat, right: arb_mat) -> arb_mat:
    """[left, right]."""
    return arb_mat([[*a, *b] for a, b in zip(left.tolist(), right.tolist(), strict=True)])


def solved(M: Any, right: Any, what: str) -> Any:
    """M^{-1} right, in rationals or balls; refused if M is not proved invertible."""
    try:
        return M.solve(right)
    except ZeroDivisionError:
        raise Refused(f"{what} is not proved invertible") from None
