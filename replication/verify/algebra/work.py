"""The work of a check, estimated from sizes and digits before it is done: few bytes can ask for years of it.

All that this module can do is to refuse: no number of a proof comes from here, so that nothing here need be trusted.

Estimates are in nanoseconds of an ordinary processor, to within a factor of a few; they are the same on any machine, so
that the same certificates are refused everywhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from math import lcm
from typing import TYPE_CHECKING, Any

from replication.verify.theorem import require

if TYPE_CHECKING:  # what a paper wants can be read without it
    from flint import fmpq, fmpq_mat, fmpq_poly

MOST = 12 * 10**9
"""Of one certificate."""
BALL = 200
"""One operation on balls of a few hundred bits."""
STEP = 20_000
"""What goes with every estimate: the matrices are made, looked at and read out."""
PLACE = 10_000
"""One entry, or one object, that is made for itself; it takes memory too."""
_spent: ContextVar[int] = ContextVar("work", default=0)


@contextmanager
def budget() -> Iterator[None]:
    """Within it the estimates add up from zero; raises Refused where they exceed `MOST`."""
    before = _spent.set(0)
    try:
        yield
    finally:
        _spent.reset(before)


def spend(work: int, what: str) -> None:
    """Add an estimate, before the work is done."""
    total = _spent.get() + work + STEP
    require(total <= MOST, f"{what} takes the check beyond {MOST // 10**9} s of work; give fewer or shorter numbers")
    _spent.set(total)


def bits(*matrices: fmpq_mat) -> int:
    """The length of the longest numerator or denominator in these matrices."""
    return max(estimate_length(M.entries()) for M in matrices)


def estimate_length(numbers: Iterable[fmpq]) -> int:
    """The length of the longest numerator or denominator of these numbers: that of all their bits together."""
    together: Any = 1
    for number in numbers:
        top = number.numerator
        together |= number.denominator | (top if top >= 0 else -top)
    return int(together.bit_length())


def multiplying(first: int, second: int) -> int:
    """One product of integers of so many bits: by columns if one is short, by fast transforms if both are long."""
    short, long = sorted((first // 64 + 1, second // 64 + 1))
    return 30 + long * min(short, 40 + 10 * short.bit_length())


def spend_product(A: fmpq_mat, B: fmpq_mat) -> None:
    """Of A B; the entries of a product are also brought to lowest terms."""
    first, second = bits(A), bits(B)
    once = multiplying(first, second)
    spend(A.nrows() * B.ncols() * (A.ncols() * once + 10 * multiplying(first + second, first + second)), "a product")


def spend_elimination(rows: int, columns: int, length: int, what: str) -> None:
    """Of exact elimination, in which entries of so many bits grow with each pivot."""
    order = min(rows, columns)
    grown = order * length // 2 + 1
    spend(rows * columns * order * multiplying(grown, grown), what)


def spend_solution(M: Any, right: Any) -> None:
    """Of a linear equation, in rationals or balls."""
    from flint import fmpq_mat

    order = M.nrows()
    if isinstance(M, fmpq_mat):
        spend_elimination(order, order + right.ncols(), bits(M, right), "a linear equation")
    else:
        spend(order**2 * (order + right.ncols()) * BALL, "a linear equation")


def spend_on_roots(polynomial: fmpq_poly) -> None:
    """Of the roots of a polynomial, or of the test of Schur and Cohn."""
    n, length = polynomial.degree(), estimate_length(polynomial.coeffs())
    spend((n + 1) ** 2 * 10 * multiplying(n * length, n * length), "the roots of a polynomial")


def spend_on_products(degree: int, length: int, what: str) -> None:
    """Of a few products of a polynomial of this degree, with coefficients of so many bits, by short ones."""
    spend(20 * degree * multiplying(length, length), what)


def spend_characteristic(M: fmpq_mat) -> None:
    """Of det(z I − M), modulo as many primes as its coefficients are long."""
    n, length = M.nrows(), bits(M)
    primes = n * length // 60 + 1
    spend(primes * n**3 * 5 + n * multiplying(n * length, n * length) * 10, "a characteristic polynomial")


def limit_denominator(numbers: Iterable[fmpq], digits: int, path: str) -> None:
    """Refuse a matrix whose common denominator is too long: exact arithmetic soon writes all entries over it."""
    common = 1
    for denominator in {int(number.denominator) for number in numbers}:
        common = lcm(common, denominator)
        require(common < 10**digits, f"{path} has a common denominator of more than {digits} digits")
