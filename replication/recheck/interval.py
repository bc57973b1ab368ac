"""Intervals with dyadic ends that are rounded outwards; roots, logarithms and exponentials enclosed in them.

An interval holds two integers and stands for all numbers from low/2^BITS to high/2^BITS. A comparison is true only
if it holds for all numbers of both intervals.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache, lru_cache
from math import isqrt
from typing import Any

from replication.recheck.exact import plus, scaled, times, unit
from replication.recheck.reading import Matrix, need

BITS = 320
ONE = 1 << BITS


class Interval:
    """A closed interval."""

    __slots__ = ("high", "low")

    def __init__(self, low: int, high: int) -> None:
        self.low, self.high = low, high

    @staticmethod
    def of(value: Any) -> Interval:
        """The number, enclosed; an interval as it is."""
        if isinstance(value, Interval):
            return value
        if isinstance(value, int):
            return Interval(value << BITS, value << BITS)
        top = value.numerator << BITS
        return Interval(top // value.denominator, -(-top // value.denominator))

    @staticmethod
    def between(low: Any, high: Any) -> Interval:
        """All from the least number of one to the largest of the other."""
        return Interval(Interval.of(low).low, Interval.of(high).high)

    def __add__(self, other: Any) -> Any:
        if isinstance(other, Interval):
            return Interval(self.low + other.low, self.high + other.high)
        return self + Interval.of(other) if isinstance(other, int | Fraction) else NotImplemented

    __radd__ = __add__

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Any) -> Any:
        return self + (-other)

    def __rsub__(self, other: Any) -> Any:
        return (-self) + other

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, int):
            ends = (self.low * other, self.high * other)
            return Interval(min(ends), max(ends))
        if not isinstance(other, Interval):
            return self * Interval.of(other) if isinstance(other, Fraction) else NotImplemented
        if other is self:
            ends = (self.low * self.low, self.high * self.high)
            least = 0 if self.low < 0 < self.high else min(ends)
            return Interval(least >> BITS, -(-max(ends) >> BITS))
        all_ = (self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high)
        return Interval(min(all_) >> BITS, -(-max(all_) >> BITS))

    __rmul__ = __mul__

    def inverse(self) -> Interval:
        """One over it; refused if it holds zero."""
        need(not self.low <= 0 <= self.high, "a divisor may be zero")
        return Interval((ONE * ONE) // self.high, -((-ONE * ONE) // self.low))

    def __truediv__(self, other: Any) -> Any:
        return self * (other.inverse() if isinstance(other, Interval) else Fraction(1) / other)

    def __rtruediv__(self, other: Any) -> Any:
        return self.inverse() * other

    def __lt__(self, other: Any) -> bool:
        return self.high < Interval.of(other).low

    def __gt__(self, other: Any) -> bool:
        return self.low > Interval.of(other).high

    def __le__(self, other: Any) -> bool:
        return self.high <= Interval.of(other).low

    def __ge__(self, other: Any) -> bool:
        return self.low >= Interval.of(other).high

    def __eq__(self, other: object) -> bool:
        one = Interval.of(other)
        return self.low == self.high == one.low == one.high

    __hash__ = None  # type: ignore[assignment]

    def __abs__(self) -> Interval:
        if self.low >= 0 or self.high <= 0:
            return self if self.low >= 0 else -self
        return Interval(0, max(-self.low, self.high))

    def weight(self) -> int:
        """How far from zero it surely is."""
        return 0 if self.low <= 0 <= self.high else min(abs(self.low), abs(self.high))

    def ends(self) -> tuple[Fraction, Fraction]:
        """Both ends as rationals."""
        return Fraction(self.low, ONE), Fraction(self.high, ONE)

    def root(self) -> Interval:
        """The square root; refused if it may be of a negative number."""
        need(self.low >= 0, "a root of what may be negative")
        return Interval(isqrt(self.low << BITS), isqrt(self.high << BITS) + 1)

    def widened(self, by: Any) -> Interval:
        """All numbers at most so far away."""
        far = Interval.of(by).high
        return Interval(self.low - far, self.high + far)

    def middle(self) -> Fraction:
        """The number half way between the ends."""
        return Fraction(self.low + self.high, 2 * ONE)


def least(*values: Any) -> Interval:
    """An enclosure of the least of numbers."""
    found = [Interval.of(value) for value in values]
    return Interval(min(one.low for one in found), min(one.high for one in found))


def largest(*values: Any) -> Interval:
    """An enclosure of the largest of numbers."""
    found = [Interval.of(value) for value in values]
    return Interval(max(one.low for one in found), max(one.high for one in found))


def enclosed(matrix: Matrix) -> Matrix:
    """A matrix of intervals."""
    return [[Interval.of(entry) for entry in row] for row in matrix]


def norm_above(matrix: Matrix) -> Fraction:
    """At least the largest sum of moduli in a row."""
    return max(sum((abs(Interval.of(entry)) for entry in row), Interval(0, 0)).ends()[1] for row in matrix)


def exponential(matrix: Matrix) -> Matrix:
    """exp of a square matrix of rationals or intervals: Taylor's sum of the halved matrix, squared as often."""
    norm, halvings = norm_above(matrix), 4
    while norm * 16 > 1 << halvings:
        halvings += 1
    small = enclosed(scaled(Fraction(1, 1 << halvings), matrix))
    size = len(small)
    total = term = enclosed(unit(size))
    order, left = 0, Fraction(1)  # left: at least |small|^order/order!
    while left * ONE > 2:
        order += 1
        left = Interval.of(left * norm / (order << halvings)).ends()[1]
        term = scaled(Fraction(1, order), times(term, small))
        total = plus(total, term)
    # The terms that are left out are below left/16 + left/256 + .. in norm.
    total = [[entry.widened(left) for entry in row] for row in total]
    for _ in range(halvings):
        total = times(total, total)
    return total


def logarithm(value: Any) -> Interval:
    """The natural logarithm of a positive interval, by its ends."""
    low, high = Interval.of(value).ends()
    need(low > 0, "a logarithm of what may not be positive")
    return Interval.between(_logarithm(low), _logarithm(high))


def _logarithm(value: Fraction) -> Interval:
    halvings = value.numerator.bit_length() - value.denominator.bit_length()
    reduced = value / Fraction(2) ** halvings
    answer: Interval = _artanh2((reduced - 1) / (reduced + 1)) + _artanh2(Fraction(1, 3)) * halvings
    return answer


def _artanh2(value: Fraction) -> Interval:
    """2 artanh of a number of at most a third: log((1 + value)/(1 - value))."""
    point = Interval.of(value)
    square = point * point
    term, total = point, Interval(0, 0)
    for order in range(1, 2 * BITS, 2):
        total = total + term * Fraction(2, order)
        term = term * square
    # What is left is below 2 |term|/(1 - 1/9).
    return total.widened(abs(term) * 3)


@cache
def pi() -> Interval:
    """Machin's formula: 16 arctan(1/5) - 4 arctan(1/239)."""

    def arctan(over: int) -> Interval:
        total, order = Interval(0, 0), 1
        while over**order < ONE:
            total = total + Interval.of(Fraction((-1) ** (order // 2), order * over**order))
            order += 2
        answer: Interval = total.widened(Fraction(1, ONE))
        return answer

    machin: Interval = arctan(5) * 16 - arctan(239) * 4
    return machin


@lru_cache(maxsize=1000)
def wave(angle: Fraction) -> tuple[Interval, Interval]:
    """Cosine and sine."""
    found = exponential([[Fraction(0), -angle], [angle, Fraction(0)]])
    return found[0][0], found[1][0]
