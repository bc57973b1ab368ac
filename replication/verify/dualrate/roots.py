"""Where the roots of an enclosed polynomial lie: certainly inside a circle, or one certainly within a disc."""

from __future__ import annotations

from flint import acb, acb_poly, arb, arb_poly, fmpq

from replication.verify.theorem import Refused, require


def is_less(a: arb | int, b: arb | int) -> bool:
    """Whether every point of the ball a is below every point of the ball b."""
    return bool(a < b)


def require_roots_within(polynomial: arb_poly, radius: fmpq, what: str) -> None:
    """Refuse unless all roots of a monic real polynomial lie inside the circle of this radius: Schur-Cohn in balls.

    With q(z) = p(radius z) and q*(z) = z^n q(1/z), q is Schur iff |q(0)| < |leading coefficient| and
    (leading q − q(0) q*)/z is.
    """
    coefficients = [c * arb(radius) ** k for k, c in enumerate(polynomial.coeffs())]
    while len(coefficients) > 1:
        first, last = coefficients[0], coefficients[-1]
        if not is_less(abs(first), abs(last)):
            raise Refused(f"{what} are not proved to lie inside the circle of radius {radius}")
        turned = coefficients[::-1]
        coefficients = [a - b * first / last for a, b in zip(coefficients[1:], turned[1:], strict=True)]


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
