"""Running observers: equal to simulations that share no code with them, also from files and with signals by name."""

import io
import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import scipy.io

from replication.errors import InvalidInputError, SolverError
from replication.estimation import delay, dualrate, load, nonuniform
from replication.estimation.api.running import MOST_STATES, PeriodicObserver, Phase, require_small, statespace, vector
from replication.estimation.delay import result as delay_result
from replication.estimation.delay.sos.observer import error_system, spectral_abscissa
from replication.estimation.dualrate.observers import over_time
from replication.estimation.linear.norms import continuous_norm
from replication.estimation.nonuniform.worst_case import simulate_error
from tests.estimation.api.api_cases import (
    CASES,
    DT,
    PIPE,
    RUNNING,
    TANKS,
    TIMES,
    WAVES,
    result_of,
    running,
    sizes,
    stamped,
    steps,
)

EXACT = 1e-10
SAMPLED = 1e-3
"""Largest error of a delay observer fed by samples 10 ms apart, relative; it falls with the square of the distance."""
KINK = 5e-3
"""A history that starts constant has a kink, which polynomials over it do not follow exactly."""


def test_nonuniform_agrees_with_the_simulation() -> None:
    result, rng = result_of("nonuniform"), np.random.default_rng(2)
    periods, w = rng.uniform(0.05, 0.2, 60), rng.standard_normal((60, 2))
    expected = simulate_error(result.plant, result.filter, periods, w)
    observer, x = result.observer(), np.zeros(2)
    for k, h in enumerate(periods):
        assert np.allclose(result.plant.L @ x - observer.estimate, expected[k], atol=EXACT)
        observer.step(None, result.plant.C @ x + result.plant.D @ w[k])
        Phi, Gamma = result.plant.discretise(float(h))
        x = Phi @ x + Gamma @ w[k]


@pytest.mark.parametrize(
    "name", sorted(set(dualrate.OBSERVERS) - {"state_feedback", "single_rate", "single_rate_correction"})
)
def test_dualrate_agrees_with_the_closed_loop(name: str) -> None:
    given = result_of("dualrate")
    loop = given.loop
    gains = {"feedback": given.gains["K"], "injection": given.gains["L"]}
    result = dualrate.analyse(loop.plant, **gains, period=0.02, ratio=10, observer=name)
    errors = dualrate.simulate(result, [1.0, 0.5], estimate=[0.2, 0.0], slow_periods=6).signals["estimation error"]
    observer, x = result.observer(), np.array([1.0, 0.5])
    observer.reset([0.2, 0.0])
    step = over_time(loop.plant, 0.02, None)
    for k in range(60):
        assert np.allclose(x - observer.estimate, errors[10 * k], atol=EXACT)
        u = result.gains["K"] @ observer.estimate
        observer.step(u, loop.plant.C @ x if k % 10 == 0 or name == "fast_sensor" else None)
        x = step.state @ x + step.input @ u
    assert observer.missed == 0


def test_delay_agrees_with_the_simulation() -> None:
    result = result_of("delay")
    expected = delay.simulate(result, TIMES, WAVES).signals["error of x"]
    states = plant_response()
    observer = result.observer(DT)
    found = states - np.array([observer.step(None, x[:1]) for x in states])
    assert np.abs(found - expected).max() <= SAMPLED * np.abs(expected).max()


def plant_response() -> np.ndarray[Any, Any]:
    """x at TIMES by the classical Runge-Kutta method; the delay is a whole number of steps."""
    A, late, h, lag = TANKS.A, np.array(PIPE[0]), DT, 40
    x = np.zeros((len(TIMES), 2))

    def past(k: float) -> Any:
        low = int(np.floor(k))
        return np.zeros(2) if k <= 0 else x[low] + (k - low) * (x[low + 1] - x[low]) if k > low else x[low]

    def rate(k: float, state: Any) -> Any:
        w = np.array([np.interp(k * h, TIMES, column) for column in WAVES.T])
        return A @ state + late @ past(k - lag) + w

    for k in range(len(TIMES) - 1):
        k1 = rate(k, x[k])
        k2 = rate(k + 0.5, x[k] + h / 2 * k1)
        k3 = rate(k + 0.5, x[k] + h / 2 * k2)
        x[k + 1] = x[k] + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(k + 1, x[k] + h * k3))
    return x


