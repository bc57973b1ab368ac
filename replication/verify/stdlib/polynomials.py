"""Polynomials with rational coefficients: in one variable with their roots enclosed, and in several."""

from __future__ import annotations

import cmath
from collections.abc import Iterable, Sequence
from typing import Any

from replication.verify.stdlib.balls import acb, arb
from replication.verify.stdlib.rationals import fmpq
from replication.verify.theorem import Refused

STEPS = 400
"""Of the search for roots in floats."""
FINE = 60
"""Of the same in middles of balls, which ends as soon as nothing moves any more."""
NEAR = fmpq(1, 2**200)


class Polynomial:
    """A polynomial in one variable by its coefficients, lowest first, the last of which is not exactly zero."""

    __slots__ = ("terms",)
    field: Any = fmpq

    def __init__(self, coefficients: Iterable[Any] = ()) -> None:
        self.terms = [c if isinstance(c, self.field) else self.field(c) for c in coefficients]
        while self.terms and self.terms[-1] == 0:
            self.terms.pop()

    def coeffs(self) -> list[Any]:
        """The coefficients, lowest first; none of the zero polynomial."""
        return [*self.terms]

    def degree(self) -> int:
        """The degree; -1 of the zero polynomial."""
        return len(self.terms) - 1

    def derivative(self) -> Any:
        """The derivative."""
        return type(self)([c * k for k, c in enumerate(self.terms)][1:])

    def __call__(self, point: Any) -> Any:
        """Its value, by Horner's scheme."""
        total = point * 0
        for c in reversed(self.terms):
            total = total * point + c
        return total

    def _other(self, other: Any) -> list[Any]:
        return other.terms if isinstance(other, Polynomial) else [self.field(other)]

    def __add__(self, other: Any) -> Any:
        a, b = self.terms, self._other(other)
        zeros = [self.field(0)] * abs(len(a) - len(b))
        long, short = (a, b) if len(a) > len(b) else (b, a)
        return type(self)([x + y for x, y in zip(long, [*short, *zeros], strict=True)])

    def __neg__(self) -> Any:
        return type(self)([-c for c in self.terms])

    def __sub__(self, other: Any) -> Any:
        return self + -type(self)(self._other(other))

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, (Polynomial, fmpq, int, arb, acb)):
            return NotImplemented
        b = self._other(other)
        made = [self.field(0)] * (len(self.terms) + len(b))
        for i, x in enumerate(self.terms):
            for j, y in enumerate(b):
                made[i + j] = made[i + j] + x * y
        return type(self)(made)

    __radd__, __rmul__ = __add__, __mul__

    def __pow__(self, power: int) -> Any:
        made = type(self)([1])
        for _ in range(power):
            made = made * self
        return made

    def __eq__(self, other: object) -> bool:
        return self.terms == type(self)(self._other(other)).terms

    __hash__ = None  # type: ignore[assignment]


class fmpq_poly(Polynomial):
    """A polynomial with rational coefficients."""

    __slots__ = ()

    def divided(self, other: fmpq_poly) -> tuple[fmpq_poly, fmpq_poly]:
        """Quotient and remainder."""
        rest, found = [*self.terms], []
        for shift in range(len(rest) - len(other.terms), -1, -1):
            factor = rest[shift + other.degree()] / other.terms[-1]
            found.append(factor)
            for i, c in enumerate(other.terms):
                rest[shift + i] = rest[shift + i] - factor * c
        return fmpq_poly(found[::-1]), fmpq_poly(rest)

    def common(self, other: fmpq_poly) -> fmpq_poly:
        """The greatest common divisor, with the leading coefficient one (Euclid)."""
        a, b = self, other
        while b.terms:
            a, b = b, a.divided(b)[1]
        return fmpq_poly([c / a.terms[-1] for c in a.terms])

    def complex_roots(self) -> list[tuple[acb, int]]:
        """Enclosures of all roots, apart from each other, with their multiplicities: real ones first, rising.

        The factors of the multiplicities 1, 2, .. are common divisors of the polynomial and its derivatives (Yun).
        """
        found, multiplicity = [], 0
        whole = self.common(self.derivative()) if self.degree() > 0 else self
        left = self.divided(whole)[0]
        while left.degree() > 0:
            multiplicity += 1
            common = left.common(whole)
            found += [(root, multiplicity) for root in _simple_roots(left.divided(common)[0])]
            left, whole = common, whole.divided(common)[0]
        _require_apart([root for root, _ in found])
        return sorted(found, key=lambda each: _place(each[0]))


def _place(root: acb) -> tuple[bool, float, float]:
    return root.imag != 0, float(root.real), -float(root.imag)


def _require_apart(discs: Sequence[acb]) -> None:
    for i, one in enumerate(discs):
        for other in discs[:i]:
            if (one.real - other.real).contains(0) and (one.imag - other.imag).contains(0):
                raise Refused("the roots of a polynomial are not told apart")


