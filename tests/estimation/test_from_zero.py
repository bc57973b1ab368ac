"""The states of all phases at once against the recursion one phase after the other; what has no limit is None."""

from __future__ import annotations

import numpy as np
import pytest

from replication.estimation.linear.riccati import RiccatiMap, apply, from_zero, settled, solve, stacked
from replication.estimation.validation import Array
from tests.tolerances import ROUNDING


def maps(rng: np.random.Generator, count: int, n: int, size: float) -> list[RiccatiMap]:
    found = []
    for _ in range(count):
        A, C, B = rng.normal(size=(n, n)), rng.normal(size=(1, n)), rng.normal(size=(n, 1))
        found.append(RiccatiMap(size * A / np.linalg.norm(A, 2), C.T @ C, B @ B.T))
    return found


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7, 8, 13])
@pytest.mark.parametrize("size", [0.9, 1.3])
def test_they_are_those_of_the_recursion(count: int, size: float) -> None:
    stages = maps(np.random.default_rng(count), count, 3, size)
    found, wanted = from_zero(stacked(stages)), settled(stacked(stages))
    assert found is not None and wanted is not None
    np.testing.assert_allclose(found, wanted, atol=ROUNDING * np.linalg.norm(wanted))
    for k, stage in enumerate(stages):
        following: Array = found[(k + 1) % count]
        np.testing.assert_allclose(apply(stage, found[k]), following, atol=ROUNDING * np.linalg.norm(following))


def test_singular_transitions_are_no_exception() -> None:
    stages = maps(np.random.default_rng(0), 5, 3, 0.9)
    stages[2] = stages[2]._replace(A=np.zeros((3, 3)))
    found = from_zero(stacked(stages))
    assert found is not None
    np.testing.assert_allclose(found[3], stages[2].H)


@pytest.mark.parametrize("mode", [1.0, -1.0])
def test_a_motion_that_does_not_die_out_has_none(mode: float) -> None:
    """From zero a mode that nothing disturbs stays at zero, which is a limit, and not the one that stabilises."""
    stage = RiccatiMap(np.diag([mode, 0.5]), np.ones((2, 2)), np.diag([0.0, 1.0]))
    assert from_zero(stacked([stage] * 3)) is None
    disturbed = stage._replace(H=np.eye(2))
    assert from_zero(stacked([disturbed] * 3)) is not None


def test_what_grows_without_bound_has_none() -> None:
    unseen = RiccatiMap(np.diag([1.1, 0.5]), np.diag([0.0, 1.0]), np.eye(2))
    assert from_zero(stacked([unseen] * 2)) is None


def test_a_singular_matrix_is_an_error() -> None:
    for matrix in (np.zeros((2, 2)), np.zeros((3, 2, 2))):
        with pytest.raises(np.linalg.LinAlgError):
            solve(matrix, np.ones_like(matrix))
