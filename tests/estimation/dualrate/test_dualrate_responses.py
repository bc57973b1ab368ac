"""Steady state and time response against brute force, against each other, and the plant's own inverse."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from slow_loops import MOTOR_DESIGN, START, motor_loop

from papers.shao.method.motor import (
    Feedforward,
    ReferenceTiming,
    bandwidth,
    estimation_error_ratio,
    estimation_lag,
    simulate,
)
from replication.estimation.dualrate.loop import DualRateLoop, close_loop
from replication.estimation.dualrate.observers import OBSERVERS, Harmonic
from replication.estimation.dualrate.problem import dual_rate_design, make_plant
from replication.estimation.dualrate.response import (
    _error_at,
    steady_state,
    time_response,
    tracking_error_peak,
    tracking_error_ratio,
)

AGREEMENT = 1e-10
NOT_SIMULATED = {"single_rate_correction", "single_correction", "slow_input_interpolation", "open_loop_prediction"}
SIMULATED = [name for name in OBSERVERS if name not in NOT_SIMULATED]


@pytest.mark.parametrize("name", SIMULATED)
@pytest.mark.parametrize("frequency", [0.5, 3.0])
def test_lifted_and_brute_force_responses_agree_with_their_transients(name: str, frequency: float) -> None:
    loop, unstable = motor_loop(name, frequency), name == "single_rate"
    counts = {"slow_periods": 10 if unstable else 40, "substeps": 7}
    lifted = time_response(loop, START, np.zeros(3), **counts)
    brute = simulate(MOTOR_DESIGN, name, loop.harmonic, START, np.zeros(3), **counts)
    np.testing.assert_allclose(lifted.time, brute.time, atol=AGREEMENT)
    estimates = lifted.estimate[:, 0], brute.estimate[:, 0]
    for one, other in ((lifted.output, brute.output), estimates, (lifted.input, brute.input)):
        size = np.abs(other).max() if unstable else 1.0
        np.testing.assert_allclose(one, other, rtol=0, atol=AGREEMENT * size)


@pytest.mark.parametrize("name", SIMULATED)
def test_lifted_and_brute_force_agree_for_several_outputs_a_true_plant_and_no_reference(name: str) -> None:
    rng = np.random.default_rng(6)
    model, true = (
        make_plant(A - 2 * np.eye(3), rng.normal(size=(3, 2)), rng.normal(size=(2, 3)))
        for A in rng.normal(size=(2, 3, 3))
    )
    gains = {"feedback": 0.2 * rng.normal(size=(2, 3)), "injection": 0.2 * rng.normal(size=(3, 2))}
    design = dual_rate_design(model, period=0.2, ratio=3, **gains)
    loop = close_loop(design, OBSERVERS[name], plant=true)
    rest = Harmonic(1.0, np.zeros(2))
    for output in (0, 1):
        counts = {"slow_periods": 12, "substeps": 5, "output": output}
        lifted = time_response(loop, START, -START, **counts)
        brute = simulate(design, name, rest, START, -START, plant=true, **counts)
        np.testing.assert_allclose(lifted.output, brute.output, rtol=0, atol=AGREEMENT)
        np.testing.assert_allclose(lifted.estimate, brute.estimate, rtol=0, atol=AGREEMENT)
        np.testing.assert_array_equal(lifted.reference, 0)


@pytest.mark.parametrize("timing", ReferenceTiming)
def test_the_response_from_the_steady_state_stays_in_it(timing: ReferenceTiming) -> None:
    # The slow instants must fill the circle evenly: a golden-section share of a turn per slow period.
    loop = motor_loop("alternating_predictive", np.pi * (3 - np.sqrt(5)), timing=timing)
    start = np.imag(steady_state(loop).states[0])
    response = time_response(loop, start[:3], start[3:6], slow_periods=300, substeps=100)
    assert np.abs(response.error).max() == pytest.approx(tracking_error_ratio(loop), rel=1e-3)


def test_exact_feedforward_that_acts_continuously_tracks_exactly_under_state_feedback() -> None:
    """Continuous r with the held feedback K x̂ leaves an error of the hold alone: it vanishes with the period."""
    errors = [
        tracking_error_ratio(
            motor_loop(
                "state_feedback",
                1.0,
                design=replace(MOTOR_DESIGN, period=period),
                form=Feedforward.CORRECTED,
                timing=ReferenceTiming.CONTINUOUS,
            )
        )
        for period in (2e-3, 1e-3, 5e-4)
    ]
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(2, rel=0.05)


LAG = Harmonic(1.5, np.array([0.6 + 0.2j]), continuous=True)


def lag_loop() -> DualRateLoop:
    """A first-order plant, whose output feels a continuous command at once."""
    plant = make_plant([[-1.0]], [[2.0]], [[1.0]])
    design = dual_rate_design(plant, period=0.2, ratio=3, feedback=[[-0.3]], injection=[[0.5]])
    return close_loop(design, OBSERVERS["running_prediction"], harmonic=LAG)


@pytest.mark.parametrize("loop", [motor_loop("held_measurement", 1.5), lag_loop()], ids=["motor", "lag"])
def test_slope_and_bend_of_the_error_are_its_derivatives(loop: DualRateLoop) -> None:
    steady, step, time = steady_state(loop), 1e-6, 2.3 * loop.design.period
    before, here, after = (_error_at(loop, steady, time + way * step) for way in (-1, 0, 1))
    assert (after[0] - before[0]) / (2 * step) == pytest.approx(here[1], rel=1e-6)
    assert (after[1] - before[1]) / (2 * step) == pytest.approx(here[2], rel=1e-6)


@pytest.mark.parametrize("frequency", [0.5, 1.5, 3.0])
def test_the_refined_peak_is_where_a_search_without_derivatives_finds_it(frequency: float) -> None:
    loop = motor_loop("held_measurement", frequency)
    steady, (highest, where) = steady_state(loop), tracking_error_peak(loop)
    width = MOTOR_DESIGN.period / 100
    found = minimize_scalar(
        lambda time: -abs(_error_at(loop, steady, time)[0]),
        bounds=(where - 0.7 * width, where + width),
        method="bounded",
        options={"xatol": 1e-9 * width},
    )
    assert -found.fun == pytest.approx(highest, rel=1e-13)
    assert -found.fun > max(abs(_error_at(loop, steady, where + way * width)[0]) for way in (-0.7, 1.0))


def test_preview_shifts_the_command_by_one_period() -> None:
    held, early = (motor_loop("fast_sensor", 1.0, timing=timing).harmonic for timing in list(ReferenceTiming)[:2])
    np.testing.assert_allclose(early.amplitude, held.amplitude * np.exp(0.2j), rtol=1e-14)


def test_a_held_measurement_is_late_by_half_the_hold() -> None:
    """Far below the loop's rates; also (6), whose gain acts once per slow period on a prediction that it trusts."""
    for name, hold in (("held_measurement", 1.0), ("alternating_predictive", 1.0), ("running_prediction", 0.2)):
        assert estimation_lag(motor_loop(name, 1e-3)) == pytest.approx(hold / 2, rel=0.05)
    assert estimation_error_ratio(motor_loop("state_feedback", 1.0)) == 0.0


def test_estimation_error_is_that_of_the_time_response() -> None:
    loop = motor_loop("alternating_predictive", np.pi * (3 - np.sqrt(5)))
    response = time_response(loop, START, START, slow_periods=600, substeps=1)
    late = np.abs(response.state - response.estimate)[1000:, 0].max()
    assert late == pytest.approx(estimation_error_ratio(loop), rel=1e-3)


def test_bandwidth_is_where_the_error_reaches_the_level() -> None:
    def own(frequency: float) -> float:
        return tracking_error_ratio(motor_loop("alternating_predictive", frequency))

    assert own(bandwidth(own, 0.1, np.linspace(0.1, 6, 60))) == pytest.approx(0.1, abs=1e-8)
    assert bandwidth(own, 0.9, [0.1, 0.2]) is bandwidth(own, 1e-3, [2.0, 3.0]) is None
