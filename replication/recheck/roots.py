"""Roots of polynomials in discs that hold exactly one each."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from replication.recheck.exact import Complex
from replication.recheck.interval import Interval
from replication.recheck.reading import need

ROUNDS = 500
PLACES = 1 << 120


def horner(polynomial: Sequence[Any], point: Any) -> Any:
    """The value of a polynomial, coefficients from that of z^0 on."""
    value: Any = Fraction(0)
    for coefficient in reversed(polynomial):
        value = value * point + coefficient
    return value


def slope(polynomial: Sequence[Any]) -> list[Any]:
    """The derivative."""
    return [coefficient * i for i, coefficient in enumerate(polynomial)][1:]


def distance(polynomial: Sequence[Any], point: Complex) -> Interval:
    """How far the nearest root is at most: p'/p is the sum of 1/(z - root), so n |p/p'|."""
    value, change = horner(polynomial, point), horner(slope(polynomial), point)
    degree = len(polynomial) - 1
    answer: Interval = (
        Interval.of(Complex.of(value).size2()) / Interval.of(Complex.of(change).size2())
    ).root() * degree
    return answer


def roots(polynomial: Sequence[Fraction]) -> list[tuple[Complex, Fraction]]:
    """A centre and a radius for each root; the discs are disjoint. A real centre has a real root."""
    degree = len(polynomial) - 1
    scaled = [complex(float(coefficient / polynomial[-1])) for coefficient in polynomial]
    found = [complex(0.4, 0.9) ** k * (1 + max(map(abs, scaled))) ** (1 / degree) for k in range(degree)]
    for _ in range(ROUNDS):
        for i, one in enumerate(found):
            apart = complex(1)
            for j, other in enumerate(found):
                apart *= one - other if i != j else 1
            found[i] = one - horner(scaled, one) / apart if apart else one + 1e-9
    discs = [_refined(polynomial, one) for one in found]
    for i, (centre, radius) in enumerate(discs):
        for other, beside in discs[:i]:
            need((centre - other).size2() > (radius + beside) ** 2, "roots are too close to tell apart")
    return discs


def _refined(polynomial: Sequence[Fraction], start: complex) -> tuple[Complex, Fraction]:
    real = abs(start.imag) < 1e-9 * max(1, abs(start))
    point = Complex(Fraction(start.real), Fraction(0) if real else Fraction(start.imag))
    for _ in range(5):
        change = Complex.of(horner(slope(polynomial), point))
        need(change.size2() != 0, "a root is not simple")
        step = Complex.of(horner(polynomial, point)) * (1 / change)
        point = Complex(*(Fraction(round(part * PLACES), PLACES) for part in ((point - step).re, (point - step).im)))
    return point, distance(polynomial, point).ends()[1]
