"""Constant loads and set-points: no error at rest, by simulation apart from the library's; the level under loads."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy

from replication.errors import InvalidInputError
from replication.estimation import dualrate
from replication.estimation.dualrate.problem import Plant, steady_of
from replication.estimation.dualrate.slow.result import SlowRateResult, joint, root_mean_square

HEIGHT = Plant([[0, 1, 0], [0, -0.1, 1], [0, 0, 0]], [[0], [1], [0]], [[1, 0, 0]])
"""Height, speed and weight of something that flies."""
TANKS = Plant(
    [[-1, 0.2, 1, 0], [0.3, -2, 0, 1], [0, 0, 0, 0], [0, 0, 0, 0]],
    [[1, 0], [0.2, 1], [0, 0], [0, 0]],
    [[1, 0, 0, 0], [0, 1, 0, 0]],
)
SERVO = Plant([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])
NOISES = {3: np.diag([0.0, 0.1, 0.01]), 4: np.diag([0.1, 0.1, 1.0, 2.0]), 2: np.diag([0.0, 0.1])}
RATES: dict[str, dict[str, Any]] = {
    "slow": {"at": "slow", "ratio": 5},
    "slow, held": {"at": "slow", "ratio": 4, "hold": 2},
    "continuous": {"ratio": 5},
    **{name: {"ratio": 3, "observer": name} for name in ("single_rate", "model_interpolation", "fast_sensor")},
}
FAR = 6_000
"""Fast instants after which all but the loads has died out."""


def designed(plant: Plant, rates: str, **given: Any) -> Any:
    return dualrate.design(plant, period=0.02, process_noise=NOISES[plant.order], **RATES[rates], **given)


def mixed(plant: Plant, change: Any) -> Plant:
    """In other coordinates x~ = change x."""
    back = np.linalg.inv(change)
    return Plant(change @ plant.A @ back, change @ plant.B_u, plant.C @ back)


def run(result: Any, plant: Plant, start: Any, setpoint: Any) -> Any:
    """y at the last fast instant and half a period before, of a plant that is stepped by exponentials of its own."""
    n, slow = plant.order, isinstance(result, SlowRateResult)
    block = np.zeros((n + plant.B_u.shape[1],) * 2)
    block[:n, :n], block[:n, n:] = plant.A, plant.B_u
    whole, half = (scipy.linalg.expm(block * time)[:n] for time in (0.02, 0.01))
    observer = result.running() if slow else result.observer()
    ratio = result.problem.sensors.periods[0] if slow else result.loop.design.ratio
    name = "" if slow else result.observer_name
    x, u = np.asarray(start, dtype=float), np.zeros(plant.B_u.shape[1])
    for k in range(FAR):
        y = plant.C @ x if k % ratio == 0 or name == "fast_sensor" else [None] * len(plant.C)
        if slow:
            u = observer.command
        elif k % ratio == 0 or name != "single_rate":
            u = result.gains["K"] @ observer.estimate + result.gains["N"] @ setpoint
        observer.step(setpoint if slow else u, y)
        before = np.concatenate([x, u])
        x = whole @ before
    return plant.C @ x, plant.C @ half @ before


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize(("plant", "loads", "setpoint"), [(HEIGHT, [-3.0], [2.0]), (TANKS, [0.7, -0.4], [1.0, 2.0])])
def test_outputs_rest_at_set_points_under_loads(plant: Plant, loads: Any, setpoint: Any, rates: str) -> None:
    result = designed(plant, rates, tracked=range(len(setpoint)))
    start = np.zeros(plant.order)
    start[-len(loads) :] = loads
    for y in run(result, plant, start, setpoint):
        assert y == pytest.approx(setpoint, abs=1e-6)
    assert result.fact("steady error").value < 1e-9
    shown = dualrate.simulate(result, start, slow_periods=FAR // 5, setpoint=setpoint, output=len(setpoint) - 1)
    assert shown.signals["output"][-1] == pytest.approx(setpoint[-1], abs=1e-6)


@pytest.mark.parametrize("rates", ["slow", "continuous"])
def test_without_a_set_point_loads_are_held_at_zero(rates: str) -> None:
    result = designed(HEIGHT, rates)
    shown = dualrate.simulate(result, [0, 0, 2.0], slow_periods=FAR // 5)
    assert shown.signals["output"][-1] == pytest.approx(0.0, abs=1e-6)
    assert shown.signals["input"][-1] == pytest.approx(-2.0, abs=1e-6)
    assert "N" not in result.gains
    with pytest.raises(InvalidInputError, match="no set-points"):
        dualrate.simulate(result, [0, 0, 0], slow_periods=2, setpoint=[1.0])
    with pytest.raises(InvalidInputError, match='under constant loads the gains are those of goal="h2"'):
        designed(HEIGHT, "slow", goal="hinf")


def test_feedback_that_knows_no_load_leaves_an_error() -> None:
    given: dict[str, Any] = {"injection": [[2], [2], [0.5]], "period": 0.02, "ratio": 5}
    blind = dualrate.analyse(HEIGHT, feedback=[[-2, -2, 0]], **given)
    assert blind.fact("steady error").value == pytest.approx(0.5, rel=1e-9)  # one over the feedback of the height
    assert dualrate.analyse(HEIGHT, feedback=[[-2, -2, -1]], **given).fact("steady error").value < 1e-12
    # The load is no mode of the loop: that of the plant without it is the same with full state.
    radii = dualrate.compare(blind)
    still = dualrate.make_plant(HEIGHT.A[:2, :2], HEIGHT.B_u[:2], HEIGHT.C[:, :2])
    alone = dualrate.analyse(still, feedback=[[-2, -2]], injection=[[2], [2]], period=0.02, ratio=5)
    assert radii["state_feedback"] == pytest.approx(dualrate.compare(alone)["state_feedback"], rel=1e-12)


@pytest.mark.parametrize("goal", ["h2", "hinf", "mixed"])
def test_set_points_need_no_load(goal: str) -> None:
    result = dualrate.design(SERVO, period=0.02, ratio=5, at="slow", goal=goal, process_noise=NOISES[2], tracked=0)
    plain = dualrate.design(SERVO, period=0.02, ratio=5, at="slow", goal=goal, process_noise=NOISES[2])
    assert run(result, SERVO, [0, 0], [1.5])[0] == pytest.approx([1.5], abs=1e-6)
    assert result.value == plain.value and result.signals == plain.signals
    system = result.to_statespace()
    assert system.input_labels[:2] == ["set-point of y[0]@0", "y[0]@0"]


def test_the_mean_square_under_loads_is_that_of_a_long_run() -> None:
    """The covariance of everything; the loads wander, and x and u less what holds them settle."""
    result = designed(TANKS, "slow, held")
    A, B, C, nothing = TANKS.A[:2, :2], TANKS.B_u[:2], TANKS.C[:, :2], np.zeros((2, 2))
    held = np.linalg.solve(np.block([[A, B], [C, nothing]]), np.vstack([-np.eye(2), nothing]))
    # z = (Q^(1/2) x, u), of which the loads, the third and fourth state, hold this; Q^(1/2) is that of C'C.
    rest = np.vstack([held[:2], nothing, held[2:]])
    stages, P, squares = joint(result.problem, result.controller).stages, np.zeros((10, 10)), []
    for k in range(FAR):
        stage = stages[k % len(stages)]
        z = stage.C / np.sqrt(result.problem.period)
        z[:, 2:4] -= rest
        squares.append(np.trace(z @ P @ z.T))
        P = stage.A @ P @ stage.A.T + stage.B @ stage.B.T
    mean = float(np.sqrt(np.mean(squares[-len(stages) :])))
    assert result.fact("root mean square").value == pytest.approx(mean, rel=1e-6)


@pytest.mark.parametrize("factor", [0.97, 1.03])
def test_another_feedback_has_a_larger_mean_square(factor: float) -> None:
    result = designed(HEIGHT, "slow")
    other = replace(result, gains={**result.gains, "K": result.gains["K"] * [factor, 1.0, 1.0, 1.0]})
    assert root_mean_square(result.problem, other.loop) > result.fact("root mean square").value * (1 + 1e-6)


@pytest.mark.parametrize("rates", ["slow", "continuous"])
def test_neither_level_nor_rest_depends_on_coordinates(rates: str) -> None:
    change = np.array([[1e3, 0, 0], [0.5, 2e-3, 0.1], [0, 0, 50.0]])
    moved, back = mixed(HEIGHT, change), np.linalg.inv(change)
    given: dict[str, Any] = {"period": 0.02, "process_noise": NOISES[3], **RATES[rates]}
    plain = dualrate.design(HEIGHT, **given)
    given["process_noise"] = change @ NOISES[3] @ change.T
    given["process_noise"] = (given["process_noise"] + given["process_noise"].T) / 2
    other = dualrate.design(moved, state_weight=(W := back.T @ HEIGHT.C.T @ HEIGHT.C @ back) / 2 + W.T / 2, **given)
    assert other.value == pytest.approx(plain.value, rel=1e-6)
    assert other.fact("steady error").value * 50.0 == pytest.approx(0.0, abs=1e-6)
    steady = steady_of(moved)
    assert steady is not None and steady.load @ moved.A == pytest.approx(0.0, abs=1e-9)
