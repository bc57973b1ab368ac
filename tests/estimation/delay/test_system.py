"""Validation of systems with delays, and changes of coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.delay import delay_system, minimum_gain
from replication.estimation.delay.general.plant import checked_delays
from replication.estimation.delay.observer import error_system
from replication.estimation.delay.sos.certificate import certificate_at
from replication.estimation.delay.system import measured_last, transformed
from tests.estimation.delay.plants import one_delay, scalar, two_delays

GOOD: dict[str, Any] = {
    "a0": np.zeros((2, 2)),
    "a": [np.eye(2), np.eye(2)],
    "delays": [0.5, 1.0],
    "b": np.ones((2, 1)),
    "c10": [[1, 0]],
    "c2": [[0, 1]],
}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"delays": [0.5, -1.0]}, r"delays\[1\] must be positive"),
        ({"delays": [0.0, 1.0]}, r"delays\[0\] must be positive"),
        ({"delays": [1.0, 0.5]}, "increase strictly"),
        ({"delays": [1.0, 1.0]}, "increase strictly"),
        ({"delays": [], "a": []}, "at least one delay"),
        ({"delays": [1.0]}, "one matrix per delay"),
        ({"a0": np.zeros((2, 3))}, "a0 must have 2 columns"),
        ({"a": [np.eye(2), np.eye(3)]}, r"a\[1\] must have 2 rows"),
        ({"b": np.ones((3, 1))}, "b must have 2 rows"),
        ({"c10": [[1, 0, 0]]}, "c10 must have 2 columns"),
        ({"c2": [[0, 1], [0, 2]]}, "full row rank"),
        ({"c2": [[0, 0]]}, "full row rank"),
        ({"c1": [[[1, 0]]]}, "c1 must hold one matrix per delay"),
        ({"a0": [[np.nan, 0], [0, 0]]}, "a0 must be finite"),
        ({"delays": 0.5}, "delays must be a list"),
        ({"a": None}, "a must be a list"),
        ({"b": np.zeros((2, 0))}, "b must have a column"),
        ({"c10": np.zeros((0, 2))}, "c10 and c2 a row"),
    ],
)
def test_bad_systems(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        delay_system(**{**GOOD, **change})


def test_the_caller_keeps_the_matrices() -> None:
    a0 = np.zeros((2, 2))
    system = delay_system(**{**GOOD, "a0": a0})
    a0[0, 0] = 5.0
    assert system.a0[0, 0] == 0.0


def test_measured_states_come_last() -> None:
    rotated, change = measured_last(one_delay())
    assert np.abs(change @ change.T - np.eye(2)).max() < 1e-12
    assert rotated.c2[0, 0] == 0.0
    assert np.abs(rotated.c2 @ change - one_delay().c2).max() < 1e-12


def test_coordinates_with_the_measured_states_last_are_kept() -> None:
    inner, _ = measured_last(one_delay())
    again, change = measured_last(inner)
    assert np.array_equal(change, np.eye(2))
    assert again is inner


def test_singular_change_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="invertible"):
        transformed(two_delays(), [[1, 1], [1, 1]])


@pytest.mark.parametrize("degree", [0, -1, 1.5, True])
def test_bad_degrees(degree: Any) -> None:
    with pytest.raises(InvalidInputError, match="degree"):
        minimum_gain(scalar([-1.0], [1.0]), degree)


@pytest.mark.parametrize("gamma", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_levels(gamma: float) -> None:
    with pytest.raises(InvalidInputError, match="gamma"):
        certificate_at(two_delays(), gamma, 1)


def test_bad_order() -> None:
    certificate = certificate_at(two_delays(), 5.0, 1)
    from replication.estimation.delay.operators import observer_gains

    with pytest.raises(InvalidInputError, match="order"):
        error_system(two_delays(), observer_gains(certificate), 0)


def test_equal_delays_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="delays must increase strictly"):
        checked_delays([0.5, 0.5])
    assert checked_delays([0.5, 0.6]) == (0.5, 0.6)
