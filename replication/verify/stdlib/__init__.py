"""The part of python-flint that the verifier uses, from the standard library alone: a second arithmetic.

Under the names of python-flint: `fmpq`, a Fraction, and its matrices and polynomials are exact; `arb` and `acb` are
numbers enclosed with a radius, rounded outwards to multiples of 2^-BITS. It shares no code with FLINT. What cannot be
enclosed, such as a quotient by what may be zero, is refused; python-flint goes on with a number of which nothing is
known. Numbers are in `balls`, what is exact in `exact`; matrices and polynomials of enclosed numbers follow.
"""

from __future__ import annotations

from operator import add
from typing import Any

from replication.verify.stdlib.balls import acb, arb, ball, ctx, enclosed, exponential, fmpq, fmpz, times
from replication.verify.stdlib.exact import Matrix, Polynomial, fmpq_mat, fmpq_poly, fmpz_mat

__all__ = [
    "acb", "acb_mat", "acb_poly", "arb", "arb_mat", "arb_poly", "ctx", "fmpq",
    "fmpq_mat", "fmpq_poly", "fmpz", "fmpz_mat",
]  # fmt: skip

Rows = list[list[Any]]


def _parts(rows: Rows) -> tuple[list[list[int]], list[list[int]]]:
    """Middles and radii."""
    return [[x.m for x in row] for row in rows], [[x.r for x in row] for row in rows]


def _balls(m: list[list[int]], r: list[list[int]]) -> Rows:
    return [list(map(ball, *pair)) for pair in zip(m, r, strict=True)]


class arb_poly(Polynomial):
    """A polynomial with enclosed coefficients."""

    __slots__ = ()
    field = arb


class acb_poly(Polynomial):
    """A polynomial with enclosed complex coefficients."""

    __slots__ = ()
    field = acb


class _Matrix(Matrix):
    """What real and complex matrices have in common."""

    __slots__ = ()
    entry: Any

    def keep(self, table: Rows) -> None:
        """As balls."""
        self.rows = [[x if isinstance(x, self.entry) else self.entry(x) for x in row] for row in table]

    def like(self, rows: Rows, columns: int) -> Any:
        """These rows of enclosed entries, which are not looked at again, as a matrix."""
        instance = type(self).__new__(type(self))
        instance.rows, instance.columns = rows, columns
        return instance

    def __getitem__(self, place: tuple[int, int]) -> Any:
        return self.rows[place[0]][place[1]]

    def __add__(self, other: Any) -> Any:
        if not isinstance(other, type(self)):
            return NotImplemented
        rows = [list(map(add, *both)) for both in zip(self.rows, other.rows, strict=True)]
        return self.like(rows, self.columns)

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, type(self)):
            if enclosed(other) is None and not isinstance(other, self.entry):
                return NotImplemented
            return self.like([[entry * other for entry in row] for row in self.rows], self.columns)
        if self.columns != other.nrows():
            raise ValueError("matrices whose shapes do not fit are multiplied")
        zero = self.entry(0)
        return self.like(
            self.product(other.rows) if other.rows else [[zero] * other.columns for _ in self.rows], other.columns
        )

    def product(self, other: Rows) -> Rows:
        """The rows of the product with these rows."""
        raise NotImplementedError

    def __truediv__(self, divisor: Any) -> Any:
        return self.like([[entry / divisor for entry in row] for row in self.rows], self.columns)

    def solve(self, right: Any) -> Any:
        """X with self X = right for all points of both; ZeroDivisionError if an inverse is not proved to exist."""
        size = self.nrows()
        table = [[*a, *b] for a, b in zip(self.rows, right.rows, strict=True)]
        for k in range(size):
            best = max(range(k, size), key=lambda i: abs(table[i][k]).lower().m)
            table[k], table[best] = table[best], table[k]
            pivot = table[k][k]
            if pivot.contains(0):
                raise ZeroDivisionError("the matrix is not proved to have an inverse")
            table[k][k + 1 :] = top = [entry / pivot for entry in table[k][k + 1 :]]
            for i, row in enumerate(table):
                if i != k:
                    row[k + 1 :] = [a - row[k] * b for a, b in zip(row[k + 1 :], top, strict=True)]
        return type(self)([row[size:] for row in table])


class arb_mat(_Matrix):
    """A matrix of real numbers."""

    __slots__ = ()
    entry = arb
    polynomial = arb_poly

    def product(self, other: Rows) -> Rows:
        """By middles and radii."""
        return _balls(*times(*_parts(self.rows), *_parts(other)))

    def exp(self) -> Any:
        """The exponential."""
        return self.like(_balls(*exponential(*_parts(self.rows))), self.columns)


class acb_mat(_Matrix):
    """A matrix of complex numbers a + ib; as a left factor it is [a, -b; b, a]."""

    __slots__ = ()
    entry = acb
    polynomial = acb_poly

    def real(self) -> arb_mat:
        """[a, -b; b, a]."""
        upper = [[*(x.real for x in row), *(-x.imag for x in row)] for row in self.rows]
        return arb_mat(upper + [[*(x.imag for x in row), *(x.real for x in row)] for row in self.rows])

    def product(self, other: Rows) -> Rows:
        """By real and imaginary parts."""
        return self._joined(
            self.real().product([[x.real for x in row] for row in other] + [[x.imag for x in row] for row in other])
        )

    def exp(self) -> acb_mat:
        """The exponential."""
        return acb_mat(self._joined([row[: self.columns] for row in self.real().exp().rows]))

    def _joined(self, rows: Rows) -> Rows:
        n = self.nrows()
        return [[acb(*pair) for pair in zip(*both, strict=True)] for both in zip(rows[:n], rows[n:], strict=True)]
