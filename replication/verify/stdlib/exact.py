"""Matrices of rational numbers: integers over one denominator, eliminated without fractions (Bareiss)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from math import gcd, lcm
from operator import add, mul, sub
from typing import Any

from replication.verify.stdlib.polynomials import fmpq_poly
from replication.verify.stdlib.rationals import fmpq, parts_of

Rows = list[list[int]]
MERSENNE = (
    521, 1279, 2203, 3217, 4423, 9689, 19937, 44497, 86243, 132049, 216091, 756839, 1398269, 3021377, 6972593, 13466917
)  # fmt: skip
"""Exponents k for which 2^k - 1 is prime."""


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


class fmpq_mat:
    """A matrix of integers `rows` over one denominator `low` > 0, without a common factor."""

    __slots__ = ("columns", "low", "rows")
    columns: int
    low: int
    rows: Rows

    def __init__(self, rows: Any, columns: int | None = None, entries: Iterable[Any] | None = None) -> None:
        table = shaped(rows, columns, entries)
        if table is None:
            self.rows, self.low, self.columns = [[*row] for row in rows.rows], rows.low, rows.columns
            return
        parts = [[parts_of(entry) or (0, 0) for entry in row] for row in table]
        self.low = lcm(*{low for row in parts for _, low in row})
        if not self.low:
            raise TypeError("a matrix of rationals has an entry that is none")
        self.rows = [[top * (self.low // low) for top, low in row] for row in parts]
        self.columns = columns if columns is not None else len(table[0]) if table else 0
        if any(len(row) != self.columns for row in table):
            raise ValueError("the rows of a matrix differ in length")

    @classmethod
    def over(cls, rows: Rows, low: int, columns: int) -> fmpq_mat:
        """rows/low in lowest terms."""
        made = cls.__new__(cls)
        common = low if low == 1 else gcd(low, *(entry for row in rows for entry in row))
        made.rows = rows if common == 1 else [[entry // common for entry in row] for row in rows]
        made.low, made.columns = low // common, columns
        return made

    def nrows(self) -> int:
        """The number of rows."""
        return len(self.rows)

    def ncols(self) -> int:
        """The number of columns."""
        return self.columns

    def __getitem__(self, place: tuple[int, int]) -> fmpq:
        return fmpq(self.rows[place[0]][place[1]], self.low)

    def __setitem__(self, place: tuple[int, int], value: Any) -> None:
        table = self.tolist()
        table[place[0]][place[1]] = value
        changed = fmpq_mat(table)
        self.rows, self.low = changed.rows, changed.low

    def tolist(self) -> list[list[fmpq]]:
        """Its rows."""
        return [[fmpq(entry, self.low) for entry in row] for row in self.rows]

    def entries(self) -> list[fmpq]:
        """All entries, row by row."""
        return [fmpq(entry, self.low) for row in self.rows for entry in row]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, fmpq_mat):
            return NotImplemented
        return (self.columns, self.low, self.rows) == (other.columns, other.low, other.rows)

    __hash__ = None  # type: ignore[assignment]

    def transpose(self) -> fmpq_mat:
        """The transpose."""
        rows = [list(column) for column in zip(*self.rows, strict=True)] or [[] for _ in range(self.columns)]
        return fmpq_mat.over(rows, self.low, self.nrows())

    def _sum(self, other: Any, operation: Callable[[int, int], int]) -> Any:
        if not isinstance(other, fmpq_mat):
            return NotImplemented
        if (self.nrows(), self.columns) != (other.nrows(), other.columns):
            raise ValueError("matrices of different shapes are added")
        common = lcm(self.low, other.low)
        a, b = common // self.low, common // other.low
        pairs = zip(self.rows, other.rows, strict=True)
        rows = [[operation(a * x, b * y) for x, y in zip(*pair, strict=True)] for pair in pairs]
        return fmpq_mat.over(rows, common, self.columns)

    def __add__(self, other: Any) -> Any:
        return self._sum(other, add)

    def __sub__(self, other: Any) -> Any:
        return self._sum(other, sub)

    def __neg__(self) -> fmpq_mat:
        return fmpq_mat.over([[-entry for entry in row] for row in self.rows], self.low, self.columns)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, fmpq_mat):
            if self.columns != other.nrows():
                raise ValueError("matrices whose shapes do not fit are multiplied")
            columns = list(zip(*other.rows, strict=True)) or [()] * other.columns
            rows = [[sum(map(mul, row, column)) for column in columns] for row in self.rows]
            return fmpq_mat.over(rows, self.low * other.low, other.columns)
        parts = parts_of(other)
        if parts is None:
            return NotImplemented
        return fmpq_mat.over([[x * parts[0] for x in row] for row in self.rows], self.low * parts[1], self.columns)

    __rmul__ = __mul__

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
        found, last = eliminated(table, size, both=True)
        if found < size:
            raise ZeroDivisionError("the matrix has no inverse")
        # self/low X = right/low', and the table is now last times the identity beside the solution for integers.
        rows = [[entry * self.low for entry in row[size:]] for row in table]
        sign = 1 if last > 0 else -1
        rows = [[sign * entry for entry in row] for row in rows]
        return fmpq_mat.over(rows, abs(last) * right.low, right.columns)

    def inv(self) -> fmpq_mat:
        """The inverse; raises ZeroDivisionError if there is none."""
        size = self.nrows()
        return self.solve(fmpq_mat(size, size, [int(i == j) for i in range(size) for j in range(size)]))

    def rank(self) -> int:
        """The rank."""
        return eliminated([[*row] for row in self.rows], self.columns)[0]

    def det(self) -> fmpq:
        """The determinant: that of -M is the last coefficient of det(z I - M)."""
        last: fmpq = self.charpoly().coeffs()[0] * (-1) ** self.nrows()
        return last

    def charpoly(self) -> fmpq_poly:
        """det(z I - M), by Hessenberg's form modulo a number that is more than twice all coefficients."""
        n = self.nrows()
        if n != self.columns:
            raise ValueError("only a square matrix has a characteristic polynomial")
        longest = max((entry.bit_length() for row in self.rows for entry in row), default=0)
        # Each coefficient is a sum of C(n, k) minors of order k <= n, each at most k! times the entries' product.
        needed = n * (longest + n.bit_length() + 1) + 2
        modulus = (1 << next(k for k in MERSENNE if k > needed)) - 1
        found = _hessenberg([[entry % modulus for entry in row] for row in self.rows], modulus)
        exact = [c - modulus if 2 * c > modulus else c for c in found]
        return fmpq_poly([fmpq(c, self.low ** (n - k)) for k, c in enumerate(exact)])


