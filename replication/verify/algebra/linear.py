"""Exact linear algebra over the rationals: blocks, definiteness, linear equations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.work import spend_characteristic, spend_product, spend_solution
from replication.verify.theorem import Refused, require


def zeros(rows: int, columns: int) -> fmpq_mat:
    """The zero matrix."""
    return fmpq_mat(rows, columns)


def identity(size: int) -> fmpq_mat:
    """The identity matrix."""
    return fmpq_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])


def block(rows: Sequence[Sequence[fmpq_mat]]) -> fmpq_mat:
    """The matrix made of these blocks; blocks without rows or columns may take part."""
    table: list[list[fmpq]] = []
    for row in rows:
        height = row[0].nrows()
        require(all(part.nrows() == height for part in row), "blocks beside each other differ in their rows")
        parts = [part.tolist() for part in row]
        table.extend([entry for part in parts for entry in part[i]] for i in range(height))
    width = sum(part.ncols() for part in rows[0])
    require(all(len(entries) == width for entries in table), "blocks above each other differ in their columns")
    return fmpq_mat(len(table), width, [entry for entries in table for entry in entries])


def submatrix(M: fmpq_mat, rows: Sequence[int], columns: Sequence[int]) -> fmpq_mat:
    """These rows and columns of M."""
    return fmpq_mat(len(rows), len(columns), [M[i, j] for i in rows for j in columns])


def take_rows(M: fmpq_mat, rows: Sequence[int]) -> fmpq_mat:
    """These rows of M, all columns."""
    return submatrix(M, rows, range(M.ncols()))


def product(A: fmpq_mat, B: fmpq_mat) -> fmpq_mat:
    """A B, its work estimated."""
    spend_product(A, B)
    result: fmpq_mat = A * B
    return result


def characteristic_polynomial(M: fmpq_mat) -> Any:
    """det(z I − M), its work estimated."""
    spend_characteristic(M)
    return M.charpoly()


def solved(M: Any, right: Any, what: str) -> Any:
    """M^{-1} right, in rationals or balls; refused, by these words, if M is not proved invertible."""
    spend_solution(M, right)
    try:
        return M.solve(right)
    except ZeroDivisionError:
        raise Refused(what) from None
