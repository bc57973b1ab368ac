"""Plants for the tests: without noise, some with exact optima; with noise, and observers that nobody designed."""

import numpy as np

from replication.estimation.delay import DelayObserver, DelayPlant, delay_system
from replication.estimation.delay.general.cone import line_form
from replication.estimation.delay.units import time_scaled, transformed
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
        [[-1.0, 2], [0.5, -0.5]], [[[-0.5, 0.3], [0.4, -1.0]]], [0.8], np.eye(2), [[1, 0.0]], [[1, 1.0]], [[[0.3, 0.0]]]
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


def tanks(delay: float = 0.4) -> DelayPlant:
    """Stable; each tank is disturbed and wanted, now and late; the first is measured."""
    eye = np.eye(2)
    return delay_system([[-1, 0.2], [0.5, -2]], [[[-0.3, 0], [0.5, 0.2]]], [delay], eye, eye, [[1, 0]], [0.3 * eye])


def hidden(rate: float) -> DelayPlant:
    """A first state with this rate that y does not see."""
    return delay_system(np.diag([rate, -1.0]), [np.zeros((2, 2))], [1.0], np.eye(2), np.eye(2), [[0.0, 1.0]])


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


SIZES = np.diag([3e5, 2e-4])
"""Of the states, in awkward units."""


def awkward(system: DelayPlant, factor: float) -> DelayPlant:
    """With time divided by `factor` and states of very different sizes."""
    return transformed(time_scaled(system, factor), SIZES)


def frequency_response(system: DelayPlant, omega: Array | float) -> Array:
    """The exact response from w to z of a plant of `delay_system` (M, p, r), term by term as eq. (1) has it."""
    found = []
    for s in 1j * np.atleast_1d(omega):
        late = np.exp(-s * np.array(system.delays))
        matrix = s * np.eye(system.states) - system.a0 - sum(e * a for e, a in zip(late, system.a, strict=True))
        output = system.c10 + sum(e * c for e, c in zip(late, system.c1, strict=True))
        found.append(output @ np.linalg.solve(matrix, system.b))
    return np.array(found)


# Plants with noise


def delayed_output() -> DelayPlant:
    """The first public example: output and noise delayed by 1 s; published level 1.808."""
    zero = np.zeros((1, 2))
    more = {"a": [[[-1, -1], [0, 0.9]]], "c2_delayed": [[[1, 10]]], "d21_delayed": [[[0, 5]]]}
    return DelayPlant([[0, 0], [0, 1]], [1.0], np.eye(2), [[1, 0]], zero, **more)  # type: ignore[arg-type]


def two_late(ranges: tuple[tuple[float, float], ...] = ()) -> DelayPlant:
    """The second public example: stable, two delays; published level 1.0448."""
    more = {
        "a": [[[-0.1, 0], [0.2, -0.2]], [[0, 0.1], [-0.2, -0.3]]],
        "c2_delayed": [[[0, 10]], [[0, 2]]],
        "d21": [[1, 1]],
        "ranges": ranges,
    }
    return DelayPlant([[0, 3], [-4, -5]], [0.3, 0.5], np.diag([-0.4545, 0.909]), [[0, 100]], [[0, 100]], **more)  # type: ignore[arg-type]


def averaged() -> DelayPlant:
    """Stable, with averages over the delay in state and output, known inputs with and without delay, and D_11."""
    more = {
        "a": [[[-0.3, 0], [0, 0.2]]],
        "a_spread": [[[[0.2, 0], [0, -0.1]], [[0.1, 0.3], [0, 0]]]],
        "c1_spread": [[[[0.3, 0.1]]]],
        "c2_delayed": [[[1, 0.0]]],
        "c2_spread": [[[[0.5, 0.2]], [[0.1, -0.4]]]],
        "d11": [[0.1, 0, 0.2]],
        "d21": [[0, 0, 0.3]],
        "b_u": [[0], [1]],
        "b_u_delayed": [[[1], [0]]],
    }
    b = np.eye(2, 3)
    return DelayPlant([[-0.6, 1], [-1, -0.8]], [0.6], b, [[1, 0]], [[0, 0.0]], **more)  # type: ignore[arg-type]


def late(rate: float, noise: float, delay: float) -> DelayPlant:
    """x' = rate x + w_1, z = x, y = x(t - delay) + noise w_2."""
    more = {"c2_delayed": [[[1]]], "d21": [[0, noise]]}
    return DelayPlant([[rate]], [delay], [[1, 0]], [[1]], [[0]], **more)  # type: ignore[arg-type]


def made_up(plant: DelayPlant, size: float, seed: int = 0, degree: int = 4) -> DelayObserver:
    """An observer with random gains."""
    rng = np.random.default_rng(seed)
    form, q = line_form(plant), plant.measurements
    kernels = tuple(size * rng.standard_normal((degree, line.width, q)) for line in form.lines)
    l0, lz = size * rng.standard_normal((plant.states, q)), size * rng.standard_normal((plant.outputs, q))
    return DelayObserver(plant, form, l0, lz, kernels)