@pytest.mark.parametrize("name", RUNNING)
def test_reset_starts_again(name: str) -> None:
    observer = RUNNING[name]()
    first = steps(observer, 6)
    observer.step(np.ones(sizes(observer)[0]), None)
    observer.reset()
    assert (observer.instant, observer.missed) == (0, 0)
    assert np.array_equal(steps(observer, 6), first, equal_nan=True)


@pytest.mark.parametrize("method", ["multirate", "dualrate", "delay"])
def test_a_missing_measurement_is_one_that_is_expected(method: str) -> None:
    one, other = running(method), running(method)
    inputs, measurements = sizes(one)
    plant_output = {
        "multirate": lambda: result_of("multirate").problem.plant.C,
        "dualrate": lambda: result_of("dualrate").loop.design.model.C,
        "delay": lambda: result_of("delay").plant.c2,
    }[method]()
    one.reset([0.4, -0.2]), other.reset([0.4, -0.2])
    expected = plant_output @ one.estimate
    assert np.allclose(one.step(np.ones(inputs), expected), other.step(np.ones(inputs), [None] * measurements))
    assert one.missed == 0 and other.missed == (1 if method == "multirate" else measurements)


def test_a_missing_measurement_does_not_touch_the_model_of_a_delayed_plant() -> None:
    """Without measurements the observer follows the plant that is left to itself."""
    observer = running("delay")
    observer.reset([1.0, -1.0])
    for _ in range(200):
        observer.step(None, None)
    assert observer.missed == 200
    free = delay.design(TANKS, delayed=PIPE, delays=[0.4], measured=["float"], level=50.0, order=12)
    assert free.value == 50.0
    other = free.observer(DT)
    other.reset([1.0, -1.0])
    for _ in range(200):
        other.step(None, [np.nan])
    # Whatever the gains are, they have nothing to correct.
    assert np.allclose(observer.estimate, other.estimate, rtol=KINK)


NO_MEASUREMENTS: tuple[Any, ...] = (
    [np.inf], ["1"], [1.0, 2.0, 3.0], [1j], [np.complex64(1)], [[1.0, 2.0], [3.0, 4.0]], [object()],
)  # fmt: skip


@pytest.mark.parametrize("name", RUNNING)
def test_measurements_that_are_none_are_refused_and_change_nothing(name: str) -> None:
    observer = RUNNING[name]()
    known = np.ones(sizes(observer)[0])
    observer.step(known, None)
    before, instant = observer.estimate.copy(), observer.instant
    for bad in NO_MEASUREMENTS:
        with pytest.raises(InvalidInputError, match="y must"):
            observer.step(known, bad)
        assert np.array_equal(observer.estimate, before) and observer.instant == instant


TWO_SENSORS = nonuniform.SampledPlant(-np.diag([1.0, 2.0]), np.eye(2), np.eye(2), np.eye(2), [[1, 1]])
REFUSED: list[tuple[str, Callable[[], Any]]] = [
    *(("u must", lambda bad=bad: running("multirate").step(bad, None)) for bad in (None, [np.nan], [1.0, 2.0], "1")),
    ("has no names", lambda: PeriodicObserver(running("multirate").phases, ()).step({"encoder": 1.0})),
    ("u must have 0 entries", lambda: running("nonuniform").step([1.0], 1.0)),
    ("complete or None", lambda: nonuniform.design(TWO_SENSORS, periods=(0.1, 0.2), leaves=1, horizon=20).observer()
     .step(None, [1.0, None])),
    *(("estimate must", lambda bad=bad: running("dualrate").reset(bad)) for bad in ([1.0], [np.nan, 1.0], "ab")),
    *(("dt must", lambda bad=bad: result_of("delay").observer(bad)) for bad in (0, -1.0, np.nan, "x")),
]  # fmt: skip


