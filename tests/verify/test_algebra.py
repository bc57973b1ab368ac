"""Exact linear algebra, balls, roots, symbols and words of the verifier."""

from math import prod
from typing import Any
from unittest.mock import patch

import pytest
from flint import acb, acb_mat, acb_poly, arb, arb_mat, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra import linear as balls
from replication.verify.algebra.linear import block, identity, submatrix, take_rows, zeros
from replication.verify.algebra.symbolic import IDENTITY, Symbolic, Words, blocks, letter, letters, number, one
from replication.verify.kernel import decide, identical
from replication.verify.theorem import Refused

# Exact linear algebra of the verifier.


DEFINITE = fmpq_mat([[2, -1, 0], [-1, 2, -1], [0, -1, 2]])
SINGULAR = fmpq_mat([[1, 1], [1, 1]])


def test_blocks() -> None:
    M = block([[identity(2), zeros(2, 1)], [fmpq_mat([[1, 2]]), fmpq_mat([[3]])]])
    assert fmpq_mat([[1, 0, 0], [0, 1, 0], [1, 2, 3]]) == M
    assert block([[identity(1), zeros(1, 0)]]) == identity(1)
    with pytest.raises(Refused, match="beside"):
        block([[identity(2), zeros(1, 1)]])
    with pytest.raises(Refused, match="above"):
        block([[identity(2)], [zeros(1, 1)]])
    assert submatrix(M, [2, 0], [1]) == fmpq_mat([[2], [0]])
    assert take_rows(M, [2]) == fmpq_mat([[1, 2, 3]])


# Balls hold what they should.


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
    assert balls.resolved(arb_mat([[2]]), acb(5), acb_mat([[12]]), "")[0, 0] == 4


def test_a_held_input_is_integrated() -> None:
    """x' = -x + u: e^{-t}, and 1 - e^{-t}; with two inputs one column each."""
    Phi, Gamma = balls.hold(fmpq_mat([[-1]]), fmpq_mat([[1, 3]]), fmpq(2))
    decay = arb(-2).exp()
    assert Phi[0, 0].overlaps(decay) and Gamma[0, 0].overlaps(1 - decay) and Gamma[0, 1].overlaps(3 - 3 * decay)


# Roots of polynomials, told from each other.


def test_a_root_lies_in_its_disc_and_no_smaller_one_would_do() -> None:
    """Of (z − 1)^n the root is as far from z as the disc reaches."""
    for n in (1, 2, 5):
        polynomial = acb_poly([-1, 1]) ** n
        disc = balls.root_near(polynomial, acb(3, 2))
        assert disc.contains(1)
        assert abs(disc - acb(3, 2)).upper() < 1.5 * arb(8).sqrt()
    with pytest.raises(Refused, match="derivative of the characteristic polynomial may vanish"):
        balls.root_near(acb_poly([1, 0, 1]), acb(0))


def test_the_roots_of_a_polynomial_stand_apart_and_are_held() -> None:
    """1, 2, 3 and -3, i/2 and -i/2; i and (1 + 10^-9) i; and one that occurs twice."""

    def of(*factors: list[Any]) -> list[acb]:
        return balls.roots(prod(map(fmpq_poly, factors), start=fmpq_poly([1])))

    alike = of([-1, 1], [-2, 1], [6, 2], [-3, 1], [fmpq(1, 4), 0, 1])
    assert sorted((round(float(z.real)), round(2 * float(z.imag)), z.imag == 0) for z in alike) == [
        (-3, 0, True), (0, -1, False), (0, 1, False), (1, 0, True), (2, 0, True), (3, 0, True)
    ]  # fmt: skip
    assert all(z.real.rad() < 1e-9 > z.imag.rad() for z in alike)
    above = 1 + fmpq(1, 10**9)
    close = of([1, 0, 1], [above**2, 0, 1])
    for root in (fmpq(1), fmpq(-1), above, -above):
        assert sum(z.overlaps(acb(0, root)) for z in close) == 1
    with pytest.raises(Refused, match="may vanish"):
        of([-1, 1], [-1, 1])


def test_no_root_is_real_because_its_ball_meets_the_axis() -> None:
    """The ball about 0.7 i that holds i reaches below the axis; its mirror image holds -i."""
    guesses = [acb(0, 0.7), acb(0, -1), acb(5)]
    with patch.object(balls, "_guesses", lambda _: guesses), pytest.raises(Refused, match="apart"):
        balls.roots(fmpq_poly([1, 0, 1]) * fmpq_poly([-5, 1]))


