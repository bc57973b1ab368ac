"""Whether all matrices in intervals are positive definite: changed to near the identity, then by dominant diagonals."""

from __future__ import annotations

from fractions import Fraction
from math import frexp, sqrt

from replication.recheck.exact import times, turned
from replication.recheck.interval import BITS, ONE, Interval
from replication.recheck.reading import Matrix


def surely_positive(matrix: Matrix) -> bool:
    """Whether every symmetric matrix in these intervals is surely positive definite."""
    whole = [[Interval.of(entry) for entry in row] for row in matrix]
    change = _change([[(entry.low + entry.high) / (2 * ONE) for entry in row] for row in whole])
    if change is None:
        return False
    # The change is invertible: triangular with a diagonal that is not zero.
    near = times(change, times(whole, turned(change)))
    for i, row in enumerate(near):
        beside = sum((abs(entry) for j, entry in enumerate(row) if j != i), Interval(0, 0))
        if not row[i] > beside:
            return False
    return True


def _change(matrix: list[list[float]]) -> list[list[Interval]] | None:
    """The inverse of the Cholesky factor, roughly: any invertible matrix will do."""
    size = len(matrix)
    factor = [[0.0] * size for _ in range(size)]
    for i in range(size):
        for j in range(i + 1):
            rest = matrix[i][j] - sum(factor[i][k] * factor[j][k] for k in range(j))
            if i == j:
                if rest <= 0:
                    return None
                factor[i][i] = sqrt(rest)
            else:
                factor[i][j] = rest / factor[j][j]
    found = [[0.0] * size for _ in range(size)]
    for j in range(size):
        for i in range(j, size):
            right = float(i == j) - sum(factor[i][k] * found[k][j] for k in range(j, i))
            found[i][j] = right / factor[i][i]
    return [[_dyadic(entry) for entry in row] for row in found]


def _dyadic(value: float) -> Interval:
    mantissa, exponent = frexp(value)
    whole = int(mantissa * (1 << 53))
    shift = BITS + exponent - 53
    point = whole << shift if shift >= 0 else int(Fraction(whole, 1 << -shift))
    return Interval(point, point)
