"""Storage matrices at one constant period, in balls: close to an optimum they are too ill-conditioned for doubles.

Where the bound is a relative distance d above the gain, some states need a storage of the order of 1/d times their
output, while the inequality has room of the order of d.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx, fmpq

from replication.certify.rounding import exact
from replication.errors import SolverError
from replication.estimation.validation import Array
from replication.verify.algebra.linear import block, zeros

PRECISION = 200
SLACK = fmpq(1, 2**40)
"""Room in the state block of the inequality."""
EXACT_BITS = 60
"""Storage matrices are multiples of 2^-EXACT_BITS: much finer than the room."""
SETTLED, MAX_DOUBLINGS = fmpq(1, 2**70), 60
"""Relative change of the recursion at its end, and its length."""

Json = Mapping[str, Any]


def storage_matrix(
    plant: Json, filter_: Json, period: str, level: fmpq, *, per_duration: bool = False
) -> list[list[str]]:
    """P = A'(P + PB (w g^2 - B'PB)^-1 B'P) A + w C'C + slack of the error system at `period`, by doubling from P = 0.

    plant, filter_: as certificates write them; w = 1, or the period if `per_duration`. Raises SolverError if there is
    none: the level g is too low.
    """
    with ctx.workprec(PRECISION):
        h = _period(plant, period)
        A, B, C = error_stage(plant, filter_, h)
        weight = h if per_duration else arb(1)
        supplied = weight * arb(level) ** 2
        one = _multiple(A.nrows(), arb(1))
        G, P = -(B * B.transpose()) / supplied, C.transpose() * C * weight + _multiple(A.nrows(), arb(SLACK))
        for _ in range(MAX_DOUBLINGS):
            through = (one + G * P).inv()
            added = A.transpose() * P * through * A
            A, G, P = (A * through * A).mid(), (G + A * through * G * A.transpose()).mid(), (P + added).mid()
            if _size(added) < SETTLED * _size(P):
                break
        gap = _multiple(B.ncols(), supplied) - B.transpose() * P * B
        sound = all(np.all(np.linalg.eigvalsh(_floats(M)) > 0) for M in (gap, P))
        if not sound or not _size(added) < SETTLED * _size(P):
            raise SolverError(f"no storage matrix at the level {level}: it is too low; raise it")
        return [[_rounded(entry / 2) for entry in row] for row in (P + P.transpose()).tolist()]


def _period(plant: Json, name: str) -> arb:
    """The period named h_l, middle or h_u, in seconds."""
    low, high = (arb(a[0, 0]) + arb(a[0, 1]) * arb.pi() for a in (exact([plant[end]]) for end in ("h_l", "h_u")))
    return {"h_l": low, "middle": (low + high) / 2, "h_u": high}[name]


def error_stage(plant: Json, filter_: Json, h: arb) -> tuple[arb_mat, arb_mat, arb_mat]:
    """A-bar, B-bar, C-bar of the error system (5) at the period h."""
    A, B, C, D, L = (exact(plant[name]) for name in "ABCDL")
    A_f, B_f, C_f = (exact(filter_[name]) for name in "ABC")
    n, m, nf = A.nrows(), B.ncols(), A_f.nrows()
    generator = arb_mat(block([[A, B], [zeros(m, n + m)]]))
    held = (generator * h).exp().tolist()[:n]
    state = [[*row[:n], *[arb(0)] * nf] for row in held] + arb_mat(block([[B_f * C, A_f]])).tolist()
    drive = [row[n:] for row in held] + arb_mat(B_f * D).tolist()
    return arb_mat(state), arb_mat(drive), arb_mat(block([[L, -C_f]]))


def _multiple(size: int, factor: arb) -> arb_mat:
    """The factor times the identity."""
    return arb_mat(size, size, [factor * int(i == j) for i in range(size) for j in range(size)])


def _size(M: arb_mat) -> arb:
    """The sum of the moduli of the entries."""
    return sum((abs(entry) for entry in M.entries()), arb(0))


def _floats(M: arb_mat) -> Array:
    return np.array([[float(entry.mid()) for entry in row] for row in M.tolist()])


def _rounded(entry: arb) -> str:
    return str(fmpq((entry * 2**EXACT_BITS).floor().mid().unique_fmpz(), 2**EXACT_BITS))