@pytest.mark.parametrize(("words", "work"), REFUSED)
def test_what_does_not_fit_is_named(words: str, work: Callable[[], Any]) -> None:
    with pytest.raises(InvalidInputError, match=words):
        work()


def test_gains_that_miss_their_own_level_are_an_error() -> None:
    result = result_of("delay")
    wrong = replace(
        continuous_norm(*error_system(result.plant, result.gains_of.operators, 4)), lower=1e3 * result.value
    )
    with (
        patch.object(delay_result, "continuous_norm", return_value=wrong),
        pytest.raises(SolverError, match="raise `order`"),
    ):
        CASES["delay"].design()


def test_the_parts_of_a_periodic_observer_take_their_turns() -> None:
    """Two phases that read different states; the second sensor is due at the second instant only."""
    due = np.array([[True, False], [True, True]])
    phases = [Phase(np.eye(2), np.zeros((2, 0)), np.eye(2), np.eye(2)[[k]], due[k]) for k in range(2)]
    observer = PeriodicObserver(phases, [np.eye(2)] * 2)
    observer.reset([3.0])
    start = observer.estimate
    observer.step(None, [1.0, math.nan])
    assert observer.missed == 0 and start.shape == (1,)
    assert observer.estimate == pytest.approx(phases[1].readout @ observer._state)
    assert observer._completed(np.array([5.0, 6.0]), np.array([7.0, 8.0]), due[0]).tolist() == [5.0, 8.0]
    # What is not due has no effect in the lifted form either.
    system = statespace(phases, None)
    assert np.all(system.B[:, 1] == 0) and np.any(system.B[:, 3] != 0)
    with pytest.raises(InvalidInputError, match="must be finite"):
        vector("y", [1.0, math.inf], 2)
    np.testing.assert_array_equal(vector("y", np.ma.array([1.0, 2.0], mask=[True, False]), 2), [math.nan, 2.0])


def test_one_name_for_an_input_and_a_measurement_needs_two_dicts() -> None:
    observer = result_of("multirate").observer()
    assert observer.signals is not None
    observer.signals = replace(observer.signals, inputs=("encoder",))
    with pytest.raises(InvalidInputError, match="'encoder' is an input and a measurement; give two dicts"):
        observer.step({"encoder": 1.0, "camera": 2.0})


def test_a_stable_error_decays_at_a_positive_rate() -> None:
    result = result_of("delay")
    abscissa = spectral_abscissa(error_system(result.plant, result.gains_of.operators, result.order))
    assert result.fact("error decays at").value == pytest.approx(-abscissa) and abscissa < 0


def test_a_linear_system_has_at_most_so_many_states() -> None:
    require_small(MOST_STATES)
    with pytest.raises(InvalidInputError, match=str(MOST_STATES)):
        require_small(MOST_STATES + 1)


# In files, and with signals by name


COUNT, STORED = 200, 1e-15


