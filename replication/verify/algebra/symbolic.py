"""Matrices of polynomials with a symbol for every entry: an identity between them holds for all matrices of a size.

Or matrices whose blocks are words, with a letter for every block: an identity holds for blocks of all sizes that fit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import add, sub
from typing import Any

from flint import Ordering, fmpq, fmpq_mpoly_ctx

from replication.verify.algebra.words import Words, letter

Entry = Any
"""A polynomial, or a sum of words."""
Change = Callable[[Entry], Entry]
Shapes = Mapping[str, tuple[int, int]]


@dataclass(frozen=True)
class Symbolic:
    """A matrix of polynomials in one ring, or of words, by rows."""

    rows: tuple[tuple[Entry, ...], ...]

    @property
    def T(self) -> Symbolic:
        """The transpose."""
        mirrored = Symbolic(tuple(zip(*self.rows, strict=True)))
        return mirrored.each(lambda entry: entry.T if isinstance(entry, Words) else entry)

    @property
    def entry(self) -> Entry:
        """The only entry of a 1 x 1 matrix."""
        ((value,),) = self.rows
        return value

    def __add__(self, other: Symbolic) -> Symbolic:
        """The sum."""
        return self._beside(add, other)

    def __sub__(self, other: Symbolic) -> Symbolic:
        """The difference."""
        return self._beside(sub, other)

    def __neg__(self) -> Symbolic:
        """The negative."""
        return self * -1

    def __mul__(self, factor: Entry | fmpq | int) -> Symbolic:
        """The multiple by a polynomial, a central letter or a number."""
        return self.each(lambda entry: entry * factor)

    def __matmul__(self, other: Symbolic) -> Symbolic:
        """The product."""
        columns = tuple(zip(*other.rows, strict=True))
        return Symbolic(tuple(tuple(_dot(row, column) for column in columns) for row in self.rows))

    def each(self, change: Change) -> Symbolic:
        """The matrix of the changed entries."""
        return Symbolic(tuple(tuple(change(entry) for entry in row) for row in self.rows))

    def is_zero(self) -> bool:
        """Whether every entry is zero."""
        return all(entry.is_zero() for row in self.rows for entry in row)

    def _beside(self, operation: Callable[[Entry, Entry], Entry], other: Symbolic) -> Symbolic:
        pairs = zip(self.rows, other.rows, strict=True)
        return Symbolic(tuple(tuple(operation(a, b) for a, b in zip(*pair, strict=True)) for pair in pairs))


def _dot(row: Sequence[Entry], column: Sequence[Entry]) -> Entry:
    first, *others = (a * b for a, b in zip(row, column, strict=True))
    return sum(others, first)


def symbols(shapes: Shapes, symmetric: Sequence[str] = (), diagonal: Sequence[str] = ()) -> dict[str, Symbolic]:
    """A matrix of symbols of its own for each name and shape (rows, columns).

    Of those in `symmetric` the entries mirror each other, of those in `diagonal` the others are zero.
    """

    def symbol(name: str, i: int, j: int) -> str:
        low, high = (min(i, j), max(i, j)) if name in symmetric else (i, j)
        return f"{name}_{low}_{high}" if i == j or name not in diagonal else ""

    tables = {
        name: [[symbol(name, i, j) for j in range(columns)] for i in range(rows)]
        for name, (rows, columns) in shapes.items()
    }
    names = [*dict.fromkeys(entry for table in tables.values() for row in table for entry in row if entry)]
    ring = fmpq_mpoly_ctx.get(names, Ordering.degrevlex)
    known = {"": ring.constant(0), **dict(zip(names, ring.gens(), strict=True))}
    return {
        name: Symbolic(tuple(tuple(known[entry] for entry in row) for row in rows)) for name, rows in tables.items()
    }


def letters(*names: str, symmetric: Sequence[str] = ()) -> tuple[Symbolic, ...]:
    """A matrix of any size for each name; those in `symmetric` are their own transposes."""
    return tuple(Symbolic(((letter(name, symmetric=name in symmetric),),)) for name in names)


def unit(size: int, one: Entry) -> Symbolic:
    """The identity matrix times a polynomial, or of so many blocks."""
    return Symbolic(tuple(tuple(one if i == j else one - one for j in range(size)) for i in range(size)))


def blocks(table: Sequence[Sequence[Symbolic]]) -> Symbolic:
    """The matrix made of these blocks."""
    rows = [zip(*(part.rows for part in parts), strict=True) for parts in table]
    return Symbolic(tuple(tuple(entry for piece in pieces for entry in piece) for row in rows for pieces in row))
