"""The kernel: to what every theorem comes down, and how each of these obligations is decided. It knows no family.

The reduction of a theorem states obligations, each by a function below, and hands them to `decide`, which refuses the
certificate unless they are proved: a function says why it is not proved, and nothing if it is. Numbers and matrices are
rational, and then all is exact; or they are balls, and then an obligation is proved only if it holds for every point of
them. what: its name in the reason, or the reason.
"""

from typing import Any

from flint import arb, arb_mat, arb_poly, fmpq, fmpq_mat, fmpq_poly, fmpz_mat

from replication.verify.algebra.linear import characteristic_polynomial
from replication.verify.algebra.work import bits, estimate_length, spend_elimination, spend_on_roots
from replication.verify.theorem import require

ONE = fmpq(1)


def decide(reason: str) -> None:
    """Refuse unless the obligation is proved."""
    require(not reason, reason)


def holds(reason: str) -> bool:
    """Whether the obligation is proved; if not, it may hold all the same."""
    return not reason


def less(first: Any, second: Any, what: str) -> str:
    """first < second; of balls, for all their points."""
    return "" if first < second else what


def at_most(first: Any, second: Any, what: str) -> str:
    """first <= second; of balls, for all their points."""
    return "" if first <= second else what


def equal(first: Any, second: Any, what: str) -> str:
    """Both numbers, polynomials or matrices are the same."""
    return "" if first == second else what


def identical(left: Any, right: Any, what: str) -> str:
    """Both sides, words or matrices of words, are the same expression: their expanded difference is zero."""
    return "" if (left - right).is_zero() else f"{what} is no identity"


def definite(M: fmpq_mat | arb_mat, what: str) -> str:
    """M is symmetric and positive definite; of balls the lower triangle is read."""
    return _minors(M, what) if isinstance(M, fmpq_mat) else _pivots(M, what)


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


def semidefinite(M: fmpq_mat, what: str) -> str:
    """M is symmetric and positive semidefinite.

    Its eigenvalues are real, so by Descartes' rule of signs none is negative iff no coefficient of det(z I + M), the
    characteristic polynomial of -M, is negative.
    """
    if M.transpose() != M:
        return f"{what} is not symmetric"
    return "" if min(characteristic_polynomial(-M).coeffs()) >= 0 else f"{what} is not positive semidefinite"


def hurwitz(M: fmpq_mat, what: str) -> str:
    """All eigenvalues of M have negative real parts.

    The leading minors of the Hurwitz matrix (a_{n−2j+i}), i, j = 1 … n, of the characteristic polynomial a_n s^n + …
    are positive: a_n is 1 (Routh and Hurwitz).
    """
    n, coefficients = M.nrows(), characteristic_polynomial(M).coeffs()
    zeros = [fmpq(0)] * n
    padded = zeros + coefficients + zeros
    for size in range(1, n + 1):
        spend_elimination(size, size, estimate_length(coefficients), "a Hurwitz determinant")
        rows = [[padded[2 * n - 1 - 2 * j + i] for j in range(size)] for i in range(size)]
        if not fmpq_mat(rows).det() > 0:
            return f"{what} is not Hurwitz: its Hurwitz determinant {size} is not positive"
    return ""


def within(of: fmpq_poly | arb_poly | fmpq_mat | arb_mat, what: str, radius: Any = ONE) -> str:
    """All roots of a polynomial, or eigenvalues of a matrix, lie inside the circle of this radius about zero.

    The test of Schur and Cohn for p(radius z), lowest coefficient first; a polynomial in balls is monic. With the
    reversed polynomial p*(z) = z^n p(1/z), all roots of p are inside the unit circle iff |p(0)| < |leading coefficient|
    and those of (leading p - p(0) p*) / z are. The zero polynomial has no set of roots.
    """
    polynomial: Any = characteristic_polynomial(of) if isinstance(of, fmpq_mat | arb_mat) else of
    if isinstance(polynomial, fmpq_poly):
        spend_on_roots(polynomial)
        factor = radius
    else:
        factor = arb(radius)
    rest = [c * factor**k for k, c in enumerate(polynomial.coeffs())]
    while rest and abs(rest[0]) < abs(rest[-1]):
        # With the ratio, not with both factors, or the digits of the coefficients would double each time.
        ratio = rest[0] / rest[-1]
        rest = [a - ratio * b for a, b in zip(rest[1:], rest[-2::-1], strict=True)]
    return "" if len(rest) == 1 else f"{what} are not proved to lie inside the circle of radius {radius}"
