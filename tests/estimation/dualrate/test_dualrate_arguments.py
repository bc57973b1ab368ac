"""True plants other than the model, sampling that loses modes, and arguments that must not yield a number."""

from dataclasses import replace

import control
import numpy as np
import pytest
import scipy.linalg
import scipy.signal
from slow_loops import MOTOR, MOTOR_DESIGN, START, motor_loop

from papers.shao.method.motor import bandwidth
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.dualrate.loop import close_loop, noise_gain, stability_radius
from replication.estimation.dualrate.observers import OBSERVERS, Harmonic
from replication.estimation.dualrate.problem import MAX_RATIO, DualRateDesign, dual_rate_design, make_plant
from replication.estimation.dualrate.response import Points, steady_state, time_response, tracking_error_ratio

APO, FAST, STATE = (OBSERVERS[name] for name in ("alternating_predictive", "fast_sensor", "state_feedback"))
OSCILLATOR = make_plant([[0, 1], [-1, 0]], [[0], [1]], [[1, 0]])


def oscillator_design(*, damping: float, period: float = 0.3) -> DualRateDesign:
    plant = make_plant([[0, 1], [-1, -damping]], [[0], [1]], [[1, 0]])
    return dual_rate_design(plant, feedback=[[0, 0]], injection=[[0.5], [0.5]], period=period, ratio=2)


@pytest.mark.parametrize("factor", [2.0, 0.1, -1.0])
def test_the_sensor_reads_the_true_plant(factor: float) -> None:
    """Against the single-rate loop with a sensor gain, from scipy's zero-order hold."""
    A, B, C = MOTOR.A, MOTOR.B_u, MOTOR.C
    design = replace(MOTOR_DESIGN, ratio=1)
    K, L = design.feedback, design.injection
    Ad, Bd = scipy.signal.cont2discrete((A, B, C, [[0]]), design.period)[:2]
    F, GH = scipy.signal.cont2discrete((A - L @ C, np.hstack([B, L]), C, np.zeros((1, 2))), design.period)[:2]
    textbook = np.block([[Ad, Bd @ K], [factor * GH[:, 1:] @ C, F + GH[:, :1] @ K]])
    found = stability_radius(close_loop(design, APO, plant=make_plant(A, B, factor * C)))
    assert found == pytest.approx(np.abs(np.linalg.eigvals(textbook)).max(), rel=1e-9)
    assert abs(found - stability_radius(close_loop(design, APO))) > 1e-3


def test_a_true_plant_may_have_another_order_and_come_from_control() -> None:
    """An added state that nothing reads leaves the eigenvalues; in one row with them it is a mode of its own."""
    A, B, C = MOTOR.A, MOTOR.B_u, MOTOR.C
    wide = control.StateSpace(
        scipy.linalg.block_diag(A, [[-30.0]]), np.vstack([B, [[1]]]), np.hstack([C, [[0]]]), [[0]]
    )
    loop = close_loop(MOTOR_DESIGN, APO, plant=wide, harmonic=motor_loop("fast_sensor", 1.0).harmonic)
    same = motor_loop("alternating_predictive", 1.0)
    assert stability_radius(loop) == pytest.approx(stability_radius(same), rel=1e-9)
    assert tracking_error_ratio(loop) == pytest.approx(tracking_error_ratio(same), rel=1e-9)
    response = time_response(loop, [*START, 0], START, slow_periods=3, substeps=4)
    expected = time_response(same, START, START, slow_periods=3, substeps=4)
    np.testing.assert_allclose(response.output, expected.output, atol=1e-9)
    with pytest.raises(InvalidInputError, match="state feedback needs a true plant with the 3 states"):
        close_loop(MOTOR_DESIGN, STATE, plant=wide)
    with pytest.raises(InvalidInputError, match="the 1 inputs and 1 outputs of the model, got 1 and 2"):
        close_loop(MOTOR_DESIGN, APO, plant=make_plant(A, B, np.vstack([C, C])))


def test_points_may_be_named_and_unknown_names_are_refused() -> None:
    loop = motor_loop("held_measurement", 2.5)
    assert tracking_error_ratio(loop, "between") == tracking_error_ratio(loop, Points.BETWEEN)
    with pytest.raises(InvalidInputError, match="points must be one of"):
        tracking_error_ratio(loop, "everywhere")


def test_a_marginal_loop_has_no_steady_state() -> None:
    loop = close_loop(oscillator_design(damping=0.0), FAST, harmonic=Harmonic(2.0, np.zeros(1)))
    assert stability_radius(loop) == pytest.approx(1.0, abs=1e-13)
    with pytest.raises(InfeasibleError, match="the loop is marginal"):
        steady_state(loop)
    with pytest.raises(InfeasibleError, match="noise grows without bound"):
        noise_gain(loop)