class fmpz_mat(fmpq_mat):
    """A matrix of integers."""

    __slots__ = ()

    def fflu(self) -> tuple[fmpz_mat, None, None, fmpz_mat]:
        """The permutation of the rows, and the upper triangle U of the elimination without fractions.

        The k-th pivot is the leading minor of order k of the permuted matrix. Of a symmetric matrix only the upper
        triangle is made, as long as no pivot is zero.
        """
        size = self.nrows()
        rows, symmetric = [[*row] for row in self.rows], self.transpose() == self
        order, last = list(range(size)), 1
        for k in range(size):
            if symmetric and not rows[k][k]:  # so far only this half was made: the rest mirrors it
                symmetric, rows = (
                    False,
                    [
                        [rows[min(i, j)][max(i, j)] if min(i, j) >= k else rows[i][j] for j in range(size)]
                        for i in range(size)
                    ],
                )
            pivot = next((i for i in range(k, size) if rows[i][k]), None)
            if pivot is None:
                continue
            rows[k], rows[pivot], order[k], order[pivot] = rows[pivot], rows[k], order[pivot], order[k]
            head, top = rows[k][k], rows[k]
            for i in range(k + 1, size):
                first = i if symmetric else k + 1
                left, row = (top[i] if symmetric else rows[i][k]), rows[i]
                row[first:] = [(head * a - left * b) // last for a, b in zip(row[first:], top[first:], strict=True)]
                row[k] = 0
            last = head
        upper = [[rows[i][j] if j >= i else 0 for j in range(size)] for i in range(size)]
        moved = [[int(order[i] == j) for j in range(size)] for i in range(size)]
        return fmpz_mat(moved), None, None, fmpz_mat(upper)


def eliminated(table: Rows, columns: int, *, both: bool = False) -> tuple[int, int]:
    """Eliminate the first columns in place, without fractions; the rank of these and the last pivot.

    both: above the pivots too, so that a regular part becomes the last pivot times the identity (Gauss and Jordan).
    """
    rank, last = 0, 1
    for k in range(columns):
        place = next((i for i in range(rank, len(table)) if table[i][k]), None)
        if place is None:
            continue
        table[rank], table[place] = table[place], table[rank]
        top = table[rank]
        for i in range(0 if both else rank + 1, len(table)):
            if i != rank:
                row = table[i]
                table[i] = [(top[k] * a - row[k] * b) // last for a, b in zip(row, top, strict=True)]
        rank, last = rank + 1, top[k]
    return rank, last


def _hessenberg(rows: Rows, modulus: int) -> list[int]:
    """The coefficients of det(z I - M) modulo a number, lowest first, by similar matrices of Hessenberg's form."""
    size = len(rows)
    for k in range(1, size - 1):
        pivot = next((i for i in range(k, size) if rows[i][k - 1]), None)
        if pivot is None:
            continue
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for row in rows:
            row[k], row[pivot] = row[pivot], row[k]
        inverse = pow(rows[k][k - 1], -1, modulus)
        for i in range(k + 1, size):
            factor = rows[i][k - 1] * inverse % modulus
            if factor:
                rows[i] = [(a - factor * b) % modulus for a, b in zip(rows[i], rows[k], strict=True)]
                for row in rows:
                    row[k] = (row[k] + factor * row[i]) % modulus
    # p_k = (z - h_kk) p_{k-1} - sum over i of h_{k-i,k} h_{k,k-1} .. h_{k-i+1,k-i} p_{k-i-1}.
    found: list[list[int]] = [[1]]
    for k in range(size):
        p = [0, *found[k]]
        scale = 1
        for i in range(k, -1, -1):
            factor = rows[i][k] * scale % modulus
            for j, c in enumerate(found[i]):
                p[j] = (p[j] - factor * c) % modulus
            scale = scale * rows[i][i - 1] % modulus if i else 0
        found.append(p)
    return found[-1]
