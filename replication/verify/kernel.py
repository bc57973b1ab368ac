"""The kernel: to what every theorem comes down, as data, and how it is decided. It knows no family and no paper.

The reduction of a theorem states obligations and hands each over to `decide`, which refuses the certificate unless it
is proved. Numbers and matrices are rational, and then all is exact; or they are balls, and then an obligation is
proved only if it holds for every point of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import arb, arb_mat, arb_poly, fmpq, fmpq_mat, fmpq_poly, fmpz_mat

from replication.verify.algebra.linear import characteristic_polynomial
from replication.verify.algebra.symbolic import Symbolic
from replication.verify.algebra.work import bits, estimate_length, spend_elimination, spend_on_roots
from replication.verify.theorem import Refused

Number = fmpq | arb | int


@dataclass(frozen=True)
class Positive:
    """M is symmetric and positive definite; of balls the lower triangle is read."""

    M: fmpq_mat | arb_mat
    what: str


@dataclass(frozen=True)
class Nonnegative:
    """M is symmetric and positive semidefinite."""

    M: fmpq_mat
    what: str


@dataclass(frozen=True)
class Hurwitz:
    """All eigenvalues of M have negative real parts."""

    M: fmpq_mat
    what: str


@dataclass(frozen=True)
class Within:
    """All roots of a polynomial lie inside the circle of this radius about zero; one in balls is monic."""

    polynomial: fmpq_poly | arb_poly
    radius: fmpq
    what: str


@dataclass(frozen=True)
class Below:
    """first < second. what: the reason of a refusal."""

    first: Number
    second: Number
    what: str


@dataclass(frozen=True)
class AtMost:
    """first <= second. what: the reason of a refusal."""

    first: Number
    second: Number
    what: str


@dataclass(frozen=True)
class Equal:
    """Both numbers, polynomials or matrices are the same. what: the reason of a refusal."""

    left: Any
    right: Any
    what: str


@dataclass(frozen=True)
class Identity:
    """Both sides are the same expression, in symbols or in letters that do not commute."""

    left: Symbolic
    right: Symbolic
    what: str


Obligation = Positive | Nonnegative | Hurwitz | Within | Below | AtMost | Equal | Identity


def decide(obligation: Obligation) -> None:
    """Refuse unless the obligation is proved."""
    reason = failure(obligation)
    if reason:
        raise Refused(reason)


def holds(obligation: Obligation) -> bool:
    """Whether the obligation is proved; if not, it may hold all the same."""
    return not failure(obligation)


def failure(obligation: Obligation) -> str:
    """Why an obligation is not proved; nothing if it is."""
    match obligation:
        case Positive(M, what):
            return _not_definite(M, what) if isinstance(M, fmpq_mat) else _pivot_not_positive(M, what)
        case Nonnegative(M, what):
            return _not_semidefinite(M, what)
        case Hurwitz(M, what):
            return _not_hurwitz(M, what)
        case Within(polynomial, radius, what):
            inside = _schur_cohn(_scaled(polynomial, radius))
            return "" if inside else f"{what} are not proved to lie inside the circle of radius {radius}"
        case Below(first, second, what):
            return "" if first < second else what
        case AtMost(first, second, what):
            return "" if first <= second else what
        case Equal(left, right, what):
            return "" if left == right else what
        case Identity(left, right, what):
            return "" if (left - right).vanishes() else f"{what} is no identity"


def _not_definite(M: fmpq_mat, what: str) -> str:
    """Fraction-free elimination M = L D^-1 L' of the matrix without denominators: its pivots are the leading principal
    minors, which are all positive iff M is positive definite (Sylvester). A zero pivot would be permuted away.
    """
    if M.transpose() != M:
        return f"{what} is not symmetric"
    integers, _ = M.numer_denom()
    spend_elimination(M.nrows(), M.nrows(), bits(fmpq_mat(integers)), f"whether {what} is positive definite")
    permutation, _, _, upper = integers.fflu()
    size = M.nrows()
    unpermuted = permutation == fmpz_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])
    positive = unpermuted and all(upper[k, k] > 0 for k in range(size))
    return "" if positive else f"{what} is not positive definite"


def _pivot_not_positive(M: arb_mat, what: str) -> str:
    """The pivots of L D L' are certainly positive. One whose ball holds zero proves nothing."""
    size = M.nrows()
    if size != M.ncols():
        return f"{what} is not square"
    rest = [[M[i, j] for j in range(i + 1)] for i in range(size)]
    for k in range(size):
        pivot = rest[0][0]
        if not pivot > 0:
            return f"{what} is not proved positive definite: pivot {k} is {pivot.str(5)}"
        below = rest[1:]
        # Row i of the lower triangle has i + 1 entries: the rows beyond it are left out.
        rest = [[a - row[0] / pivot * left[0] for a, left in zip(row[1:], below, strict=False)] for row in below]
    return ""


def _not_semidefinite(M: fmpq_mat, what: str) -> str:
    """The eigenvalues of a symmetric matrix are real, so by Descartes' rule of signs none is negative iff no
    coefficient of det(z I + M), the characteristic polynomial of -M, is negative.
    """
    if M.transpose() != M:
        return f"{what} is not symmetric"
    return "" if min(characteristic_polynomial(-M).coeffs()) >= 0 else f"{what} is not positive semidefinite"


def _not_hurwitz(M: fmpq_mat, what: str) -> str:
    """The leading minors of the Hurwitz matrix (a_{n+1−2j+i}), i, j = 1 … n, of the characteristic polynomial
    a_n s^n + … are positive: a_n is 1 (Routh and Hurwitz).
    """
    n, coefficients = M.nrows(), characteristic_polynomial(M).coeffs()
    for size in range(1, n + 1):
        spend_elimination(size, size, estimate_length(coefficients), "a Hurwitz determinant")
        rows = [[_at(coefficients, n - 1 - 2 * j + i) for j in range(size)] for i in range(size)]
        if not fmpq_mat(rows).det() > 0:
            return f"{what} is not Hurwitz: its Hurwitz determinant {size} is not positive"
    return ""


def _at(coefficients: Sequence[fmpq], power: int) -> fmpq:
    return coefficients[power] if 0 <= power < len(coefficients) else fmpq(0)


def _scaled(polynomial: fmpq_poly | arb_poly, radius: fmpq) -> list[Any]:
    """The coefficients of p(radius z), lowest first."""
    if isinstance(polynomial, fmpq_poly):
        spend_on_roots(polynomial)
        return [c * radius**k for k, c in enumerate(polynomial.coeffs())]
    return [c * arb(radius) ** k for k, c in enumerate(polynomial.coeffs())]


def _schur_cohn(coefficients: Sequence[Any]) -> bool:
    """The test of Schur and Cohn: with the reversed polynomial p*(z) = z^n p(1/z), all roots of p are inside the unit
    circle iff |p(0)| < |leading coefficient| and those of (leading p - p(0) p*) / z are. The zero polynomial has none.
    """
    while len(coefficients) > 1:
        first, last = coefficients[0], coefficients[-1]
        if not abs(first) < abs(last):
            return False
        # With the ratio, not with both factors, or the digits of the coefficients would double each time.
        ratio = first / last
        coefficients = [a - ratio * b for a, b in zip(coefficients[1:], coefficients[-2::-1], strict=True)]
    return len(coefficients) == 1
