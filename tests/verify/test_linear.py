"""Exact linear algebra of the verifier."""

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.linear import (
    block,
    identity,
    is_schur,
    require_hurwitz,
    require_order,
    require_positive_definite,
    require_positive_semidefinite,
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


@pytest.mark.parametrize(
    ("coefficients", "stable"),
    [
        ([1], True),
        ([-3], True),
        ([1, 2], True),
        ([1, -2], True),
        ([2, 1], False),
        ([1, 1], False),
        ([-1, 1], False),
        ([0, 0, 0, 5], True),
        # z^2 - z + 1/2 has roots of modulus 1/sqrt(2); z^2 - 2 z + 1 a double one; z^2 + 1 a pair on the circle.
        ([1, -2, 2], True),
        ([1, -2, 1], False),
        ([1, 0, 1], False),
        # (z - 1/2)(z - 2) and (z - 1/2)(z - 1/3)(z + 3/4): 24 times.
        ([2, -5, 2], False),
        ([3, -11, -2, 24], True),
        # (z - 1)(z - 1/2)(z + 1/2)
        ([1, -1, -4, 4], False),
    ],
)
def test_schur(coefficients: list[int], stable: bool) -> None:
    assert is_schur(fmpq_poly(coefficients)) is stable


def companion(*coefficients: int) -> fmpq_mat:
    """A matrix with the characteristic polynomial s^n + .. + a_1 s + a_0, given a_0, a_1, .."""
    n = len(coefficients)
    last = [[-entry for entry in coefficients]]
    return fmpq_mat([[int(j == i + 1) for j in range(n)] for i in range(n - 1)] + last)


# s + 1, s^2 + s + 1, (s + 1)^3, s^4 + 2 s^3 + 3 s^2 + 2 s + 1, s^3 + s^2 + 2 s + 1, (s + 1)^5.
@pytest.mark.parametrize("M", [(1,), (1, 1), (1, 3, 3), (1, 2, 3, 2), (1, 2, 1), (1, 5, 10, 10, 5)])
def test_hurwitz(M: tuple[int, ...]) -> None:
    require_hurwitz(companion(*M), "M")


@pytest.mark.parametrize("M", [(0,), (-1,), (1, 0), (0, 1), (-1, 1), (1, 1, 1), (4, 2, 1), (0, 1, 1), (1, 1, 1, 1)])
def test_not_hurwitz(M: tuple[int, ...]) -> None:
    with pytest.raises(Refused, match="M is not Hurwitz"):
        require_hurwitz(companion(*M), "M")


def test_the_zero_polynomial_is_refused() -> None:
    with pytest.raises(Refused, match="zero polynomial"):
        is_schur(fmpq_poly([]))


def test_schur_of_a_high_degree_ends() -> None:
    """Of degree 60: a recursion that multiplies by both ends would double the digits 60 times."""
    inside = fmpq_poly([fmpq(1, 3), *[fmpq(1, 1000 + k) for k in range(59)], 1])
    assert is_schur(inside)
    assert not is_schur(fmpq_poly(inside.coeffs()[::-1]))
    assert is_schur(fmpq_poly([fmpq(1, 2), *[0] * 59, 1]))


def test_orders_up_to_the_largest_are_allowed() -> None:
    require_order(50, "A")
    with pytest.raises(Refused, match="A has 51 states, more than 50"):
        require_order(51, "A")
