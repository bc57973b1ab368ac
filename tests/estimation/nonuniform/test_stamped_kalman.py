"""The Kalman filter with time stamps against batch least squares, augmentation, scipy, and itself in another order."""

import control
import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from replication.errors import InvalidInputError
from replication.estimation.nonuniform.stamped.kalman import NoisyPlant, Transition
from replication.estimation.nonuniform.stamped.running import StampedKalman
from tests.estimation.api.api_cases import stamped

EXACT = 1e-9
CART = NoisyPlant(
    [[0, 1, 0], [0, 0, 1], [0, 0, -0.5]],
    [[1, 0, 0], [0, 1, 0.3]],
    Q=[[0.02, 0, 0], [0, 0.03, 0.01], [0, 0.01, 0.4]],
    R=[[0.04, 0.01], [0.01, 0.09]],
    B_u=[[0.1], [1.0], [0.2]],
    P0=np.diag([2.0, 1.0, 0.5]),
    sensors=["camera", "gyro"],
)
"""Integrates twice."""
UNSTABLE = NoisyPlant([[1.5, 2], [-1, 0.2]], [[1, 0]], Q=[[1, 0.2], [0.2, 0.5]], R=[0.1], B_u=[[0.0], [1.0]])


def history(plant, rng, count):
    """Times, samples with None where a sensor did not measure, and inputs."""
    times = np.cumsum(rng.uniform(0.02, 0.6, count))
    q = len(plant.C)
    samples = [[float(v) if rng.random() < 0.7 else None for v in rng.standard_normal(q)] for _ in times]
    samples[0] = [1.0] * q
    return times, samples, rng.standard_normal((count, plant.B_u.shape[1]))


def batch(plant, start, times, samples, inputs):
    """All states from all samples by weighted least squares, with covariances; transitions by quadrature."""
    n, count = plant.order, len(times)
    rows, right = [], []

    def add(blocks, value, covariance):
        whiten = np.linalg.inv(np.linalg.cholesky(covariance))
        row = np.zeros((len(covariance), n * count))
        for k, block in blocks:
            row[:, k * n : (k + 1) * n] = block
        rows.append(whiten @ row)
        right.append(whiten @ value)

    add([(0, np.eye(n))], start, plant.P0)
    for k in range(count - 1):
        h = times[k + 1] - times[k]
        Phi = scipy.linalg.expm(plant.A * h)
        spread, _ = scipy.integrate.quad_vec(
            lambda s: scipy.linalg.expm(plant.A * s) @ plant.Q @ scipy.linalg.expm(plant.A * s).T, 0, h, epsabs=1e-14
        )
        held, _ = scipy.integrate.quad_vec(lambda s: scipy.linalg.expm(plant.A * s) @ plant.B_u, 0, h, epsabs=1e-14)
        add([(k, -Phi), (k + 1, np.eye(n))], held @ inputs[k], spread)
    for k, sample in enumerate(samples):
        seen = [i for i, value in enumerate(sample) if value is not None]
        if seen:
            add([(k, plant.C[seen])], np.array([sample[i] for i in seen]), plant.R[np.ix_(seen, seen)])
    left = np.vstack(rows)
    x = np.linalg.lstsq(left, np.concatenate(right), rcond=None)[0].reshape(count, n)
    P = np.linalg.inv(left.T @ left)
    return x, [P[k * n : (k + 1) * n, k * n : (k + 1) * n] for k in range(count)]


def close(got, want):
    return np.max(np.abs(np.asarray(got) - want)) <= EXACT * max(1.0, float(np.max(np.abs(want))))


