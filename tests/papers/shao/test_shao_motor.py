"""The motor, its command and its brute-force simulation: choices by name, and arguments that yield no number."""

from dataclasses import replace

import numpy as np
import pytest

from papers.shao.method.motor import Feedforward, Motor, feedforward, simulate, tracking_command
from papers.shao.method.readings import Reading, Structure
from papers.shao.printed import DESIGN, MOTOR, START, literal_loop
from replication.errors import InvalidInputError
from replication.estimation.dualrate.observers import Harmonic
from replication.estimation.dualrate.problem import make_plant

COUNTS = {"slow_periods": 2, "substeps": 2}


def test_choices_may_be_named_and_unknown_names_are_refused() -> None:
    named = tracking_command(MOTOR, DESIGN, 1.0, "corrected", "continuous")
    assert named.continuous
    np.testing.assert_array_equal(
        tracking_command(MOTOR, DESIGN, 1.0, "corrected").amplitude,
        tracking_command(MOTOR, DESIGN, 1.0, Feedforward.CORRECTED).amplitude,
    )
    assert Structure(feedforward="corrected").feedforward is Feedforward.CORRECTED
    with pytest.raises(InvalidInputError, match="feedforward must be one of 'printed', 'corrected', got 'exact'"):
        feedforward(MOTOR, 1j, "exact")
    with pytest.raises(InvalidInputError, match="observer must be one of"):
        Reading(observer="kalman")


def test_parameters_and_gains_that_do_not_fit_are_named() -> None:
    with pytest.raises(InvalidInputError, match="inertia must be positive"):
        Motor(resistance=1, flux=1, inductance=1, pole_pairs=1, friction=1, inertia=-1, torque_constant=1)
    plant = make_plant([[0, 1], [-1, -0.1]], [[0], [1]], [[1, 0]])
    other = replace(DESIGN, model=plant, feedback=np.zeros((1, 2)), injection=np.full((2, 1), 0.5))
    with pytest.raises(InvalidInputError, match=r"gain K of shape \(1, 3\), got \(1, 2\)"):
        tracking_command(MOTOR, other, 1.0, Feedforward.PRINTED)


def test_what_cannot_be_simulated_is_named() -> None:
    harmonic = literal_loop("alternating_predictive", 1.0).harmonic
    with pytest.raises(InvalidInputError, match="cannot simulate 'kalman'"):
        simulate(DESIGN, "kalman", harmonic, START, START, **COUNTS)
    with pytest.raises(InvalidInputError, match="one amplitude for each of the 1 inputs, got 2"):
        simulate(DESIGN, "fast_sensor", Harmonic(1.0, np.zeros(2)), START, START, **COUNTS)
    with pytest.raises(InvalidInputError, match="number of sub-steps must be at least 1"):
        simulate(DESIGN, "fast_sensor", harmonic, START, START, slow_periods=2, substeps=0)


@pytest.mark.parametrize("start", [["a", 0, 0], [1j, 0, 0], [[0], 1, 2], [0, np.nan, 0]])
def test_estimates_that_are_not_real_numbers_are_named(start: object) -> None:
    harmonic = literal_loop("alternating_predictive", 1.0).harmonic
    with pytest.raises(InvalidInputError, match=r"ζ\(0\) must be 3 finite real numbers"):
        simulate(DESIGN, "fast_sensor", harmonic, START, start, **COUNTS)