def test_ends_are_rounded_outwards() -> None:
    assert balls.rounded_ends(arb(fmpq(1, 3))) == (fmpq(2**40 // 3, 2**40), fmpq(2**40 // 3 + 1, 2**40))
    assert balls.rounded_ends(arb(fmpq(-1, 3)), 1) == (fmpq(-1, 2), 0)


def test_a_root_is_divided_out() -> None:
    quotient = balls.without_root(acb_poly([-30, 31, -10, 1]), acb(5))
    assert [int(float(c.real.mid())) for c in quotient.coeffs()] == [6, -5, 1]


# Matrices of symbols: the rules of algebra, and what is an identity.


def symbols(name: str, rows: int, columns: int) -> Symbolic:
    """A matrix with a number of its own in each place."""
    return Symbolic(tuple(tuple(number(f"{name}{i}{j}") for j in range(columns)) for i in range(rows)))


def test_symbols_obey_the_rules_of_numbers() -> None:
    a, b, c = (number(name) for name in "abc")
    assert ((a + b) * (a - b) - (a * a - b * b)).is_zero() and not (a * b - a * c).is_zero()
    assert a * b == b * a and a != b and (2 * a + b) / 2 == a + b * fmpq(1, 2) and 1 - a == -(a - 1)
    assert (1 + a - a - one()).is_zero()
    assert (a * a * b).derivative("a") == 2 * a * b and (a * a * b).derivative("c").is_zero()
    assert (a * b + b * b * b * 2).derivative("b") == a + 6 * b * b


def test_what_is_no_identity_is_refused() -> None:
    a, b, c = symbols("a", 1, 2), symbols("b", 2, 1), symbols("c", 1, 1)
    same = a @ b
    decide(identical(same, (same + same) * fmpq(1, 2), ""))
    with pytest.raises(Refused, match="row is no identity"):
        decide(identical(a, blocks([[Symbolic(((a.rows[0][0],),)), c]]), "row"))
    for other in (c, same * 2, same + c):
        with pytest.raises(Refused, match="sum is no identity"):
            decide(identical(same, other, "sum"))


# Words in letters that do not commute: the rules of algebra, and what equalities make of them.


def test_letters_obey_the_rules_of_matrices() -> None:
    A, B, P = letter("A"), letter("B"), letter("P", symmetric=True)
    assert (A * B).T == B.T * A.T
    assert not (A * B - B * A).is_zero()
    assert ((A + B) * (A + B) - A * A - A * B - B * A - B * B).is_zero()
    assert P.T == P and A.T != A and A.T.T == A
    assert (A.T * P * B).T == B.T * P * A
    assert (A * one() - A).is_zero() and (one() * A - A).is_zero()
    assert (A * fmpq(1, 2) + A * fmpq(1, 2) - A).is_zero()
    assert (A * 0).is_zero()


def test_words_are_reduced_by_equalities() -> None:
    A, X = letter("A"), letter("X")
    inverse = {(("A", False), ("X", False)): one(), (("X", False), ("A", False)): one()}
    assert (A * X * A - A).reduced(inverse).is_zero()
    assert (X * A * X * number("t") - X * number("t")).reduced(inverse).is_zero()
    assert (A * A * X).reduced(inverse) == A
    assert not (A * X.T).reduced(inverse).is_zero()
    assert (A * X - one()).reduced({}) == A * X - one()


def test_letters_that_are_zero_and_letters_that_are_numbers() -> None:
    A, B = letter("A"), letter("B")
    form = A * B.T * number("t") * 3 - A + one()
    assert form.without("B") == one() - A
    assert form.at({"A": fmpq(2), "B": fmpq(5), "t": fmpq(1, 3)}) == 10 - 2 + 1
    assert Words({}).at({}) == 0


def test_blocks_of_letters_multiply_as_matrices() -> None:
    A, B, P = letters("A", "B", "P", symmetric=("P",))
    zero, same = A * 0, IDENTITY
    M = blocks([[A, B], [zero, same]])
    decide(identical(M.T, blocks([[A.T, zero], [B.T, same]]), "the transpose"))
    decide(identical(M @ M, blocks([[A @ A, A @ B + B], [zero, same]]), "the square"))
    decide(identical((M.T @ blocks([[P, zero], [zero, P]]) @ M).T, M.T @ blocks([[P, zero], [zero, P]]) @ M, "a form"))
    assert not (A @ B - B @ A).is_zero()