def test_the_peak_of_a_fast_lightly_damped_mode_is_found() -> None:
    """24.2 turns in T = 0.2 s, damping ratio 1e-3; against a grid of 1000 points per turn."""
    rate, ratio = 24.2 * 2 * np.pi / 0.2, 1e-3
    plant = make_plant([[0, 1], [-(rate**2), -2 * ratio * rate]], [[0], [rate**2]], [[1, 0]])
    design = dual_rate_design(plant, feedback=[[0, 0]], injection=[[0], [0]], period=0.2, ratio=1)
    loop = close_loop(design, STATE, harmonic=Harmonic(np.pi * (3 - np.sqrt(5)) / 0.2, np.array([1.0])))
    start = np.imag(steady_state(loop).states[0])[:2]
    response = time_response(loop, start, np.zeros(2), slow_periods=60, substeps=24_200)
    dense = float(np.abs(response.error).max())
    assert tracking_error_ratio(loop) == pytest.approx(dense, rel=2e-3)
    assert tracking_error_ratio(loop) >= dense * (1 - 1e-9)


def test_an_input_that_loses_a_mode_by_holding_is_refused() -> None:
    plant = make_plant([[0.1, 10 * np.pi], [-10 * np.pi, 0.1]], [[0], [1]], np.eye(2))
    gains = {"feedback": [[0, 0]], "injection": np.zeros((2, 2)), "ratio": 1}
    with pytest.raises(InvalidInputError, match=r"held over T = 0.1 s loses the unstable mode 0.1"):
        dual_rate_design(plant, period=0.1, **gains)
    # Two outputs see both eigenvectors that sampling folds together, and half the period folds none.
    assert dual_rate_design(plant, period=0.05, **{**gains, "ratio": 2}).slow_period == 0.1


@pytest.mark.parametrize("factor", [3.0, 10.0])
def test_fast_growing_plants_are_not_refused_for_rounding(factor: float) -> None:
    rng = np.random.default_rng(11)
    for _ in range(60):
        plant = make_plant(factor * rng.normal(size=(4, 4)), rng.normal(size=(4, 1)), rng.normal(size=(1, 4)))
        dual_rate_design(plant, feedback=np.zeros((1, 4)), injection=np.zeros((4, 1)), period=0.4, ratio=5)


@pytest.mark.parametrize(
    ("shapes", "counts"), [((0, 1, 1), "0, 1 and 1"), ((2, 0, 1), "2, 0 and 1"), ((2, 1, 0), "2, 1 and 0")]
)
def test_empty_plants_are_refused(shapes: tuple[int, int, int], counts: str) -> None:
    n, m, p = shapes
    with pytest.raises(InvalidInputError, match=f"needs a state, an input and an output, got {counts}"):
        make_plant(np.zeros((n, n)), np.zeros((n, m)), np.zeros((p, n)))


def test_observers_and_commands_that_do_not_fit_are_named() -> None:
    with pytest.raises(InvalidInputError, match=r"one of OBSERVERS, such as OBSERVERS\['alternating_predictive'\]"):
        close_loop(MOTOR_DESIGN, "alternating_predictive")
    with pytest.raises(InvalidInputError, match="one amplitude for each of the 1 inputs, got 2"):
        close_loop(MOTOR_DESIGN, APO, harmonic=Harmonic(1.0, np.zeros(2)))
    with pytest.raises(InvalidInputError, match="one amplitude for each of the 1 inputs, got 5"):
        close_loop(MOTOR_DESIGN, APO, harmonic=Harmonic(1.0, np.zeros(5), continuous=True))
    with pytest.raises(InvalidInputError, match=r"frequency σ .* must be finite"):
        Harmonic(float("nan"), np.zeros(1))
    with pytest.raises(InvalidInputError, match="list of finite numbers, one per input"):
        Harmonic(1.0, np.array([np.inf]))


def test_grids_are_checked() -> None:
    for grid in ([], [1.0], [2.0, 1.0], [0.0, 1.0]):
        with pytest.raises(InvalidInputError, match="frequencies must"):
            bandwidth(lambda f: tracking_error_ratio(motor_loop("fast_sensor", f)), 0.1, grid)


def test_overflow_over_a_slow_period_is_named() -> None:
    design = dual_rate_design(make_plant([[1]], [[1]], [[1]]), feedback=[[0]], injection=[[0]], period=0.1, ratio=20000)
    with pytest.raises(InvalidInputError, match="the loop overflows over M T = 2000 s"):
        stability_radius(close_loop(design, APO))


def test_ratios_up_to_the_largest_are_taken_and_no_others() -> None:
    assert replace(MOTOR_DESIGN, ratio=MAX_RATIO).ratio == MAX_RATIO
    with pytest.raises(InvalidInputError, match=f"must be at most {MAX_RATIO}, got {MAX_RATIO + 1}"):
        replace(MOTOR_DESIGN, ratio=MAX_RATIO + 1)
