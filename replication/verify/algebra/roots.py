"""Roots of polynomials: enclosed, inside the unit circle, or in the left half-plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import acb, acb_poly, arb, arb_poly, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.linear import characteristic_polynomial
from replication.verify.algebra.work import estimate_length, spend_elimination, spend_on_roots
from replication.verify.theorem import require


def is_schur(polynomial: fmpq_poly) -> bool:
    """Whether all roots of a polynomial of degree n >= 0 are inside the unit circle (exact)."""
    require(polynomial.degree() >= 0, "the zero polynomial has no set of roots")
    spend_on_roots(polynomial)
    return _schur_cohn(polynomial.coeffs())


def require_roots_within(polynomial: arb_poly, radius: fmpq, what: str) -> None:
    """Refuse unless all roots of a monic real polynomial in balls lie inside the circle of this radius."""
    within = _schur_cohn([c * arb(radius) ** k for k, c in enumerate(polynomial.coeffs())])
    require(within, f"{what} are not proved to lie inside the circle of radius {radius}")


def _schur_cohn(coefficients: Sequence[Any]) -> bool:
    """The test of Schur and Cohn, lowest coefficient first, in rationals, or in balls, where a yes is certain.

    With the reversed polynomial p*(z) = z^n p(1/z), p is Schur iff |p(0)| < |leading coefficient| and
    (leading p - p(0) p*) / z is.
    """
    while len(coefficients) > 1:
        first, last = coefficients[0], coefficients[-1]
        if not abs(first) < abs(last):
            return False
        # With the ratio, not with both factors, or the digits of the coefficients would double each time.
        ratio = first / last
        coefficients = [a - ratio * b for a, b in zip(coefficients[1:], coefficients[-2::-1], strict=True)]
    return True


def require_hurwitz(M: fmpq_mat, what: str) -> None:
    """Refuse unless the leading minors of the Hurwitz matrix (a_{n+1−2j+i}), i, j = 1 … n, of a_n s^n + … are positive.

    The matrix of the characteristic polynomial, which has a_n = 1 (Routh and Hurwitz).
    """
    n, coefficients = M.nrows(), characteristic_polynomial(M).coeffs()
    for size in range(1, n + 1):
        spend_elimination(size, size, estimate_length(coefficients), "a Hurwitz determinant")
        rows = [[_at(coefficients, n - 1 - 2 * j + i) for j in range(size)] for i in range(size)]
        require(fmpq_mat(rows).det() > 0, f"{what} is not Hurwitz: its Hurwitz determinant {size} is not positive")


def _at(coefficients: Sequence[fmpq], power: int) -> fmpq:
    return coefficients[power] if 0 <= power < len(coefficients) else fmpq(0)


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