@pytest.mark.parametrize("plant", [CART, UNSTABLE])
def test_filtered_and_smoothed_are_those_of_batch_least_squares(plant):
    times, samples, inputs = history(plant, np.random.default_rng(1), 7)
    start = np.arange(1.0, 1.0 + plant.order)
    observer = StampedKalman(plant, horizon=100.0)
    observer.reset(start)
    for k, t in enumerate(times):
        got = observer.step(samples[k], t=t, u=inputs[k])
        x, P = batch(plant, start, times[: k + 1], samples[: k + 1], inputs)
        assert close(got, x[-1])
        assert close(observer.covariance, P[-1])
    for one, mean, spread in zip(observer.smoothed(), x, P, strict=True):
        assert close(one.x, mean)
        assert close(one.P, spread)
    # The predicted estimate is the last one of a batch whose last instant has no sample.
    ahead = observer.predict(times[-1] + 0.3)
    x, P = batch(plant, start, [*times, times[-1] + 0.3], [*samples, [None] * len(plant.C)], inputs)
    assert close(ahead.x, x[-1])
    assert close(ahead.P, P[-1])


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_late_samples_change_the_estimate_as_if_they_had_come_in_time(seed):
    rng = np.random.default_rng(seed)
    times, samples, _ = history(CART, rng, 12)
    parts = [
        (float(t), {name: value})
        for t, sample in zip(times, samples, strict=True)
        for name, value in zip(CART.sensors, sample, strict=True)
        if value is not None
    ]
    in_time, late = StampedKalman(CART), StampedKalman(CART, horizon=100.0)
    for t, part in parts:
        in_time.step(part, t=t)
    for index in [0, *(1 + rng.permutation(len(parts) - 1))]:
        late.step(parts[index][1], t=parts[index][0])
    assert close(late.estimate, in_time.estimate)
    assert close(late.covariance, in_time.covariance)
    lost = StampedKalman(CART)
    for t, part in parts[:1] + parts[2:]:
        lost.step(part, t=t)
    assert not close(lost.covariance, in_time.covariance)


def test_two_sensors_at_one_time_are_one_sample_with_correlated_noise():
    apart, at_once = StampedKalman(CART), StampedKalman(CART)
    apart.step({"gyro": 0.2}, t=0.0)
    apart.step({"camera": 1.0}, t=0.0, u=[0.5])
    at_once.step([1.0, 0.2], t=0.0, u=0.5)
    assert close(apart.step({}, t=0.4), at_once.step({}, t=0.4))
    assert close(apart.covariance, at_once.covariance)


def test_only_the_horizon_is_kept():
    observer = StampedKalman(CART, horizon=0.25)
    for k in range(50):
        observer.step({"gyro": 0.1}, t=0.1 * k)
    assert len(observer.smoothed()) == 3
    with pytest.raises(InvalidInputError, match="more than the horizon"):
        observer.step({"camera": 1.0}, t=4.9 - 0.26)
    observer.step({"camera": 1.0}, t=4.9 - 0.24)


def test_held_noise_with_cross_covariance_is_the_predictor_of_the_textbook():
    """x^(k+1|k) with gain (Phi P C' + Gamma S)(C P C' + R)^-1, by the exponential of the augmented plant."""
    S = np.array([[0.01, 0.0], [0.0, 0.02], [0.05, -0.1]])
    plant = NoisyPlant(CART.A, CART.C, CART.Q, CART.R, S=S, P0=CART.P0)
    observer = StampedKalman(plant)
    rng = np.random.default_rng(3)
    x, P, t, n = np.zeros(3), np.array(plant.P0), 0.0, 3
    for h in rng.uniform(0.05, 0.5, 30):
        y = rng.standard_normal(2)
        observer.step(y, t=t)
        whole = scipy.linalg.expm(h * np.block([[plant.A, np.eye(n)], [np.zeros((n, 2 * n))]]))
        Phi, Gamma = whole[:n, :n], whole[:n, n:]
        spread = plant.C @ P @ plant.C.T + plant.R
        K = (Phi @ P @ plant.C.T + Gamma @ S) @ np.linalg.inv(spread)
        x, P = Phi @ x + K @ (y - plant.C @ x), Phi @ P @ Phi.T + Gamma @ plant.Q @ Gamma.T - K @ spread @ K.T
        t += h
        assert close(observer.predict(t).x, x)
        assert close(observer.predict(t).P, P)


