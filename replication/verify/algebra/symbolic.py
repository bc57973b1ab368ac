"""Matrices of polynomials with rational coefficients, each entry of a named matrix a symbol of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flint import Ordering, fmpq_mpoly, fmpq_mpoly_ctx

Symbolic = list[list[fmpq_mpoly]]


class Symbols:
    """Matrices by name, of the given shapes (rows, columns), and single symbols.

    Of those in `symmetric` the entries mirror each other, of those in `diagonal` the others are zero.
    """

    def __init__(
        self,
        shapes: Mapping[str, tuple[int, int]],
        scalars: Sequence[str] = (),
        symmetric: Sequence[str] = (),
        diagonal: Sequence[str] = (),
    ) -> None:
        def symbol(name: str, i: int, j: int) -> str:
            low, high = (min(i, j), max(i, j)) if name in symmetric else (i, j)
            return f"{name}_{low}_{high}"

        tables = {
            name: [[symbol(name, i, j) for j in range(columns)] for i in range(rows)]
            for name, (rows, columns) in shapes.items()
        }
        names = (*scalars, *dict.fromkeys(entry for table in tables.values() for row in table for entry in row))
        self.context = fmpq_mpoly_ctx.get(names, Ordering.lex)
        self.symbols = dict(zip(names, self.context.gens(), strict=True))
        self.matrices: dict[str, Symbolic] = {
            name: [[self.symbols[entry] for entry in row] for row in table] for name, table in tables.items()
        }
        for name in diagonal:
            self.matrices[name] = self.diagonal([row[i] for i, row in enumerate(self.matrices[name])])

    def diagonal(self, entries: Sequence[fmpq_mpoly]) -> Symbolic:
        """The diagonal matrix of these polynomials."""
        zero = self.context.constant(0)
        return [[entry if i == j else zero for j in range(len(entries))] for i, entry in enumerate(entries)]

    def zeros(self, rows: int, columns: int) -> Symbolic:
        """The zero matrix."""
        return [[self.context.constant(0)] * columns for _ in range(rows)]


def times(*factors: Symbolic) -> Symbolic:
    """The product of matrices, from the left."""
    total = factors[0]
    for factor in factors[1:]:
        total = [[dot(row, column) for column in zip(*factor, strict=True)] for row in total]
    return total


def dot(row: Sequence[fmpq_mpoly], column: Sequence[fmpq_mpoly]) -> fmpq_mpoly:
    """The sum of the products of entries."""
    first, *others = (a * b for a, b in zip(row, column, strict=True))
    return sum(others, first)


def plus(*terms: Symbolic) -> Symbolic:
    """The sum of matrices."""
    return [[sum(entries[1:], entries[0]) for entries in zip(*rows, strict=True)] for rows in zip(*terms, strict=True)]


def minus(first: Symbolic, *others: Symbolic) -> Symbolic:
    """The first matrix less all others."""
    return plus(first, *([[-entry for entry in row] for row in other] for other in others))


def transposed(M: Symbolic) -> Symbolic:
    """The transpose."""
    return [list(column) for column in zip(*M, strict=True)]


def blocks(rows: Sequence[Sequence[Symbolic]]) -> Symbolic:
    """The matrix made of these blocks."""
    return [[entry for part in parts for entry in part] for row in rows for parts in zip(*row, strict=True)]


def width(M: Symbolic) -> int:
    """The number of columns."""
    (columns,) = {len(row) for row in M}
    return columns
