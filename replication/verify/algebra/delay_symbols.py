"""Matrices whose entries are polynomials in symbols, for identities that hold for all matrices of a size."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from flint import Ordering, fmpq_mpoly, fmpq_mpoly_ctx


@dataclass(frozen=True)
class Symbolic:
    """A matrix of polynomials in one ring."""

    rows: tuple[tuple[fmpq_mpoly, ...], ...]

    @property
    def T(self) -> Symbolic:
        """The transpose."""
        return Symbolic(tuple(zip(*self.rows, strict=True)))

    def __add__(self, other: Symbolic) -> Symbolic:
        """The sum."""
        pairs = zip(self.rows, other.rows, strict=True)
        return Symbolic(tuple(tuple(a + b for a, b in zip(*pair, strict=True)) for pair in pairs))

    def __sub__(self, other: Symbolic) -> Symbolic:
        """The difference."""
        return self + other * -1

    def __mul__(self, factor: fmpq_mpoly | int) -> Symbolic:
        """The multiple by a polynomial."""
        return self.each(lambda entry: entry * factor)

    def __matmul__(self, other: Symbolic) -> Symbolic:
        """The product."""
        columns = other.T.rows
        return Symbolic(tuple(tuple(_dot(row, column) for column in columns) for row in self.rows))

    def each(self, change: Callable[[fmpq_mpoly], fmpq_mpoly]) -> Symbolic:
        """The matrix of the changed entries."""
        return Symbolic(tuple(tuple(change(entry) for entry in row) for row in self.rows))

    @property
    def entry(self) -> fmpq_mpoly:
        """The only entry of a 1 x 1 matrix."""
        ((value,),) = self.rows
        return value

    def vanishes(self) -> bool:
        """Whether every entry is the zero polynomial."""
        return all(entry.is_zero() for row in self.rows for entry in row)


def _dot(row: tuple[fmpq_mpoly, ...], column: tuple[fmpq_mpoly, ...]) -> fmpq_mpoly:
    first, *others = (a * b for a, b in zip(row, column, strict=True))
    return sum(others, first)


def symbols(shapes: Mapping[str, tuple[int, int]], symmetric: frozenset[str] = frozenset()) -> dict[str, Symbolic]:
    """A matrix of independent symbols for each name and shape; those named in `symmetric` are symmetric."""

    def symbol(name: str, i: int, j: int) -> str:
        low, high = (min(i, j), max(i, j)) if name in symmetric else (i, j)
        return f"{name}_{low}_{high}"

    layout = {
        name: [[symbol(name, i, j) for j in range(columns)] for i in range(rows)]
        for name, (rows, columns) in shapes.items()
    }
    flat = list(dict.fromkeys(entry for table in layout.values() for row in table for entry in row))
    ring = fmpq_mpoly_ctx.get(flat, Ordering.degrevlex)
    known = {entry: ring.gen(i) for i, entry in enumerate(flat)}
    return {name: Symbolic(tuple(tuple(known[e] for e in row) for row in table)) for name, table in layout.items()}


def unit(size: int, one: fmpq_mpoly) -> Symbolic:
    """The identity matrix in the ring of `one`."""
    return Symbolic(tuple(tuple(one if i == j else one - one for j in range(size)) for i in range(size)))
