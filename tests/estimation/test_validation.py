"""Checks of arguments."""

from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.validation import (
    as_array,
    as_matrix,
    at_most,
    increasing_grid,
    positive_integer,
    positive_scalar,
    undetectable_mode,
)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([[1, float("nan")]], r"entry \(0, 1\) is nan"),
        ([[float("inf"), 1]], r"entry \(0, 0\) is inf"),
        ([1, 2, 3], "two dimensions"),
        (5.0, r"two dimensions, got shape \(\); write a single number as \[\[5.0\]\]"),
        (None, "M must be an array of real numbers, got None: None is not a number"),
        ([[1, None]], "real numbers, got .*: None is not a number"),
        ([[1, 2], [3]], "real numbers"),
        ([["1", "2"]], "real numbers"),
        (np.array([[1 + 1j]]), "real numbers"),
        ([[{}, 1]], "real numbers"),
        ([[10**400, 1]], "real numbers, got .*: int too large"),
        (np.array([["1", 2]], dtype=object), "'1' is not a number"),
        (np.array([[np.complex64(1j), 2]], dtype=object), "is not a number"),
        (np.ma.array([[1.0, 2.0]], mask=[[False, True]]), "entries are masked"),
        ([[1, 2], [3, 4]], "M must have 1 rows, got shape"),
        ([[1]], "M must have 2 columns, got shape"),
    ],
)
def test_a_bad_matrix_is_named(value: Any, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message) as caught:
        as_matrix("M", value, rows=1, columns=2)
    assert "M" in str(caught.value)


def test_a_matrix_is_copied_and_frozen() -> None:
    given = np.ones((2, 2))
    matrix = as_matrix("M", given)
    given[0, 0] = 7
    assert matrix[0, 0] == 1
    with pytest.raises(ValueError, match="read-only"):
        matrix[0, 0] = 2
    assert given.flags.writeable


def test_integers_and_booleans_are_numbers() -> None:
    assert as_matrix("M", [[1, 0]]).dtype == float
    assert as_matrix("M", [[True, False]]).tolist() == [[1.0, 0.0]]


def test_an_array_has_exactly_its_shape() -> None:
    assert as_array("x", [1, 2], (2,)).tolist() == [1.0, 2.0]
    with pytest.raises(InvalidInputError, match=r"x must have shape \(n,\) = \(3,\), got shape \(2,\)"):
        as_array("x", [1, 2], (3,), axes="(n,)")


@pytest.mark.parametrize("value", [0, -1, 2.0, 2.5, True, np.True_, "3", None, float("nan"), 10**400])
def test_periods_are_positive_whole_numbers(value: Any) -> None:
    with pytest.raises(InvalidInputError, match="N must be"):
        positive_integer("N", value)
    assert positive_integer("N", np.int64(4)) == 4


@pytest.mark.parametrize("value", [0, -1.5, float("nan"), float("inf"), True, "a", None, 1j, np.complex64(1), 10**400])
def test_a_scalar_is_positive_and_finite(value: Any) -> None:
    with pytest.raises(InvalidInputError, match="level must be"):
        positive_scalar("level", value)
    assert positive_scalar("level", np.float64(0.5)) == 0.5


@pytest.mark.parametrize(
    ("state", "output", "lost"),
    [
        (np.diag([1.2, 0.5]), [[0, 1]], 1.2),
        (np.diag([1.2, 0.5]), [[1, 0]], None),
        (np.diag([1.0, 0.5]), [[0, 1]], 1.0),
        (np.diag([1.2, 1.2]), [[1, 1]], 1.2),
        (np.array([[1.2, 1], [0, 1.2]]), [[1, 0]], None),
        (np.array([[1.2, 1], [0, 1.2]]), [[0, 1]], 1.2),
        # Two states in units apart by eight powers of ten, and the same with the sensor on the mode that decays.
        (np.array([[1.2, 3e-8], [0, 0.5]]), [[1e-4, 1e4]], None),
        (np.array([[1.2, 0], [3e8, 0.5]]), [[0, 1]], None),
        (np.diag([1.2, 0.5]), [[1e-8, 0]], None),
    ],
)
def test_a_mode_is_lost_iff_no_output_sees_it(state: Any, output: Any, lost: float | None) -> None:
    found = undetectable_mode(np.array(state), np.array(output, dtype=float), discrete=True)
    assert found == (None if lost is None else pytest.approx(lost))


def test_stability_of_a_mode_depends_on_the_time_axis() -> None:
    state, output = np.diag([-0.5, -2.0]), np.zeros((1, 2))
    assert undetectable_mode(state, output, discrete=False) is None
    assert undetectable_mode(state, output, discrete=True) == pytest.approx(-2.0)


def test_the_largest_number_is_allowed() -> None:
    assert at_most("count", 5, 5) == 5
    with pytest.raises(InvalidInputError, match="at most 5, got 6"):
        at_most("count", 6, 5)


def test_what_stands_still_does_not_increase() -> None:
    assert increasing_grid("times", [0.5, 1.0, 2.0]).tolist() == [0.5, 1.0, 2.0]
    with pytest.raises(InvalidInputError, match="times"):
        increasing_grid("times", [0.5, 1.0, 1.0])
