"""The C forms of the estimators with time stamps do what Python does, and compile without a warning."""

import math
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.nonuniform.plant import PeriodRange
from replication.estimation.nonuniform.stamped.design import StampedFilter, StampedPlant, stamped_design
from replication.estimation.nonuniform.stamped.kalman import NoisyPlant
from replication.estimation.nonuniform.stamped.observer import StampedObserver
from replication.estimation.nonuniform.stamped.running import StampedKalman
from tests.estimation.compiled import EXACT, STEPS, Stamped, warnings_of

RANGE = PeriodRange(0.02, 0.4)
KINDS = ("filter", "kalman", "kalman without inputs")


A, C = [[0.4, 2.0, 0.0], [-1.0, 0.2, 1.0], [0.0, 0.0, -30.0]], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]
"""An unstable plant of two sensors."""
PLANT = StampedPlant(A, [[0, 0, 0], [1, 0, 0], [5, 0, 0]], C, [[0, 0.1, 0], [0, 0.02, 0.2]], np.eye(3))


@cache
def designed() -> StampedFilter:
    return stamped_design(PLANT, RANGE).filter


def observer_of(kind: str, factor: float = 1.0) -> Any:
    """factor: a fault in the gain."""
    known = np.array([[0.0], [1.0], [2.0]])
    if kind == "filter":
        faulty = StampedFilter(factor * designed().G, designed().edges)
        return StampedObserver(PLANT, faulty, RANGE, known, ("a", "b"))
    Q, R = np.diag([0.1, 1.0, 25.0]), factor * np.array([[0.04, 0.01], [0.01, 0.09]])
    return StampedKalman(NoisyPlant(A, C, Q, R, known if kind == "kalman" else None, P0=2 * np.eye(3)))


def predicted(observer: Any, t: float) -> Any:
    found = observer.predict(t)
    return getattr(found, "x", found)


@pytest.mark.parametrize("between", [1, 4])
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_equal_over_many_steps(kind: str, between: int, tmp_path: Path) -> None:
    """A sample at each instant, or only an input at most of them."""
    observer, rng, t = observer_of(kind), np.random.default_rng(9), -1.0
    compiled = Stamped(observer, tmp_path)
    observer.reset([1.0, -1.0, 0.5])
    compiled.reset([1.0, -1.0, 0.5])
    for k in range(STEPS):
        t += rng.uniform(RANGE.h_l, RANGE.h_u) / between
        lost = kind != "filter" and rng.random() < 0.3
        y = [float(rng.standard_normal()), None if lost else float(rng.standard_normal())]
        known = kind != "kalman without inputs" and (between > 1 or not k % 3)
        u = [float(rng.standard_normal())] if known else None
        if k % between and known:
            answer, found = compiled.step(None, t, u)
            wanted = observer.step({}, t=t, u=u)
        else:
            answer, found = compiled.step([math.nan if value is None else value for value in y], t, u)
            wanted = observer.step(y, t=t, u=u)
        assert answer == 0
        assert np.allclose(found, wanted, rtol=EXACT, atol=EXACT)
    answer, found = compiled.predict(t + 0.2)
    assert answer == 0
    assert np.allclose(found, predicted(observer, t + 0.2), rtol=EXACT, atol=EXACT)
    assert compiled.step(None, t + 0.1)[0] == 1
    assert compiled.step(None, t - 0.001, [1.0])[0] == 1


@pytest.mark.parametrize("kind", KINDS)
def test_another_gain_is_noticed(kind: str, tmp_path: Path) -> None:
    observer, other = observer_of(kind), observer_of(kind, 1.01)
    compiled = Stamped(observer, tmp_path)
    compiled.reset(np.zeros(3))
    for t in (0.0, 0.1):
        found = compiled.step([1.0, 2.0], t)[1]
        assert np.allclose(found, observer.step([1.0, 2.0], t=t), atol=EXACT)
        assert not np.allclose(found, other.step([1.0, 2.0], t=t), atol=EXACT)


