"""Exact linear algebra over the rationals: definiteness, blocks, and the Schur-Cohn test of polynomials."""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq, fmpq_mat, fmpq_poly, fmpz_mat

from replication.verify.theorem import require

LARGEST_ORDER = 50
"""Most states of a plant or a filter whose characteristic polynomial is taken."""


def require_order(states: int, what: str) -> None:
    """Refuse a matrix of more than `LARGEST_ORDER` states: exact determinants would take too long."""
    require(states <= LARGEST_ORDER, f"{what} has {states} states, more than {LARGEST_ORDER}")


def zeros(rows: int, columns: int) -> fmpq_mat:
    """The zero matrix."""
    return fmpq_mat(rows, columns)


def identity(size: int) -> fmpq_mat:
    """The identity matrix."""
    return fmpq_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])


def block(rows: Sequence[Sequence[fmpq_mat]]) -> fmpq_mat:
    """The matrix made of these blocks; blocks without rows or columns may take part."""
    table: list[list[fmpq]] = []
    for row in rows:
        height = row[0].nrows()
        require(all(part.nrows() == height for part in row), "blocks beside each other differ in their rows")
        parts = [part.tolist() for part in row]
        table.extend([entry for part in parts for entry in part[i]] for i in range(height))
    width = sum(part.ncols() for part in rows[0])
    require(all(len(entries) == width for entries in table), "blocks above each other differ in their columns")
    return fmpq_mat(len(table), width, [entry for entries in table for entry in entries])


def submatrix(M: fmpq_mat, rows: Sequence[int], columns: Sequence[int]) -> fmpq_mat:
    """These rows and columns of M."""
    return fmpq_mat(len(rows), len(columns), [M[i, j] for i in rows for j in columns])


def take_rows(M: fmpq_mat, rows: Sequence[int]) -> fmpq_mat:
    """These rows of M, all columns."""
    return submatrix(M, rows, range(M.ncols()))


def require_positive_definite(M: fmpq_mat, what: str) -> None:
    """Refuse unless the symmetric M is positive definite.

    Fraction-free elimination M = L D^-1 L' of the matrix without denominators: its pivots are the leading principal
    minors, which are all positive iff M is positive definite (Sylvester). A zero pivot would be permuted away.
    """
    require(M.transpose() == M, f"{what} is not symmetric")
    integers, _ = M.numer_denom()
    permutation, _, _, upper = integers.fflu()
    size = M.nrows()
    unpermuted = permutation == fmpz_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])
    bad = next((k for k in range(size) if upper[k, k] <= 0), None)
    require(unpermuted and bad is None, f"{what} is not positive definite")


def require_positive_semidefinite(M: fmpq_mat, what: str) -> None:
    """Refuse unless the symmetric M is positive semidefinite.

    Its eigenvalues are real, so by Descartes' rule of signs none is negative iff no coefficient of det(z I + M), the
    characteristic polynomial of -M, is negative.
    """
    require(M.transpose() == M, f"{what} is not symmetric")
    negated = zeros(M.nrows(), M.ncols()) - M
    require(min(negated.charpoly().coeffs()) >= 0, f"{what} is not positive semidefinite")


def is_schur(polynomial: fmpq_poly) -> bool:
    """Whether all roots of a polynomial of degree n >= 0 are inside the unit circle (Schur-Cohn, exact).

    With the reversed polynomial p*(z) = z^n p(1/z), p is Schur iff |p(0)| < |leading coefficient| and
    (leading p - p(0) p*) / z is.
    """
    require(polynomial.degree() >= 0, "the zero polynomial has no set of roots")
    coefficients = polynomial.coeffs()
    while len(coefficients) > 1:
        first, last = coefficients[0], coefficients[-1]
        if abs(first) >= abs(last):
            return False
        reversed_ = coefficients[::-1]
        # With the ratio, not with both factors, or the digits of the coefficients would double each time.
        ratio = first / last
        coefficients = [a - ratio * b for a, b in zip(coefficients[1:], reversed_[1:], strict=True)]
    return True


def require_hurwitz(M: fmpq_mat, what: str) -> None:
    """Refuse unless the leading minors of the Hurwitz matrix (a_{n+1−2j+i}), i, j = 1 … n, of a_n s^n + … are positive.

    The matrix of the characteristic polynomial, which has a_n = 1 (Routh and Hurwitz).
    """
    n, coefficients = M.nrows(), M.charpoly().coeffs()
    for size in range(1, n + 1):
        rows = [[_at(coefficients, n - 1 - 2 * j + i) for j in range(size)] for i in range(size)]
        require(fmpq_mat(rows).det() > 0, f"{what} is not Hurwitz: its Hurwitz determinant {size} is not positive")


def _at(coefficients: Sequence[fmpq], power: int) -> fmpq:
    return coefficients[power] if 0 <= power < len(coefficients) else fmpq(0)
