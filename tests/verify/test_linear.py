"""Exact linear algebra of the verifier."""

import pytest
from flint import fmpq_mat

from replication.verify.algebra.linear import (
    block,
    identity,
    solved,
    submatrix,
    take_rows,
    zeros,
)
from replication.verify.theorem import Refused

DEFINITE = fmpq_mat([[2, -1, 0], [-1, 2, -1], [0, -1, 2]])
SINGULAR = fmpq_mat([[1, 1], [1, 1]])


def test_blocks() -> None:
    M = block([[identity(2), zeros(2, 1)], [fmpq_mat([[1, 2]]), fmpq_mat([[3]])]])
    assert fmpq_mat([[1, 0, 0], [0, 1, 0], [1, 2, 3]]) == M
    assert block([[identity(1), zeros(1, 0)]]) == identity(1)
    with pytest.raises(Refused, match="beside"):
        block([[identity(2), zeros(1, 1)]])
    with pytest.raises(Refused, match="above"):
        block([[identity(2)], [zeros(1, 1)]])
    assert submatrix(M, [2, 0], [1]) == fmpq_mat([[2], [0]])
    assert take_rows(M, [2]) == fmpq_mat([[1, 2, 3]])


def test_what_cannot_be_solved_is_refused_in_the_words_given() -> None:
    assert solved(DEFINITE, identity(3), "M is singular") == DEFINITE.inv()
    with pytest.raises(Refused, match=r"^M is singular$"):
        solved(SINGULAR, identity(2), "M is singular")
