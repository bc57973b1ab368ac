"""Plants for the tests: scalar anchors, two with exact optima, and some where the observer matters."""

from __future__ import annotations

import numpy as np
import pytest

from papers.peet2019.method import hinf_gain
from replication.estimation.delay import DelayPlant, delay_system
from replication.estimation.validation import Array


def scalar(gains: list[float], delays: list[float]) -> DelayPlant:
    """ẋ = Σ gains_i x(t-τ_i) + w, z = y = x."""
    return delay_system([[0.0]], [[[gain]] for gain in gains], delays, [[1.0]], [[1.0]], [[1.0]])


def unstable_pair() -> DelayPlant:
    """Unstable, one delay; the unmeasured state is damped: the least gain is 1/√18, found by hand at ω = 0."""
    return delay_system([[-3, 4], [2, 0]], [[[0, 0], [1, 0]]], [0.3], np.eye(2), np.eye(2), [[0, 7]])


def blind_pair() -> DelayPlant:
    """Unstable, one delay; y does not see x_1, whose gain is that of 1/(s + e^{-s})."""
    return delay_system([[0, 0], [0, 1]], [[[-1, -1], [0, -0.9]]], [1.0], np.eye(2), [[1, 0]], [[0, 1]])


def blind_two_delays() -> DelayPlant:
    """The same with the delayed term split over two delays."""
    half = np.array([[-1, -1], [0, -0.9]]) / 2
    return delay_system([[0, 0], [0, 1]], [half, half], [0.5, 1.0], np.eye(2), [[1, 0]], [[0, 1]])


def one_delay() -> DelayPlant:
    """Nearly unstable; z holds a delayed state; y mixes both states."""
    return delay_system(
        [[-1.0, 2], [0.5, -0.5]],
        [[[-0.5, 0.3], [0.4, -1.0]]],
        [0.8],
        np.eye(2),
        [[1, 0.0]],
        [[1, 1.0]],
        [[[0.3, 0.0]]],
    )


def two_delays() -> DelayPlant:
    """Two delays, two outputs, one measurement of both states."""
    return delay_system(
        [[0.2, 1.0], [-1, -0.5]],
        [[[0.3, 0], [0.2, -0.4]], [[-0.6, 0.2], [0.1, -0.3]]],
        [0.4, 1.1],
        np.eye(2),
        [[1, 0.0], [0, 0.5]],
        [[0.3, 1.0]],
    )


def three_delays() -> DelayPlant:
    """Three delays; the second state is measured."""
    return delay_system(
        [[0.0, 1.0], [-1, 0.1]],
        [[[0, 0], [0.2, -0.4]], [[-0.3, 0.2], [0.1, -0.3]], [[0.2, 0], [0.1, -0.1]]],
        [0.3, 0.7, 1.0],
        np.eye(2),
        [[1, 0.0]],
        [[0, 1.0]],
    )


def random_system(seed: int, states: int = 2, delays: int = 1) -> DelayPlant:
    """A well-scaled plant with full disturbance, one output and one measurement."""
    rng = np.random.default_rng(seed)
    matrices: list[Array] = [0.5 * rng.standard_normal((states, states)) for _ in range(delays)]
    times = np.cumsum(rng.uniform(0.2, 0.6, delays))
    return delay_system(
        rng.standard_normal((states, states)) - 0.5 * np.eye(states),
        matrices,
        [float(time) for time in times],
        np.eye(states),
        rng.standard_normal((1, states)),
        rng.standard_normal((1, states)),
    )


ANCHORS = [
    (unstable_pair(), 1 / np.sqrt(18)),
    (blind_pair(), hinf_gain(scalar([-1.0], [1.0])).upper),
    pytest.param(blind_two_delays(), hinf_gain(scalar([-0.5, -0.5], [0.5, 1.0])).upper, marks=pytest.mark.slow),
]
"""Plants with their exact optima."""
