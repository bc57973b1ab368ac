"""The observer as it runs: its order, its stability, its signals over time, known inputs, and the same in C."""

from __future__ import annotations

import ctypes
import math
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.delay.exact.loop import error_response, plant_terms
from replication.estimation.delay.general import sampled as module
from replication.estimation.delay.general.observer import exact_gain
from replication.estimation.delay.general.sampled import (
    InnovationsObserver,
    exact_response,
    sampled,
)
from replication.estimation.delay.plant import DelayPlant
from tests.estimation.compiled import EXACT, STEPS, Compiled
from tests.estimation.delay.plants import averaged, made_up, two_late

OBSERVERS = {"averages": lambda: made_up(averaged(), 0.2), "two delays": lambda: made_up(two_late(), 0.01)}


@pytest.mark.parametrize("name", OBSERVERS)
def test_it_is_of_second_order(name: str) -> None:
    omega = [0.5, 2.0, 7.0]
    errors = [OBSERVERS[name]().running(dt).discretisation_error(omega) for dt in (0.04, 0.02, 0.01, 0.005)]
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert np.all(np.abs(ratios[-1] - 4.0) < 0.4)
    assert errors[-1][0] < 1e-5


@pytest.mark.parametrize("name", OBSERVERS)
def test_signals_over_time_are_those_of_the_frequency(name: str) -> None:
    made, dt, w = OBSERVERS[name](), 0.01, 1.7
    observer = made.running(dt)
    known = np.zeros(observer.inputs) if observer.inputs else None
    for k in range(3000):
        found = observer.step(known, [np.cos(w * k * dt)])
    turn = np.exp(1j * w * k * dt)
    sampled_value = (observer.recursion.response(np.array([w]))[0, :, 0] * turn).real
    exact = (exact_response(plant_terms(made.plant), made.terms, np.array([w]))[0, :, 0] * turn).real
    assert np.allclose(found, sampled_value, rtol=1e-6, atol=1e-9)
    assert 1e-9 < np.abs(found - exact).max() < 1e-3 * np.abs(exact).max()


def test_known_inputs_are_copied() -> None:
    """y of a simulated plant that only u moves: the observer expects just that, and estimates the plant's own x."""
    made, dt = OBSERVERS["averages"](), 0.005
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


def test_roots_of_the_recursion_are_counted() -> None:
    """The eigenvalues of the recursion's companion matrix, for stable and unstable gains."""
    counts = set()
    for seed in range(8):
        made = made_up(averaged(), 1.5, seed, degree=2)
        recursion = sampled(plant_terms(made.plant), made.terms, 0.1)
        n, _, q, _ = recursion.sizes
        states, _, measured = recursion.parts
        taps, half = recursion.taps[:, :, : n + q], recursion.dt / 2.0
        blocks = np.zeros((len(taps) + 1, n + q, n + q))
        blocks[:-1, :n] -= half * taps[:, states]
        blocks[1:, :n] -= half * taps[:, states]
        blocks[:-1, n:] = taps[:, measured]
        blocks[0] += np.eye(n + q)
        blocks[1, :n] -= np.eye(n, n + q)
        first = np.linalg.solve(blocks[0], np.concatenate(list(blocks[1:]), axis=1))
        size = first.shape[1]
        companion = np.vstack([-first, np.eye(size - n - q, size)])
        wanted = int(np.sum(np.abs(np.linalg.eigvals(companion)) > 1.0))
        assert recursion.outside() == wanted
        counts.add(wanted)
    assert len(counts) > 1


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


def test_no_more_samples_are_kept_than_allowed() -> None:
    made = made_up(averaged(), 0.2)
    longest = max(plant_terms(made.plant).terms.delays)
    with patch.object(module, "LONGEST", 10):
        made.running(longest / 10 * (1 + 1e-9))
        with pytest.raises(InvalidInputError, match="keeps the samples of its longest delay"):
            made.running(longest / 10 * (1 - 1e-9))


@pytest.mark.parametrize("name", OBSERVERS)
def test_simulated_errors_reach_the_gain_and_no_more(name: str) -> None:
    """A long sinusoid at the frequency of the peak, in the worst direction."""
    made, dt = OBSERVERS[name](), 0.02
    found = exact_gain(made)
    response = error_response(plant_terms(made.plant), made.terms)
    value = response.part(np.linalg.inv(response.matrix(np.array([1j * found.frequency]))))[0]
    worst = np.linalg.svd(value)[2][0].conj()
    times = dt * np.arange(6000)
    envelope = np.sin(np.pi * times / times[-1]) ** 2
    w = (np.exp(1j * found.frequency * times)[:, None] * worst).real * envelope[:, None]
    trajectory = made.trajectory(times, w)
    assert 0.98 * found.lower < trajectory.gain < found.upper * (1 + 1e-3)
    with pytest.raises(InvalidInputError, match="equidistant"):
        made.trajectory(times**2, w)
    with pytest.raises(InvalidInputError, match="vanish"):
        made.trajectory(times, 0.0 * w)


def output_of(compiled: Compiled, size: int) -> np.ndarray[Any, Any]:
    """The estimate of z in C."""
    output = (ctypes.c_double * size)(*[math.nan] * size)
    compiled.library.own_output(compiled.state, output)
    return np.array(output)


@pytest.mark.parametrize("name", OBSERVERS)
def test_c_is_equal_over_many_steps(name: str, tmp_path: Path) -> None:
    observer, rng = OBSERVERS[name]().running(0.03), np.random.default_rng(9)
    compiled, start = Compiled(observer, tmp_path), rng.standard_normal(observer.states)
    observer.reset(start)
    compiled.reset(start)
    for _ in range(STEPS):
        u, y = rng.standard_normal(observer.inputs), rng.standard_normal(observer.measurements)
        y = np.where(rng.random(len(y)) < 0.2, np.nan, y)
        answer, estimate = compiled.step(u, y)
        wanted = observer.step(u if observer.inputs else None, y)
        assert answer == 0
        assert np.allclose(estimate, wanted, rtol=EXACT, atol=EXACT)
        assert np.allclose(output_of(compiled, len(observer.output)), observer.output, rtol=EXACT, atol=EXACT)
    assert observer.missed > STEPS / 10


def test_c_notices_other_gains_and_refuses_what_python_refuses(tmp_path: Path) -> None:
    observer, other = made_up(averaged(), 0.2).running(0.03), made_up(averaged(), 0.201).running(0.03)
    compiled = Compiled(observer, tmp_path)
    compiled.reset(np.ones(2))
    kept = bytes(compiled.state)
    assert compiled.step([0.5], [math.inf])[0] == 1
    assert compiled.step([math.nan], [1.0])[0] == 1
    assert bytes(compiled.state) == kept
    observer.reset(np.ones(2))
    other.reset(np.ones(2))
    for _ in range(3):
        found = compiled.step([0.5], [1.0])[1]
        assert np.allclose(found, observer.step(0.5, 1.0), atol=EXACT)
        apart = other.step(0.5, 1.0)
    assert not np.allclose(found, apart, atol=1e-9)
    with pytest.raises(InvalidInputError, match="C identifier"):
        observer.to_c("int")
