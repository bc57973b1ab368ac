"""Storage matrices at one constant period, in balls: close to an optimum they are too ill-conditioned for doubles.

Where the bound is a relative distance d above the gain, some states need a storage of the order of 1/d times their
output, while the inequality has room of the order of d.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from flint import arb, arb_mat, ctx, fmpq, fmpq_mat

from replication.errors import SolverError

PRECISION = 200
SLACK = fmpq(1, 2**40)
"""Room in the state block of the inequality."""
STORAGE_BITS = 60
"""Storage matrices are multiples of 2^-STORAGE_BITS: much finer than the room."""
SETTLED, MAX_STEPS = fmpq(1, 2**70), 100_000
"""Relative change of the recursion at its end, and its length."""

Json = Mapping[str, Any]


def storage_matrix(plant: Json, filter_: Json, period: str, level: fmpq) -> list[list[str]]:
    """P = A'(P + PB (g^2 - B'PB)^-1 B'P) A + C'C + slack of the error system at `period`, the limit from P = 0.

    plant, filter_: as certificates write them. Raises SolverError if the level g is too low, or the recursion slow.
    """
    with ctx.workprec(PRECISION):
        A, B, C = error_stage(plant, filter_, period)
        constant = C.transpose() * C + _multiple(A.nrows(), SLACK)
        P = arb_mat(A.nrows(), A.nrows())
        for _ in range(MAX_STEPS):
            gap = _multiple(B.ncols(), level**2) - B.transpose() * P * B
            if not gap.det() > 0:
                raise SolverError(f"no storage matrix at the level {level}: too low; raise it")
            cross = B.transpose() * P * A
            following = (A.transpose() * P * A + cross.transpose() * gap.solve(cross) + constant).mid()
            settled = _size(following - P) < SETTLED * _size(following)
            P = following
            if settled:
                symmetric = (P + P.transpose()).tolist()
                return [[_rounded(entry / 2) for entry in row] for row in symmetric]
    raise SolverError(f"the storage matrix did not settle in {MAX_STEPS} steps at the level {level}; raise it")


def error_stage(plant: Json, filter_: Json, period: str) -> tuple[arb_mat, arb_mat, arb_mat]:
    """A-bar, B-bar, C-bar of the error system (5) at the period named h_l, middle or h_u."""
    A, B, C, D, L = (_exact(plant[name]) for name in "ABCDL")
    A_f, B_f, C_f = (_exact(filter_[name]) for name in "ABC")
    n, m, nf = A.nrows(), B.ncols(), A_f.nrows()
    low, high = (arb(a[0, 0]) + arb(a[0, 1]) * arb.pi() for a in (_exact([plant[end]]) for end in ("h_l", "h_u")))
    h = {"h_l": low, "middle": (low + high) / 2, "h_u": high}[period]
    generator = arb_mat(_beside(A, B).tolist() + [[fmpq(0)] * (n + m)] * m)
    held = (generator * h).exp().tolist()[:n]
    state = [[*row[:n], *[arb(0)] * nf] for row in held] + arb_mat(_beside(B_f * C, A_f)).tolist()
    drive = [row[n:] for row in held] + arb_mat(B_f * D).tolist()
    return arb_mat(state), arb_mat(drive), arb_mat(_beside(L, -C_f))


def _beside(left: fmpq_mat, right: fmpq_mat) -> fmpq_mat:
    return fmpq_mat([[*a, *b] for a, b in zip(left.tolist(), right.tolist(), strict=True)])


def _multiple(size: int, factor: fmpq) -> arb_mat:
    """The factor times the identity."""
    return arb_mat(fmpq_mat(size, size, [factor * (i == j) for i in range(size) for j in range(size)]))


def _exact(rows: Any) -> fmpq_mat:
    return fmpq_mat([[fmpq(*Fraction(entry).as_integer_ratio()) for entry in row] for row in rows])


def _size(M: arb_mat) -> arb:
    """The sum of the moduli of the entries."""
    return sum((abs(entry) for entry in M.entries()), arb(0))


def _rounded(entry: arb) -> str:
    return str(fmpq((entry * 2**STORAGE_BITS).floor().mid().unique_fmpz(), 2**STORAGE_BITS))
