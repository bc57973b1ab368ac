"""The extended Kalman filter against a textbook loop, the linear filter, itself with late samples, and its C form."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.multirate import ExtendedFilter
from replication.estimation.nonuniform import ExtendedKalman, NoisyPlant, NonlinearPlant, StampedKalman
from replication.estimation.recorded import replay
from tests.estimation.compiled import EXACT, CompiledWithStamps, warnings_of

BEACON = np.array([3.0, -2.0])


def f(x: Any, u: Any, d: float) -> Any:
    """A cart (x, y, heading) with speed and turn rate."""
    return np.array([x[0] + d * u[0] * math.cos(x[2]), x[1] + d * u[0] * math.sin(x[2]), x[2] + d * u[1]])


def F(x: Any, u: Any, d: float) -> Any:
    return np.array([[1, 0, -d * u[0] * math.sin(x[2])], [0, 1, d * u[0] * math.cos(x[2])], [0, 0, 1]])


def h(x: Any) -> Any:
    """Distance of a beacon, and heading."""
    return np.array([math.hypot(*(x[:2] - BEACON)), x[2]])


def H(x: Any) -> Any:
    away = x[:2] - BEACON
    return np.array([[*(away / math.hypot(*away)), 0], [0, 0, 1.0]])


CART = NonlinearPlant(
    f, F, h, H, Q=np.diag([0.01, 0.01, 0.05]), R=[0.04, 0.01], x0=[0.5, 0.2, 0.1], P0=np.diag([0.5, 0.5, 0.1]),
    inputs=2, sensors=["range", "compass"],
)  # fmt: skip


def track(steps: int, d: float = 0.1) -> dict[str, np.ndarray]:
    """A log with the truth in it: distance at each third row, heading at each."""
    rng, x, rows = np.random.default_rng(6), np.array([0.3, 0.0, 0.0]), []
    for k in range(steps):
        u = np.array([1.0, 0.5 * math.sin(0.1 * k)])
        y = h(x) + np.sqrt(np.diag(CART.R)) * rng.standard_normal(2)
        rows.append([k * d, *u, math.nan if k % 3 else y[0], y[1], *x])
        x = f(x, u, d) + np.sqrt(np.diag(CART.Q) * d) * rng.standard_normal(3)
    names = ("t", "speed", "turn", "range", "compass", "truth x", "truth y", "truth heading")
    return dict(zip(names, np.array(rows).T, strict=True))


def textbook(log: dict[str, np.ndarray], d: float) -> np.ndarray:
    """Update by those that came, predict; the covariance by Joseph's form."""
    x, P, estimates = np.array(CART.x0), np.array(CART.P0), []
    for k in range(len(log["t"])):
        y = np.array([log["range"][k], log["compass"][k]])
        rows = ~np.isnan(y)
        C, R = H(x)[rows], np.asarray(CART.R)[np.ix_(rows, rows)]
        K = P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
        x = x + K @ (y - h(x))[rows]
        P = (np.eye(3) - K @ C) @ P @ (np.eye(3) - K @ C).T + K @ R @ K.T
        estimates.append(x)
        u = np.array([log["speed"][k], log["turn"][k]])
        J, noise = F(x, u, d), np.asarray(CART.Q)
        x, P = f(x, u, d), J @ P @ J.T + d / 2 * (J @ noise @ J.T + noise)
    return np.array(estimates)


INPUTS = ("speed", "turn")


def measured(log: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: column for name, column in log.items() if "truth" not in name}


@pytest.mark.parametrize("observer", [ExtendedKalman(CART), ExtendedFilter(CART, (3, 1))])
def test_it_is_the_textbook_loop_where_samples_are_regular(observer: Any) -> None:
    log = track(300)
    expected, shown = textbook(log, 0.1), replay(observer, measured(log), inputs=INPUTS)
    np.testing.assert_allclose(shown.estimates, expected, rtol=0, atol=1e-9)
    assert shown.missing.tolist() == ([0, 0] if isinstance(observer, ExtendedFilter) else [200, 0])
    assert np.abs(shown.estimates[50:, :2] - np.array([log["truth x"], log["truth y"]]).T[50:]).max() < 1.5
    assert shown.consistent
    for k in range(300):
        u, y = [log["speed"][k], log["turn"][k]], [log["range"][k], log["compass"][k]]
        if isinstance(observer, ExtendedFilter):
            estimate = observer.step(u, y)
        else:
            estimate = observer.step([None if math.isnan(v) else v for v in y], t=log["t"][k], u=u)
        np.testing.assert_allclose(estimate, expected[k], rtol=0, atol=1e-9)