@pytest.mark.parametrize("h", [0.0, 1e-6, 0.02, 0.7, 9.0])
def test_transitions_are_those_of_scipy_and_add_up(h):
    rng = np.random.default_rng(4)
    A, B = rng.standard_normal((4, 4)) - 3 * np.eye(4), rng.standard_normal((4, 2))
    A[3] *= 1e3  # stiff: an exponential of -A overflows
    transition = Transition.of(A, B, B @ B.T)
    Phi, Gamma, Q = transition.at(h)
    block = scipy.linalg.expm(h * np.block([[A, B], [np.zeros((2, 6))]]))
    assert np.allclose(Phi, block[:4, :4], rtol=0, atol=1e-11)
    assert np.allclose(Gamma, block[:4, 4:], rtol=0, atol=1e-11)
    # d/dh Q = A Q + Q A' + B B', integrated.
    assert np.allclose(A @ Q + Q @ A.T + B @ B.T, Phi @ B @ B.T @ Phi.T, rtol=0, atol=1e-8)
    half = transition.at(h / 2)
    assert np.allclose(half[2] + half[0] @ half[2] @ half[0].T, Q, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"Q": [[1, 2], [2, 1]]}, "Q must be positive semidefinite"),
        ({"R": [0.0]}, "R must be positive definite"),
        ({"R": [0.1, 0.1]}, "R must have 1 rows"),
        ({"P0": [[1, 3], [3, 1]]}, "P0 must be positive semidefinite"),
        ({"S": [[0.5], [0]]}, "S does not fit"),
        ({"S": [[0.1]]}, "S must have 2 rows"),
        ({"B_u": [[1]]}, "B_u must have 2 rows"),
        ({"sensors": ["a", "b"]}, "sensors must be 1 different"),
        ({"sensors": "a"}, "sensors must be 1 different"),
        ({"C": [[0, 1]]}, "no sensor sees the mode"),
    ],
)
def test_plants_that_make_no_sense_are_refused(change, message):
    good = {"A": [[0, 1], [0, 0]], "C": [[1, 0]], "Q": np.eye(2), "R": [0.1]}
    NoisyPlant(**good)
    with pytest.raises(InvalidInputError, match=message):
        NoisyPlant(**{**good, **change})


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        ({"y": {"radar": 1.0}, "t": 2.0}, "no sensor 'radar'"),
        ({"y": {"camera": np.nan}, "t": 2.0}, "sample of camera"),
        ({"y": [1.0, np.inf], "t": 2.0}, "sample of gyro"),
        ({"y": [1.0], "t": 2.0}, "y must have 2 entries"),
        ({"y": [1.0, "a"], "t": 2.0}, "sample of gyro"),
        ({"y": {"camera": 1.0}, "t": np.nan}, "t must be a finite time"),
        ({"y": {"camera": 1.0}, "t": None}, "t must be a finite time"),
        ({"y": {"camera": 1.0}, "t": 1.0}, "must increase"),
        ({"y": {"camera": 1.0}, "t": 0.2}, "more than the horizon"),
        ({"y": {"camera": 1.0}, "t": 0.8, "u": 1.0}, "input cannot be changed"),
        ({"y": {"camera": 1.0}, "t": 2.0, "now": 1.9}, "lies in the future"),
        ({"y": {"camera": 1.0}, "t": 2.0, "u": np.nan}, "u must be 1 finite"),
        ({"y": {"camera": 1.0}, "t": 2.0, "u": [1.0, 2.0]}, "u must be 1 finite"),
    ],
)
def test_samples_that_make_no_sense_leave_the_estimate_unharmed(sample, message):
    observer = StampedKalman(CART, horizon=0.5)
    observer.step([1.0, 0.0], t=0.5)
    observer.step([1.0, 0.1], t=1.0)
    before = observer.estimate, observer.covariance
    with pytest.raises(InvalidInputError, match=message):
        observer.step(sample.pop("y"), **sample)
    assert np.array_equal(before[0], observer.estimate)
    assert np.array_equal(before[1], observer.covariance)
    observer.step({"camera": 1.0}, t=0.8)
    assert not np.array_equal(before[0], observer.estimate)


