"""Real and complex numbers enclosed: a middle and a radius in multiples of 2^-BITS, rounded outwards.

A comparison is true only if it holds for all numbers of both balls; `==` only if both are the same single number.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from decimal import ROUND_UP, Context, Decimal
from fractions import Fraction
from functools import cache
from math import frexp, isqrt, log
from operator import add, mul
from typing import Any, Self

from replication.verify.theorem import Refused

fmpq = Fraction

BITS = 256
ONE = 1 << BITS
REST = ONE - 1
LARGEST = 20_000
"""Bits of a number before the point; nothing that is asked for is as large."""


class fmpz(int):
    """An integer of the field, which is written as a rational is."""


class Ring:
    """What follows from a sum, a negative and a product, in whatever they are of."""

    __slots__ = ()

    def __radd__(self, other: Any) -> Self:
        return self + other  # type: ignore[no-any-return]

    def __rmul__(self, other: Any) -> Self:
        return self * other  # type: ignore[no-any-return]

    def __sub__(self, other: Any) -> Self:
        return self + -other  # type: ignore[no-any-return]

    def __rsub__(self, other: Any) -> Self:
        return -self + other  # type: ignore[operator, no-any-return]

    def __rtruediv__(self, other: Any) -> Self:
        return type(self)(other) / self  # type: ignore[call-arg, operator, no-any-return]

    def __pow__(self, power: int) -> Self:
        product: Any = self if power else self * 0 + 1  # type: ignore[operator]
        for _ in range(power - 1):
            product = product * self
        return product  # type: ignore[no-any-return]

    __hash__ = None  # type: ignore[assignment]


class _Context:
    """How fine an exponential must be: 2^-(prec + 64)."""

    prec = 53

    @contextmanager
    def workprec(self, bits: int) -> Iterator[None]:
        """Within it exponentials are as fine as that."""
        before, self.prec = self.prec, bits
        try:
            yield
        finally:
            self.prec = before


ctx = _Context()


def _between(low: int, high: int) -> arb:
    middle = (low + high) >> 1
    return ball(middle, high - middle)


def enclosed(value: Any) -> arb | None:
    """The ball of a number; None of what is none."""
    if isinstance(value, arb):
        return value
    if isinstance(value, int):
        return ball(int(value) << BITS, 0)
    if not isinstance(value, fmpq):
        return None
    m, rest = divmod(value.numerator << BITS, value.denominator)
    return ball(m, 1 if rest else 0)


class arb(Ring):
    """A real number, enclosed; of a middle and a radius, all that is so near to the middle."""

    __slots__ = ("m", "r")
    m: int
    r: int

    def __init__(self, middle: Any = 0, radius: Any = 0) -> None:
        value, far = enclosed(middle), enclosed(radius)
        if value is None or far is None:
            raise TypeError(f"cannot enclose {middle!r:.40} and {radius!r:.40}")
        self.m, self.r = value.m, value.r + abs(far.m) + far.r

    def __add__(self, other: Any) -> Any:
        b = other if isinstance(other, arb) else enclosed(other)
        return NotImplemented if b is None else ball(self.m + b.m, self.r + b.r)

    def __sub__(self, other: Any) -> Any:
        b = other if isinstance(other, arb) else enclosed(other)
        return NotImplemented if b is None else ball(self.m - b.m, self.r + b.r)

    def __neg__(self) -> arb:
        return ball(-self.m, self.r)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, int):
            return ball(self.m * other, self.r * abs(other))
        b = other if isinstance(other, arb) else enclosed(other)
        if b is None:
            return NotImplemented
        m, e = self.m * b.m, abs(self.m) * b.r + self.r * (abs(b.m) + b.r)
        # What is cut off is less than one unit of the middle, and of the radius.
        return ball(m >> BITS, (e >> BITS) + 2 if e or m & REST else 0)

    def __truediv__(self, other: Any) -> Any:
        b = enclosed(other)
        if b is None:
            return NotImplemented
        size = abs(b.m)
        if size <= b.r:
            raise Refused("a divisor may be zero")
        # |a'/b' - a/b| <= (|a| s + r |b|)/(|b| (|b| - s)) for a' within r of a, and b' within s of b.
        m, rest = divmod(self.m << BITS, b.m)
        e = size * self.r + abs(self.m) * b.r
        return ball(m, ((e << BITS) // (size * (size - b.r))) + 2 if e or rest else 0)

    def __abs__(self) -> arb:
        low, high = self.m - self.r, self.m + self.r
        return self if low >= 0 else -self if high <= 0 else _between(0, max(-low, high))

    def __lt__(self, other: Any) -> bool:
        return self._before(other) > 0

    def __le__(self, other: Any) -> bool:
        return self._before(other) >= 0

    def __gt__(self, other: Any) -> bool:
        return arb(other)._before(self) > 0

    def __ge__(self, other: Any) -> bool:
        return arb(other)._before(self) >= 0

    def _before(self, other: Any) -> int:
        """How far all of this lies below all of the other."""
        b = enclosed(other)
        if b is None:
            raise TypeError(f"a number is compared with {other!r:.40}")
        return (b.m - b.r) - (self.m + self.r)

    def __eq__(self, other: object) -> bool:
        b = enclosed(other)
        return b is not None and self.r == b.r == 0 and self.m == b.m

    def __ne__(self, other: object) -> bool:
        """Whether no number of one is one of the other."""
        b = enclosed(other)
        return b is None or abs(self.m - b.m) > self.r + b.r

    def contains(self, number: int) -> bool:
        """Whether a whole number is one of these."""
        return abs(self.m - (number << BITS)) <= self.r

    def is_finite(self) -> bool:
        """All are."""
        return True

    def lower(self) -> arb:
        """The lower end."""
        return ball(self.m - self.r, 0)

    def upper(self) -> arb:
        """The upper end."""
        return ball(self.m + self.r, 0)

    def mid(self) -> arb:
        """The middle."""
        return ball(self.m, 0)

    def fmpq(self) -> fmpq:
        """The number, where it is only one."""
        if self.r:
            raise ValueError("a ball of more than one number is no rational")
        return fmpq(self.m, ONE)

    def union(self, other: Any) -> arb:
        """All numbers between those of both."""
        b = arb(other)
        return _between(min(self.m - self.r, b.m - b.r), max(self.m + self.r, b.m + b.r))

    def max(self, other: Any) -> arb:
        """The larger one."""
        b = arb(other)
        return _between(max(self.m - self.r, b.m - b.r), max(self.m + self.r, b.m + b.r))

    def sqrt(self) -> arb:
        """The square root; refused of what may be negative."""
        if self.m < self.r:
            raise Refused("a square root of what may be negative")
        return self.root_of_square()

    def root_of_square(self) -> arb:
        """The square root of what is known not to be negative."""
        return _between(isqrt(max(self.m - self.r, 0) << BITS), isqrt((self.m + self.r) << BITS) + 1)

    def exp(self) -> arb:
        """e to this power."""
        ((m,),), ((r,),) = exponential([[self.m]], [[self.r]])
        return ball(m, r)

    def log(self) -> arb:
        """The natural logarithm; refused of what may not be positive."""
        if self.m <= self.r:
            raise Refused("a logarithm of what may not be positive")
        return _logarithm(self.lower()).union(_logarithm(self.upper()))

    @staticmethod
    @cache
    def pi() -> arb:
        """Machin's formula 16 arctan(1/5) - 4 arctan(1/239); the terms alternate and fall."""

        def arctan(over: int) -> arb:
            total, power, order = arb(0), ONE // over, 1
            while power:
                term = ball((-1) ** (order // 2) * (power // order), 2)
                total, power, order = total + term, power // over**2, order + 2
            return ball(total.m, total.r + 2)

        first, second = arctan(5), arctan(239)
        return ball(16 * first.m - 4 * second.m, 16 * first.r + 4 * second.r)

    def __float__(self) -> float:
        return self.m / ONE

    def str(self, digits: int = 15, radius: bool = True) -> Any:
        """[middle +/- radius], as many digits of the middle as are right to one in the last, and three of the rest."""
        exact = Context(prec=10_000)
        unit, far = exact.divide(Decimal(1), Decimal(ONE)), Decimal(self.r)
        middle = exact.multiply(Decimal(self.m), unit)
        if self.r:
            digits = max(1, min(digits, middle.adjusted() - exact.multiply(far, unit).adjusted() + 1))
        shown = Context(prec=digits).plus(middle)
        left = exact.add(abs(exact.subtract(middle, shown)), exact.multiply(far, unit))
        form = "f" if -6 < shown.adjusted() < digits + 6 else "e"
        if not left:
            return f"{shown.normalize():{form}}"
        return f"[{shown:{form}} +/- {Context(prec=3, rounding=ROUND_UP).plus(left):.2e}]"

    def __str__(self) -> Any:
        return self.str()

    __repr__ = __str__


def ball(m: int, r: int) -> arb:
    """The ball of all numbers from (m - r)/2^BITS to (m + r)/2^BITS."""
    instance = arb.__new__(arb)
    instance.m, instance.r = m, r
    return instance


def _logarithm(x: arb) -> arb:
    """With a guess y and t = x e^-y - 1, |t| <= 1/2: log x = y + log(1 + t), and |log(1 + t)| <= 2 |t|."""
    mantissa, exponent = frexp(x.m / ONE) if x.m < ONE << 900 else (0.5, x.m.bit_length() - BITS)
    y = last = arb(Fraction(log(mantissa) + exponent * log(2))).mid()
    for _ in range(6):
        t = x * (-y).exp() - 1
        if abs(t) < fmpq(1, 2):
            y, last = (y + t - t * t / 2).mid(), y
    t = x * (-last).exp() - 1
    if not abs(t) <= fmpq(1, 2):
        raise Refused("a logarithm is not enclosed")
    return arb(last, (abs(t) * 2).upper())


Table = list[list[int]]


def exponential(m: Table, r: Table) -> tuple[Table, Table]:
    """exp of a square matrix of balls: Taylor's sum for the matrix over 2^k, of norm below 2^-8, squared k times."""
    size = len(m)
    norm = max((sum(abs(a) + b for a, b in zip(*rows, strict=True)) for rows in zip(m, r, strict=True)), default=0)
    halvings = max(0, (norm << 8 >> BITS).bit_length())
    if norm >> BITS > LARGEST:
        raise Refused(f"the exponential of a matrix of norm above {LARGEST} is not enclosed")
    m = [[a >> halvings for a in row] for row in m]
    r = [[(b >> halvings) + 2 if b or halvings else 0 for b in row] for row in r]
    norm = (norm >> halvings) + 3 * size + 1
    total, error = [[ONE * (i == j) for j in range(size)] for i in range(size)], [[0] * size for _ in range(size)]
    term, fuzzy, left, order, fine = total, error, ONE, 0, max(1, ONE >> ctx.prec + 64 + halvings)
    while left > fine:
        order += 1
        term, fuzzy = times(term, fuzzy, m, r)
        term = [[a // order for a in row] for row in term]
        fuzzy = [[b // order + 2 for b in row] for row in fuzzy]
        total = [[a + b for a, b in zip(*rows, strict=True)] for rows in zip(total, term, strict=True)]
        error = [[a + b for a, b in zip(*rows, strict=True)] for rows in zip(error, fuzzy, strict=True)]
        left = (left * norm >> BITS) // order + 1
    # left is at least the norm of the last term, and every later one is below half of the one before it.
    error = [[b + left for b in row] for row in error]
    for _ in range(halvings):
        total, error = times(total, error, total, error)
    return total, error


def times(m: Table, r: Table, other: Table, far: Table) -> tuple[Table, Table]:
    """The product of two matrices of balls, by their middles and radii."""
    middles = list(zip(*other, strict=True))
    radii = [(*s, *map(add, map(abs, b), s)) for b, s in zip(middles, zip(*far, strict=True), strict=True)]
    rows, errors = [], []
    for a, b in zip(m, r, strict=True):
        both = (*map(abs, a), *b)
        row, error = [], []
        for column, around in zip(middles, radii, strict=True):
            total, e = sum(map(mul, a, column)), sum(map(mul, both, around))
            row.append(total >> BITS)
            error.append((e >> BITS) + 2 if e or total & REST else 0)
        rows.append(row)
        errors.append(error)
    return rows, errors


class acb(Ring):
    """A complex number, enclosed by its real and its imaginary part."""

    __slots__ = ("imag", "real")
    real: arb
    imag: arb

    def __init__(self, real: Any = 0, imag: Any = 0) -> None:
        if isinstance(real, acb):
            real, imag = real.real, real.imag + imag
        self.real, self.imag = arb(real), arb(imag)

    @staticmethod
    def of(value: Any) -> acb | None:
        """The complex number; None of what is none."""
        return value if isinstance(value, acb) else acb(value) if enclosed(value) is not None else None

    def __add__(self, other: Any) -> Any:
        b = acb.of(other)
        return NotImplemented if b is None else acb(self.real + b.real, self.imag + b.imag)

    def __neg__(self) -> acb:
        return acb(-self.real, -self.imag)

    def __mul__(self, other: Any) -> Any:
        b = acb.of(other)
        if b is None:
            return NotImplemented
        return acb(self.real * b.real - self.imag * b.imag, self.real * b.imag + self.imag * b.real)

    def __truediv__(self, other: Any) -> Any:
        b = acb.of(other)
        if b is None:
            return NotImplemented
        size, c = b.real * b.real + b.imag * b.imag, self * acb(b.real, -b.imag)
        return acb(c.real / size, c.imag / size)

    def __abs__(self) -> arb:
        square: arb = self.real * self.real + self.imag * self.imag
        return square.root_of_square()

    def __eq__(self, other: object) -> bool:
        b = acb.of(other)
        return b is not None and self.real == b.real and self.imag == b.imag

    def contains(self, number: int) -> bool:
        """Whether a whole number is one of these."""
        return self.real.contains(number) and self.imag.contains(0)

    def mid(self) -> acb:
        """The middle."""
        return acb(self.real.mid(), self.imag.mid())

    def exp(self) -> acb:
        """e to this power: a column of the exponential of [a, -b; b, a]."""
        a, b = self.real, self.imag
        m, r = exponential([[a.m, -b.m], [b.m, a.m]], [[a.r, b.r], [b.r, a.r]])
        return acb(ball(m[0][0], r[0][0]), ball(m[1][0], r[1][0]))

    def sqrt(self) -> acb:
        """The square root with a real part of zero or more: a half of (|z| + a, b/root) with root = (2|z| + 2a)^1/2."""
        if self.imag == 0 and self.real <= 0:
            return acb(0, (-self.real).sqrt())
        root = ((abs(self) + self.real) * 2).sqrt()
        return acb(root / 2, self.imag / root)