def test_of_a_linear_plant_it_is_the_kalman_filter() -> None:
    linear = NoisyPlant([[0, 0], [0, 0]], np.eye(2), Q=[0.1, 0.2], R=[1, 2], B_u=[[1], [0]])
    plant = NonlinearPlant(
        lambda x, u, d: x + d * np.array([u[0], 0]), lambda x, u, d: np.eye(2), lambda x: x, lambda x: np.eye(2),
        Q=[0.1, 0.2], R=[1, 2], x0=[0, 0], inputs=1,
    )  # fmt: skip
    one, other = StampedKalman(linear, horizon=1.0, gate=3), ExtendedKalman(plant, horizon=1.0, gate=3)
    rng = np.random.default_rng(1)
    times = 0.1 * np.arange(60)
    for k in (*range(20), 21, 20, *range(22, 60)):
        y = [3 * rng.standard_normal(), None if k % 3 else rng.standard_normal()]
        u = None if k == 20 else [float(k)]
        estimate = one.step(y, t=times[k], u=u)
        np.testing.assert_allclose(other.step(y, t=times[k], u=u), estimate, rtol=0, atol=1e-12)
    assert one.gated == other.gated > 0


def test_a_prediction_widens_and_there_is_no_smoother() -> None:
    observer = ExtendedKalman(CART, horizon=1.0)
    observer.step({"compass": 0.1}, t=4.0, u=[1.0, 0.2])
    assert observer.predict(5.0).P[0, 0] > observer.covariance[0, 0]
    with pytest.raises(InvalidInputError, match="no smoother"):
        observer.smoothed()


def test_the_multirate_form_counts_and_gates() -> None:
    log, gated = track(60), ExtendedFilter(CART, (3, 1), gate=5)
    plain = ExtendedFilter(CART, (3, 1))
    for k in range(60):
        u, y = [log["speed"][k], log["turn"][k]], [log["range"][k], log["compass"][k]]
        if k == 31:
            y[0] = 1e6
        if k == 33:
            y[0] = None
        estimate = gated.step(u, y)
        y[0] = None if k == 31 else y[0]
        np.testing.assert_array_equal(estimate, plain.step(u, y))
    assert (gated.gated, gated.missed, gated.unscheduled) == (1, 1, 1)
    assert (plain.gated, plain.missed, plain.unscheduled) == (0, 1, 0)


THEIRS = """
#include <math.h>
void own_f(const double *x, const double *u, double d, double *next, double *F)
{
    int i;
    next[0] = x[0] + d * u[0] * cos(x[2]);
    next[1] = x[1] + d * u[0] * sin(x[2]);
    next[2] = x[2] + d * u[1];
    for (i = 0; i < 9; i++)
        F[i] = i % 4 == 0 ? 1.0 : 0.0;
    F[2] = -d * u[0] * sin(x[2]);
    F[5] = d * u[0] * cos(x[2]);
}
void own_h(const double *x, double *y, double *H)
{
    const double a = x[0] - 3.0, b = x[1] + 2.0;
    y[0] = sqrt(a * a + b * b);
    y[1] = x[2];
    H[0] = a / y[0];
    H[1] = b / y[0];
    H[2] = H[3] = H[4] = 0.0;
    H[5] = 1.0;
}
"""


