"""Roots of polynomials: told from each other, inside a circle, or in the left half-plane."""

import numpy as np
import pytest
from flint import acb, acb_poly, arb, arb_poly, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra import roots
from replication.verify.algebra.roots import is_schur, require_hurwitz
from replication.verify.theorem import Refused


@pytest.mark.parametrize(
    ("coefficients", "stable"),
    [
        ([1], True),
        ([-3], True),
        ([1, 2], True),
        ([1, -2], True),
        ([2, 1], False),
        ([1, 1], False),
        ([-1, 1], False),
        ([0, 0, 0, 5], True),
        # z^2 - z + 1/2 has roots of modulus 1/sqrt(2); z^2 - 2 z + 1 a double one; z^2 + 1 a pair on the circle.
        ([1, -2, 2], True),
        ([1, -2, 1], False),
        ([1, 0, 1], False),
        # (z - 1/2)(z - 2) and (z - 1/2)(z - 1/3)(z + 3/4): 24 times.
        ([2, -5, 2], False),
        ([3, -11, -2, 24], True),
        # (z - 1)(z - 1/2)(z + 1/2)
        ([1, -1, -4, 4], False),
    ],
)
def test_schur(coefficients: list[int], stable: bool) -> None:
    assert is_schur(fmpq_poly(coefficients)) is stable


def companion(*coefficients: int) -> fmpq_mat:
    """A matrix with the characteristic polynomial s^n + .. + a_1 s + a_0, given a_0, a_1, .."""
    n = len(coefficients)
    last = [[-entry for entry in coefficients]]
    return fmpq_mat([[int(j == i + 1) for j in range(n)] for i in range(n - 1)] + last)


# s + 1, s^2 + s + 1, (s + 1)^3, s^4 + 2 s^3 + 3 s^2 + 2 s + 1, s^3 + s^2 + 2 s + 1, (s + 1)^5.
@pytest.mark.parametrize("M", [(1,), (1, 1), (1, 3, 3), (1, 2, 3, 2), (1, 2, 1), (1, 5, 10, 10, 5)])
def test_hurwitz(M: tuple[int, ...]) -> None:
    require_hurwitz(companion(*M), "M")


@pytest.mark.parametrize("M", [(0,), (-1,), (1, 0), (0, 1), (-1, 1), (1, 1, 1), (4, 2, 1), (0, 1, 1), (1, 1, 1, 1)])
def test_not_hurwitz(M: tuple[int, ...]) -> None:
    with pytest.raises(Refused, match="M is not Hurwitz"):
        require_hurwitz(companion(*M), "M")


def test_the_zero_polynomial_is_refused() -> None:
    with pytest.raises(Refused, match="zero polynomial"):
        is_schur(fmpq_poly([]))


def test_schur_of_a_high_degree_ends() -> None:
    """Of degree 60: a recursion that multiplies by both ends would double the digits 60 times."""
    inside = fmpq_poly([fmpq(1, 3), *[fmpq(1, 1000 + k) for k in range(59)], 1])
    assert is_schur(inside)
    assert not is_schur(fmpq_poly(inside.coeffs()[::-1]))
    assert is_schur(fmpq_poly([fmpq(1, 2), *[0] * 59, 1]))


def test_roots_come_with_their_multiplicity() -> None:
    found = roots.roots(fmpq_poly([1, 2, 2, 2, 1]))  # (z + 1)^2 (z^2 + 1)
    assert len(found) == 4
    for root, count in ((acb(-1), 2), (acb(0, 1), 1), (acb(0, -1), 1)):
        assert sum(ball.contains(root) for ball in found) == count


@pytest.mark.parametrize("seed", range(20))
def test_roots_within_a_circle_are_told_from_roots_outside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    coefficients = [*rng.integers(-9, 10, size=int(rng.integers(1, 6))).tolist(), 3]
    polynomial, size = arb_poly(coefficients), float(max(abs(np.roots(coefficients[::-1]))))
    roots.require_roots_within(polynomial, fmpq(int(size * 1001) + 1, 1000), "roots")
    with pytest.raises(Refused, match="roots are not proved to lie inside"):
        roots.require_roots_within(polynomial, fmpq(int(size * 999), 1000), "roots")
    with pytest.raises(Refused, match="roots are not proved to lie inside"):
        roots.require_roots_within(arb_poly([-1, 1]), fmpq(1), "roots")


def test_a_root_lies_in_its_disc_and_no_smaller_one_would_do() -> None:
    """Of (z − 1)^n the root is as far from z as the disc reaches."""
    for n in (1, 2, 5):
        polynomial = acb_poly([-1, 1]) ** n
        disc = roots.root_near(polynomial, acb(3, 2))
        assert disc.contains(1)
        assert abs(disc - acb(3, 2)).upper() < 1.5 * arb(8).sqrt()
    with pytest.raises(Refused, match="derivative of the characteristic polynomial may vanish"):
        roots.root_near(acb_poly([1, 0, 1]), acb(0))


def test_a_root_is_divided_out() -> None:
    quotient = roots.without_root(acb_poly([-30, 31, -10, 1]), acb(5))
    assert [int(float(c.real.mid())) for c in quotient.coeffs()] == [6, -5, 1]