def written(name: str, folder: Path) -> Path:
    path = folder / "observer.json"
    path.write_text(RUNNING[name]().to_json(), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", RUNNING)
def test_a_loaded_observer_takes_the_same_steps(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    loaded, own = load(path), RUNNING[name]()
    assert type(loaded) is type(own) and loaded.instant == 0
    assert loaded.signals == own.signals
    assert np.allclose(steps(loaded, COUNT), steps(own, COUNT), rtol=STORED, atol=STORED, equal_nan=True)
    assert loaded.missed == own.missed > 0
    # A file that is written again is the same, also by an observer that has run.
    assert loaded.to_json() == path.read_text(encoding="utf-8")


def test_another_number_in_the_file_gives_other_steps(tmp_path: Path) -> None:
    path = written("multirate", tmp_path)
    held = json.loads(path.read_text(encoding="utf-8"))
    held["made_with"]["phases"][0]["fields"]["injection"]["array"][0][0] *= 1 + 1e-9
    path.write_text(json.dumps(held), encoding="utf-8")
    assert not np.allclose(steps(load(path), COUNT), steps(RUNNING["multirate"](), COUNT), rtol=STORED, atol=STORED)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "gains"}, "no file of a running observer"),
        ({"version": 2}, "version 2; known is version 1"),
        ({"version": None}, "version None"),
        ({"observer": "api.running:vector"}, "no class of this library"),
        ({"observer": "api.running:Mapping"}, "not known"),
        ({"observer": "api.running:np"}, "no class of this library"),
        ({"observer": "api.export:Phase"}, "no running observer"),
        ({"observer": "..files:write_directory"}, "not known"),
        ({"made_with": {}}, "not whole"),
        ({"made_with": {"phases": 3, "expected": 4}}, "not whole"),
        ({"signals": {"states": []}}, "not whole"),
    ],
)
def test_other_files_are_refused(change: dict[str, Any], words: str, tmp_path: Path) -> None:
    path = written("multirate", tmp_path)
    held = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({**held, **change}), encoding="utf-8")
    with pytest.raises(InvalidInputError, match=words):
        load(path)
    path.write_text("{", encoding="utf-8")
    for unread in (path, tmp_path / "none.json"):
        with pytest.raises(InvalidInputError, match="cannot be read as JSON"):
            load(unread)


def test_the_matlab_file_has_the_matrices() -> None:
    observer = RUNNING["multirate"]()
    held = scipy.io.loadmat(io.BytesIO(observer.to_mat()))
    for k, phase in enumerate(observer.phases, start=1):
        assert np.array_equal(held[f"transition_{k}"], phase.transition)
        assert np.array_equal(held[f"injection_{k}"], phase.injection)
    assert "A" in scipy.io.loadmat(io.BytesIO(RUNNING["nonuniform"]().to_mat()))


@pytest.mark.parametrize("name", RUNNING)
def test_signals_by_name_do_the_same(name: str) -> None:
    by_name, in_order = RUNNING[name](), RUNNING[name]()
    inputs, measurements = sizes(in_order)
    u, y = np.arange(1.0, 1.0 + inputs), np.arange(2.0, 2.0 + measurements)
    known = dict(zip(by_name.signals.inputs, u, strict=True))
    values = dict(zip(by_name.signals.measurements, y, strict=True))
    for one, other in [
        (by_name.step({**values, **known}), in_order.step(u, y)),
        (by_name.step(known), in_order.step(u, None)),
        (by_name.step(u, values), in_order.step(u, y)),
    ]:
        parts = (one, other) if isinstance(one, tuple) else ((one,), (other,))
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(*parts, strict=True))
    assert by_name.missed == in_order.missed


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (({"camara": 1.0, "force": 0.0},), "no signal 'camara'; the signals are force, encoder, camera"),
        (({"encoder": 1.0},), "input 'force' has no value"),
        (({"encoder": 1.0}, None), "no input 'encoder'; the inputs are force"),
        ((0.0, {"force": 1.0}), "no measurement 'force'"),
        ((0.0,), "step takes u and y, or one dict"),
    ],
)
def test_names_of_signals_that_do_not_fit_are_refused(given: tuple[Any, ...], words: str) -> None:
    for observer in (RUNNING["multirate"](), result_of("kalman").filter()):
        with pytest.raises(InvalidInputError, match=words):
            observer.step(*given)
        assert observer.instant == 0


@pytest.mark.parametrize("kind", ["filter", "kalman"])
def test_a_filter_with_time_stamps(kind: str, tmp_path: Path) -> None:
    observer, rng = stamped(kind), np.random.default_rng(2)
    (tmp_path / "observer.json").write_text(observer.to_json(), encoding="utf-8")
    loaded = load(tmp_path / "observer.json")
    for t in np.cumsum(rng.uniform(0.02, 0.4, 40)):
        y = rng.standard_normal(2)
        one, other = (run.step(y, t=t, u=[0.5]) for run in (observer, loaded))
        assert np.array_equal(one, other)
