"""Whether all matrices near an integer one are positive definite: changed to near the identity, then by dominance.

The change is roughly the inverse of a Cholesky factor in floating point, made of integers; any invertible one would do.
What is decided with it is exact.
"""

from __future__ import annotations

from math import frexp, ldexp, sqrt
from operator import mul

from replication.recheck.interval import Interval

Whole = list[list[int]]

DIGITS = 60
"""Bits of the smallest diagonal entry of the change."""


def surely_positive(middle: Whole, radius: Whole) -> bool:
    """Whether every symmetric matrix within the radius of the middle, entry by entry, is positive definite."""
    change = _change(middle)
    if change is None:
        # Floating point finds no factor.
        return pivots_are_positive(_around(middle, radius))
    near = _both_sides(change, middle)
    far = _both_sides([[abs(entry) for entry in row] for row in change], radius)
    # Triangular with a diagonal that is not zero, the change is invertible.
    return all(
        row[i] - wide[i]
        > sum(abs(entry) + more for j, (entry, more) in enumerate(zip(row, wide, strict=True)) if j != i)
        for i, (row, wide) in enumerate(zip(near, far, strict=True))
    )


def pivots_are_positive(rows: list[list[Interval]]) -> bool:
    """Whether every symmetric matrix within these intervals is positive definite, by the pivots of L D L'."""
    rows = [list(row) for row in rows]
    for i, pivot in enumerate(rows):
        if not pivot[i] > 0:
            return False
        for k in range(i + 1, len(rows)):
            factor = rows[k][i] / pivot[i]
            rows[k] = [a - factor * b for a, b in zip(rows[k], pivot, strict=True)]
    return True


def _around(middle: Whole, radius: Whole) -> list[list[Interval]]:
    return [
        [Interval(entry - far, entry + far) for entry, far in zip(*both, strict=True)]
        for both in zip(middle, radius, strict=True)
    ]


def _both_sides(change: Whole, matrix: Whole) -> Whole:
    """change * matrix * change'; the matrix is symmetric."""
    half = [[sum(map(mul, row, column)) for column in matrix] for row in change]
    return [[sum(map(mul, row, column)) for column in change] for row in half]


def _change(matrix: Whole) -> Whole | None:
    size = len(matrix)
    spare = max(0, max(matrix[i][i].bit_length() for i in range(size)) - 900)
    rows = [[float(entry >> spare) for entry in row] for row in matrix]
    factor = [[0.0] * size for _ in range(size)]
    for i in range(size):
        for j in range(i + 1):
            rest = rows[i][j] - sum(map(mul, factor[i][:j], factor[j][:j]))
            if i == j and rest <= 0:
                return None
            factor[i][j] = sqrt(rest) if i == j else rest / factor[j][j]
    found = [[0.0] * size for _ in range(size)]
    for j in range(size):
        for i in range(j, size):
            right = float(i == j) - sum(factor[i][k] * found[k][j] for k in range(j, i))
            found[i][j] = right / factor[i][i]
    shift = DIGITS - min(frexp(found[i][i])[1] for i in range(size))
    return [[int(ldexp(entry, shift)) for entry in row] for row in found]