@pytest.mark.parametrize("kind", KINDS)
def test_what_python_refuses_changes_nothing(kind: str, tmp_path: Path) -> None:
    compiled = Stamped(observer_of(kind), tmp_path)
    compiled.reset(np.ones(3))
    assert compiled.predict(0.0)[0] == 1
    assert compiled.step([1.0, 1.0], 0.0)[0] == 0
    kept = bytes(compiled.state)
    assert compiled.step([1.0, 1.0], 0.0)[0] == 1
    assert compiled.step([1.0, 1.0], math.nan)[0] == 1
    assert compiled.step([1.0, math.inf], 0.1)[0] == 1
    assert compiled.predict(-0.1)[0] == 1
    if kind == "filter":
        assert compiled.step([1.0, math.nan], 0.1)[0] == 1
    if kind != "kalman without inputs":
        assert compiled.step([1.0, 1.0], 0.1, [math.nan])[0] == 1
    assert bytes(compiled.state) == kept
    assert compiled.step([1.0, 1.0], 0.1)[0] == 0
    assert bytes(compiled.state) != kept


def test_a_bad_name_and_held_noise_have_messages() -> None:
    for kind in KINDS:
        with pytest.raises(InvalidInputError, match="C identifier"):
            observer_of(kind).to_c("int")
    held = NoisyPlant([[-1.0]], [[1.0]], [[1.0]], [1.0], S=[[0.5]])
    with pytest.raises(InvalidInputError, match="no C form"):
        StampedKalman(held).to_c()


def single_sensor() -> StampedKalman:
    """The smallest, of which compilers see most."""
    return StampedKalman(NoisyPlant([[0, 1], [0, -1]], [[1, 0]], Q=[[0, 0], [0, 1]], R=[0.01]))


@pytest.mark.parametrize("observer", [single_sensor, *(partial(observer_of, kind) for kind in KINDS)])
def test_compilers_warn_of_nothing(observer: Callable[[], Any], tmp_path: Path) -> None:
    assert warnings_of(observer().to_c("own"), tmp_path) == []


def test_a_warning_is_seen(tmp_path: Path) -> None:
    assert warnings_of("int own(void) { int never; return never; }", tmp_path)


def test_an_input_between_samples_moves_the_estimate_as_the_plant() -> None:
    observer, other = observer_of("filter"), observer_of("filter")
    for run in (observer, other):
        run.step([1.0, 0.5], t=0.0, u=[2.0])
    observer.step({}, t=0.1, u=[2.0])
    assert np.allclose(observer.predict(0.3), other.predict(0.3), rtol=EXACT, atol=EXACT)
    assert np.allclose(observer.step([0.0, 0.0], t=0.3), other.step([0.0, 0.0], t=0.3), rtol=EXACT, atol=EXACT)
    observer.step({}, t=0.4, u=[0.0])
    assert not np.allclose(observer.predict(0.5), other.predict(0.5), atol=1e-3)
    assert (observer.outside, other.outside) == (0, 0)
    for y, t, u in (({}, 0.45, None), ([0.0, 0.0], 0.35, None), ({}, 0.35, [1.0])):
        with pytest.raises(InvalidInputError):
            observer.step(y, t=t, u=u)


def test_the_gate_with_time_stamps(tmp_path: Path) -> None:
    plain = observer_of("kalman")
    gated = StampedKalman(plain.plant, gate=5.0)
    compiled, rng = Stamped(gated, tmp_path), np.random.default_rng(4)
    compiled.reset(np.zeros(3))
    for k in range(60):
        y = list(0.1 * rng.standard_normal(2))
        lost = [1e6, y[1]] if k % 7 == 3 else y
        estimate = gated.step(lost, t=0.1 * k)
        assert np.array_equal(estimate, plain.step([None, y[1]] if k % 7 == 3 else y, t=0.1 * k))
        assert np.allclose(compiled.step(lost, 0.1 * k)[1], estimate, rtol=1e-9, atol=1e-9)
    assert gated.gated == 9
    with pytest.raises(InvalidInputError, match="held noise"):
        StampedKalman(NoisyPlant([[-1.0]], [[1.0]], [[1.0]], [1.0], S=[[0.5]]), gate=3)


def test_a_late_sample_is_gated_as_if_it_had_come_in_time() -> None:
    samples = [([0.1, 0.0], 0.0), ([0.1, 9.0], 0.1), ([5.0, 0.1], 0.2), ([0.0, 0.1], 0.3)]
    plant = observer_of("kalman").plant
    order, late = (StampedKalman(plant, horizon=1.0, gate=3.0) for _ in range(2))
    for y, t in samples:
        order.step(y, t=t)
    for i in (0, 2, 3, 1):
        late.step(samples[i][0], t=samples[i][1])
    assert np.allclose(order.estimate, late.estimate, rtol=EXACT) and order.gated == late.gated > 0
