"""Intervals against exact fractions: every operation holds all that it should, and nothing beyond its last place.

The class goes by its module, so that a fault seeded there is met here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import product
from math import ceil, floor
from operator import add, ge, gt, le, lt, mul, sub
from typing import Any

import numpy as np
import pytest

from replication.recheck import interval
from replication.recheck.interval import ONE
from replication.recheck.reading import Unproved

Ends = tuple[Fraction, Fraction]
UNIT = Fraction(1, ONE)


def drawn(rng: np.random.Generator, number: int = 40) -> Iterator[interval.Interval]:
    """Intervals of either sign, about zero, with zero at an end, one number wide, and some last places wide."""
    for _ in range(number):
        first, second = sorted(int(i) for i in rng.integers(-9, 10, 2))
        # Ends that are no round numbers.
        shift = [int(i) for i in rng.integers(0, 1 << 60, 2)]
        yield interval.Interval((first << 320) // 7 - shift[0], -(-(second << 320) // 7) + shift[1])
        yield interval.Interval.of(Fraction(first, 7))
        yield interval.Interval.between(first, second)
        yield interval.Interval(first, second)


@pytest.mark.parametrize("operation", [add, sub, mul])
def test_sums_differences_and_products_end_at_the_nearest_places_outside(operation: Callable[[Any, Any], Any]) -> None:
    rng = np.random.default_rng(1)
    for one, other in zip(drawn(rng), drawn(rng), strict=True):
        wanted = [operation(a, b) for a, b in product(one.ends(), other.ends())]
        found = operation(one, other)
        assert (found.low, found.high) == (floor(min(wanted) * ONE), ceil(max(wanted) * ONE))
        for number in (int(rng.integers(-5, 6)), Fraction(int(rng.integers(-9, 10)), 7)):
            held = interval.Interval.of(number)
            for found, wanted in (
                (operation(one, number), [operation(a, b) for a, b in product(one.ends(), held.ends())]),
                (operation(number, one), [operation(b, a) for a, b in product(one.ends(), held.ends())]),
            ):
                assert (found.low, found.high) == (floor(min(wanted) * ONE), ceil(max(wanted) * ONE))


def test_a_square_is_not_negative() -> None:
    for one in drawn(np.random.default_rng(2)):
        low, high = one.ends()
        least = Fraction(0) if low <= 0 <= high else min(low * low, high * high)
        found = one * one
        assert (found.low, found.high) == (floor(least * ONE), ceil(max(low * low, high * high) * ONE))


def test_quotients_hold_those_of_the_ends_and_none_by_what_may_be_zero() -> None:
    rng = np.random.default_rng(3)
    for one, other in zip(drawn(rng), drawn(rng), strict=True):
        if other.low <= 0 <= other.high:
            with pytest.raises(Unproved, match="a divisor may be zero"):
                other.inverse()
            continue
        low, high = other.ends()
        found = other.inverse()
        assert (found.low, found.high) == (floor(ONE / high), ceil(ONE / low))
        wanted = [a / b for a, b in product(one.ends(), other.ends())]
        # Once rounded as an inverse, then as a product.
        slack = 4 * UNIT * (1 + max(map(abs, one.ends()))) * (1 + 1 / min(map(abs, other.ends())))
        assert within(one / other, ends_of(wanted), slack)
        for number in (3, Fraction(-2, 7)):
            assert within(number / other, ends_of([number / low, number / high]), slack)
            quotients = [end / number for end in one.ends()]
            assert within(one / number, ends_of(quotients), slack)
    near = interval.Interval(1, 1).inverse()
    assert near.low == near.high == ONE * ONE


def ends_of(values: list[Fraction]) -> Ends:
    return min(values), max(values)


def within(found: interval.Interval, wanted: Ends, slack: Fraction) -> bool:
    """Whether it holds all that is wanted and at most the slack beyond."""
    (low, high), (least, most) = found.ends(), wanted
    return least - slack <= low <= least and most <= high <= most + slack


@pytest.mark.parametrize("comparison", [lt, gt, le, ge])
def test_a_comparison_holds_where_it_does_for_all_numbers(comparison: Callable[[Any, Any], bool]) -> None:
    values = range(-2, 3)
    pairs = [(a, b) for a, b in product(values, values) if a <= b]
    for (a, b), (c, d) in product(pairs, pairs):
        wanted = all(comparison(x, y) for x, y in product((a, b), (c, d)))
        assert comparison(interval.Interval(a, b), interval.Interval(c, d)) == wanted
        assert comparison(interval.Interval.between(a, b), c) == all(comparison(x, c) for x in (a, b))


def test_equal_are_single_numbers_alone() -> None:
    for (a, b), c in product(product(range(-1, 2), repeat=2), range(-1, 2)):
        if a <= b:
            assert (interval.Interval(a, b) == interval.Interval(c, c)) == (a == b == c)
            assert (interval.Interval(c, c) == interval.Interval(a, b)) == (a == b == c)
            assert (interval.Interval.between(a, b) == c) == (a == b == c)


def test_moduli_weights_and_middles() -> None:
    small = [interval.Interval(a, b) for a, b in product(range(-3, 4), repeat=2) if a <= b]
    for one in (*small, *drawn(np.random.default_rng(4))):
        far = [abs(one.low), abs(one.high)]
        nearest = 0 if one.low <= 0 <= one.high else min(far)
        assert (abs(one).low, abs(one).high) == (nearest, max(far))
        assert one.weight() == nearest
        assert one.middle() == sum(one.ends()) / 2
        wide = one.widened(Fraction(1, 2))
        assert (one.low - wide.low, wide.high - one.high) == (ONE // 2, ONE // 2)


def test_the_least_and_the_largest_of_some() -> None:
    rng = np.random.default_rng(5)
    for one, other, third in zip(drawn(rng), drawn(rng), drawn(rng), strict=True):
        for function, chosen in ((interval.least, min), (interval.largest, max)):
            found = function(one, other, third, Fraction(1, 2))
            half = Fraction(1, 2)
            wanted = [chosen(*ends, half) for ends in zip(one.ends(), other.ends(), third.ends(), strict=True)]
            assert list(found.ends()) == wanted


def test_a_root_holds_those_of_both_ends() -> None:
    for one in drawn(np.random.default_rng(6)):
        if one.low < 0:
            with pytest.raises(Unproved, match="may be negative"):
                one.root()
            continue
        (low, high), (least, most) = one.root().ends(), one.ends()
        assert low >= 0 and low * low <= least < (low + UNIT) ** 2
        assert (high - UNIT) ** 2 <= most <= high * high
    assert interval.Interval.of(0).root().low == 0


def test_the_norm_is_that_of_rows_and_exact() -> None:
    assert interval.norm_above([[1, Fraction(-2)], [interval.Interval.between(-4, 3), 1]]) == 5
    assert interval.norm_above([[Fraction(-1, 2), interval.Interval.between(-1, 0)]]) == Fraction(3, 2)


PLACES = Fraction(1, 1 << 290)
"""What an exponential or a logarithm may be wide: a few of the last places are lost."""


def series(x: Fraction, terms: int = 120) -> Ends:
    """e^x by Taylor's sum in fractions, for a number of modulus up to three."""
    total, term = Fraction(0), Fraction(1)
    for order in range(1, terms):
        total, term = total + term, term * x / order
    return total - 2 * abs(term), total + 2 * abs(term)


