"""Matrices of polynomials with rational coefficients, each entry of a named matrix a symbol of its own."""

from __future__ import annotations

from collections.abc import Sequence

from flint import Ordering, fmpq_mpoly, fmpq_mpoly_ctx

Symbolic = list[list[fmpq_mpoly]]


class Symbols:
    """The matrices of the given shapes (rows, columns) by name; those in `symmetric` have mirrored entries."""

    def __init__(self, shapes: dict[str, tuple[int, int]], symmetric: Sequence[str] = ()) -> None:
        places = {(name, i, j) for name, (rows, columns) in shapes.items() for i in range(rows) for j in range(columns)}
        mirrored = {(name, *((i, j) if i <= j or name not in symmetric else (j, i))) for name, i, j in places}
        names = {place: f"{place[0]}_{place[1]}_{place[2]}" for place in sorted(mirrored)}
        self.context = fmpq_mpoly_ctx.get(tuple(names.values()), Ordering.lex)
        generators = dict(zip(names, self.context.gens(), strict=True))
        self.matrices: dict[str, Symbolic] = {
            name: [
                [generators[(name, i, j) if (name, i, j) in generators else (name, j, i)] for j in range(columns)]
                for i in range(rows)
            ]
            for name, (rows, columns) in shapes.items()
        }

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
