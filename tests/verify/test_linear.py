"""Exact linear algebra of the verifier."""

import pytest
from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import (
    block,
    identity,
    require_positive_definite,
    require_positive_semidefinite,
    solved,
    submatrix,
    take_rows,
    zeros,
)
from replication.verify.theorem import Refused

DEFINITE = fmpq_mat([[2, -1, 0], [-1, 2, -1], [0, -1, 2]])
SINGULAR = fmpq_mat([[1, 1], [1, 1]])
INDEFINITE = fmpq_mat([[1, 2], [2, 1]])
HOLLOW = fmpq_mat([[0, 1], [1, 0]])
SKEW = fmpq_mat([[1, fmpq(1, 10**30)], [0, 1]])


def test_positive_definite() -> None:
    require_positive_definite(DEFINITE, "M")
    require_positive_definite(DEFINITE / 7, "M")
    require_positive_definite(identity(1), "M")
    # By 10^-60 only.
    near = fmpq_mat([[1, 1 - fmpq(1, 10**60)], [1 - fmpq(1, 10**60), 1]])
    require_positive_definite(near, "M")


@pytest.mark.parametrize("M", [SINGULAR, INDEFINITE, HOLLOW, -DEFINITE, zeros(2, 2), fmpq_mat([[0, 0], [0, 1]])])
def test_not_positive_definite(M: fmpq_mat) -> None:
    with pytest.raises(Refused, match="M is not positive definite"):
        require_positive_definite(M, "M")


def test_semidefinite() -> None:
    for M in (DEFINITE, SINGULAR, zeros(2, 2), zeros(3, 3), identity(2)):
        require_positive_semidefinite(M, "M")
    for M in (INDEFINITE, HOLLOW, -SINGULAR, -identity(3), -identity(1)):
        with pytest.raises(Refused, match="M is not positive semidefinite"):
            require_positive_semidefinite(M, "M")


def test_definiteness_is_for_symmetric_matrices() -> None:
    for test in (require_positive_definite, require_positive_semidefinite):
        with pytest.raises(Refused, match="M is not symmetric"):
            test(SKEW, "M")


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
