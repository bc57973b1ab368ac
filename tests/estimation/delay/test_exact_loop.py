"""The exact gain of an observer against moments, grids, random delays, eigenvalues; and how it runs, also in C."""

import math
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from scipy.integrate import quad

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.delay.exact import response as peak
from replication.estimation.delay.exact.response import Response, error_response, mismatched_response, right_roots
from replication.estimation.delay.exact.terms import Kernel, Terms, plant_terms, projected
from replication.estimation.delay.general import observer as module
from replication.estimation.delay.general.observer import DelayObserver, InnovationsObserver, exact_gain, worst_gain
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos.observer import simulate
from tests.estimation.delay.plants import averaged, delayed_output, made_up, two_late

OMEGA = np.linspace(0.0, 12.0, 241)
OBSERVERS = {
    "averages": lambda: made_up(averaged(), 0.2),
    "two delays": lambda: made_up(two_late(), 0.01),
    "none": lambda: made_up(averaged(), 0.0),
}


def response(observer: DelayObserver):  # type: ignore[no-untyped-def]
    return error_response(plant_terms(observer.plant), observer.terms)


@pytest.mark.parametrize("s", [0.0, 3.0j, 250.0j, 2.0 + 5.0j, 1500.0, -2.0 + 5.0j])
def test_transform_is_the_integral(s: complex) -> None:
    kernel = Kernel(projected(lambda lags: np.stack([1.0 / (0.5 + lags), np.sin(9.0 * lags)], axis=-1)[:, None, :], 35))
    found = kernel.transform(np.array([s]))[0, 0]
    for entry, function in enumerate((lambda t: 1.0 / (0.5 + t), lambda t: np.sin(9.0 * t))):
        parts = [
            quad(lambda t, f=function, p=part: f(t) * p(np.exp(-s * t)), 0.0, 1.0, limit=2000, epsabs=1e-11)[0]
            for part in (np.real, np.imag)
        ]
        assert abs(found[entry] - complex(*parts)) < 1e-9


def test_bounds_of_a_kernel_hold() -> None:
    kernel = Kernel(np.random.default_rng(1).standard_normal((9, 2, 3)))
    s = 1j * np.geomspace(0.01, 1e3, 300)
    found = np.abs(kernel.transform(s))
    assert np.all(found <= kernel.size() * (1 + 1e-12))
    assert np.all(found <= kernel.variation() / np.abs(s)[:, None, None])
    lags = np.linspace(0.0, 1.0, 50)
    assert np.allclose(kernel.lagged()(lags), lags[:, None, None] * kernel(lags))


def test_weights_are_exact_for_broken_lines() -> None:
    kernel = Kernel(np.random.default_rng(2).standard_normal((6, 1, 1)))
    zero, step = np.zeros((1, 1)), 0.3
    weights = Terms(zero, (1.0,), (zero,), (kernel,)).weights(step)[:, 0, 0]
    for sample in range(len(weights)):
        hat = lambda t, k=sample: float(kernel(np.array([t]))[0, 0, 0]) * max(0.0, 1.0 - abs(t / step - k))  # noqa: E731
        assert weights[sample] == pytest.approx(quad(hat, 0.0, 1.0, points=[0.3, 0.6, 0.9])[0], abs=1e-10)


@pytest.mark.parametrize("name", OBSERVERS)
def test_response_is_that_of_the_moments(name: str) -> None:
    observer = OBSERVERS[name]()
    a, b, c, d = observer.error_model(24)  # no code of the exact loop
    wanted = np.linalg.norm(c @ np.linalg.solve(1j * OMEGA[:, None, None] * np.eye(len(a)) - a, b) + d, 2, axis=(1, 2))
    assert np.allclose(response(observer).gains(OMEGA), wanted, rtol=1e-9)
    others = made_up(observer.plant, 0.21)
    assert not np.allclose(response(others).gains(OMEGA), wanted, rtol=1e-3)


