"""The kernel: to what every theorem comes down, as data, and how each is decided. It knows no family and no paper.

The reduction of a theorem states obligations and hands each over to `decide`, which refuses the certificate unless it
is proved. Numbers and matrices are rational, and then all is exact; or they are balls, and then an obligation is
proved only if it holds for every point of them. `failure` says why it is not proved, and nothing if it is.
"""

from dataclasses import dataclass
from operator import eq, le, lt
from typing import Any

from flint import arb, arb_mat, arb_poly, fmpq, fmpq_mat, fmpq_poly, fmpz_mat

from replication.verify.algebra.linear import characteristic_polynomial
from replication.verify.algebra.work import bits, estimate_length, spend_elimination, spend_on_roots
from replication.verify.theorem import require

ONE = fmpq(1)


@dataclass(frozen=True)
class Compared:
    """A relation of two numbers; of balls, of all their points. what: the reason of a refusal."""

    first: Any
    second: Any
    what: str
    relation = staticmethod(lt)

    def failure(self) -> str:
        """By comparison."""
        return "" if self.relation(self.first, self.second) else self.what


class Below(Compared):
    """first < second."""


class AtMost(Compared):
    """first <= second."""

    relation = staticmethod(le)


class Equal(Compared):
    """Both numbers, polynomials or matrices are the same."""

    relation = staticmethod(eq)


@dataclass(frozen=True)
class Identity:
    """Both sides are the same expression: words, or matrices of words or of polynomials in symbols."""

    left: Any
    right: Any
    what: str

    def failure(self) -> str:
        """By their expanded difference."""
        return "" if (self.left - self.right).is_zero() else f"{self.what} is no identity"


@dataclass(frozen=True)
class Positive:
    """M is symmetric and positive definite; of balls the lower triangle is read."""

    M: fmpq_mat | arb_mat
    what: str

    def failure(self) -> str:
        """By the leading minors of rationals, or the pivots of balls."""
        M = self.M
        return _minors(M, self.what) if isinstance(M, fmpq_mat) else _pivots(M, self.what)


def _minors(M: fmpq_mat, what: str) -> str:
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


def _pivots(M: arb_mat, what: str) -> str:
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
        shares = [row[0] / pivot for row in below]
        rest = [
            [a - share * left[0] for a, left in zip(row[1:], below, strict=False)]
            for row, share in zip(below, shares, strict=True)
        ]
    return ""


@dataclass(frozen=True)
class Nonnegative:
    """M is symmetric and positive semidefinite."""

    M: fmpq_mat
    what: str

    def failure(self) -> str:
        """Its eigenvalues are real, so by Descartes' rule of signs none is negative iff no coefficient of det(z I + M),
        the characteristic polynomial of -M, is negative.
        """
        if self.M.transpose() != self.M:
            return f"{self.what} is not symmetric"
        least = min(characteristic_polynomial(-self.M).coeffs())
        return "" if least >= 0 else f"{self.what} is not positive semidefinite"


@dataclass(frozen=True)
class Hurwitz:
    """All eigenvalues of M have negative real parts."""

    M: fmpq_mat
    what: str

    def failure(self) -> str:
        """The leading minors of the Hurwitz matrix (a_{n−2j+i}), i, j = 1 … n, of the characteristic polynomial
        a_n s^n + … are positive: a_n is 1 (Routh and Hurwitz).
        """
        n, coefficients = self.M.nrows(), characteristic_polynomial(self.M).coeffs()
        zeros = [fmpq(0)] * n
        padded = zeros + coefficients + zeros
        for size in range(1, n + 1):
            spend_elimination(size, size, estimate_length(coefficients), "a Hurwitz determinant")
            rows = [[padded[2 * n - 1 - 2 * j + i] for j in range(size)] for i in range(size)]
            if not fmpq_mat(rows).det() > 0:
                return f"{self.what} is not Hurwitz: its Hurwitz determinant {size} is not positive"
        return ""


@dataclass(frozen=True)
class Within:
    """All roots of a polynomial, or eigenvalues of a matrix, lie inside the circle of this radius about zero.

    A polynomial in balls is monic.
    """

    of: fmpq_poly | arb_poly | fmpq_mat | arb_mat
    what: str
    radius: fmpq = ONE

    def failure(self) -> str:
        """The test of Schur and Cohn for p(radius z), lowest coefficient first.

        With the reversed polynomial p*(z) = z^n p(1/z), all roots of p are inside the unit circle iff |p(0)| <
        |leading coefficient| and those of (leading p - p(0) p*) / z are. The zero polynomial has no set of roots.
        """
        radius: Any = self.radius
        polynomial: Any = characteristic_polynomial(self.of) if isinstance(self.of, fmpq_mat | arb_mat) else self.of
        if isinstance(polynomial, fmpq_poly):
            spend_on_roots(polynomial)
        else:
            radius = arb(radius)
        rest = [c * radius**k for k, c in enumerate(polynomial.coeffs())]
        while rest and abs(rest[0]) < abs(rest[-1]):
            # With the ratio, not with both factors, or the digits of the coefficients would double each time.
            ratio = rest[0] / rest[-1]
            rest = [a - ratio * b for a, b in zip(rest[1:], rest[-2::-1], strict=True)]
        return "" if len(rest) == 1 else f"{self.what} are not proved to lie inside the circle of radius {self.radius}"


Obligation = Compared | Identity | Positive | Nonnegative | Hurwitz | Within


def decide(obligation: Obligation) -> None:
    """Refuse unless the obligation is proved."""
    reason = obligation.failure()
    require(not reason, reason)


def holds(obligation: Obligation) -> bool:
    """Whether the obligation is proved; if not, it may hold all the same."""
    return not obligation.failure()
