"""Matrices and polynomials of enclosed numbers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from replication.verify.stdlib.balls import BITS, Table, acb, arb, ball, enclosed, exponential, times
from replication.verify.stdlib.polynomials import Polynomial
from replication.verify.stdlib.rationals import fmpq_mat, shaped


def _table(value: Any, columns: int | None, entries: Iterable[Any] | None) -> tuple[list[list[Any]], int]:
    """Rows of entries, and how many columns there are."""
    rows = shaped(value, columns, entries)
    if rows is None:
        return value.tolist(), value.ncols()
    width = columns if columns is not None else len(rows[0]) if rows else 0
    if any(len(row) != width for row in rows):
        raise ValueError("the rows of a matrix differ in length")
    return rows, width


class _Matrix:
    """What real and complex matrices have in common."""

    __slots__ = ()
    entry: Any

    def entries(self) -> list[Any]:
        """All entries, row by row."""
        return [entry for row in self.tolist() for entry in row]

    def tolist(self) -> list[list[Any]]:
        """Its rows."""
        raise NotImplementedError

    def nrows(self) -> int:
        """The number of rows."""
        raise NotImplementedError

    def ncols(self) -> int:
        """The number of columns."""
        raise NotImplementedError

    def __rmul__(self, factor: Any) -> Any:
        return self * factor

    def __mul__(self, other: Any) -> Any:
        raise NotImplementedError

    def __sub__(self, other: Any) -> Any:
        return self + other * -1

    def __neg__(self) -> Any:
        return self * -1

    def __truediv__(self, divisor: Any) -> Any:
        return type(self)([[entry / divisor for entry in row] for row in self.tolist()])

    def trace(self) -> Any:
        """The sum of the diagonal."""
        return sum((row[i] for i, row in enumerate(self.tolist())), self.entry(0))

    def charpoly(self) -> Any:
        """det(z I - M), with c_{n-k} = -trace(M M_k)/k and M_{k+1} = M M_k + c_{n-k} I from M_1 = I (Faddeev)."""
        n = self.nrows()
        one = type(self)([[int(i == j) for j in range(n)] for i in range(n)])
        current, found = one, [self.entry(1)]
        for k in range(1, n + 1):
            current = self * current
            found.append(-current.trace() / k)
            current = current + one * found[-1]
        return (acb_poly if self.entry is acb else arb_poly)(found[::-1])

    def det(self) -> Any:
        """The determinant."""
        return self.charpoly()(self.entry(0)) * (-1) ** self.nrows()


class arb_mat(_Matrix):  # noqa: N801 - the names are those of python-flint
    """A real matrix by middles m and radii r of its entries."""

    __slots__ = ("columns", "m", "r")
    entry = arb

    def __init__(self, value: Any, columns: int | None = None, entries: Iterable[Any] | None = None) -> None:
        if isinstance(value, fmpq_mat):
            low, rows = value.low, value.rows
            cut = [[divmod(entry << BITS, low) for entry in row] for row in rows]
            self.m = [[m for m, _ in row] for row in cut]
            self.r = [[1 if rest else 0 for _, rest in row] for row in cut]
            self.columns = value.ncols()
            return
        rows, self.columns = _table(value, columns, entries)
        balls = [[arb(entry) for entry in row] for row in rows]
        self.m, self.r = ([[getattr(entry, part) for entry in row] for row in balls] for part in "mr")

    @classmethod
    def of(cls, m: Table, r: Table, columns: int) -> arb_mat:
        """The matrix with these middles and radii."""
        made = cls.__new__(cls)
        made.m, made.r, made.columns = m, r, columns
        return made

    def nrows(self) -> int:
        """The number of rows."""
        return len(self.m)

    def ncols(self) -> int:
        """The number of columns."""
        return self.columns

    def __getitem__(self, place: tuple[int, int]) -> arb:
        i, j = place
        return ball(self.m[i][j], self.r[i][j])

    def tolist(self) -> list[list[arb]]:
        """Its rows."""
        return [[ball(*entry) for entry in zip(*rows, strict=True)] for rows in zip(self.m, self.r, strict=True)]

    def transpose(self) -> arb_mat:
        """The transpose."""
        m, r = (
            [list(column) for column in zip(*rows, strict=True)] or [[] for _ in range(self.columns)]
            for rows in (self.m, self.r)
        )
        return arb_mat.of(m, r, self.nrows())

    def __add__(self, other: Any) -> Any:
        if not isinstance(other, arb_mat):
            return NotImplemented
        m, r = (
            [[a + b for a, b in zip(*pair, strict=True)] for pair in zip(*tables, strict=True)]
            for tables in ((self.m, other.m), (self.r, other.r))
        )
        return arb_mat.of(m, r, self.columns)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, arb_mat):
            if self.columns != other.nrows():
                raise ValueError("matrices whose shapes do not fit are multiplied")
            if not other.nrows():
                return arb_mat([[0] * other.columns for _ in self.m])
            return arb_mat.of(*times(self.m, self.r, other.m, other.r), other.columns)
        factor = enclosed(other)
        if factor is None:
            return NotImplemented
        return arb_mat(self.nrows(), self.columns, [entry * factor for entry in self.entries()])

    def exp(self) -> arb_mat:
        """The exponential."""
        return arb_mat.of(*exponential(self.m, self.r), self.columns)

    def solve(self, right: arb_mat) -> arb_mat:
        """X with self X = right for all points of both; ZeroDivisionError if an inverse is not proved to exist."""
        size = self.nrows()
        table = [[*a, *b] for a, b in zip(self.tolist(), right.tolist(), strict=True)]
        for k in range(size):
            best = max(range(k, size), key=lambda i: abs(table[i][k].m) - table[i][k].r)
            table[k], table[best] = table[best], table[k]
            pivot = table[k][k]
            if pivot.contains(0):
                raise ZeroDivisionError("the matrix is not proved to have an inverse")
            top = [entry / pivot for entry in table[k][k + 1 :]]
            table[k] = [*table[k][: k + 1], *top]
            for i, row in enumerate(table):
                if i != k and not row[k] == 0:
                    factor = row[k]
                    row[k + 1 :] = [a - factor * b for a, b in zip(row[k + 1 :], top, strict=True)]
        return arb_mat([row[size:] for row in table])


class acb_mat(_Matrix):  # noqa: N801
    """A complex matrix by its real and its imaginary part."""

    __slots__ = ("imag", "real")
    entry = acb

    def __init__(self, value: Any, columns: int | None = None, entries: Iterable[Any] | None = None) -> None:
        if isinstance(value, (fmpq_mat, arb_mat)):
            self.real = arb_mat(value) if isinstance(value, fmpq_mat) else value
            self.imag = arb_mat(value.nrows(), value.ncols())
            return
        rows, width = _table(value, columns, entries)
        numbers = [acb(entry) for row in rows for entry in row]
        self.real = arb_mat(len(rows), width, [number.real for number in numbers])
        self.imag = arb_mat(len(rows), width, [number.imag for number in numbers])

    @classmethod
    def of(cls, real: arb_mat, imag: arb_mat) -> acb_mat:
        """The matrix with these parts."""
        made = cls.__new__(cls)
        made.real, made.imag = real, imag
        return made

    def nrows(self) -> int:
        """The number of rows."""
        return self.real.nrows()

    def ncols(self) -> int:
        """The number of columns."""
        return self.real.ncols()

    def __getitem__(self, place: tuple[int, int]) -> acb:
        return acb(self.real[place], self.imag[place])

    def tolist(self) -> list[list[acb]]:
        """Its rows."""
        pairs = zip(self.real.tolist(), self.imag.tolist(), strict=True)
        return [[acb(*entry) for entry in zip(*rows, strict=True)] for rows in pairs]

    def __add__(self, other: Any) -> Any:
        if not isinstance(other, acb_mat):
            return NotImplemented
        return acb_mat.of(self.real + other.real, self.imag + other.imag)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, acb_mat):
            a, b, c, d = self.real, self.imag, other.real, other.imag
            return acb_mat.of(a * c - b * d, a * d + b * c)
        factor = acb.of(other)
        if factor is None:
            return NotImplemented
        a, b, c, d = self.real, self.imag, factor.real, factor.imag
        return acb_mat.of(a * c - b * d, a * d + b * c)

    def exp(self) -> acb_mat:
        """The exponential."""
        return _halves(self._real().exp(), self.nrows())

    def solve(self, right: acb_mat) -> acb_mat:
        """X with self X = right; ZeroDivisionError if an inverse is not proved to exist."""
        found = self._real().solve(arb_mat(right.real.tolist() + right.imag.tolist()))
        return _halves(found, right.ncols())

    def _real(self) -> arb_mat:
        """[a, -b; b, a], which is to real columns [x; y] as a + ib to x + iy."""
        pairs = list(zip(self.real.tolist(), self.imag.tolist(), strict=True))
        upper = [[*a, *(-entry for entry in b)] for a, b in pairs]
        return arb_mat(upper + [[*b, *a] for a, b in pairs])


def _halves(whole: arb_mat, width: int) -> acb_mat:
    """The complex matrix a + ib of which [a, ..; b, ..] is a real one."""
    rows, half = [row[:width] for row in whole.tolist()], whole.nrows() // 2
    return acb_mat.of(arb_mat(rows[:half]), arb_mat(rows[half:]))


class arb_poly(Polynomial):  # noqa: N801
    """A polynomial with enclosed coefficients."""

    __slots__ = ()
    field = arb


class acb_poly(Polynomial):  # noqa: N801
    """A polynomial with enclosed complex coefficients."""

    __slots__ = ()
    field = acb
