"""Roots of polynomials, told from each other."""

import pytest
from flint import acb, acb_poly, arb, fmpq_poly

from replication.verify.algebra import linear as roots
from replication.verify.theorem import Refused


def test_roots_come_with_their_multiplicity() -> None:
    found = roots.roots(fmpq_poly([1, 2, 2, 2, 1]))  # (z + 1)^2 (z^2 + 1)
    assert len(found) == 4
    for root, count in ((acb(-1), 2), (acb(0, 1), 1), (acb(0, -1), 1)):
        assert sum(ball.contains(root) for ball in found) == count


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
