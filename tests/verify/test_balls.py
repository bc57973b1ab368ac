"""Balls hold what they should."""

import pytest
from flint import acb_mat, arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra import linear as balls
from replication.verify.theorem import Refused


def test_a_ball_between_two_numbers_holds_both() -> None:
    ball = balls.between(fmpq(1, 3), fmpq(2, 3))
    assert ball.contains(arb(fmpq(1, 3))) and ball.contains(arb(fmpq(2, 3))) and not ball.contains(1)


def test_ends_of_balls() -> None:
    low, high = balls.ends(arb(1, fmpq(1, 2)))
    assert 0 < low <= fmpq(1, 2) and fmpq(3, 2) <= high < 2
    for ball in (arb("inf"), arb("nan"), arb(0, arb("inf"))):
        with pytest.raises(Refused, match="no finite ends"):
            balls.ends(ball)


def test_points_of_the_circle_and_energies() -> None:
    z = balls.circle_point(fmpq(1, 2))
    assert z.real.contains(fmpq(3, 5)) and z.imag.contains(fmpq(4, 5))
    assert balls.energy(acb_mat([[3], [4j]])) == 25
    assert balls.energy(arb_mat([[3, -4]])) == 25
    pair = balls.complex_of([fmpq(1), fmpq(-2)])
    assert (pair.real, pair.imag) == (1, -2)
    assert balls.largest([arb(1), arb(3), arb(2)]) == 3


def test_blocks_beside_each_other_are_of_one_height() -> None:
    assert balls.beside(arb_mat([[1]]), arb_mat([[2, 3]])).tolist() == [[1, 2, 3]]
    with pytest.raises(ValueError, match="zip"):
        balls.beside(arb_mat([[1], [2]]), arb_mat([[2, 3]]))


def test_a_held_input_is_integrated() -> None:
    """x' = -x + u: e^{-t}, and 1 - e^{-t}; with two inputs one column each."""
    Phi, Gamma = balls.hold(fmpq_mat([[-1]]), fmpq_mat([[1, 3]]), fmpq(2))
    decay = arb(-2).exp()
    assert Phi[0, 0].overlaps(decay) and Gamma[0, 0].overlaps(1 - decay) and Gamma[0, 1].overlaps(3 - 3 * decay)
    assert balls.hold(fmpq_mat([[-1]]), fmpq_mat([[1]]), arb(0).union(arb(2)))[0][0, 0].contains(decay)
    assert balls.generator(fmpq_mat([[5]]), fmpq_mat([[1, 3]])).tolist() == [[5, 1, 3], [0, 0, 0], [0, 0, 0]]