@pytest.mark.parametrize("name", OBSERVERS)
def test_bracket_holds_the_peak(name: str) -> None:
    observer = OBSERVERS[name]()
    found = exact_gain(observer)
    assert found.upper <= found.lower * (1 + 1e-6)
    assert response(observer).gains(np.array([found.frequency]))[0] == pytest.approx(found.lower, rel=1e-12)
    assert response(observer).gains(np.linspace(0.0, 200.0, 40_001)).max() <= found.upper


def test_a_sharp_peak_is_found() -> None:
    """A resonance of relative width 1e-5, far from any point of the first grid."""
    w = 3.21
    plant = DelayPlant([[0, 1], [-w * w, -2e-5 * w]], [0.7], [[0], [1]], [[1, 0]], [[0, 1]])  # type: ignore[arg-type]
    found = exact_gain(made_up(plant, 0.0))
    assert found.lower == pytest.approx(1.0 / (2e-5 * w * w), rel=1e-5)
    assert found.upper <= found.lower * (1 + 1e-6)


@pytest.mark.parametrize("worst", [0.0, peak.WORST])
def test_the_bound_of_a_cell_holds_inside_it(worst: float) -> None:
    """In the basis of the step and in that of the unit matrix; and it is tight for small cells."""
    observer, rng = made_up(two_late(), 0.02), np.random.default_rng(6)
    nominal = observer.plant.delays
    ranges = [(0.9 * delay, 1.1 * delay) for delay in nominal]
    made = mismatched_response(plant_terms(observer.plant), observer.terms, nominal, ranges)
    omega, half = rng.uniform(0.5, 20.0, 60), 10.0 ** rng.uniform(-5.0, -0.5, 60)
    delays = np.tile(made.loop.delays, (60, 1))
    spread = np.zeros(delays.shape)
    spread[:, :2] = 10.0 ** rng.uniform(-6.0, -2.0, (60, 2))
    with patch.object(peak, "WORST", worst):
        middle, above, _ = made.bounded(peak.Cells(omega, half, delays, spread))
    assert np.sum(np.isfinite(above)) > 30
    for _ in range(30):
        shift, move = rng.choice([-1.0, 1.0, 0.3], 60), rng.choice([-1.0, 1.0, -0.4], delays.shape)
        assert np.all(made.gains(omega + shift * half, delays + move * spread) <= above * (1 + 1e-12))
    small = (half < 1e-3) & (spread.max(axis=1) < 1e-4)
    assert np.any(small) and np.all(above[small] <= middle[small] * 1.01)


