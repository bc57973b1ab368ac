"""Roots of polynomials, enclosed."""

from __future__ import annotations

from flint import acb, acb_poly, arb, fmpq_poly

from replication.verify.algebra.work import spend_on_roots
from replication.verify.theorem import require


def roots(polynomial: fmpq_poly) -> list[acb]:
    """Enclosures of all complex roots, each as often as its multiplicity; apart from each other unless equal."""
    spend_on_roots(polynomial)
    found: list[tuple[acb, int]] = polynomial.complex_roots()  # type: ignore[assignment]  # its stubs say otherwise
    return [root for root, multiplicity in found for _ in range(multiplicity)]


def root_near(polynomial: acb_poly, guess: acb) -> acb:
    """A ball that holds a root: one lies within n |p(z)/p'(z)| of z, since p'/p is the sum of 1/(z − root)."""
    slope = polynomial.derivative()(guess)
    require(not slope.contains(0), "the derivative of the characteristic polynomial may vanish at the guessed root")
    distance = (polynomial.degree() * abs(polynomial(guess) / slope)).upper()
    return acb(arb(guess.real, distance), arb(guess.imag, distance))


def without_root(polynomial: acb_poly, root: acb) -> acb_poly:
    """p(z)/(z − root) of a polynomial that has this root, by Horner's scheme."""
    quotient = [acb(0)]
    for coefficient in polynomial.coeffs()[:0:-1]:
        quotient.append(coefficient + quotient[-1] * root)
    return acb_poly(quotient[:0:-1])
