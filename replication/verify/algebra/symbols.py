"""Matrices with a symbol for every entry: an identity holds iff the difference of its sides is the zero polynomial."""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq, fmpq_mpoly, fmpq_mpoly_ctx

from replication.verify.theorem import require

Matrix = list[list[fmpq_mpoly]]
"""A matrix of polynomials, as rows."""


def symbols(**shapes: tuple[int, int]) -> dict[str, Matrix]:
    """Matrices of these shapes whose entries are all different symbols."""
    names = [f"{name}_{i}_{j}" for name, (rows, columns) in shapes.items() for i in range(rows) for j in range(columns)]
    entries = iter(fmpq_mpoly_ctx.get(names).gens())
    return {
        name: [[next(entries) for _ in range(columns)] for _ in range(rows)] for name, (rows, columns) in shapes.items()
    }


def add(*terms: Matrix) -> Matrix:
    """The sum."""
    return [[sum(entries[1:], entries[0]) for entries in zip(*rows, strict=True)] for rows in zip(*terms, strict=True)]


def scale(factor: int | fmpq, term: Matrix) -> Matrix:
    """factor · term."""
    return [[factor * entry for entry in row] for row in term]


def product(*factors: Matrix) -> Matrix:
    """The product from left to right."""
    total = factors[0]
    for factor in factors[1:]:
        columns = list(zip(*factor, strict=True))
        total = [[_dot(row, column) for column in columns] for row in total]
    return total


def require_equal(left: Matrix, right: Matrix, what: str) -> None:
    """Refuse unless both sides are the same polynomials."""
    same = all(entry.is_zero() for row in add(left, scale(-1, right)) for entry in row)
    require(same, f"{what} is no identity")


def _dot(left: Sequence[fmpq_mpoly], right: Sequence[fmpq_mpoly]) -> fmpq_mpoly:
    terms = [a * b for a, b in zip(left, right, strict=True)]
    return sum(terms[1:], terms[0])
