"""Exact matrices and polynomials: integers over one denominator, eliminated without fractions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import zip_longest
from math import gcd, lcm
from operator import mul
from typing import Any

from replication.verify.stdlib.balls import Ring, acb, arb, fmpq

Rows = list[list[int]]


class Polynomial(Ring):
    """A polynomial in one variable by its coefficients, lowest first, the last of which is not exactly zero."""

    __slots__ = ("terms",)
    field: Any = fmpq

    def __init__(self, coefficients: Iterable[Any] = ()) -> None:
        self.terms = [c if isinstance(c, self.field) else self.field(c) for c in coefficients]
        while self.terms and self.terms[-1] == 0:
            self.terms.pop()

    def coeffs(self) -> list[Any]:
        """The coefficients, lowest first; none of the zero polynomial."""
        return [*self.terms]

    def degree(self) -> int:
        """The degree; -1 of the zero polynomial."""
        return len(self.terms) - 1

    def derivative(self) -> Any:
        """The derivative."""
        return type(self)([c * k for k, c in enumerate(self.terms)][1:])

    def __call__(self, point: Any) -> Any:
        """Its value, by Horner's scheme."""
        total = point * 0
        for c in reversed(self.terms):
            total = total * point + c
        return total

    def _other(self, other: Any) -> list[Any]:
        return other.terms if isinstance(other, Polynomial) else [self.field(other)]

    def __add__(self, other: Any) -> Any:
        pairs = zip_longest(self.terms, self._other(other), fillvalue=self.field(0))
        return type(self)([a + b for a, b in pairs])

    def __neg__(self) -> Any:
        return type(self)([-c for c in self.terms])

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, (Polynomial, fmpq, int, arb, acb)):
            return NotImplemented
        b = self._other(other)
        terms = [self.field(0)] * (len(self.terms) + len(b))
        for i, x in enumerate(self.terms):
            for j, y in enumerate(b):
                terms[i + j] = terms[i + j] + x * y
        return type(self)(terms)

    def __eq__(self, other: object) -> bool:
        return self.terms == type(self)(self._other(other)).terms


class fmpq_poly(Polynomial):
    """A polynomial with rational coefficients."""

    __slots__ = ()


def shaped(rows: Any, columns: int | None, entries: Iterable[Any] | None) -> list[list[Any]] | None:
    """Rows of entries from the arguments of a matrix: a list of rows, or a shape with or without all entries."""
    if columns is None:
        return [list(row) for row in rows] if isinstance(rows, Sequence) else None
    if entries is None:
        return [[0] * columns for _ in range(rows)]
    flat = list(entries)
    if len(flat) != rows * columns:
        raise ValueError(f"{len(flat)} entries for {rows} x {columns}")
    return [flat[i * columns : (i + 1) * columns] for i in range(rows)]


class Matrix(Ring):
    """What all matrices have in common: rows, and how many columns, which an empty one has too."""

    __slots__ = ("columns", "rows")
    columns: int
    rows: list[list[Any]]
    polynomial: Any
    """What the characteristic polynomial is."""

    def __init__(self, value: Any, columns: int | None = None, entries: Iterable[Any] | None = None) -> None:
        table = shaped(value, columns, entries)
        if table is None:
            table, columns = value.tolist(), value.ncols()
        self.columns = columns if columns is not None else len(table[0]) if table else 0
        if any(len(row) != self.columns for row in table):
            raise ValueError("the rows of a matrix differ in length")
        self.keep(table)

    def keep(self, table: list[list[Any]]) -> None:
        """Take these rows."""
        raise NotImplementedError

    def nrows(self) -> int:
        """The number of rows."""
        return len(self.rows)

    def ncols(self) -> int:
        """The number of columns."""
        return self.columns

    def tolist(self) -> list[list[Any]]:
        """Its rows."""
        return [[*row] for row in self.rows]

    def entries(self) -> list[Any]:
        """All entries, row by row."""
        return [entry for row in self.tolist() for entry in row]

    def transpose(self) -> Any:
        """The transpose."""
        columns = zip(*self.tolist(), strict=True) if self.rows else [()] * self.columns
        return type(self)(self.columns, self.nrows(), [entry for column in columns for entry in column])

    def __neg__(self: Any) -> Any:
        return self * -1

    def trace(self: Any) -> Any:
        """The sum of the diagonal."""
        return sum((self[i, i] for i in range(1, self.nrows())), self[0, 0])

    def charpoly(self: Any) -> Any:
        """det(z I - M), with c_{n-k} = -trace(M M_k)/k and M_{k+1} = M M_k + c_{n-k} I from M_1 = I (Faddeev)."""
        n = self.nrows()
        if n != self.columns:
            raise ValueError("only a square matrix has a characteristic polynomial")
        current = unit = type(self)(n, n, [int(i == j) for i in range(n) for j in range(n)])
        coefficients = [self.polynomial.field(1)]
        for k in range(1, n + 1):
            current = self * current
            coefficients.append(-current.trace() / k)
            current = current + unit * coefficients[-1]
        return self.polynomial(coefficients[::-1])

    def det(self) -> Any:
        """The determinant: that of -M is the last coefficient of det(z I - M)."""
        return self.charpoly().coeffs()[0] * (-1) ** self.nrows()


