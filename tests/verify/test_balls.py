"""Balls answer yes only if every point of them does."""

import pytest
from flint import acb, arb, arb_mat, fmpq, fmpq_poly

from replication.verify.algebra import balls
from replication.verify.theorem import Refused

BALL = arb(0, fmpq(1, 2))
"""From -1/2 to 1/2."""


@pytest.mark.parametrize(
    "M",
    [
        [[2, 0], [1, 1]],
        [[arb(1, fmpq(1, 2))]],
        [[4, 0, 0], [2, 2, 0], [2, 1, arb(fmpq(3, 2), fmpq(1, 4))]],
        [[arb(2), BALL], [BALL, arb(1)]],
    ],
)
def test_positive_definite_by_the_lower_triangle(M: list[list[arb]]) -> None:
    balls.require_positive_definite(arb_mat(M), "M")


@pytest.mark.parametrize(
    ("M", "pivot"),
    [
        ([[0]], 0),
        ([[BALL]], 0),
        ([[arb("nan")]], 0),
        ([[-1]], 0),
        ([[1, 0], [1, 1]], 1),
        ([[1, 0], [2, 1]], 1),
        ([[1, 0], [1, arb(1, fmpq(1, 2))]], 1),
        ([[4, 0, 0], [2, 2, 0], [2, 1, 1]], 2),
        ([[4, 0, 0], [2, 2, 0], [2, 3, arb(1, fmpq(1, 2))]], 2),
    ],
)
def test_what_is_not_proved_positive_definite(M: list[list[arb]], pivot: int) -> None:
    with pytest.raises(Refused, match=f"M is not proved positive definite: pivot {pivot} is"):
        balls.require_positive_definite(arb_mat(M), "M")


def test_only_square_matrices_are_definite() -> None:
    for M in ([[1, 0]], [[1], [0]]):
        with pytest.raises(Refused, match="M is not square"):
            balls.require_positive_definite(arb_mat(M), "M")


def test_a_ball_between_two_numbers_holds_both() -> None:
    ball = balls.between(fmpq(1, 3), fmpq(2, 3))
    assert ball.contains(arb(fmpq(1, 3))) and ball.contains(arb(fmpq(2, 3))) and not ball.contains(1)


def test_ends_of_balls() -> None:
    low, high = balls.ends(arb(1, fmpq(1, 2)))
    assert 0 < low <= fmpq(1, 2) and fmpq(3, 2) <= high < 2
    for ball in (arb("inf"), arb("nan"), arb(0, arb("inf"))):
        with pytest.raises(Refused, match="no finite ends"):
            balls.ends(ball)


def test_roots_come_with_their_multiplicity() -> None:
    found = balls.roots(fmpq_poly([1, 2, 2, 2, 1]))  # (z + 1)^2 (z^2 + 1)
    assert len(found) == 4
    for root, count in ((acb(-1), 2), (acb(0, 1), 1), (acb(0, -1), 1)):
        assert sum(ball.contains(root) for ball in found) == count