def test_what_the_filter_cannot_do_is_refused():
    held = NoisyPlant(CART.A, CART.C, CART.Q, CART.R, S=np.zeros((3, 2)))
    with pytest.raises(InvalidInputError, match="late samples need white noise"):
        StampedKalman(held, horizon=0.1)
    with pytest.raises(InvalidInputError, match="all sensors at once"):
        StampedKalman(held).step([1.0, None], t=0.0)
    with pytest.raises(InvalidInputError, match="horizon must be positive"):
        StampedKalman(CART, horizon=-1.0)
    with pytest.raises(InvalidInputError, match="must be a NoisyPlant"):
        StampedKalman(CART.A)
    with pytest.raises(InvalidInputError, match="no sample yet"):
        StampedKalman(CART).predict(1.0)
    started = StampedKalman(CART, horizon=1.0)
    started.reset(t=1.0)
    with pytest.raises(InvalidInputError, match="before the start"):
        started.step({"gyro": 0.0}, t=0.9)
    with pytest.raises(InvalidInputError, match="before the newest"):
        started.predict(0.5)


def test_a_statespace_names_the_sensors():
    system = control.ss(CART.A, CART.B_u, CART.C, 0, outputs=["camera", "gyro"])
    plant = NoisyPlant.from_statespace(system, CART.Q, CART.R, P0=CART.P0)
    one, other = StampedKalman(plant), StampedKalman(CART)
    for t in (0.0, 0.3, 0.35):
        assert np.array_equal(one.step({"gyro": t}, t=t, u=1.0), other.step({"gyro": t}, t=t, u=1.0))
    with pytest.raises(InvalidInputError, match="feedthrough"):
        NoisyPlant.from_statespace(control.ss(-1, 1, 1, 1), [[1]], [1])
    with pytest.raises(InvalidInputError, match="continuous-time"):
        NoisyPlant.from_statespace(control.ss(-1, 1, 1, 0, 0.1), [[1]], [1])


def test_the_prediction_at_the_newest_sample_is_the_estimate():
    observer = StampedKalman(CART)
    observer.step([1.0, 0.5], t=0.3)
    np.testing.assert_allclose(observer.predict(0.3).x, observer.estimate, rtol=0, atol=EXACT)
    np.testing.assert_allclose(observer.predict(0.3).P, observer.covariance, rtol=0, atol=EXACT)
    with pytest.raises(InvalidInputError, match="before the newest sample"):
        observer.predict(0.3 - 1e-6)


def test_an_input_between_samples_moves_the_estimate_as_the_plant() -> None:
    observer, other = stamped("filter"), stamped("filter")
    for run in (observer, other):
        run.step([1.0, 0.5], t=0.0, u=[2.0])
    observer.step({}, t=0.1, u=[2.0])
    assert np.allclose(observer.predict(0.3), other.predict(0.3), rtol=1e-12, atol=1e-12)
    assert np.allclose(observer.step([0.0, 0.0], t=0.3), other.step([0.0, 0.0], t=0.3), rtol=1e-12, atol=1e-12)
    observer.step({}, t=0.4, u=[0.0])
    assert not np.allclose(observer.predict(0.5), other.predict(0.5), atol=1e-3)
    assert (observer.outside, other.outside) == (0, 0)
    for y, t, u in (({}, 0.45, None), ([0.0, 0.0], 0.35, None), ({}, 0.35, [1.0])):
        with pytest.raises(InvalidInputError):
            observer.step(y, t=t, u=u)


def test_a_late_sample_is_gated_as_if_it_had_come_in_time() -> None:
    samples = [([0.1, 0.0], 0.0), ([0.1, 9.0], 0.1), ([5.0, 0.1], 0.2), ([0.0, 0.1], 0.3)]
    plant = stamped("kalman").plant
    order, late = (StampedKalman(plant, horizon=1.0, gate=3.0) for _ in range(2))
    for y, t in samples:
        order.step(y, t=t)
    for i in (0, 2, 3, 1):
        late.step(samples[i][0], t=samples[i][1])
    assert np.allclose(order.estimate, late.estimate, rtol=1e-12) and order.gated == late.gated > 0