@pytest.mark.parametrize("gate", [None, 2.5])
def test_the_c_form_is_equal_and_refuses_alike(gate: float | None, tmp_path: Path) -> None:
    assert gate or warnings_of(ExtendedKalman(CART).to_c("own") + THEIRS, tmp_path) == []
    log, observer = track(400), ExtendedKalman(CART, gate=gate)
    compiled = CompiledWithStamps(observer, tmp_path, THEIRS)
    compiled.reset()
    for k in range(400):
        t, u, y = log["t"][k], [log["speed"][k], log["turn"][k]], [log["range"][k], log["compass"][k]]
        sample = None if k % 50 == 49 else y
        answer, found = compiled.step(sample, t, u)
        named = {} if sample is None else {n: v for n, v in zip(CART.sensors, y, strict=True) if not math.isnan(v)}
        assert answer == 0
        np.testing.assert_allclose(found, observer.step(named, t=t, u=u), rtol=0, atol=EXACT)
    assert (observer.gated > 0) == (gate is not None)
    kept = bytes(compiled.state)
    for t, u, y in (
        (39.0, None, [1, 1]),
        (math.nan, None, [1, 1]),
        (50, [math.inf, 0], None),
        (50, None, [math.inf, 0]),
    ):
        assert compiled.step(y, t, u)[0] == 1
        assert bytes(compiled.state) == kept
    assert compiled.step(None, 50, [1e308, 0])[0] == 0
    kept = bytes(compiled.state)
    assert compiled.step([1, 1], 1e3)[0] == 1  # own_f is no longer finite
    assert bytes(compiled.state) == kept
    assert ExtendedFilter(CART, (3, 1), gate=gate).to_c("own", "a cart") == observer.to_c("own", "a cart")


def changed(**parts: Any) -> Any:
    return lambda: replace(CART, **parts)


BAD = {
    "what F returns must have shape": changed(F=lambda x, u, d: np.eye(2)),
    "what H returns must have shape": changed(H=lambda x: H(x).T),
    "what f returns must have shape": changed(f=lambda x, u, d: x[:2]),
    "what f returns must be finite": changed(f=lambda x, u, d: x * np.nan),
    "F is not the Jacobian of f at x0: entry": changed(F=lambda x, u, d: F(x, u, d) + 0.1 * np.eye(3)[[1, 0, 2]]),
    "H is not the Jacobian of h at x0: entry": changed(H=lambda x: 2 * H(x)),
    "must be functions": changed(H=np.eye(2, 3)),
    "R must be positive definite": changed(R=[0.0, 1.0]),
    "sensors must be 2 different names": changed(sensors=["a", "a"]),
    "dt must be positive": changed(dt=0),
    "gate must be positive": lambda: ExtendedKalman(CART, gate=0),
    "gate must be positive and": lambda: ExtendedFilter(CART, (3, 1), gate=0),
    "plant must be a NonlinearPlant": lambda: ExtendedKalman(object()),  # type: ignore[arg-type]
    "periods are of 1, the plant has 2": lambda: ExtendedFilter(CART, (3,)),
    "Q as a matrix": lambda: ExtendedKalman(replace(CART, Q=lambda d: d * np.eye(3))).to_c(),
    "the filter is lost": lambda: lost(ExtendedKalman(replace(CART, h=lambda x: h(x) if x[0] < 9 else h(x) * np.nan))),
}


def lost(observer: ExtendedKalman) -> None:
    observer.step({"compass": 0.0}, t=0.0, u=[100.0, 0.0])
    observer.step({"compass": 0.0}, t=1.0)


@pytest.mark.parametrize("message", BAD)
def test_what_does_not_fit_has_its_own_message(message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        BAD[message]()


def test_a_filter_that_is_lost_is_not_consistent() -> None:
    log = measured(track(300))
    good = replay(ExtendedKalman(CART), log, inputs=INPUTS)
    astray = replay(ExtendedKalman(replace(CART, P0=1e-4 * np.eye(3))), log, inputs=INPUTS, start=[9.0, 5.0, 0.0])
    assert good.consistent and not astray.consistent
    with pytest.raises(InvalidInputError, match="latencies belong"):
        replay(ExtendedFilter(CART, (3, 1)), log, inputs=INPUTS, latencies={"range": 0.1})
    earlier = replay(ExtendedKalman(CART), log, inputs=INPUTS, latencies={"range": 0.05})
    assert len(earlier.log.t) == 400
