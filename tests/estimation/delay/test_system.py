"""Validation of systems with delays, and changes of coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.special import lambertw

from papers.peet2019.method import _output, frequency_response, hinf_gain
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.delay import DegreeRule, DelayPlant, delay_system, design, minimum_gain
from replication.estimation.delay.plant import checked_delays
from replication.estimation.delay.sos.certificate import certificate_at
from replication.estimation.delay.sos.observer import error_system, hinf_norm
from replication.estimation.delay.sos.operators import observer_gains
from replication.estimation.delay.spectrum import rightmost_roots, undetectable_root
from replication.estimation.delay.units import STEP, measured_last, natural_units, reach, time_scaled, transformed
from tests.estimation.delay.plants import one_delay, scalar, three_delays, two_delays, unstable_pair

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
    from replication.estimation.delay.sos.operators import observer_gains

    with pytest.raises(InvalidInputError, match="order"):
        error_system(two_delays(), observer_gains(certificate), 0)


def test_equal_delays_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="delays must increase strictly"):
        checked_delays([0.5, 0.5])
    assert checked_delays([0.5, 0.6]) == (0.5, 0.6)


# Plants in awkward units of time and of the states: the same levels, and gains in the units of the plant


SAME = 1e-6
SIZES = np.diag([3e5, 2e-4])


@pytest.mark.parametrize("system", [one_delay(), two_delays(), three_delays(), unstable_pair()])
def test_moderate_plants_keep_their_units(system: DelayPlant) -> None:
    units = natural_units(system)
    assert units.system is system and units.time == 1.0 and np.array_equal(units.change, np.eye(2))


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_units_are_found_again(factor: float) -> None:
    awkward = transformed(time_scaled(two_delays(), factor), SIZES)
    units = natural_units(awkward)
    assert 1 / STEP < reach(units.system) < STEP and 1 / STEP < units.time * factor < STEP
    assert np.all(np.abs(np.log(np.diag(units.change @ SIZES) / units.change[0, 0] / SIZES[0, 0])) < np.log(STEP))
    back = transformed(time_scaled(units.system, 1 / units.time), np.linalg.inv(units.change))
    assert np.allclose(back.a0, awkward.a0, rtol=1e-14) and back.delays == pytest.approx(awkward.delays)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_level_and_observer_do_not_depend_on_the_units(factor: float) -> None:
    awkward = transformed(time_scaled(one_delay(), factor), SIZES)
    least = minimum_gain(one_delay(), 2, DegreeRule.BESSEL).gamma
    assert minimum_gain(awkward, 2, DegreeRule.BESSEL).gamma == pytest.approx(least, rel=SAME)
    gains = observer_gains(certificate_at(awkward, 1.1 * least, 2, DegreeRule.BESSEL))
    error = error_system(awkward, gains, 20)
    assert hinf_norm(error).upper <= 1.1 * least
    root = rightmost_roots(one_delay(), 1)[0]
    assert rightmost_roots(awkward, 1)[0] == pytest.approx(root * factor, rel=SAME)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_what_y_does_not_see_is_found_in_any_unit(factor: float) -> None:
    hidden = delay_system(np.diag([0.3, -1.0]), [np.zeros((2, 2))], [1.0], np.eye(2), np.eye(2), [[0.0, 1.0]])
    with pytest.raises(InvalidInputError, match="does not see the root"):
        minimum_gain(transformed(time_scaled(hidden, factor), SIZES), 1, DegreeRule.BESSEL)
    seen = delay_system(np.diag([-0.01, 1.0]), [np.zeros((2, 2))], [1.0], np.eye(2), np.eye(2), [[0.0, 1.0]])
    slow = transformed(time_scaled(seen, factor), SIZES)
    assert minimum_gain(slow, 1, DegreeRule.BESSEL).gamma == pytest.approx(100.0, rel=1e-4)


# Characteristic roots and the H∞ gain against closed forms and independent sweeps


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


# Ranges of delays where the plant is marginal, and for every goal; units of the disturbance


LATE: dict[str, Any] = {
    "delays": [0.5], "b": [[1.0, 0.0]], "c10": [[1.0]], "c2": [[0.0]], "c2_delayed": [[[1.0]]], "d21": [[0.0, 1.0]]
}  # fmt: skip
GOALS = ("hinf", "h2", "mixed")


def test_over_ranges_an_integrator_is_left_open_with_the_reason() -> None:
    found = design(DelayPlant(a0=[[0.0]], ranges=[(0.49, 0.51)], **LATE))
    worst = found.fact("worst gain over the ranges")
    assert worst.value == "open" and "imaginary axis" in worst.method
    assert np.isfinite(found.value)


@pytest.mark.parametrize("goal", GOALS)
def test_every_goal_says_what_its_gains_are_worth_over_the_ranges(goal: str) -> None:
    found = design(DelayPlant(a0=[[-1.0]], ranges=[(0.4, 0.6)], **LATE), goal=goal)
    worst, attained = (found.fact(name).value for name in ("worst gain over the ranges", "attained there"))
    assert isinstance(worst, float) and isinstance(attained, float)
    # The nominal delay lies in the range, where the gain is at least as large as the lower end of the bracket.
    assert found.bracket.lower * (1 - 2e-3) <= worst and attained <= worst


@pytest.mark.parametrize("goal", GOALS)
@pytest.mark.parametrize("unit", [1e-9, 1e-6, 1e6])
def test_the_unit_of_the_disturbance_scales_the_level_and_nothing_else(goal: str, unit: float) -> None:
    def level(unit: float) -> float:
        scaled = {**LATE, "b": [[unit, 0.0]], "d21": [[0.0, unit]]}
        return design(DelayPlant(a0=[[-1.0]], **scaled), goal=goal).value

    assert level(unit) / unit == pytest.approx(level(1.0), rel=1e-6)
