"""Matrices and polynomials of enclosed numbers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from replication.verify.stdlib.balls import (
    BITS,
    REST,
    Table,
    acb,
    arb,
    ball,
    complex_ball,
    enclosed,
    exponential,
    times,
)
from replication.verify.stdlib.exact import fmpq_mat, shaped
from replication.verify.stdlib.polynomials import Polynomial


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

    def __init__(self, value: Any, columns: int | None = None, entries: Iterable[Any] | None = None) -> None:
        raise NotImplementedError

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


class arb_mat(_Matrix):
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
        a, s = factor.m, factor.r
        far, exact = abs(a) + s, not (s or a & REST)
        a, far = (a >> BITS, far >> BITS) if exact else (a, far)
        m = [[x * a for x in row] for row in self.m]
        r = [[abs(x) * s + y * far for x, y in zip(*rows, strict=True)] for rows in zip(self.m, self.r, strict=True)]
        if not exact:
            m, r = [[x >> BITS for x in row] for row in m], [[(y >> BITS) + 2 for y in row] for row in r]
        return arb_mat.of(m, r, self.columns)

    def __truediv__(self, divisor: Any) -> Any:
        if not isinstance(divisor, int):
            return super().__truediv__(divisor)
        m = [[x // divisor for x in row] for row in self.m]
        return arb_mat.of(m, [[y // abs(divisor) + 2 for y in row] for row in self.r], self.columns)

    def __sub__(self, other: Any) -> Any:
        if not isinstance(other, arb_mat):
            return NotImplemented
        m = [[a - b for a, b in zip(*pair, strict=True)] for pair in zip(self.m, other.m, strict=True)]
        r = [[a + b for a, b in zip(*pair, strict=True)] for pair in zip(self.r, other.r, strict=True)]
        return arb_mat.of(m, r, self.columns)

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
                if i != k and (row[k].m or row[k].r):
                    factor = row[k]
                    row[k + 1 :] = [a - factor * b for a, b in zip(row[k + 1 :], top, strict=True)]
        return arb_mat([row[size:] for row in table])


class acb_mat(_Matrix):
    """A complex matrix a + ib as the real [a; b]; as a left factor it is [a, -b; b, a]."""

    __slots__ = ("both", "wide")
    entry = acb
    wide: arb_mat | None

    def __init__(self, value: Any, columns: int | None = None, entries: Iterable[Any] | None = None) -> None:
        self.wide = None
        if isinstance(value, (fmpq_mat, arb_mat)):
            real, rows, width = arb_mat(value) if isinstance(value, fmpq_mat) else value, value.nrows(), value.ncols()
            zeros = [[0] * width for _ in range(rows)]
            self.both = arb_mat.of(real.m + zeros, real.r + zeros, width)
            return
        table, width = _table(value, columns, entries)
        numbers = [[acb(entry) for entry in row] for row in table]
        parts = [[number.real for number in row] for row in numbers] + [[one.imag for one in row] for row in numbers]
        self.both = arb_mat(len(parts), width, [part for row in parts for part in row])

    @classmethod
    def of(cls, both: arb_mat) -> acb_mat:
        """The matrix of these parts."""
        made = cls.__new__(cls)
        made.both, made.wide = both, None
        return made

    def nrows(self) -> int:
        """The number of rows."""
        return self.both.nrows() // 2

    def ncols(self) -> int:
        """The number of columns."""
        return self.both.columns

    def __getitem__(self, place: tuple[int, int]) -> acb:
        i, j = place
        return complex_ball(self.both[i, j], self.both[i + self.nrows(), j])

    def tolist(self) -> list[list[acb]]:
        """Its rows."""
        rows, n = self.both.tolist(), self.nrows()
        return [
            [complex_ball(*pair) for pair in zip(*parts, strict=True)] for parts in zip(rows[:n], rows[n:], strict=True)
        ]

    def __add__(self, other: Any) -> Any:
        return acb_mat.of(self.both + other.both) if isinstance(other, acb_mat) else NotImplemented

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, acb_mat):
            return acb_mat.of(self.real() * other.both)
        if enclosed(other) is not None:
            return acb_mat.of(self.both * other)
        factor = acb.of(other)
        if factor is None:
            return NotImplemented
        # ic (a + ib) = c (-b + ia).
        n, m, r = self.nrows(), self.both.m, self.both.r
        turned = arb_mat.of([[-x for x in row] for row in m[n:]] + m[:n], r[n:] + r[:n], self.ncols())
        return acb_mat.of(self.both * factor.real + turned * factor.imag)

    def __truediv__(self, divisor: Any) -> Any:
        return acb_mat.of(self.both / divisor) if isinstance(divisor, int) else super().__truediv__(divisor)

    def exp(self) -> acb_mat:
        """The exponential."""
        whole, n = self.real().exp(), self.ncols()
        return acb_mat.of(arb_mat.of([row[:n] for row in whole.m], [row[:n] for row in whole.r], n))

    def solve(self, right: acb_mat) -> acb_mat:
        """X with self X = right; ZeroDivisionError if an inverse is not proved to exist."""
        return acb_mat.of(self.real().solve(right.both))

    def real(self) -> arb_mat:
        """[a, -b; b, a]."""
        if self.wide is None:
            n, m, r = self.nrows(), self.both.m, self.both.r
            rows = [[*a, *(-x for x in b)] for a, b in zip(m[:n], m[n:], strict=True)]
            rows += [[*b, *a] for a, b in zip(m[:n], m[n:], strict=True)]
            around = [[*a, *b] for a, b in zip(r[:n], r[n:], strict=True)]
            around += [[*b, *a] for a, b in zip(r[:n], r[n:], strict=True)]
            self.wide = arb_mat.of(rows, around, 2 * self.ncols())
        return self.wide


class arb_poly(Polynomial):
    """A polynomial with enclosed coefficients."""

    __slots__ = ()
    field = arb

    def __call__(self, point: Any) -> Any:
        """By Horner's scheme, on middles and radii; of other points as of any polynomial."""
        if not isinstance(point, arb):
            return super().__call__(point)
        x, far, m, r = point.m, abs(point.m) + point.r, 0, 0
        for c in reversed(self.terms):
            m, r = (m * x >> BITS) + c.m, (abs(m) * point.r + r * far >> BITS) + 2 + c.r
        return ball(m, r)

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, arb_poly) or not self.terms or not other.terms:
            return super().__mul__(other)
        # The product of a band of shifted coefficients with the other ones.
        n, size = len(self.terms), len(self.terms) + len(other.terms) - 1
        column = [[[getattr(c, part)] for c in self.terms] for part in "mr"]
        shifted = [[0] * (n - 1) + [getattr(c, part) for c in reversed(other.terms)] + [0] * (n - 1) for part in "mr"]
        bands = [[row[size - 1 - k : size - 1 - k + n] for k in range(size)] for row in shifted]
        m, r = times(*bands, *column)
        return arb_poly([ball(*pair) for (pair,) in (zip(a, b, strict=True) for a, b in zip(m, r, strict=True))])


class acb_poly(Polynomial):
    """A polynomial with enclosed complex coefficients."""

    __slots__ = ()
    field = acb
