"""Plants: what is refused and why, coordinates and units, characteristic roots, and modes that y does not see."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import lambertw

from papers.peet2019.method import open_loop_gain
from replication.errors import InvalidInputError
from replication.estimation.delay import DelayPlant, analyse, delay_system
from replication.estimation.delay.spectrum import require_seen, rightmost_roots
from replication.estimation.delay.units import STEP, measured_last, natural_units, reach, time_scaled, transformed
from tests.estimation.delay.plants import (
    SIZES,
    averaged,
    awkward,
    hidden,
    one_delay,
    scalar,
    three_delays,
    two_delays,
    two_late,
    unstable_pair,
)

GOOD: dict[str, Any] = {
    "a0": -np.eye(2), "a": [np.eye(2), np.eye(2)], "delays": [0.5, 1.0], "b": np.eye(2, 3), "c10": np.eye(2),
    "c2": [[1.0, 0.0]],
}  # fmt: skip
BAD_ALWAYS = [
    ({"delays": [0.5, -1.0]}, r"delays\[1\] must be positive"),
    ({"delays": [0.0, 1.0]}, r"delays\[0\] must be positive"),
    ({"delays": [1.0, 0.5]}, "increase strictly"),
    ({"delays": [1.0, 1.0]}, "increase strictly"),
    ({"delays": [], "a": []}, "at least one delay"),
    ({"delays": [1.0]}, "one matrix per delay"),
    ({"delays": 0.5}, "delays must be a list"),
    ({"a0": np.zeros((2, 3))}, "a0 must have 2 columns"),
    ({"a0": [[np.nan, 0], [0, 0]]}, "a0 must be finite"),
    ({"a": [np.eye(2), np.eye(3)]}, r"a\[1\] must have 2 rows"),
    ({"a": None}, "a must be a list"),
    ({"b": np.ones((3, 1))}, "b must have 2 rows"),
    ({"b": np.zeros((2, 0))}, "b must have a column"),
    ({"c10": [[1, 0, 0]]}, "c10 must have 2 columns"),
    ({"c10": np.zeros((0, 2))}, "c10 and c2 a row"),
    ({"c1": [[[1, 0]]]}, "c1 must hold one matrix per delay"),
]
BAD_WITHOUT_NOISE = [
    ({"c2": [[0, 1], [0, 2]]}, "full row rank"),
    ({"c2": [[0, 0]]}, "full row rank"),
    ({"a": []}, "a must hold one matrix per delay"),
    ({"c1": []}, "c1 must hold one matrix per delay"),
]
BAD_WITH_NOISE = [
    ({"ranges": [[0.6, 0.4], [0.9, 1.1]]}, r"ranges\[0\] must be \(shortest, longest\)"),
    ({"ranges": [[0.3, 0.4], [0.9, 1.1]]}, r"ranges\[0\] must be \(shortest, longest\)"),
    ({"ranges": [[0.6, 0.7], [0.9, 1.1]]}, r"ranges\[0\] must be \(shortest, longest\)"),
    ({"ranges": [[-0.1, 0.6], [0.9, 1.1]]}, r"ranges\[0\]\[0\] must be positive"),
    ({"ranges": [[0.4, 0.6]]}, "one pair per delay: 2 delays, 1 pairs"),
    ({"ranges": [[0.4, 0.5, 0.6], [0.9, 1.1]]}, r"ranges\[0\] must be a pair"),
    ({"a_spread": [np.zeros((7, 2, 2)), np.zeros((1, 2, 2))]}, "fit a weight of degree 5"),
    ({"a_spread": [np.zeros((2, 3, 2)), np.zeros((1, 2, 2))]}, r"a_spread\[0\]\[0\] must have 2 rows"),
    ({"c2_delayed": [[[1.0, 0.0]]]}, "one matrix per delay: 2 delays, 1 matrices"),
    ({"d21": [[0.1, 0.2]]}, "d21 must have 3 columns"),
    ({"d11": np.zeros((1, 3))}, "d11 must have 2 rows"),
    ({"b_u_delayed": [[[1.0], [0.0]], [[1.0]]]}, r"b_u_delayed\[1\] must have 2 rows"),
    ({"b_delayed": 3}, "b_delayed must be a list"),
]


@pytest.mark.parametrize(
    ("make", "change", "message"),
    [(make, *row) for make in (delay_system, DelayPlant) for row in BAD_ALWAYS]
    + [(delay_system, *row) for row in BAD_WITHOUT_NOISE]
    + [(DelayPlant, *row) for row in BAD_WITH_NOISE],
)
def test_bad_fields_are_named(make: Any, change: dict[str, Any], message: str) -> None:
    make(**GOOD)
    with pytest.raises(InvalidInputError, match=message):
        make(**{**GOOD, **change})


def test_the_name_of_a_plant_file_is_told_and_the_caller_keeps_the_matrices() -> None:
    given = {name: value for name, value in GOOD.items() if name != "c2"}
    with pytest.raises(InvalidInputError, match="C2 is the name in a plant file; in Python write c2="):
        DelayPlant(**given, C2=[[1.0, 0.0]])
    with pytest.raises(TypeError, match="C3"):
        DelayPlant(**GOOD, C3=1)
    a0 = np.zeros((2, 2))
    system = delay_system(**{**GOOD, "a0": a0})
    a0[0, 0] = 5.0
    assert system.a0[0, 0] == 0.0


def test_the_plant_of_the_paper_is_the_special_case_without_noise() -> None:
    plain = delay_system([[-1.0]], [[[-0.3]]], [0.4], [[1.0]], [[1.0]], [[1.0]], [[[0.2]]])
    noisy = replace(plain, d21=np.array([[0.1]]))
    assert plain.noiseless and not noisy.noiseless
    alone, with_noise = ({fact.what: fact.value for fact in analyse(plant).evidence} for plant in (plain, noisy))
    for name in ("rightmost root", "unstable roots", "gain from w to z", "rms of z"):
        assert alone[name] == with_noise[name]
    assert alone["gain from w to z"] == pytest.approx(open_loop_gain(plain).upper, rel=1e-3)


def test_measured_states_come_last_and_coordinates_of_this_form_are_kept() -> None:
    rotated, change = measured_last(one_delay())
    assert np.abs(change @ change.T - np.eye(2)).max() < 1e-12
    assert rotated.c2[0, 0] == 0.0
    assert np.abs(rotated.c2 @ change - one_delay().c2).max() < 1e-12
    again, change = measured_last(rotated)
    assert np.array_equal(change, np.eye(2)) and again is rotated
    with pytest.raises(InvalidInputError, match="invertible"):
        transformed(two_delays(), [[1, 1], [1, 1]])


@pytest.mark.parametrize("system", [one_delay(), two_delays(), three_delays(), unstable_pair()])
def test_moderate_plants_keep_their_units(system: DelayPlant) -> None:
    units = natural_units(system)
    assert units.time == 1.0 and np.array_equal(units.states, np.ones(2))


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_units_are_found_again(factor: float) -> None:
    plant = awkward(two_delays(), factor)
    units = natural_units(plant)
    assert 1 / STEP < reach(units.plant(plant)) < STEP and 1 / STEP < units.time * factor < STEP
    assert np.all(np.abs(np.log(units.states * np.diag(SIZES) / units.states[0] / SIZES[0, 0])) < np.log(STEP))
    back = transformed(time_scaled(units.plant(plant), 1 / units.time), np.diag(1 / units.states))
    assert np.allclose(back.a0, plant.a0, rtol=1e-14) and back.delays == pytest.approx(plant.delays)


# Characteristic roots and the H∞ gain against closed forms and independent sweeps


@pytest.mark.parametrize("gain", [-1.0, -0.3, 0.4])
def test_roots_of_the_scalar_equation(gain: float) -> None:
    """s = g e^{-s} has the roots W_k(g)."""
    roots = rightmost_roots(scalar([gain], [1.0]), 3)
    branches = np.array([complex(lambertw(gain, k)) for k in range(-4, 4)])
    branches = branches[np.argsort(-branches.real)][:3]
    assert np.sort(roots.real) == pytest.approx(np.sort(branches.real), abs=1e-9)


@pytest.mark.parametrize("system", [one_delay(), two_delays(), two_late(), averaged()])
def test_the_rightmost_roots_are_told_in_the_unit_of_the_plant(system: DelayPlant) -> None:
    roots = rightmost_roots(system, 2)
    for factor in (1e-6, 1e6):
        found = rightmost_roots(awkward(system, factor), 2)
        assert np.sort(found.real) == pytest.approx(np.sort(roots.real) * factor, rel=1e-6)


def test_roots_with_an_average_solve_the_characteristic_equation() -> None:
    """det(s - A_0 - A_1 e^-s tau - mean of (A_s0 + A_s1 age) e^(-s age)) by quadrature, also left of the axis."""
    plant, points = averaged(), np.polynomial.legendre.leggauss(40)
    ages, weights = (points[0] + 1) / 2, points[1] / 2
    for root in rightmost_roots(plant, 4):
        mean = sum(
            w * np.exp(-root * plant.delays[0] * t) * (plant.a_spread[0][0] + t * plant.a_spread[0][1])
            for t, w in zip(ages, weights, strict=True)
        )
        matrix = root * np.eye(2) - plant.a0 - np.exp(-root * plant.delays[0]) * plant.a[0] - mean
        assert np.linalg.svd(matrix)[1][-1] < 1e-9 * np.linalg.norm(matrix)


@pytest.mark.parametrize("rate", [0.5, 0.0])
@pytest.mark.parametrize("factor", [1.0, 1e-6, 1e6])
def test_the_root_that_no_sensor_sees_is_told_in_the_unit_of_the_plant(rate: float, factor: float) -> None:
    plant = time_scaled(hidden(rate), factor)
    units = natural_units(plant)
    with pytest.raises(InvalidInputError, match=r"not detectable: y does not see the root") as caught:
        require_seen(units.plant(plant), units.time)
    told = complex(str(caught.value).partition("the root ")[2].partition(";")[0])
    assert told == pytest.approx(rate * factor, rel=1e-5, abs=1e-9 * factor)
    require_seen(hidden(-0.1), 1.0)
