"""True plants other than the model, sampling that loses modes, and arguments that must not yield a number."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest
import scipy.linalg
import scipy.signal
from slow_loops import MOTOR, MOTOR_DESIGN, START, motor_loop, textbook_loop

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.dualrate.loop import (
    Points,
    close_loop,
    noise_gain,
    stability_radius,
    steady_state,
    time_response,
    tracking_error_ratio,
)
from replication.estimation.dualrate.observers import OBSERVERS, Harmonic
from replication.estimation.dualrate.problem import MAX_RATIO, DualRateDesign, as_plant, dual_rate_design, make_plant

APO, FAST, STATE = (OBSERVERS[name] for name in ("alternating_predictive", "fast_sensor", "state_feedback"))
OSCILLATOR = make_plant([[0, 1], [-1, 0]], [[0], [1]], [[1, 0]])


def oscillator_design(*, damping: float, period: float = 0.3) -> DualRateDesign:
    plant = make_plant([[0, 1], [-1, -damping]], [[0], [1]], [[1, 0]])
    return dual_rate_design(plant, feedback=[[0, 0]], injection=[[0.5], [0.5]], period=period, ratio=2)


@pytest.mark.parametrize("factor", [2.0, 0.1, -1.0])
def test_the_sensor_reads_the_true_plant(factor: float) -> None:
    """Against the single-rate loop with a sensor gain."""
    design = replace(MOTOR_DESIGN, ratio=1)
    found = stability_radius(close_loop(design, APO, plant=make_plant(MOTOR.A, MOTOR.B_u, factor * MOTOR.C)))
    assert found == pytest.approx(np.abs(np.linalg.eigvals(textbook_loop(design.period, factor))).max(), rel=1e-9)
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


@pytest.mark.parametrize("factor", [3.0, 10.0])
def test_fast_growing_plants_are_not_refused_for_rounding(factor: float) -> None:
    rng = np.random.default_rng(11)
    for _ in range(60):
        plant = make_plant(factor * rng.normal(size=(4, 4)), rng.normal(size=(4, 1)), rng.normal(size=(1, 4)))
        dual_rate_design(plant, feedback=np.zeros((1, 4)), injection=np.zeros((4, 1)), period=0.4, ratio=5)


TURNING = make_plant([[0.1, 10 * np.pi], [-10 * np.pi, 0.1]], [[0], [1]], np.eye(2))
HALF_TURN = make_plant([[0, np.pi], [-np.pi, 0]], [[0], [1]], [[1, 0]])
FIXED = make_plant([[1]], [[1]], [[1]])
WIDER = make_plant(scipy.linalg.block_diag(MOTOR.A, [[-30.0]]), [*MOTOR.B_u, [1]], np.hstack([MOTOR.C, [[0]]]))
HARMONIC = Harmonic(1.0, np.zeros(1))


def gainless(plant: Any, period: float, ratio: int) -> DualRateDesign:
    (n, m), p = plant.B_u.shape, len(plant.C)
    return dual_rate_design(plant, feedback=np.zeros((m, n)), injection=np.zeros((n, p)), period=period, ratio=ratio)


def changed(**change: Any) -> Any:
    given = {"feedback": MOTOR_DESIGN.feedback, "injection": MOTOR_DESIGN.injection, "period": 0.2, "ratio": 5}
    return lambda: dual_rate_design(MOTOR, **{**given, **change})


def response(start: Any = START, estimate: Any = START, periods: int = 2, steps: int = 2, output: int = 0) -> Any:
    loop = motor_loop("alternating_predictive", 1.0)
    return lambda: time_response(loop, start, estimate, slow_periods=periods, substeps=steps, output=output)


REFUSED: list[tuple[str, Callable[[], Any]]] = [
    *((f"rate ratio M must be {words}", changed(ratio=ratio)) for words, ratio in (
        ("at least 1", 0), ("a whole number, got 2.5", 2.5), ("a whole number", True),
        (f"at most {MAX_RATIO}, got {MAX_RATIO + 1}", MAX_RATIO + 1),
    )),
    *(("period T must be positive", changed(period=period)) for period in (0.0, -0.2, np.nan)),
    ("feedback gain K must have 3 columns", changed(feedback=[[-20, -0.1]])),
    ("observer gain L must have 3 rows", changed(injection=[[0.45, 0.9, 0.9]])),
    ("observer gain L must be finite", changed(injection=[[np.inf], [0], [0]])),
    *((f"needs a state, an input and an output, got {n}, {m} and {p}",
       lambda n=n, m=m, p=p: make_plant(np.zeros((n, n)), np.zeros((n, m)), np.zeros((p, n))))
      for n, m, p in ((0, 1, 1), (2, 0, 1), (2, 1, 0))),
    ("not stabilisable: no input moves the unstable mode 1",
     lambda: gainless(make_plant([[1, 0], [0, -1]], [[0], [1]], [[1, 0]]), 0.1, 2)),
    ("not detectable: the output does not see the unstable mode 1",
     lambda: gainless(make_plant([[1, 0], [0, -1]], [[1], [0]], [[0, 1]]), 0.1, 2)),
    ("hides the unstable mode", lambda: gainless(HALF_TURN, 0.5, 2)),
    ("held over T = 0.1 s loses the unstable mode 0.1", lambda: gainless(TURNING, 0.1, 1)),
    ("overflows over M T = 2000 s", lambda: stability_radius(close_loop(gainless(FIXED, 0.1, 20000), APO))),
    ("overflows", lambda: close_loop(gainless(make_plant([[1e6]], [[1]], [[1]]), 0.2, 5), FAST)),
    ("continuous-time", lambda: as_plant(control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1))),
    ("strictly proper", lambda: as_plant(control.ss([[-1.0]], [[1.0]], [[1.0]], [[1.0]]))),
    ("one of OBSERVERS, such as OBSERVERS['fast_sensor']", lambda: close_loop(MOTOR_DESIGN, "fast_sensor")),
    *((f"one amplitude for each of the 1 inputs, got {size}",
       lambda size=size: close_loop(MOTOR_DESIGN, APO, harmonic=Harmonic(1.0, np.zeros(size), continuous=size > 2)))
      for size in (2, 5)),
    ("frequency σ of the reference (rad/s) must be finite", lambda: Harmonic(np.nan, np.zeros(1))),
    ("list of finite numbers, one per input", lambda: Harmonic(1.0, np.array([np.inf]))),
    ("state feedback needs a true plant with the 3 states", lambda: close_loop(MOTOR_DESIGN, STATE, plant=WIDER)),
    ("the 1 inputs and 1 outputs of the model, got 1 and 2",
     lambda: close_loop(MOTOR_DESIGN, APO, plant=make_plant(MOTOR.A, MOTOR.B_u, [*MOTOR.C, *MOTOR.C]))),
    ("no reference", lambda: tracking_error_ratio(close_loop(MOTOR_DESIGN, FAST))),
    ("one output, the plant has 2", lambda: tracking_error_ratio(
        close_loop(gainless(make_plant(-np.eye(2), [[1], [1]], np.eye(2)), 0.1, 2), FAST, harmonic=HARMONIC))),
    ("points must be one of", lambda: tracking_error_ratio(motor_loop("fast_sensor", 1.0), "everywhere")),
    *((words, response(**{name: start})) for name, words in (
        ("start", "x(0) must be 3 finite real numbers"), ("estimate", "ζ(0) must be 3 finite real numbers"),
    ) for start in ([0, 0], ["a", 0, 0], [1j, 0, 0], [[0], 1, 2], [0, np.nan, 0])),
    ("number of sub-steps must be at least 1", response(steps=0)),
    ("number of slow periods", response(periods=0)),
    ("output must be a number from 0 to 0, got 2", response(output=2)),
]  # fmt: skip


@pytest.mark.parametrize(("words", "work"), REFUSED)
def test_what_does_not_fit_is_named(words: str, work: Callable[[], Any]) -> None:
    with pytest.raises(InvalidInputError, match=re.escape(words)):
        work()


def test_what_is_next_to_a_refusal_is_taken() -> None:
    assert replace(MOTOR_DESIGN, ratio=MAX_RATIO).ratio == MAX_RATIO
    assert as_plant(control.ss([[-1.0]], [[1.0]], [[1.0]], [[0.0]])).order == 1
    # Two outputs see both eigenvectors that sampling folds together, and half the period folds none.
    assert gainless(TURNING, 0.05, 2).slow_period == 0.1
    loop = motor_loop("held_measurement", 2.5)
    assert tracking_error_ratio(loop, "between") == tracking_error_ratio(loop, Points.BETWEEN)


def test_loops_that_do_not_settle_have_no_steady_state() -> None:
    marginal = close_loop(oscillator_design(damping=0.0), FAST, harmonic=Harmonic(2.0, np.zeros(1)))
    assert stability_radius(marginal) == pytest.approx(1.0, abs=1e-13)
    for loop, words in ((marginal, "the loop is marginal"), (motor_loop("single_rate", 1.0), "unstable .* no steady")):
        with pytest.raises(InfeasibleError, match=words):
            steady_state(loop)
        with pytest.raises(InfeasibleError, match="noise grows without bound"):
            noise_gain(loop)
