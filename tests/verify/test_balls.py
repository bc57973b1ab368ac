"""Balls of the second arithmetic to the last unit: each result holds what it must, and little more.

Of exact ends the result is known exactly, or from python-flint with more bits; comparisons follow from their definition
on all small intervals.
"""

import cmath
import operator
import random
from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import product
from typing import Any

import flint
import pytest

from replication.verify.stdlib import acb, arb, arb_mat, arb_poly, balls, ctx
from replication.verify.stdlib.balls import ONE, ball
from replication.verify.theorem import Refused

Ends = tuple[Fraction, Fraction]
SEEDS = range(4)
FINE = 700
"""Bits of python-flint where it says what is right."""


def ends(value: arb) -> Ends:
    """In units of the last place."""
    return Fraction(value.m - value.r), Fraction(value.m + value.r)


def of(low: Fraction | int, high: Fraction | int) -> arb:
    """The ball between two numbers whose sum and difference, in units, are even."""
    a, b = (int(Fraction(end) * ONE) for end in (low, high))
    return ball((a + b) // 2, (b - a) // 2)


def near(value: arb, exact: Ends, room: Fraction | int) -> None:
    """It holds all between these ends, in units, and at either end no more than so many units beside."""
    low, high = ends(value)
    assert exact[0] - room <= low <= exact[0] and exact[1] <= high <= exact[1] + room, (value, room)


def drawn(seed: int) -> Iterator[tuple[arb, arb]]:
    """Pairs of points and balls with all bits set at random, of which the second does not hold zero."""
    rng = random.Random(seed)
    for _ in range(12):
        radii = [rng.choice([0, 1, 5, rng.getrandbits(100)]) for _ in range(2)]
        middles = [rng.choice([-1, 1]) * rng.getrandbits(rng.randint(230, 262)) for _ in range(2)]
        a, b = (ball(m, r) for m, r in zip(middles, radii, strict=True))
        yield a, b if abs(b.m) > 4 * b.r else b + 1


def of_quotient(a: arb, b: arb) -> Fraction:
    """The radius is that at the end of b next to zero, for both ends."""
    size, e = abs(b.m), abs(a.m) * b.r + abs(b.m) * a.r
    return 4 + Fraction(2 * e * b.r * ONE, size**2 * (size - b.r))


OPERATIONS: dict[str, tuple[Any, Callable[[Any, Any], Any], Callable[[Fraction, Fraction], Fraction]]] = {
    "sum": (0, operator.add, operator.add),
    "difference": (0, operator.sub, operator.sub),
    "product": (3, operator.mul, lambda x, y: x * y / ONE),
    "whole multiple": (0, lambda a, b: a * -7, lambda x, y: -7 * x),
    "quotient": (of_quotient, operator.truediv, lambda x, y: x * ONE / y),
    "larger": (1, lambda a, b: a.max(b), lambda x, y: max(x, y)),
}
"""In how many units the result may be wider than the numbers of both balls make it; the operation; of two numbers."""


@pytest.mark.parametrize("name", OPERATIONS)
@pytest.mark.parametrize("seed", SEEDS)
def test_it_holds_the_results_of_all_ends_and_little_more(name: str, seed: int) -> None:
    room, operation, of_numbers = OPERATIONS[name]
    for a, b in drawn(seed):
        exact = [of_numbers(x, y) for x, y in product(ends(a), ends(b))]
        near(operation(a, b), (min(exact), max(exact)), room(a, b) if callable(room) else room)


def test_whole_numbers_stay_exact() -> None:
    rows = arb_mat([[arb(3), arb(-2)], [arb(0), arb(7)]])
    made = [
        arb(3) ** 0,
        arb(3) * 5,
        arb(3) * arb(5),
        arb(15) / 5,
        arb(3) + 5,
        abs(arb(-3)),
        -arb(3),
        *(rows * rows).entries(),
    ]
    assert [(int(one.m), one.r) for one in made] == [(n * ONE, 0) for n in (1, 15, 15, 3, 8, 3, -3, 9, -20, 0, 49)]


def test_empty_matrices_and_zero_polynomials_have_their_shapes() -> None:
    assert [(M.nrows(), M.ncols()) for M in (arb_mat([]), arb_mat([[1, 2]]), arb_mat(0, 3).transpose())] == [
        (0, 0), (1, 2), (3, 0)
    ]  # fmt: skip
    assert (arb_mat(2, 0) * arb_mat(0, 3)).tolist() == [[0] * 3] * 2
    with pytest.raises(ValueError, match="differ in length"):
        arb_mat([[1], [1, 2]])
    p, zero = arb_poly([1, 2, 3]), arb_poly()
    assert [(a * b).coeffs() for a, b in ((p, zero), (zero, p), (p, 2), (p, p))] == [
        [],
        [],
        [2, 4, 6],
        [1, 4, 10, 12, 9],
    ]


INTERVALS = [(low, high) for low in range(-3, 4) for high in range(low, 4) if (high - low) % 2 == 0]


@pytest.mark.parametrize("name", ["lt", "le", "gt", "ge", "ne"])
def test_a_comparison_is_true_if_it_is_of_all_numbers(name: str) -> None:
    compared = getattr(operator, name)
    for one, other in product(INTERVALS, repeat=2):
        numbers = (range(low, high + 1) for low, high in (one, other))
        assert compared(of(*one), of(*other)) is all(compared(x, y) for x, y in product(*numbers)), (one, other)


def test_what_follows_from_the_ends_of_whole_intervals() -> None:
    for one, other in product(INTERVALS, repeat=2):
        a, b = of(*one), of(*other)
        inside = range(one[0], one[1] + 1)
        near(abs(a), (min(map(abs, inside)) * Fraction(ONE), max(map(abs, inside)) * Fraction(ONE)), 0)
        near(a.union(b), (min(one[0], other[0]) * Fraction(ONE), max(one[1], other[1]) * Fraction(ONE)), 0)
        assert (a == b) is (one == other and one[0] == one[1])
        assert [ends(end) for end in (a.lower(), a.mid(), a.upper())] == [
            (end * Fraction(ONE),) * 2 for end in (one[0], Fraction(sum(one), 2), one[1])
        ]
        assert [a.contains(n) for n in range(-4, 5)] == [n in inside for n in range(-4, 5)]
        assert a.is_finite()
        if other[0] <= 0 <= other[1]:
            with pytest.raises(Refused):
                a / b
    near(abs(ball(1, 4)), (Fraction(0), Fraction(5)), 1)
    assert ball(0, 0) < ball(1, 0) and ball(1, 0) > ball(0, 0) and not ball(0, 1) < ball(1, 0)


def test_a_product_that_is_cut_by_the_least_unit_is_held() -> None:
    """3 times the inverse of 3 modulo 2^256, both exact, is a whole number of units and the least part of one."""
    three, inverse = ball(3, 0), ball(pow(3, -1, ONE), 0)
    exact = (Fraction(3 * inverse.m, ONE),) * 2
    assert 3 * inverse.m % ONE == 1
    for result in (three * inverse, (arb_mat([[three]]) * arb_mat([[inverse]])).tolist()[0][0]):
        near(result, exact, 3)


def test_a_number_is_rounded_outwards_and_a_default_is_zero() -> None:
    for number in (Fraction(1, 3), Fraction(-5, 7), Fraction(3, 8)):
        low, high = ends(arb(number))
        assert number * ONE - 2 < low <= number * ONE <= high < number * ONE + 1 + (low == high)
        wide = arb(number, Fraction(1, 3))
        near(wide, tuple(sorted((number + side * Fraction(1, 3)) * ONE for side in (-1, 1))), 3)  # type: ignore[arg-type]
    assert ends(arb()) == ends(acb().real) == ends(acb().imag) == (0, 0)
    for wrong in (("x",), (0, "x")):
        with pytest.raises(TypeError, match="cannot enclose"):
            arb(*wrong)


def right(exact: Any) -> Fraction:
    """The middle of what python-flint says with many bits, in units."""
    return Fraction(str(exact.mid().fmpq())) * ONE


def many_bits(function: Callable[..., Any], *values: Fraction) -> Any:
    with flint.ctx.workprec(FINE):
        return function(*(flint.arb(flint.fmpq(value.numerator, value.denominator)) for value in values))


FUNCTIONS: dict[str, tuple[Callable[[arb], arb], Callable[[Any], Any], list[tuple[Fraction | int, Fraction | int]]]] = {
    "root": (lambda x: x.sqrt(), flint.arb.sqrt, [(0, 0), (0, 2), (2, 2), (Fraction(1, 4), 3), (10**30, 10**31)]),
    "logarithm": (
        lambda x: x.log(),
        flint.arb.log,
        [(1, 1), (2, 2), (1, 3), (Fraction(1, 2**90), 2), (10**6, 10**6 + 2)],
    ),
    "exponential": (
        lambda x: x.exp(),
        flint.arb.exp,
        [(0, 0), (1, 1), (-1, 1), (3, 3), (Fraction(1, 2**200),) * 2, (-40, -40), (-50, 3), (2, Fraction(9, 4))],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_holds_its_values_at_the_ends(name: str) -> None:
    function, exact, intervals = FUNCTIONS[name]
    for low, high in intervals:
        with ctx.workprec(256):
            found = function(of(low, high))
        first, last = (right(many_bits(exact, Fraction(end))) for end in (low, high))
        reached = ends(found)
        assert reached[0] <= first and last <= reached[1], (name, low, high)
        # Rounding costs a part of the largest number, the width of the argument what the slope makes of it.
        room = (2**40 if low == high else 2**256) * (1 + abs(last) / ONE)
        assert reached[0] >= first - room * (1 if low == high else 60) and reached[1] <= last + room * 60


@pytest.mark.parametrize("seed", SEEDS)
def test_an_exponential_of_a_matrix_holds_that_of_points(seed: int) -> None:
    """Rows of very different size, points and ends of balls."""
    rng = random.Random(seed)
    size = 1 + seed % 3
    middles = [[rng.getrandbits(256) * 6 ** (2 * i) for _ in range(size)] for i in range(size)]
    radius = seed % 2 * 2**80
    with ctx.workprec(256):
        found = arb_mat([[ball(m, radius) for m in row] for row in middles]).exp()
    with flint.ctx.workprec(FINE):
        scale = flint.fmpq(1, ONE)
        for side in (-1, 1):
            exact = flint.arb_mat([[flint.arb((m + side * radius) * scale) for m in row] for row in middles]).exp()
            for i, j in product(range(size), repeat=2):
                low, high = ends(found[i, j])
                assert low <= right(exact[i, j]) <= high


@pytest.mark.parametrize(
    "z", [0, 4, -4, 2j, -2j, 3 + 4j, 3 - 4j, -3 + 4j, -3 - 4j, 1e-9 + 1j, -5 + 1e-6j, -5 - 1e-6j, 0.25]
)
def test_a_complex_root_has_its_square_and_no_negative_real_part(z: complex) -> None:
    exact = acb(Fraction(complex(z).real), Fraction(complex(z).imag))
    root = exact.sqrt()
    assert abs(complex(float(root.real), float(root.imag)) - cmath.sqrt(z)) < 1e-12
    difference = root * root - exact
    assert difference.contains(0) and abs(difference) < Fraction(1, 10**20)


@pytest.mark.parametrize("radii", [(0, 0), (2**200, 0), (0, 2**200), (2**190, 2**200)])
def test_complex_balls_hold_what_follows_from_their_corners(radii: tuple[int, int]) -> None:
    rng = random.Random(3)
    a, b = (rng.getrandbits(254) for _ in range(2))
    z, w = acb(ball(a, radii[0]), ball(b, radii[1])), acb(ball(b, 0), ball(a + 1, radii[0]))
    with ctx.workprec(256):
        found = [z * w, z / w, z.exp(), z.sqrt(), acb(z, w.real), z + w, -z]
    with flint.ctx.workprec(FINE):
        unit = flint.fmpq(1, ONE)
        for s, t, u in product((-1, 1), repeat=3):
            x = flint.acb(flint.arb((a + s * radii[0]) * unit), flint.arb((b + t * radii[1]) * unit))
            y = flint.acb(flint.arb(b * unit), flint.arb((a + 1 + u * radii[0]) * unit))
            exact = [x * y, x / y, x.exp(), x.sqrt(), x + flint.acb(0, y.real), x + y, -x]
            for ours, theirs in zip(found, exact, strict=True):
                for part, value in ((ours.real, theirs.real), (ours.imag, theirs.imag)):
                    assert ends(part)[0] <= right(value) <= ends(part)[1]
    assert z == z if radii == (0, 0) else z != z
    assert acb(1, 2) == acb(1, 2) and acb(1, 2) != acb(1, 3) and acb(1, 2) != acb(2, 2) and acb(1) != "1"
    assert acb(0, of(-1, 1)).contains(0) and not acb(0, 1).contains(0) and not acb(1, 0).contains(0)


def test_what_may_be_beyond_the_domain_is_refused() -> None:
    assert ends(ball(5, 5).sqrt())[0] in (-1, 0)
    for refused in (
        lambda: ball(4, 5).sqrt(),
        lambda: ball(5, 5).log(),
        lambda: arb(0).log(),
        lambda: arb(2**900).log(),
        lambda: ball(5, 5) ** 0 / ball(5, 5),
    ):
        with pytest.raises(Refused):
            refused()
    assert balls.LARGEST == 20_000 and arb(20_000).exp() > arb(2) ** 28_853
    with pytest.raises(Refused, match="norm above 20000"):
        arb(20_001).exp()


@pytest.mark.parametrize(
    ("middle", "radius", "digits", "shown"),
    [
        (Fraction(1, 8), 0, 15, "0.125"),
        (Fraction(-1, 8), 0, 2, "[-0.12 +/- 5.00e-3]"),
        (12345678901, 0, 5, "[12346000000 +/- 3.22e+5]"),
        (123456789, 0, 3, "[123000000 +/- 4.57e+5]"),
        (1234567890, 0, 3, "[1.23e+9 +/- 4.57e+6]"),
        (Fraction(1, 2**16), 0, 3, "[0.0000153 +/- 4.13e-8]"),
        (Fraction(1, 2**18), 0, 3, "[3.81e-6 +/- 4.70e-9]"),
        (1000, Fraction(1, 4), 15, "[1000.0 +/- 2.50e-1]"),
        (1000, 3, 15, "[1000 +/- 3.00e+0]"),
        (5, 700, 4, "[5 +/- 7.00e+2]"),
    ],
)
def test_digits_are_those_that_are_right(middle: Any, radius: Any, digits: int, shown: str) -> None:
    assert arb(middle, radius).str(digits) == shown
    assert arb(Fraction(1, 3)).str() == str(arb(Fraction(1, 3))) and "0.333333333333333 +/-" in str(arb(Fraction(1, 3)))
