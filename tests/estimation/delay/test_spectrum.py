"""Characteristic roots and the H∞ gain against closed forms and independent sweeps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import lambertw

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.delay import delay_system, minimum_gain
from replication.estimation.delay.spectrum import (
    _output,
    frequency_response,
    hinf_gain,
    rightmost_roots,
    undetectable_root,
)
from replication.estimation.delay.system import natural_units, time_scaled
from tests.estimation.delay.plants import one_delay, scalar, two_delays, unstable_pair


@pytest.mark.parametrize("gain", [-1.0, -0.3, 0.4])
def test_roots_of_the_scalar_equation(gain: float) -> None:
    """s = g e^{-s} has the roots W_k(g)."""
    roots = rightmost_roots(scalar([gain], [1.0]), 3)
    branches = np.array([complex(lambertw(gain, k)) for k in range(-4, 4)])
    branches = branches[np.argsort(-branches.real)][:3]
    assert np.sort(roots.real) == pytest.approx(np.sort(branches.real), abs=1e-9)


def test_gain_of_an_integrator_with_delayed_feedback() -> None:
    bracket = hinf_gain(scalar([-1.0], [1.0]))
    omega = np.linspace(1.30, 1.31, 200_001)
    dense = np.abs(1 / (1j * omega + np.exp(-1j * omega))).max()
    assert bracket.lower <= bracket.upper
    assert bracket.upper / bracket.lower - 1 < 2e-9
    assert dense == pytest.approx(bracket.lower, rel=1e-8)


def test_gain_bounds_a_sweep_from_above() -> None:
    for system in (one_delay(), two_delays()):
        bracket = hinf_gain(system)
        response = frequency_response(system, np.linspace(0, 60, 4001))
        assert np.linalg.norm(response, 2, axis=(1, 2)).max() <= bracket.upper


def test_response_without_delay_matches_the_state_space_formula() -> None:
    system = delay_system([[-1.0, 1], [0, -2]], [np.zeros((2, 2))], [1.0], [[0], [1]], [[1, 0]], [[1, 0]])
    assert frequency_response(system, 0.5)[0, 0, 0] == pytest.approx(1 / ((0.5j + 1) * (0.5j + 2)))


def test_unstable_plant_has_no_gain() -> None:
    with pytest.raises(InfeasibleError, match="infinite"):
        hinf_gain(unstable_pair())


def test_undetectable_plant_is_refused_before_the_solver() -> None:
    system = delay_system(np.diag([0.5, -1.0]), [np.zeros((2, 2))], [1.0], np.eye(2), [[1, 0]], [[0, 1]])
    assert undetectable_root(system) == pytest.approx(0.5, abs=1e-9)
    with pytest.raises(InvalidInputError, match="not detectable"):
        minimum_gain(system, 1)


def test_derivatives_of_a_delayed_output_are_those_of_differences() -> None:
    system = delay_system(
        -np.eye(2), [np.zeros((2, 2))] * 2, [0.5, 2.0], np.eye(2), [[1, 0]], [[0, 1]], [[[1.0, 2.0]], [[-0.5, 1.0]]]
    )
    s, step = np.array([0.3 + 1.0j]), 1e-4
    for power in (0, 1):
        difference = (_output(system, s + step, power) - _output(system, s - step, power)) / (2 * step)
        assert np.abs(_output(system, s, power + 1) - difference).max() < 1e-6


def test_the_root_that_no_sensor_sees_is_told_in_the_unit_of_the_plant() -> None:
    system = delay_system(np.diag([0.5, -1.0]), [np.zeros((2, 2))], [1.0], np.eye(2), [[1, 0]], [[0, 1]])
    for factor in (1e-6, 1e6):
        assert natural_units(time_scaled(system, factor)).time != 1.0
        assert undetectable_root(time_scaled(system, factor)) == pytest.approx(0.5 * factor, rel=1e-9)


def test_the_rightmost_roots_are_told_in_the_unit_of_the_plant() -> None:
    roots = rightmost_roots(two_delays(), 2)
    for factor in (1e-6, 1e6):
        found = rightmost_roots(time_scaled(two_delays(), factor), 2)
        assert np.sort(found.real) == pytest.approx(np.sort(roots.real) * factor, rel=1e-7)