def _simple_roots(polynomial: fmpq_poly) -> list[acb]:
    """Enclosures of the roots of a polynomial that has no root twice.

    Around each point near a root there is one within n |p/p'|. As many such regions, apart from each other, as there
    are roots hold one each; so one that meets its mirror image holds a real root.
    """
    n = polynomial.degree()
    if n < 1:
        return []
    monic = fmpq_poly([c / polynomial.terms[-1] for c in polynomial.terms])
    slope, found = monic.derivative(), []
    try:
        guesses = _guesses([float(c) for c in monic.terms])
    except (OverflowError, ZeroDivisionError):
        raise Refused("the roots of a polynomial are beyond the range of floats") from None
    for z in _refined(monic, guesses):
        rate = slope(z)
        if rate.contains(0):
            raise Refused("the roots of a polynomial are not told apart")
        far = (abs(monic(z) / rate) * n).upper()
        real = abs(z.imag) <= far
        found.append(acb(arb(z.real, far + abs(z.imag)), arb(0)) if real else acb(arb(z.real, far), arb(z.imag, far)))
    _require_apart(found)
    return found


def _refined(monic: fmpq_poly, guesses: Sequence[complex]) -> list[acb]:
    """The same iteration in middles of balls, until nothing moves; nothing is proved."""
    roots = [acb(arb.of_float(z.real), arb.of_float(z.imag)) for z in guesses]
    for _ in range(FINE):
        moved = False
        for i, z in enumerate(roots):
            apart = acb(1)
            for j, other in enumerate(roots):
                apart = apart * (z - other).mid() if j != i else apart
            if not apart.contains(0):
                step = (monic(z) / apart).mid()
                roots[i] = (z - step).mid()
                moved = moved or not abs(step) <= NEAR
        if not moved:
            break
    return roots


def _guesses(coefficients: Sequence[float]) -> list[complex]:
    """Approximations of all roots of a monic polynomial, by the iteration of Durand and Kerner; nothing is proved."""
    n = len(coefficients) - 1
    radius = max((2 * abs(c) ** (1 / (n - k)) for k, c in enumerate(coefficients[:-1])), default=1.0) or 1.0
    roots = [cmath.rect(radius / 2, 2 * cmath.pi * k / n + 0.4) for k in range(n)]
    for _ in range(STEPS):
        moved = 0.0
        for i, z in enumerate(roots):
            value, apart = 0j, 1 + 0j
            for c in reversed(coefficients):
                value = value * z + c
            for j, other in enumerate(roots):
                if j != i:
                    apart *= (z - other) or 1e-300
            roots[i] = z - value / apart
            moved = max(moved, abs(value / apart))
        if moved <= 1e-15 * radius:
            break
    return roots


class Ordering:
    """How the terms of a polynomial are ordered, of which nothing here depends."""

    degrevlex = "degrevlex"


class fmpq_mpoly_ctx:
    """The polynomials in some variables."""

    def __init__(self, names: Sequence[str]) -> None:
        self.names = tuple(names)

    @classmethod
    def get(cls, names: Sequence[str], _: Any = None) -> fmpq_mpoly_ctx:
        """Those in the variables of these names."""
        return cls(names)

    def constant(self, value: Any) -> Several:
        """A polynomial without variables."""
        return Several({0: value})

    def gens(self) -> list[Several]:
        """The variables."""
        return [Several({1 << SHIFT * i: 1}) for i in range(len(self.names))]


SHIFT = 16
"""Bits of one exponent: a product adds whole words of exponents, in which none may reach the next."""


class Several:
    """A polynomial in several variables: coefficients by words of exponents, none of which is zero."""

    __slots__ = ("terms",)

    def __init__(self, terms: dict[int, Any]) -> None:
        self.terms = {word: c for word, c in terms.items() if c != 0}

    def _other(self, other: Any) -> dict[int, Any] | None:
        if isinstance(other, Several):
            return other.terms
        return {0: other} if isinstance(other, (int, fmpq)) else None

    def __add__(self, other: Any) -> Any:
        b = self._other(other)
        if b is None:
            return NotImplemented
        total = dict(self.terms)
        for word, c in b.items():
            total[word] = total.get(word, 0) + c
        return Several(total)

    def __neg__(self) -> Several:
        return Several({word: -c for word, c in self.terms.items()})

    def __sub__(self, other: Any) -> Any:
        return self + other * -1

    def __rsub__(self, other: Any) -> Any:
        return self * -1 + other

    def __mul__(self, other: Any) -> Any:
        b = self._other(other)
        if b is None:
            return NotImplemented
        total: dict[int, Any] = {}
        for word, c in self.terms.items():
            for more, d in b.items():
                total[word + more] = total.get(word + more, 0) + c * d
        return Several(total)

    __radd__, __rmul__ = __add__, __mul__

    def __truediv__(self, other: Any) -> Any:
        return self * (fmpq(1) / other)

    def __eq__(self, other: object) -> bool:
        return bool((self - other).is_zero())

    __hash__ = None  # type: ignore[assignment]

    def is_zero(self) -> bool:
        """Whether there is no term."""
        return not self.terms

    def derivative(self, i: int) -> Several:
        """The derivative in the i-th variable."""
        found = {}
        for word, c in self.terms.items():
            power = word >> SHIFT * i & (1 << SHIFT) - 1
            if power:
                found[word - (1 << SHIFT * i)] = c * power
        return Several(found)