def holds(found: interval.Interval, wanted: Ends) -> bool:
    """Whether two enclosures of one number meet, and the first is narrow."""
    low, high = found.ends()
    return low <= wanted[1] and wanted[0] <= high and high - low < PLACES


@pytest.mark.parametrize("number", ["0", "1", "-5/2", "1/1000", "2", "1/3", "-16/7"])
def test_exponentials_hold_taylors_sum(number: str) -> None:
    x = Fraction(number)
    ends = series(x)
    assert holds(interval.exponential([[x]])[0][0], ends)
    # [x, 1; 0, x]: e^x beside itself, and of a wide interval all between.
    found = interval.exponential([[x, Fraction(1)], [Fraction(0), x]])
    assert holds(found[0][1], ends) and holds(found[0][0], ends) and found[1][0].ends()[0] <= 0 <= found[1][0].ends()[1]
    wide = interval.exponential([[interval.Interval.between(x, x + 1)]])[0][0]
    assert wide.low <= ends[0] * ONE and wide.high >= series(x + 1)[1] * ONE


def test_exponentials_of_large_numbers_are_products() -> None:
    found, one = interval.exponential([[Fraction(40)]])[0][0], interval.exponential([[Fraction(1)]])[0][0]
    power = Fraction(1)
    for _ in range(40):
        power *= one.ends()[0]
    assert found.ends()[0] / power - 1 < PLACES and power / found.ends()[1] - 1 < PLACES


@pytest.mark.parametrize("number", ["1", "2", "1/2", "3", "1/1000", "1000/3", "99/100", "3/2", "7/10"])
def test_logarithms_are_inverse_to_exponentials(number: str) -> None:
    x = Fraction(number)
    found = interval.logarithm(x)
    low, high = found.ends()
    assert high - low < PLACES
    assert interval.exponential([[low]])[0][0].ends()[0] <= x <= interval.exponential([[high]])[0][0].ends()[1]
    wide = interval.logarithm(interval.Interval.between(x / 2, 2 * x))
    assert wide.low == interval.logarithm(x / 2).low and wide.high == interval.logarithm(2 * x).high


def test_a_logarithm_is_that_of_a_positive_number_and_zero_of_one() -> None:
    assert interval.logarithm(1) == 0
    for low in (0, -1):
        with pytest.raises(Unproved, match="may not be positive"):
            interval.logarithm(interval.Interval.between(low, 1))


def arctangent(x: Fraction) -> Ends:
    """By its series, whose terms alternate and fall."""
    total, order, power = Fraction(0), 0, x
    while abs(power) > UNIT / 1000:
        total, order, power = total + (-1) ** order * power / (2 * order + 1), order + 1, power * x * x
    return total - abs(power), total + abs(power)


def test_pi_is_that_of_another_formula() -> None:
    """Euler's: pi = 20 arctan(1/7) + 8 arctan(3/79)."""
    (a, b), (c, d) = arctangent(Fraction(1, 7)), arctangent(Fraction(3, 79))
    low, high = interval.pi().ends()
    assert low <= 20 * a + 8 * c and 20 * b + 8 * d <= high and high - low < PLACES


@pytest.mark.parametrize("angle", ["0", "1", "-7/3", "22/7"])
def test_cosine_and_sine_lie_on_the_circle_and_double(angle: str) -> None:
    x = Fraction(angle)
    (c, s), (c2, s2) = interval.wave(x), interval.wave(2 * x)
    for one, other in ((c * c + s * s, 1), (c * c - s * s, c2), (c * s * 2, s2)):
        assert within_each_other(one, interval.Interval.of(other))
    assert (c.low > 0) == (abs(x) < Fraction(11, 7)) and (s.low > 0) == (0 < x < 3)


def within_each_other(one: interval.Interval, other: interval.Interval) -> bool:
    """Whether two narrow intervals meet."""
    (a, b), (c, d) = one.ends(), other.ends()
    return a <= d and c <= b and max(b - a, d - c) < PLACES
