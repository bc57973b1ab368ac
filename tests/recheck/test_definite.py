"""Definiteness of all matrices near one, against exact answers where it is barely so, or barely not."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from replication.recheck.exact import is_positive
from replication.recheck.interval import BITS, Interval
from replication.recheck.nonuniform import definite

Whole = definite.Whole
LARGE = 1 << 200


def nought(size: int) -> Whole:
    return [[0] * size for _ in range(size)]


def around(middle: Whole, radius: Whole) -> list[list[Interval]]:
    return [
        [Interval(one - far << BITS, one + far << BITS) for one, far in zip(*rows, strict=True)]
        for rows in zip(middle, radius, strict=True)
    ]


@pytest.mark.parametrize(
    ("middle", "radius", "positive"),
    [
        ([[1]], [[0]], True),
        ([[0]], [[0]], False),
        ([[-1]], [[0]], False),
        ([[5]], [[4]], True),
        ([[5]], [[5]], False),
        ([[4, 0], [0, 4]], [[0, 3], [3, 0]], True),
        ([[4, 0], [0, 4]], [[0, 4], [4, 0]], False),
        ([[4, 0], [0, 4]], [[0, 5], [5, 0]], False),
        ([[9, 0], [0, 1]], [[0, 0], [0, 1]], False),
        ([[1, 0], [0, 9]], [[1, 0], [0, 0]], False),
        ([[1, 2], [2, 5]], nought(2), True),
        ([[1, 2], [2, 4]], nought(2), False),
        ([[4, 2], [2, 1]], nought(2), False),
        ([[1, 2], [2, 3]], nought(2), False),
        ([[1, -2], [-2, 3]], nought(2), False),
        ([[1, -2, 0], [-2, 3, 1], [0, 1, 9]], nought(3), False),
        ([[-1, 2], [2, 5]], nought(2), False),
        # Entries of sizes so different that a common scale would leave nothing of some.
        ([[1, 0], [0, LARGE]], nought(2), True),
        ([[LARGE, 0], [0, 1]], nought(2), True),
        ([[100, 0], [0, 1 << 2000]], nought(2), True),
        ([[1 << 2000, 0], [0, 1 << 1990]], nought(2), True),
        # Floating point sees a determinant of zero.
        ([[LARGE, LARGE - 1], [LARGE - 1, LARGE]], nought(2), True),
        ([[LARGE, LARGE - 1], [LARGE - 1, LARGE]], [[1, 1], [1, 1]], False),
        ([[LARGE, LARGE - 5], [LARGE - 5, LARGE]], [[2, 2], [2, 2]], True),
        ([[LARGE, LARGE], [LARGE, LARGE]], nought(2), False),
    ],
)
def test_what_is_barely_definite_or_barely_not(middle: Whole, radius: Whole, positive: bool) -> None:
    assert definite.surely_positive(middle, radius) is positive
    small = max(map(max, middle)) < LARGE
    assert not small or definite.pivots_are_positive(around(middle, radius)) is positive


def test_drawn_matrices_are_definite_as_exactly_computed() -> None:
    """Without a radius both ways are exact but for rounding; with one, a corner that is not definite forbids it."""
    rng, seen = np.random.default_rng(7), set()
    for number in range(60):
        size = 1 + number % 4
        root = rng.integers(-9, 10, (size, size))
        middle = [[int(entry) for entry in row] for row in root @ root.T + np.diag(rng.integers(-20, 30, size))]
        positive = is_positive(middle)
        seen.add(positive)
        assert definite.surely_positive(middle, nought(size)) == positive
        assert definite.pivots_are_positive(around(middle, nought(size))) == positive
        drawn = rng.integers(0, 6, (size, size))
        radius = [[int(entry) for entry in row] for row in drawn + drawn.T]
        for signs in rng.choice([-1, 1], (8, size)):
            corner = [
                [
                    entry - (1 if i == j else s * t) * far
                    for j, (entry, far, t) in enumerate(zip(*rows, signs, strict=True))
                ]
                for i, (*rows, s) in enumerate(zip(middle, radius, signs, strict=True))
            ]
            if not is_positive(corner):
                assert not definite.surely_positive(middle, radius)
                assert not definite.pivots_are_positive(around(middle, radius))
    assert seen == {True, False}


def test_the_change_decides_where_pivots_cannot() -> None:
    """A matrix of many rows that depend on each other: pivots of intervals grow wide; near the identity none."""
    size = 12
    middle = [[(1 << 30) * (min(i, j) + 1) for j in range(size)] for i in range(size)]
    radius = [[1 << 22] * size for _ in range(size)]
    assert definite.surely_positive(middle, radius)
    assert not definite.pivots_are_positive(around(middle, radius))


def test_the_change_is_triangular_and_makes_the_identity() -> None:
    rng = np.random.default_rng(8)
    for size, scale in product((1, 2, 5), (0, 10, 1000, 1500)):
        root = rng.integers(-9, 10, (size, size)) + 20 * np.eye(size, dtype=int)
        middle = [[int(entry) << scale for entry in row] for row in root @ root.T]
        change = definite._change(middle)
        assert change is not None
        assert all(change[i][j] == 0 for i in range(size) for j in range(i + 1, size))
        assert min(change[i][i] for i in range(size)) >= 1 << definite.DIGITS - 1
        made = definite._both_sides(change, middle)
        unit = made[0][0]
        for i, j in product(range(size), repeat=2):
            assert abs(made[i][j] - (i == j) * unit) * 10**9 < unit


def test_no_change_is_found_of_what_is_not_definite() -> None:
    for middle in ([[0]], [[-1]], [[1, 1], [1, 1]], [[1, 2], [2, 1]], [[2, -1], [-1, -3]]):
        assert definite._change(middle) is None
