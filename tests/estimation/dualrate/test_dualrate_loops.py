"""Closed dual-rate loops against textbook loops; steady state and time response against brute force and each other."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
from scipy.optimize import linear_sum_assignment, minimize_scalar
from slow_loops import MOTOR, MOTOR_DESIGN, START, motor_loop, textbook_loop

from papers.shao.method.motor import (
    Feedforward,
    ReferenceTiming,
    bandwidth,
    estimation_error_ratio,
    estimation_lag,
    simulate,
)
from replication.errors import InfeasibleError, SolverError
from replication.estimation.dualrate.facade import analyse, design
from replication.estimation.dualrate.loop import (
    DualRateLoop,
    Points,
    _error_at,
    close_loop,
    fast_errors,
    monodromy,
    noise_gain,
    noise_system,
    steady_state,
    time_response,
    tracking_error_peak,
    tracking_error_ratio,
)
from replication.estimation.dualrate.observers import OBSERVERS, Harmonic, sampled_model
from replication.estimation.dualrate.problem import dual_rate_design, make_plant
from replication.estimation.validation import ComplexArray

ROUND_OFF = 1e-9
TRUE_OBSERVERS = [name for name in OBSERVERS if name != "state_feedback"]


def leading_eigenvalues(loop: DualRateLoop, count: int) -> ComplexArray:
    """The `count` largest eigenvalues of the monodromy matrix; the others must be zero."""
    values = np.linalg.eigvals(monodromy(loop)).astype(complex)
    values = values[np.argsort(-np.abs(values), kind="stable")]
    assert np.all(np.abs(values[count:]) < 1e-7)
    return values[:count]


def farthest(first: ComplexArray, second: ComplexArray) -> float:
    """Largest distance of two sets of complex numbers, matched."""
    distances = np.abs(first[:, None] - second[None, :])
    return float(distances[linear_sum_assignment(distances)].max())


def test_all_observers_coincide_with_the_single_rate_loop_at_ratio_one() -> None:
    design = replace(MOTOR_DESIGN, ratio=1)
    expected = leading_eigenvalues(close_loop(design, OBSERVERS["single_rate"]), 6)
    for name in TRUE_OBSERVERS:
        assert farthest(leading_eigenvalues(close_loop(design, OBSERVERS[name]), 6), expected) < ROUND_OFF
    ratios = [tracking_error_ratio(motor_loop(name, 1.5, design=design)) for name in TRUE_OBSERVERS]
    np.testing.assert_allclose(ratios, ratios[0], rtol=ROUND_OFF)


def test_single_rate_loop_is_the_textbook_sampled_data_loop() -> None:
    ours = leading_eigenvalues(close_loop(MOTOR_DESIGN, OBSERVERS["single_rate"]), 6)
    assert farthest(ours, np.linalg.eigvals(textbook_loop(MOTOR_DESIGN.slow_period))) < 1e-7


FRESH = ("single_correction", "alternating_predictive", "open_loop_prediction", "running_prediction", "fast_sensor")


def estimation_error(name: str, *, discrete_gain: bool) -> float:
    """Largest entry of x − x̂ over four slow periods from x̂(0) = x(0), with a perfect model."""
    loop = close_loop(MOTOR_DESIGN, OBSERVERS[name], discrete_gain=discrete_gain)
    z = np.zeros(loop.size)
    z[:3] = z[3:6] = START
    worst = 0.0
    for step in loop.steps * 4:
        worst = max(worst, float(np.abs(z[:3] - step.estimate_state @ z).max()))
        z = step.state @ z
    return worst


@pytest.mark.parametrize("name", FRESH)
def test_zero_initial_error_stays_zero_if_no_measurement_is_stale(name: str) -> None:
    assert estimation_error(name, discrete_gain=True) < ROUND_OFF


@pytest.mark.parametrize(("name", "discrete_gain"), [("held_measurement", True), ("alternating_predictive", False)])
def test_a_stale_measurement_disturbs_a_perfect_estimate(name: str, discrete_gain: bool) -> None:
    """Held over M T, or, with the continuous gain of (3), over T."""
    assert estimation_error(name, discrete_gain=discrete_gain) > 1e-3


def test_lifted_system_carries_the_same_noise() -> None:
    """Energy of its impulse response per output: the variances at the phases, the largest of which is the gain."""
    loop = close_loop(MOTOR_DESIGN, OBSERVERS["running_prediction"])
    system = noise_system(loop).lift()
    np.testing.assert_array_equal(system.A, monodromy(loop))
    energy = np.sum(system.D**2, axis=1)
    power = system.B
    for _ in range(200):
        energy = energy + np.sum((system.C @ power) ** 2, axis=1)
        power = system.A @ power
    assert np.sqrt(energy.max()) == pytest.approx(noise_gain(loop), rel=1e-9)


@pytest.mark.parametrize("name", OBSERVERS)
def test_noise_on_a_reading_acts_like_the_state_that_gives_it(name: str) -> None:
    """A noise w = C x moves estimate, command and all that follows as x does, but for the motion of x itself."""
    loop = close_loop(MOTOR_DESIGN, OBSERVERS[name])
    x = np.array([0.3, -0.2, 0.7])
    reading = x if name == "state_feedback" else MOTOR.C @ x
    own = scipy.linalg.expm(MOTOR.A * MOTOR_DESIGN.period) @ x
    for step in loop.steps:
        moved = step.state[:, :3] @ x
        moved[:3] -= own
        np.testing.assert_allclose(step.noise @ reading, moved, atol=ROUND_OFF)


def test_a_single_correction_comes_with_the_measurement() -> None:
    first, *later = OBSERVERS["single_correction"](sampled_model(MOTOR_DESIGN, None)).steps
    assert np.any(first.injection) and not any(np.any(step.injection) for step in later)


def test_the_error_at_the_slow_instants_is_that_of_the_first() -> None:
    loop = motor_loop("alternating_predictive", 1.5)
    errors = fast_errors(loop)
    assert tracking_error_ratio(loop, Points.SLOW) == errors[0] < errors.max()
    assert tracking_error_ratio(loop, Points.FAST) == errors.max() <= tracking_error_ratio(loop)


def test_the_noise_of_a_design_is_that_in_other_units_of_the_states_without_a_warning() -> None:
    rng, found = np.random.default_rng(0), 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for units in 10.0 ** rng.integers(-6, 7, (20, 4)):
            A, B, C = rng.normal(size=(4, 4)), rng.normal(size=(4, 1)), rng.normal(size=(1, 4))
            plants = make_plant(A, B, C), make_plant(A * units[:, None] / units, B * units[:, None], C / units)
            try:
                plain, moved = (design(plant, period=0.01, ratio=2).fact("noise to output") for plant in plants)
            except InfeasibleError:
                continue
            found += 1
            assert moved.value == pytest.approx(plain.value, rel=1e-6)
    assert found > 10


@pytest.mark.parametrize("unit", [1e-9, 1e5, 1e9])
def test_a_small_unit_of_a_fast_state_hides_nothing_of_a_slow_one(unit: float) -> None:
    """Means of squares do not settle for the largest numbers alone, nor do coordinates of a design follow the units."""
    both = []
    for d in (1.0, unit):
        plant = make_plant(np.diag([-1e-3, -30.0]), [[1e-3, 0], [0, 30 * d]], [[1, 0], [0, 1 / d]])
        given = {"feedback": [[-0.5, 0], [0, -0.1 / d]], "injection": [[5e-3, 0], [0, 0.1 * d]]}
        weights = {"state_weight": [1, 1e-3 / d**2], "process_noise": [1e-6, d**2], "sensor_noise": [1, 1e-4]}
        noise = analyse(plant, **given, period=0.05, ratio=4).fact("noise to output").value
        slow = design(plant, period=0.05, ratio=4, at="slow", **weights)
        both.append([noise, slow.fact("root mean square").value, slow.value, slow.gains["K"][0, 0, 0]])
    np.testing.assert_allclose(*both, rtol=1e-9)


@pytest.mark.parametrize("units", [(1e9, 1e-4, 1), (1e-9, 1e5, 1), (1e-4, 1e9, 1e5), (1, 1e9, 1e9), (1, 1, 1e-12)])
@pytest.mark.parametrize("tracked", [None, 0])
def test_units_far_apart_hide_no_input_and_no_rest(units: tuple[float, ...], tracked: int | None) -> None:
    """A cart's place is a chain from the input to the sensor, which no balancing of A alone sees."""
    *t, u = units
    for at in ("continuous", "slow"):
        levels = []
        for states, unit in ((np.ones(2), 1.0), (np.array(t), u)):
            A, B, C = np.array([[0, 1], [0, -1]]), np.array([[0], [unit]]), np.array([[1, 0]]) / states
            plant = make_plant(A * states[:, None] / states, B * states[:, None], C)
            noise = B @ B.T / unit**2 * np.outer(states, states)
            levels.append(
                design(
                    plant, at=at, input_weight=[unit**2], process_noise=noise, tracked=tracked, period=0.05, ratio=4
                ).value
            )
        assert levels[1] == pytest.approx(levels[0], rel=1e-6)


