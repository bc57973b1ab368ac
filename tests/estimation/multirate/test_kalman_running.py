"""The running filters against conditioning on all measurements at once, against each other, and in C."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from multirate_examples import CART as MOVED
from multirate_examples import Conditioned, correlated, problem

from replication.estimation import multirate
from replication.estimation.api.running import UnscheduledSampleWarning
from replication.estimation.multirate.kalman import filter_gains, kalman_design, smoothing_limit
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.multirate.running import KalmanFilter, StartingFilter
from replication.estimation.validation import Array

EQUAL = 1e-9
CART = replace(MOVED, D=np.array([[0.5, 0], [0.1, 0.2]]), D_u=None)
START, P0 = np.array([1.0, -2.0]), np.array([[2.0, 0.3], [0.3, 1.0]])


def cases() -> dict[str, MultirateProblem]:
    plain = problem(CART, (1, 3), (0, 1))
    return {
        "plain": plain,
        "correlated": correlated(plain, 2),
        "unstable": problem(replace(CART, A=1.2 * CART.A), (1, 2)),
    }


def signals(given: MultirateProblem, steps: int, *, lost: float, seed: int = 4) -> tuple[Array, Array, Array]:
    """Inputs, measurements, and which of them come."""
    rng = np.random.default_rng(seed)
    due = given.schedule.mask[np.arange(steps) % given.schedule.period]
    came = due & (rng.random(due.shape) >= lost)
    return rng.normal(size=(steps, 1)), rng.normal(size=due.shape), came


@pytest.mark.parametrize("name", cases())
@pytest.mark.parametrize("lag", [0, 1, 3])
@pytest.mark.parametrize("lost", [0.0, 0.4])
def test_each_estimate_is_the_conditional_mean(name: str, lag: int, lost: float) -> None:
    given = cases()[name]
    u, y, came = signals(given, 9, lost=lost)
    exact = Conditioned(given, START, P0, u)
    run = StartingFilter(given, P0, lag)
    run.reset(START)
    for k in range(len(u)):
        found = run.step(u[k], np.where(came[k], y[k], np.nan))
        told = came[: k + 1], y[: k + 1]
        wanted = {"filtered": exact(k, *told), "prediction": exact(k + 1, *told)}
        if k >= lag:
            wanted["smoothed"] = exact(k - lag, *told)
        else:
            assert np.all(np.isnan(found.smoothed))
        covariances = {
            "filtered": "covariance",
            "prediction": "predicted_covariance",
            "smoothed": "smoothed_covariance",
        }
        for key, (mean, covariance) in wanted.items():
            np.testing.assert_allclose(getattr(found, key), mean, rtol=EQUAL, atol=EQUAL)
            np.testing.assert_allclose(getattr(found, covariances[key]), covariance, rtol=EQUAL, atol=EQUAL)
    due = int(given.schedule.mask[np.arange(len(u)) % given.schedule.period].sum())
    assert run.missed == due - int(came.sum())


@pytest.mark.parametrize("name", cases())
@pytest.mark.parametrize("lag", [0, 2])
def test_from_its_own_covariance_the_start_is_the_steady_state(name: str, lag: int) -> None:
    given = cases()[name]
    X = kalman_design(given).X
    steady, starting = KalmanFilter(given, filter_gains(given, X, lag)), StartingFilter(given, X[0], lag)
    u, y, _ = signals(given, 12, lost=0.0)
    for k in range(len(u)):
        due = np.where(given.schedule.mask[k % given.schedule.period], y[k], np.nan)
        one, other = steady.step(u[k], due), starting.step(u[k], due)
        for field, a, b in zip(one._fields, one, other, strict=True):
            if k >= lag or not field.startswith("smoothed"):
                np.testing.assert_allclose(a, b, rtol=EQUAL, atol=EQUAL, err_msg=field)


@pytest.mark.parametrize("name", cases())
def test_a_longer_lag_is_better_and_tends_to_the_smoother(name: str) -> None:
    given = cases()[name]
    X = kalman_design(given).X
    traces = [np.trace(filter_gains(given, X, lag).smoothed, axis1=1, axis2=2).sum() for lag in (0, 1, 2, 4, 200)]
    assert np.all(np.diff(traces) < 0)
    # The covariance of x(k - lag) is told by the phase of k: turned back to that of k - lag.
    turned = np.roll(filter_gains(given, X, 300).smoothed, -(300 % given.schedule.period), axis=0)
    np.testing.assert_allclose(turned, smoothing_limit(given, X), rtol=1e-7, atol=EQUAL)


def test_covariances_over_time_are_those_of_the_running_filter() -> None:
    result = multirate.design(CART, periods=(1, 3), goal="h2", P0=P0)
    assert isinstance(result, multirate.KalmanResult)
    predicted, filtered = result.covariances(5)
    run = result.filter()
    for k in range(5):
        step = run.step([0.0], [0.0, None if k % 3 else 0.0])
        np.testing.assert_allclose(filtered[k], step.covariance, atol=EQUAL)
        if k < 4:
            np.testing.assert_allclose(predicted[k + 1], step.predicted_covariance, atol=EQUAL)
    np.testing.assert_array_equal(predicted[0], P0)
    steady, _ = multirate.design(CART, periods=(1, 3), goal="h2").covariances(7)  # type: ignore[attr-defined]
    np.testing.assert_allclose(steady[3:6], steady[:3], atol=EQUAL)


@pytest.mark.parametrize("start", [None, P0])
def test_what_is_handed_out_cannot_change_the_filter(start: Any) -> None:
    result = multirate.design(CART, periods=(1, 3), goal="h2", P0=start)
    assert isinstance(result, multirate.KalmanResult)
    run = result.filter()
    step = run.step([1.0], [0.5, 0.2])
    for kept in (step.prediction, step.covariance, step.predicted_covariance):
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 7.0
    run.estimate[:] = 7.0
    np.testing.assert_array_equal(run.estimate, step.prediction)


def test_a_sample_off_its_schedule_is_used_where_the_covariance_is_followed() -> None:
    """As if the schedule had had it: the other filter is made for a schedule in which that sensor is due."""
    given = multirate.design(CART, periods=(1, 3), goal="h2").problem  # type: ignore[attr-defined]
    early = MultirateProblem(given.plant, SensingSchedule((1, 1)))
    one, other = StartingFilter(given, P0, 1), StartingFilter(early, P0, 1)
    for y in ([0.3, 0.1], [0.2, 0.5], [0.1, None], [0.4, -0.2]):
        left, right = one.step([0.1], y), other.step([0.1], y)
        for a, b in zip(left, right, strict=True):
            np.testing.assert_allclose(a, b, rtol=EQUAL, atol=EQUAL)
    assert (one.unscheduled, one.missed, other.unscheduled, other.missed) == (1, 0, 0, 1)


@pytest.mark.parametrize("goal", ["hinf", "h2"])
def test_a_sample_off_its_schedule_is_told_once_where_gains_are_fixed(goal: str) -> None:
    result = multirate.design(CART, periods=(1, 4), offsets=(0, 1), goal=goal)
    runs = [result.filter() if goal == "h2" else result.observer() for _ in range(2)]  # type: ignore[attr-defined]
    with pytest.warns(UnscheduledSampleWarning, match="off its schedule") as told:
        for k in range(40):
            y = [0.1, 10.0 if k % 4 == 2 else np.nan]  # the camera comes one instant late for ever
            runs[0].step([0.0], y)
            runs[1].step([0.0], [0.1, None])
    assert len(told) == 1
    assert (runs[0].unscheduled, runs[0].missed, runs[1].unscheduled) == (10, 10, 0)
    assert np.array_equal(runs[0].estimate, runs[1].estimate)


@pytest.mark.parametrize("start", [None, P0])
@pytest.mark.parametrize("gate", [4.0, 0.9999])
def test_a_gate_leaves_out_what_cannot_be(start: Any, gate: float) -> None:
    result = multirate.design(CART, periods=(1, 3), goal="h2")
    gated, plain = (result.filter(P0=start, gate=g) for g in (gate, None))  # type: ignore[attr-defined]
    rng, wild = np.random.default_rng(5), 0
    for k in range(60):
        y = np.where(result.problem.schedule.mask[k % 3], 0.1 * rng.standard_normal(2), np.nan)
        lost = y.copy()
        if k % 7 == 3 and k % 3 == 0:
            y[1], lost[1], wild = 1e6, np.nan, wild + 1
        one, other = gated.step([0.0], y), plain.step([0.0], lost)
        np.testing.assert_allclose(one.filtered, other.filtered, rtol=EQUAL, atol=EQUAL)
        np.testing.assert_allclose(one.covariance, other.covariance, rtol=EQUAL, atol=EQUAL)
    assert gated.gated == wild > 1 and gated.missed == 0


def test_a_gate_lets_good_samples_pass_as_often_as_it_says() -> None:
    """Innovations of the plant's own noise are normal: one in a thousand is beyond the gate of 99.9 %."""
    result, rng = multirate.design(CART, periods=(1, 1), goal="h2"), np.random.default_rng(8)
    run, plant, x = result.filter(gate=0.999), result.problem.plant, np.zeros(2)  # type: ignore[attr-defined]
    count = 20_000
    for _ in range(count):
        run.step([0.0], plant.C @ x + plant.D @ rng.standard_normal(plant.D.shape[1]))
        x = plant.A @ x + plant.B_d @ rng.standard_normal(plant.B_d.shape[1])
    # What is left out makes the next innovations a little larger than the filter thinks.
    assert 0.0007 < run.gated / (2 * count) < 0.002