@pytest.mark.parametrize("least", [1e-2, 1e-4])
def test_a_bend_counts_where_the_slope_is_zero(least: float) -> None:
    """X = jw + least - 1 + e^-jw has no slope at w = 0, and all but vanishes beside it."""
    constant = np.array([[least - 1.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    loop = Terms(constant, (1.0,), (np.diag([1.0, 0.0, 0.0]),), (None,))
    one_state = Response(loop, (1, 1, 1), 0.0, ((1.0, 1.0),))
    half = np.sqrt(2.0 * least * 0.89)
    _, bound, _ = one_state.bounded(one_state.cells(np.array([-half, half])))
    by_hand = 1.0 / abs(1j * half + least - 1.0 + np.exp(-1j * half))
    assert one_state.gains(np.array([half])) == pytest.approx([by_hand])
    assert by_hand <= bound[0] < np.inf


def test_few_cells_give_a_wide_bracket() -> None:
    observer = OBSERVERS["averages"]()
    with patch.object(peak, "MOST", 300):
        wide = exact_gain(observer)
    narrow = exact_gain(observer)
    assert wide.lower <= narrow.upper and narrow.lower <= wide.upper
    assert wide.upper - wide.lower > narrow.upper - narrow.lower


@pytest.mark.parametrize("seed", range(12))
def test_roots_are_counted(seed: int) -> None:
    observer = made_up(averaged(), 1.5, seed, degree=2)
    values = np.linalg.eigvals(observer.error_model(30).A)
    unstable = int(np.sum(values.real > 0.0))
    assert right_roots(response(observer))[1] == unstable
    if unstable:
        with pytest.raises(InfeasibleError, match=f"{unstable} roots"):
            exact_gain(observer)


def test_worst_gain_over_a_range_holds_for_random_delays() -> None:
    ranges = ((0.27, 0.33), (0.48, 0.52))
    observer = made_up(two_late(ranges), 0.01)
    found = worst_gain(observer)
    assert found.lower <= found.upper <= found.lower * (1 + 1e-3)
    omega = np.linspace(found.frequency - 1.0, found.frequency + 1.0, 401)
    plant, gains = plant_terms(observer.plant), observer.terms
    rng = np.random.default_rng(3)
    for _ in range(20):
        delays = [float(rng.uniform(*ends)) for ends in ranges]
        values = mismatched_response(plant, gains, delays, [(d, d) for d in delays]).gains(omega)
        assert values.max() <= found.upper
    at = mismatched_response(plant, gains, found.delays, [(d, d) for d in found.delays])
    assert at.gains(np.array([found.frequency]))[0] == pytest.approx(found.lower, rel=1e-9)
    assert found.lower > exact_gain(observer).upper


def test_a_range_of_one_point_is_nominal() -> None:
    observer = made_up(averaged(), 0.2)
    assert worst_gain(observer, relative=1e-6).lower == pytest.approx(exact_gain(observer).lower, rel=2e-6)


def test_a_range_with_an_unstable_delay_is_not_certified() -> None:
    """x' = -1.2 x(t - tau): stable for tau below pi / 2.4 = 1.309 s and for none beyond."""
    plant = DelayPlant([[0.0]], [1.0], [[1.0, 0]], [[1.0]], [[1.0]], a=[[[-1.2]]], d21=[[0, 1.0]])  # type: ignore[arg-type]
    observer = made_up(plant, 0.0)
    with patch.object(peak, "MOST", 4000):
        assert worst_gain(observer, [(0.99, 1.29)], relative=0.5).upper < np.inf
        assert worst_gain(observer, [(0.99, 1.35)], relative=0.5).upper == np.inf


def test_what_cannot_be_asked() -> None:
    observer = made_up(two_late(), 0.01)
    with pytest.raises(InfeasibleError, match="the plant has 1 unstable roots"):
        worst_gain(made_up(delayed_output(), 0.0), [(0.99, 1.01)])
    for ranges in ([(0.2, 0.4)], [(0.4, 0.2), (0.5, 0.5)], [(-0.1, 0.3), (0.5, 0.5)]):
        with pytest.raises(InvalidInputError, match="ranges"):
            worst_gain(observer, ranges)
    with pytest.raises(InvalidInputError, match="relative"):
        exact_gain(observer, relative=0.0)


# The observer as it runs: its order, its stability, its signals over time, known inputs, and the same in C


RUNNING = {name: OBSERVERS[name] for name in ("averages", "two delays")}


@pytest.mark.parametrize("name", RUNNING)
def test_it_is_of_second_order(name: str) -> None:
    omega = [0.5, 2.0, 7.0]
    errors = [RUNNING[name]().running(dt).discretisation_error(omega) for dt in (0.04, 0.02, 0.01, 0.005)]
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert np.all(np.abs(ratios[-1] - 4.0) < 0.4)
    assert errors[-1][0] < 1e-5


@pytest.mark.parametrize("name", RUNNING)
def test_signals_over_time_are_those_of_the_frequency(name: str) -> None:
    made, dt, w = RUNNING[name](), 0.01, 1.7
    observer = made.running(dt)
    known = np.zeros(observer.inputs) if observer.inputs else None
    for k in range(3000):
        found = observer.step(known, [np.cos(w * k * dt)])
    turn = np.exp(1j * w * k * dt)
    sampled_value, exact = ((value[0, :, 0] * turn).real for value in observer._responses(np.array([w])))
    assert np.allclose(found, sampled_value, rtol=1e-6, atol=1e-9)
    assert 1e-9 < np.abs(found - exact).max() < 1e-3 * np.abs(exact).max()


def test_known_inputs_are_copied() -> None:
    """y of a simulated plant that only u moves: the observer expects just that, and estimates the plant's own x."""
    made, dt = RUNNING["averages"](), 0.005
    plant = plant_terms(made.plant)
    silent = replace(made.terms, constant=np.zeros((4, 1)), kernels=(None,))
    # Without gains the observer is the plant; its z^ row is made the measured one.
    n, p, q, r = plant.sizes
    swap = np.eye(n + p + q)[[0, 1, 3, 3]]
    simulated = InnovationsObserver(
        replace(plant, terms=plant.terms.applied(swap, np.eye(n + r)), known=plant.known.applied(swap, np.eye(1))),
        silent,
        dt=dt,
    )
    observer = made.running(dt)
    rng = np.random.default_rng(4)
    for k in range(1500):
        u = [math.sin(3.0 * k * dt) + 0.1 * rng.standard_normal()]
        x = simulated.step(u, [np.nan])
        found = observer.step(u, simulated.output)
        assert np.allclose(found, x, rtol=0.0, atol=1e-12)
    assert np.abs(x).max() > 0.1
    lost = observer.step([0.0], simulated.output)
    assert not np.allclose(lost, simulated.step(u, [np.nan]), atol=1e-9)


def test_a_start_is_taken_for_the_whole_past() -> None:
    plant = DelayPlant([[0.0]], [0.5], [[1, 0]], [[1]], [[1]], a=[[[-1.0]]], d21=[[0, 1]])  # type: ignore[arg-type]
    observer = made_up(plant, 0.0).running(0.001)
    observer.reset([2.0])
    for _ in range(401):
        found = observer.step(None, None)
    assert found[0] == pytest.approx(2.0 - 2.0 * 0.4, abs=1e-9)  # x' = -x(t - 0.5) = -2 up to 0.5 s
    assert observer.missed == 401


def test_steps_that_do_not_fit_are_refused() -> None:
    made = made_up(averaged(), 0.2)
    with pytest.raises(InvalidInputError, match="dt"):
        made.running(0.0)
    with pytest.raises(InvalidInputError, match="dt must be at least"):
        made.running(1e-7)
    with pytest.raises(InvalidInputError, match="not stable"):
        made_up(averaged(), 40.0).running(0.05)
    with pytest.raises(InvalidInputError, match="below pi / dt"):
        made.running(0.1).discretisation_error([1.0, 40.0])
    several, one = (made.running(0.1).discretisation_error(omega) for omega in ([0.5, 2.0], 2.0))
    assert one == pytest.approx(several[1:], rel=1e-12)
    with pytest.raises(InvalidInputError, match="at least 1"):
        made.running(0.1).discretisation_error(-2.0)
    observer = made.running(0.1)
    with pytest.raises(InvalidInputError, match="u must"):
        observer.step(None, [0.0])
    with pytest.raises(InvalidInputError, match="finite"):
        observer.step([0.0], [math.inf])
    assert observer.instant == 0
    # No more samples are kept than allowed.
    longest = max(made.plant.delays)
    with patch.object(module, "LONGEST", 10):
        made.running(longest / 10 * (1 + 1e-9))
        with pytest.raises(InvalidInputError, match="keeps the samples of its longest delay"):
            made.running(longest / 10 * (1 - 1e-9))


@pytest.mark.parametrize("name", RUNNING)
def test_simulated_errors_reach_the_gain_and_no_more(name: str) -> None:
    """A long sinusoid at the frequency of the peak, in the worst direction."""
    made, dt = RUNNING[name](), 0.02
    found = exact_gain(made)
    response = error_response(plant_terms(made.plant), made.terms)
    value = response.part(np.linalg.inv(response.matrix(np.array([1j * found.frequency]))))[0]
    worst = np.linalg.svd(value)[2][0].conj()
    times = dt * np.arange(6000)
    envelope = np.sin(np.pi * times / times[-1]) ** 2
    w = (np.exp(1j * found.frequency * times)[:, None] * worst).real * envelope[:, None]
    model = made.error_model(24)
    trajectory = simulate(model, times, w, made.plant.states)
    assert 0.98 * found.lower < trajectory.gain < found.upper * (1 + 1e-3)
    with pytest.raises(InvalidInputError, match="equidistant"):
        simulate(model, times**2, w, made.plant.states)