def test_loads_far_from_unity_are_seen() -> None:
    """A weight in other units still rests, and the gains for it follow its unit."""
    gains = []
    for unit in (1.0, 1e-12, 1e9):
        plant = make_plant([[0, 1, 0], [0, -0.1, unit], [0, 0, 0]], [[0], [1], [0]], [[1, 0, 0]])
        loop = design(plant, period=0.02, ratio=5, process_noise=[0, 0.1, 0.01 / unit**2])
        slow = design(plant, period=0.02, ratio=5, at="slow", process_noise=[0, 0.1, 0.01 / unit**2])
        gains.append([loop.gains["K"][0, 2] / unit, slow.gains["K"][0, 0, 2] / unit, loop.value, slow.value])
    np.testing.assert_allclose(gains[1:], gains[:1] * 2, rtol=1e-6)


def test_an_input_that_moves_nothing_and_a_mode_beyond_all_numbers_end_without_a_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert design(make_plant([[-1.0]], [[0.0]], [[1.0]]), period=0.1, ratio=2).value < 1e-15
        with pytest.raises(SolverError, match=r"grows by a factor of exp\(1.8e\+04\) over the 60 s"):
            design(make_plant([[300.0]], [[1.0]], [[1.0]]), period=1.0, ratio=60, at="slow")


# Steady state and time response

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
