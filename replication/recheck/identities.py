"""Identities for all matrices of a size, at random points (Schwartz and Zippel).

Both sides are computed exactly, with integers of 64 bits for all entries. Sides that differ as polynomials of degree d
agree at such a point with a probability below d/2^64; degrees here stay below a hundred. Sides that differ at one point
are not identical, which is no matter of chance. The points are the same in each run.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from random import Random
from typing import Any

from replication.recheck.reading import Matrix

POINTS = 3


class Draw:
    """Random rationals, matrices of them, and symmetric ones."""

    def __init__(self, seed: int) -> None:
        self._random = Random(seed)

    def number(self) -> Fraction:
        """An integer from 1 to 2^64."""
        return Fraction(self._random.getrandbits(64) + 1)

    def matrix(self, rows: int, columns: int) -> Matrix:
        """A matrix of such numbers."""
        return [[self.number() for _ in range(columns)] for _ in range(rows)]

    def symmetric(self, size: int) -> Matrix:
        """A symmetric matrix of such numbers."""
        drawn = self.matrix(size, size)
        return [[drawn[max(i, j)][min(i, j)] for j in range(size)] for i in range(size)]


def same(sides: Callable[[Draw], tuple[Any, Any]]) -> bool:
    """Whether both sides agree at all points that are tried."""
    return all(left == right for left, right in (sides(Draw(seed)) for seed in range(POINTS)))
