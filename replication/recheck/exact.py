"""Linear algebra on rows of entries of any field, and exact tests: positive, semidefinite, Schur, Hurwitz."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import reduce
from math import lcm
from operator import mul
from typing import Any

from replication.recheck.reading import Matrix, need


def times(*factors: Matrix) -> Matrix:
    """The product of matrices."""
    return reduce(_times, factors)


def _times(left: Matrix, right: Matrix) -> Matrix:
    columns = list(zip(*right, strict=True))
    return [[sum(map(mul, row, column)) for column in columns] for row in left]


def plus(*terms: Matrix) -> Matrix:
    """The sum of matrices."""
    return [[sum(entries) for entries in zip(*rows, strict=True)] for rows in zip(*terms, strict=True)]


def scaled(factor: Any, matrix: Matrix) -> Matrix:
    """A matrix times a number."""
    return [[factor * entry for entry in row] for row in matrix]


def minus(left: Matrix, right: Matrix) -> Matrix:
    """The difference of two matrices."""
    return [[a - b for a, b in zip(*rows, strict=True)] for rows in zip(left, right, strict=True)]


def turned(matrix: Matrix) -> Matrix:
    """The transpose."""
    return [list(column) for column in zip(*matrix, strict=True)]


def unit(size: int, value: Any = Fraction(1)) -> Matrix:
    """A multiple of the identity."""
    return [[value if i == j else Fraction(0) for j in range(size)] for i in range(size)]


def nought(rows: int, columns: int) -> Matrix:
    """A matrix of zeros."""
    return [[Fraction(0)] * columns for _ in range(rows)]


def blocks(rows: Sequence[Sequence[Matrix]]) -> Matrix:
    """A matrix from its blocks."""
    return [[entry for block in row for entry in block[i]] for row in rows for i in range(len(row[0]))]


def part(matrix: Matrix, rows: slice | Sequence[int], columns: slice | Sequence[int]) -> Matrix:
    """A block, or chosen rows and columns."""
    chosen = matrix[rows] if isinstance(rows, slice) else [matrix[i] for i in rows]
    return [row[columns] if isinstance(columns, slice) else [row[j] for j in columns] for row in chosen]


def squares(matrix: Matrix) -> Any:
    """The sum of the squares of all entries."""
    return sum(entry * entry for row in matrix for entry in row)


def trace(matrix: Matrix) -> Any:
    """The sum of the diagonal."""
    return sum(matrix[i][i] for i in range(len(matrix)))


def solved(matrix: Matrix, right: Matrix) -> Matrix:
    """The solution X of matrix X = right; refused if a pivot may vanish."""
    rows = [[*left, *beside] for left, beside in zip(matrix, right, strict=True)]
    size = len(rows)
    for i in range(size):
        best = max(range(i, size), key=lambda k: _weight(rows[k][i]))
        rows[i], rows[best] = rows[best], rows[i]
        need(_weight(rows[i][i]) > 0, "a linear system is singular, or not enclosed well enough")
        pivot = 1 / rows[i][i]
        rows[i] = [*rows[i][: i + 1], *(pivot * entry for entry in rows[i][i + 1 :])]
        for k in range(size):
            if k != i and rows[k][i] != 0:
                factor = rows[k][i]
                rows[k] = [
                    *rows[k][: i + 1],
                    *(a - factor * b for a, b in zip(rows[k][i + 1 :], rows[i][i + 1 :], strict=True)),
                ]
    return [row[size:] for row in rows]


def _weight(entry: Any) -> Any:
    return entry.weight() if hasattr(entry, "weight") else abs(entry)


def inverse(matrix: Matrix) -> Matrix:
    """The inverse."""
    return solved(matrix, unit(len(matrix)))


def power(matrix: Matrix, exponent: int) -> Matrix:
    """A power, by repeated squaring."""
    found = unit(len(matrix))
    while exponent:
        if exponent & 1:
            found = times(found, matrix)
        matrix = times(matrix, matrix) if exponent > 1 else matrix
        exponent >>= 1
    return found


def characteristic(matrix: Matrix) -> list[Any]:
    """The coefficients of det(z - matrix), from that of z^0 on (Faddeev and LeVerrier)."""
    size = len(matrix)
    found: list[Any] = [Fraction(1)]
    current = unit(size)
    for k in range(1, size + 1):
        step = times(matrix, current)
        found.append(trace(step) * Fraction(-1, k))
        current = plus(step, unit(size, found[-1]))
    return found[::-1]


def determinant(matrix: Matrix) -> Any:
    """The determinant, without divisions by entries."""
    return characteristic(matrix)[0] * (-1) ** len(matrix)


def rank(matrix: Matrix) -> int:
    """The rank of a rational matrix."""
    rows, found = [list(row) for row in matrix], 0
    for column in range(len(matrix[0])):
        chosen = next((k for k in range(found, len(rows)) if rows[k][column] != 0), None)
        if chosen is None:
            continue
        rows[found], rows[chosen] = rows[chosen], rows[found]
        for k in range(found + 1, len(rows)):
            factor = rows[k][column] / rows[found][column]
            rows[k] = [a - factor * b for a, b in zip(rows[k], rows[found], strict=True)]
        found += 1
    return found


def integers(matrix: Matrix) -> list[list[int]]:
    """A positive multiple of a rational matrix with integer entries."""
    common = lcm(*(entry.denominator for row in matrix for entry in row))
    return [[entry.numerator * (common // entry.denominator) for entry in row] for row in matrix]


def is_positive(matrix: Matrix) -> bool:
    """Whether a symmetric rational matrix is positive definite: all leading minors, by Bareiss, are positive."""
    return _eliminated(matrix, strict=True)


def is_semidefinite(matrix: Matrix) -> bool:
    """Whether a symmetric rational matrix is positive semidefinite: a zero pivot must stand in a row of zeros."""
    return _eliminated(matrix, strict=False)


def _eliminated(matrix: Matrix, strict: bool) -> bool:
    rows = integers(matrix)
    need(rows == turned(rows), "a matrix that must be symmetric is not")
    before = 1
    for i in range(len(rows)):
        pivot = rows[i][i]
        if pivot < 0 or (pivot == 0 and (strict or any(rows[i][i + 1 :]))):
            return False
        if pivot == 0:
            continue
        for k in range(i + 1, len(rows)):
            factor = rows[i][k]
            for j in range(k, len(rows)):
                rows[k][j] = (pivot * rows[k][j] - factor * rows[i][j]) // before
        before = pivot
    return True


def is_schur(polynomial: Sequence[Any], radius: Any = Fraction(1)) -> bool:
    """Whether all roots of a real polynomial lie surely inside a circle about zero (Schur and Cohn)."""
    rest = [coefficient * radius**i for i, coefficient in enumerate(polynomial)]
    while len(rest) > 1:
        first, last = rest[0], rest[-1]
        if not first * first < last * last:
            return False
        rest = [a - first / last * b for a, b in zip(rest, rest[::-1], strict=True)][1:]
    return True


def is_hurwitz(matrix: Matrix) -> bool:
    """Whether all eigenvalues of a rational matrix have negative real parts, by Routh's array."""
    rest = characteristic(matrix)[::-1]
    above, below = rest[::2], [*rest[1::2], *([Fraction(0)] if len(rest) % 2 else [])]
    for _ in matrix:
        if not below[0] > 0:
            return False
        factor = above[0] / below[0]
        above, below = below, [a - factor * b for a, b in zip(above[1:], [*below[1:], Fraction(0)], strict=False)]
        below.append(Fraction(0))
    return True


