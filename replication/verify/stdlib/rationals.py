"""Rational numbers, exact: an integer over another one, in lowest terms."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import total_ordering
from math import gcd, isqrt
from typing import Any


class fmpz(int):
    """An integer."""

    def isqrt(self) -> fmpz:
        """The largest integer whose square is at most this one."""
        return fmpz(isqrt(self))


def parts_of(value: Any) -> tuple[int, int] | None:
    """Numerator and denominator; None of what is no rational number."""
    if isinstance(value, fmpq):
        return value.top, value.low
    return (int(value), 1) if isinstance(value, int) else None


@total_ordering
class fmpq:
    """A rational number in lowest terms, top/low with low > 0."""

    __slots__ = ("low", "top")

    def __init__(self, top: Any = 0, low: Any = 1) -> None:
        if isinstance(top, str):
            exact = Fraction(top)
            top, low = exact.numerator, exact.denominator
        elif isinstance(top, fmpq) or isinstance(low, fmpq):
            quotient = fmpq(1) * top / low
            top, low = quotient.top, quotient.low
        if low == 0:
            raise ZeroDivisionError("a fraction with the denominator zero")
        common = gcd(top, low) if low > 0 else -gcd(top, low)
        self.top, self.low = int(top) // common, int(low) // common

    p = property(lambda self: fmpz(self.top))
    q = property(lambda self: fmpz(self.low))
    numerator, denominator = p, q

    def _with(self, other: Any, made: Callable[[int, int, int, int], tuple[int, int]]) -> Any:
        parts = parts_of(other)
        return NotImplemented if parts is None else fmpq(*made(self.top, self.low, *parts))

    def __add__(self, other: Any) -> Any:
        return self._with(other, lambda a, b, c, d: (a * d + c * b, b * d))

    def __sub__(self, other: Any) -> Any:
        return self._with(other, lambda a, b, c, d: (a * d - c * b, b * d))

    def __rsub__(self, other: Any) -> Any:
        return self._with(other, lambda a, b, c, d: (c * b - a * d, b * d))

    def __mul__(self, other: Any) -> Any:
        return self._with(other, lambda a, b, c, d: (a * c, b * d))

    def __truediv__(self, other: Any) -> Any:
        return self._with(other, lambda a, b, c, d: (a * d, b * c))

    def __rtruediv__(self, other: Any) -> Any:
        return self._with(other, lambda a, b, c, d: (c * b, d * a))

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> fmpq:
        return fmpq(-self.top, self.low)

    def __abs__(self) -> fmpq:
        return fmpq(abs(self.top), self.low)

    def __pow__(self, power: int) -> fmpq:
        return fmpq(self.top**power, self.low**power) if power >= 0 else 1 / self**-power

    def __eq__(self, other: object) -> bool:
        parts = parts_of(other)
        return NotImplemented if parts is None else (self.top, self.low) == parts

    def __lt__(self, other: Any) -> bool:
        parts = parts_of(other)
        return NotImplemented if parts is None else self.top * parts[1] < parts[0] * self.low

    def __hash__(self) -> int:
        return hash(Fraction(self.top, self.low))

    def __bool__(self) -> bool:
        return self.top != 0

    def __float__(self) -> float:
        return self.top / self.low

    def __str__(self) -> str:
        return str(self.top) if self.low == 1 else f"{self.top}/{self.low}"

    __repr__ = __str__

    def floor(self) -> fmpz:
        """The largest integer that is not above it."""
        return fmpz(self.top // self.low)

    def ceil(self) -> fmpz:
        """The smallest integer that is not below it."""
        return fmpz(-(-self.top // self.low))

    def height_bits(self) -> int:
        """The length of the longer of numerator and denominator."""
        return max(self.top.bit_length(), self.low.bit_length())
