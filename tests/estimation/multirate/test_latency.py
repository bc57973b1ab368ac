"""Late samples against plants augmented by hand, the plant run step by step, and the C form."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.integrate
from multirate_examples import CART, MOVING

from replication.errors import InvalidInputError
from replication.estimation import multirate
from replication.estimation.multirate import MultiratePlant
from replication.estimation.validation import Array

EQUAL = 1e-9


def measured(latency: tuple[float, ...], u: Array, d: Array) -> tuple[Array, Array]:
    """States at the instants and late samples of the moving plant, by an integrator, from rest and zero inputs."""
    A, B = np.asarray(MOVING.A), np.hstack([MOVING.B_u, MOVING.B_d])
    x, course = np.zeros(2), []
    for u_k, d_k in zip(u, d, strict=True):
        course.append(x)
        held = np.array([u_k, d_k])
        x = _after(A, B @ held, x, MOVING.dt)
    samples = np.zeros((len(u), 2))
    for k in range(len(u)):
        for i, age in enumerate(latency):
            at = k - int(np.ceil(age))
            if at >= 0:
                part = (k - age - at) * MOVING.dt
                then = _after(A, B @ np.array([u[at], d[at]]), course[at], part)
                samples[k, i] = np.asarray(MOVING.C)[i] @ then + np.asarray(MOVING.D_u)[i, 0] * u[at]
    return np.array(course), samples


def _after(A: Array, drive: Array, x: Array, time: float) -> Array:
    if time == 0:
        return x
    solved = scipy.integrate.solve_ivp(lambda _, z: A @ z + drive, (0, time), x, rtol=1e-12, atol=1e-12)
    return np.asarray(solved.y[:, -1])


@pytest.mark.parametrize("latency", [(0.0, 1.0), (0.4, 1.75), (2.0, 0.0)])
def test_without_noise_the_estimate_is_the_state(latency: tuple[float, ...]) -> None:
    """From a known start, with inputs and no disturbances, each sample is what the observer expects."""
    u = np.random.default_rng(5).standard_normal(30)
    course, y = measured(latency, u, np.zeros(30))
    found = multirate.design(MOVING, periods=(1, 3), latency=latency)
    estimates = runs(found, u, y)
    assert np.allclose(estimates[:-1], course[1:], rtol=1e-8, atol=1e-8)
    wrong = runs(multirate.design(MOVING, periods=(1, 3), latency=(latency[0] + 0.25, latency[1])), u, y)
    assert not np.allclose(wrong[:-1], course[1:], rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("latency", [(0.4, 1.75), (1.0, 0.5)])
def test_the_error_with_disturbances_is_that_of_the_error_system(latency: tuple[float, ...]) -> None:
    rng = np.random.default_rng(6)
    u, d = rng.standard_normal(30), rng.standard_normal(30)
    course, y = measured(latency, u, d)
    found = multirate.design(MOVING, periods=(1, 3), latency=latency)
    noise = np.hstack([d[:, None], np.zeros((30, 2))])
    error = multirate.simulate(found, 30, disturbance=noise).signals["error"]
    assert np.allclose(course[1:] - runs(found, u, y)[:-1], error[1:], rtol=1e-8, atol=1e-8)


def runs(found: Any, u: Array, y: Array) -> Array:
    observer = found.observer()
    return np.array([observer.step([u_k], y_k) for u_k, y_k in zip(u, y, strict=True)])


def test_a_state_space_in_continuous_time_is_the_plant_of_arrays() -> None:
    control = pytest.importorskip("control")
    B, D = np.hstack([MOVING.B_u, MOVING.B_d]), np.hstack([MOVING.D_u, np.zeros((2, 1))])
    system = control.ss(MOVING.A, B, MOVING.C, D, inputs=["push", "wind"], states=["place", "speed"])
    given = {"noise": [0.1, 0.2], "disturbances": ["wind"], "dt": MOVING.dt}
    found = multirate.design(system, periods=(1, 3), latency=(0.4, 1.75), **given)
    assert found.value == pytest.approx(multirate.design(MOVING, periods=(1, 3), latency=(0.4, 1.75)).value, rel=EQUAL)
    assert found.signals.outputs == ("place", "speed")
    assert len(found.signals.states) == len(found.problem.plant.A)
    assert found.to_statespace().nstates == found.problem.plant.order


def test_analyse_gives_the_level_of_a_design() -> None:
    found = multirate.design(MOVING, periods=(1, 3), latency=(0.4, 1.75))
    again = multirate.analyse(MOVING, found.gains["L"], periods=(1, 3), latency=(0.4, 1.75))
    assert again.value == pytest.approx(found.value, rel=EQUAL)
    start = multirate.simulate(found, 20, initial_error=[1.0, 0.0]).signals["error"]
    assert np.array_equal(start[0], [1.0, 0.0]) and np.linalg.norm(start[-1]) < 0.5


def test_the_kalman_filter_knows_the_feedthrough() -> None:
    found: Any = multirate.design(CART, periods=(1, 4), goal="h2")
    running, predictor = found.filter(), found.observer()
    rng = np.random.default_rng(2)
    for _ in range(50):
        u, y = rng.standard_normal(1), np.where(rng.random(2) < 0.2, np.nan, rng.standard_normal(2))
        assert np.allclose(running.step(u, y).prediction, predictor.step(u, y), rtol=EQUAL, atol=EQUAL)


BAD: dict[str, tuple[MultiratePlant, dict[str, Any]]] = {
    "latency beyond the horizon": (CART, {"latency": (0, 500)}),
    "must be at least 0": (CART, {"latency": (0, -1)}),
    "one entry for each": (CART, {"latency": (1,)}),
    "must be a number": (CART, {"latency": (0, "1")}),
    "in continuous time": (CART, {"latency": (0, 0.5)}),
    "dt belongs": (CART, {"dt": 0.1}),
    "S and latency": (replace(CART, B_w=[[0.1, 0], [0, 0]]), {"latency": (0, 1)}),
    "P0 and latency": (CART, {"latency": (0, 1), "goal": "h2", "P0": np.eye(2)}),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_latencies_have_messages(message: str) -> None:
    plant, given = BAD[message]
    with pytest.raises(InvalidInputError, match=message):
        multirate.design(plant, periods=(1, 4), **given)