class Complex:
    """A complex number over any field of real numbers."""

    __slots__ = ("im", "re")

    def __init__(self, re: Any, im: Any = Fraction(0)) -> None:
        self.re, self.im = re, im

    @staticmethod
    def of(value: Any) -> Complex:
        """The number itself, or a real one as a complex one."""
        return value if isinstance(value, Complex) else Complex(value)

    def __add__(self, other: Any) -> Complex:
        other = Complex.of(other)
        return Complex(self.re + other.re, self.im + other.im)

    __radd__ = __add__

    def __neg__(self) -> Complex:
        return Complex(-self.re, -self.im)

    def __sub__(self, other: Any) -> Complex:
        return self + (-Complex.of(other))

    def __rsub__(self, other: Any) -> Complex:
        return Complex.of(other) + (-self)

    def __mul__(self, other: Any) -> Complex:
        if not isinstance(other, Complex):
            return Complex(self.re * other, self.im * other)
        return Complex(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)

    __rmul__ = __mul__

    def __rtruediv__(self, other: Any) -> Complex:
        answer: Complex = Complex(self.re, -self.im) * (1 / self.size2()) * other
        return answer

    def __eq__(self, other: object) -> bool:
        other = Complex.of(other)
        return bool(self.re == other.re and self.im == other.im)

    __hash__ = None  # type: ignore[assignment]

    def size2(self) -> Any:
        """The square of the modulus."""
        return self.re * self.re + self.im * self.im

    def weight(self) -> Any:
        """How far from zero it surely is, as a pivot."""
        return _weight(self.size2())