class fmpq_mat(Matrix):
    """A matrix of integers `rows` over one denominator `low` > 0, without a common factor."""

    __slots__ = ("low",)
    low: int
    polynomial = fmpq_poly

    def keep(self, table: list[list[Any]]) -> None:
        """Over the least common denominator."""
        if not all(isinstance(entry, (int, fmpq)) for row in table for entry in row):
            raise TypeError("a matrix of rationals has an entry that is none")
        self.low = lcm(*{entry.denominator for row in table for entry in row})
        self.rows = [[entry.numerator * (self.low // entry.denominator) for entry in row] for row in table]

    @classmethod
    def over(cls, rows: Rows, low: int, columns: int) -> fmpq_mat:
        """rows/low in lowest terms."""
        instance = cls.__new__(cls)
        common = low if low == 1 else gcd(low, *(entry for row in rows for entry in row))
        instance.rows = rows if common == 1 else [[entry // common for entry in row] for row in rows]
        instance.low, instance.columns = low // common, columns
        return instance

    def __getitem__(self, place: tuple[int, int]) -> fmpq:
        return fmpq(self.rows[place[0]][place[1]], self.low)

    def __setitem__(self, place: tuple[int, int], value: Any) -> None:
        table = self.tolist()
        table[place[0]][place[1]] = value
        self.keep(table)

    def tolist(self) -> list[list[fmpq]]:
        """Its rows."""
        return [[fmpq(entry, self.low) for entry in row] for row in self.rows]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, fmpq_mat):
            return NotImplemented
        return (self.columns, self.low, self.rows) == (other.columns, other.low, other.rows)

    def __add__(self, other: Any) -> Any:
        if not isinstance(other, fmpq_mat):
            return NotImplemented
        if (self.nrows(), self.columns) != (other.nrows(), other.columns):
            raise ValueError("matrices of different shapes are added")
        common = lcm(self.low, other.low)
        a, b = common // self.low, common // other.low
        pairs = zip(self.rows, other.rows, strict=True)
        return fmpq_mat.over(
            [[a * x + b * y for x, y in zip(*pair, strict=True)] for pair in pairs], common, self.columns
        )

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, fmpq_mat):
            if self.columns != other.nrows():
                raise ValueError("matrices whose shapes do not fit are multiplied")
            columns = list(zip(*other.rows, strict=True)) or [()] * other.columns
            rows = [[sum(map(mul, row, column)) for column in columns] for row in self.rows]
            return fmpq_mat.over(rows, self.low * other.low, other.columns)
        if not isinstance(other, (int, fmpq)):
            return NotImplemented
        top, low = other.numerator, other.denominator
        return fmpq_mat.over([[x * top for x in row] for row in self.rows], self.low * low, self.columns)

    def __truediv__(self, other: Any) -> Any:
        return self * (fmpq(1) / other)

    def numer_denom(self) -> tuple[fmpz_mat, int]:
        """The integers, and their denominator."""
        return fmpz_mat(self.rows), self.low

    def solve(self, right: fmpq_mat) -> fmpq_mat:
        """X with self X = right; raises ZeroDivisionError if self has no inverse."""
        size = self.nrows()
        if (size, size) != (self.columns, right.nrows()):
            raise ValueError("the shapes of an equation do not fit")
        table = [[*a, *b] for a, b in zip(self.rows, right.rows, strict=True)]
        rank, last, _ = eliminated(table, size, both=True)
        if rank < size:
            raise ZeroDivisionError("the matrix has no inverse")
        # self/low X = right/low', and the table is now last times the identity beside the solution for integers.
        factor = self.low if last > 0 else -self.low
        return fmpq_mat.over([[x * factor for x in row[size:]] for row in table], abs(last) * right.low, right.columns)

    def inv(self) -> fmpq_mat:
        """The inverse; raises ZeroDivisionError if there is none."""
        size = self.nrows()
        return self.solve(fmpq_mat(size, size, [int(i == j) for i in range(size) for j in range(size)]))

    def rank(self) -> int:
        """The rank."""
        return eliminated([[*row] for row in self.rows], self.columns)[0]


class fmpz_mat(fmpq_mat):
    """A matrix of integers."""

    __slots__ = ()

    def fflu(self) -> tuple[fmpz_mat, None, None, fmpz_mat]:
        """The permutation of the rows, and the upper triangle U of the elimination without fractions.

        The k-th pivot is the leading minor of order k of the permuted matrix.
        """
        size, upper = self.nrows(), [[*row] for row in self.rows]
        order = eliminated(upper, size)[2]
        moved = [[int(place == j) for j in range(size)] for place in order]
        return fmpz_mat(moved), None, None, fmpz_mat(upper)


def eliminated(table: Rows, columns: int, *, both: bool = False) -> tuple[int, int, list[int]]:
    """Eliminate the first columns in place, without fractions; their rank, the last pivot, the order of the rows.

    both: above the pivots too, so that a regular part becomes the last pivot times the identity (Gauss and Jordan).
    """
    rank, last, order = 0, 1, list(range(len(table)))
    for k in range(columns):
        place = next((i for i in range(rank, len(table)) if table[i][k]), None)
        if place is None:
            continue
        table[rank], table[place], order[rank], order[place] = table[place], table[rank], order[place], order[rank]
        top, start = table[rank], 0 if both else k
        for i in range(0 if both else rank + 1, len(table)):
            if i != rank:
                row, left = table[i], table[i][k]
                row[start:] = [(top[k] * a - left * b) // last for a, b in zip(row[start:], top[start:], strict=True)]
        rank, last = rank + 1, top[k]
    return rank, last, order
