"""The C and MATLAB forms of all running observers do what Python does, and compilers warn of nothing."""

import ctypes
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation import multirate
from replication.estimation.delay import DelayObserver
from replication.estimation.multirate import MultiratePlant, losses
from replication.estimation.multirate.kalman import filter_gains, kalman_design
from replication.estimation.multirate.running import KalmanFilter
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.validation import Array
from tests.estimation.api.api_cases import STAMPED, STAMPS, result_of, running, stamped
from tests.estimation.api.matlab import Interpreted
from tests.estimation.compiled import EXACT, STEPS, Compiled, CompiledWithStamps, doubles, warnings_of
from tests.estimation.delay.plants import averaged, made_up, two_late
from tests.estimation.dualrate.test_loads import TANKS, designed
from tests.estimation.multirate.multirate_examples import CART, MOVING, correlated, problem

TURNING = replace(CART, A=np.array([[0.98, 0.1], [-0.05, 0.97]]))
ALONE = MultiratePlant(A=[[0.9]], B_d=[[1]], C=[[1]], D=[[0.5]])


class Flat:
    """A filter with one vector for all that its C form writes of an instant, and of the one `lag` before."""

    def __init__(self, run: KalmanFilter) -> None:
        self.run, self.to_c, self.inputs, self.measurements = run, run.to_c, run.inputs, run.measurements
        self.states, self.estimate = run.states, np.zeros(run.states * (run.lag + 2))

    def reset(self, start: Array) -> None:
        self.run.reset(start)

    def step(self, u: Array, y: Array) -> Array:
        step = self.run.step(u, y)
        return np.concatenate([step.prediction, step.filtered, step.smoothed])

    def __getattr__(self, name: str) -> Any:
        return getattr(self.run, name)


def kalman(plant: Any, **settings: Any) -> Flat:
    found: Any = multirate.design(plant, periods=(1, 4), goal="h2")
    return Flat(found.filter(**settings))


def smoother() -> Flat:
    given = correlated(problem(CART, (1, 3)), 6)
    return Flat(KalmanFilter(given, filter_gains(given, kalman_design(given).X, 3)))


@cache
def lossy(kind: str) -> losses.LossResult:
    plant, periods, model = LOSSES[kind]
    return losses.design(multirate.design(plant, periods=periods), model)


def late(goal: str) -> Any:
    return multirate.design(MOVING, periods=(1, 3), latency=(0.4, 1.75), goal=goal).observer()


LOSSES: dict[str, tuple[MultiratePlant, tuple[int, ...], losses.InARow | losses.Independent | losses.Markov]] = {
    "each sensor": (TURNING, (2, 1), losses.InARow((1, 2))),
    "packets": (TURNING, (2, 3), losses.InARow(1, together=True)),
    "one sensor, no inputs": (ALONE, (2,), losses.InARow(3)),
    "random": (TURNING, (1, 2), losses.Markov(after_arrival=0.1, after_loss=0.5)),
}
PERIODIC = ("dualrate", "multirate", "nonuniform")
SAMPLED: dict[str, Callable[[], DelayObserver]] = {
    "averages over a delay": lambda: made_up(averaged(), 0.2),
    "two delays": lambda: made_up(two_late(), 0.01),
}
OBSERVERS: dict[str, Callable[[], Any]] = {
    **{method: partial(running, method) for method in PERIODIC},
    "set-points": lambda: designed(TANKS, "slow, held", tracked=[0, 1]).running(),
    "late": lambda: late("hinf"),
    "late, least mean error": lambda: late("h2"),
    "filter": lambda: kalman(CART),
    "filter in continuous time": lambda: kalman(MOVING),
    "filter with a gate": lambda: kalman(CART, lag=1, gate=2.0),
    "smoother": smoother,
    **{kind: partial(lambda kind: lossy(kind).observer(), kind) for kind in LOSSES},
    **{kind: partial(lambda kind: SAMPLED[kind]().running(0.03), kind) for kind in SAMPLED},
}


FORMS: dict[str, Any] = {"C": Compiled, "MATLAB": Interpreted}
IN_BOTH = (*PERIODIC, "filter")
PAIRS = [(form, kind) for form in FORMS for kind in (OBSERVERS if form == "C" else IN_BOTH)]


@pytest.mark.filterwarnings("ignore::replication.estimation.api.running.UnscheduledSampleWarning")
@pytest.mark.parametrize(
    ("form", "kind"), [pair if pair[1] in PERIODIC else pytest.param(*pair, marks=pytest.mark.slow) for pair in PAIRS]
)
def test_it_is_equal_over_many_steps(form: str, kind: str, tmp_path: Path) -> None:
    observer, rng, steps = OBSERVERS[kind](), np.random.default_rng(11), STEPS if form == "C" else STEPS // 10
    other, start = FORMS[form](observer, tmp_path), rng.standard_normal(observer.states)
    observer.reset(start)
    other.reset(start)
    for k in range(steps):
        u, y = rng.standard_normal(observer.inputs), rng.standard_normal(observer.measurements)
        # Some do not come: single ones where the observer completes them, else whole samples.
        gone = rng.random(1 if kind == "nonuniform" else len(y)) < (0.6 if (k // 100) % 2 else 0.2)
        y = np.where(gone, math.nan, y)
        answer, found = other.step(u, y)
        wanted, n = observer.step(u if observer.inputs else None, y), observer.states
        told = np.concatenate([found[: 2 * n], found[-n:]]) if isinstance(observer, Flat) else found
        there = ~np.isnan(wanted)  # of before the first instant nothing is known
        assert answer == 0 and np.all(there[:n])
        # Of several thousand added numbers the largest is as exact as its own size.
        size = 1 + np.abs(wanted).max() if kind == "set-points" else 1.0
        assert np.allclose(told[there], wanted[there], rtol=EXACT, atol=EXACT * size)
        if kind in SAMPLED:
            output = doubles([math.nan] * len(observer.output))
            other.library.own_output(other.state, output)
            assert np.allclose(output, observer.output, rtol=EXACT, atol=EXACT)
            assert np.allclose(observer.innovation[np.isnan(y)], 0.0, atol=EXACT)
    assert observer.missed > steps / 100
    if form == "MATLAB":
        assert other.function.kept["lost_so_far"] == observer.missed
    if "gate" in kind:
        assert STEPS / 20 < observer.gated < STEPS
    if kind in LOSSES:
        orders, order = ctypes.cast(other.state, ctypes.POINTER(ctypes.c_ulong)), len(observer._state)
        assert [orders[order], orders[order + 1]] == [observer.missed, observer.unforeseen]
        assert (observer.unforeseen > 0) is (kind != "random")


def louder(kind: str) -> Any:
    """The observer with gains that are larger by a millionth, or by a hundredth where they act over a short time."""
    if kind in LOSSES:
        result = lossy(kind)
        return replace(result, gains={**result.gains, "L": result.gains["L"] * (1 + 1e-6)}).observer()
    if kind in SAMPLED:
        made = SAMPLED[kind]()
        return replace(made, l0=1.01 * made.l0).running(0.03)
    other = OBSERVERS[kind]()
    first, *more = other.phases
    other.phases = (replace(first, injection=first.injection * (1 + 1e-6)), *more)
    return other


@pytest.mark.parametrize(
    ("form", "kind"),
    [*((form, kind) for form in FORMS for kind in PERIODIC), *(("C", kind) for kind in ("each sensor", *SAMPLED))],
)
def test_what_python_refuses_changes_nothing_and_another_gain_is_noticed(form: str, kind: str, tmp_path: Path) -> None:
    observer, other = OBSERVERS[kind](), louder(kind)
    same, start = FORMS[form](observer, tmp_path), np.ones(observer.states)
    for each in (same, observer, other):
        each.reset(start)
    known, y = np.ones(observer.inputs), np.arange(1.0, 1.0 + observer.measurements)
    kept, bad = same.memory, [(known, [math.inf, *y[1:]])]
    bad += [([math.nan, *known[1:]], y)] if observer.inputs and form == "C" else []
    bad += [(known, [*y, 1.0]), ([*known, 1.0], y)] if form == "MATLAB" else []
    for given in bad:
        assert same.step(*given)[0] == 1
        assert same.memory == kept
    inputs = known if observer.inputs else None
    for _ in range(2):  # some give the estimate of the instant itself, before the gain acts
        answer, found = same.step(known, y)
        assert answer == 0 and same.memory != kept
        apart = other.step(inputs, y)
        assert np.allclose(found, observer.step(inputs, y), rtol=EXACT, atol=EXACT)
    assert not np.allclose(found, apart, rtol=1e-9, atol=1e-9)


def test_bad_names_and_observers_without_a_form_have_messages() -> None:
    named = [OBSERVERS[kind]() for kind in ("multirate", "one sensor, no inputs", "two delays")]
    for observer in (*named, *map(stamped, STAMPED)):
        with pytest.raises(InvalidInputError, match="C identifier"):
            observer.to_c("double")
    for bad in ("end", "9a", "a b", 3):
        with pytest.raises(InvalidInputError, match="MATLAB function"):
            result_of("multirate").observer().to_matlab(bad)
    for form in ("to_c", "to_matlab"):
        with pytest.raises(InvalidInputError, match="no periodic recursion"):
            getattr(running("delay"), form)()
    with pytest.raises(InvalidInputError, match="no C form"):
        StampedKalman(NoisyPlant([[-1.0]], [[1.0]], [[1.0]], [1.0], S=[[0.5]])).to_c()
    with pytest.raises(InvalidInputError, match="no form in MATLAB"):
        kalman(CART, gate=2.0).run.to_matlab()


def test_after_more_losses_than_were_foreseen_the_gain_is_that_after_losses() -> None:
    """Not that after an arrival: the estimate is as uncertain as after the most losses that the gains are made for."""
    result = losses.design(multirate.design(ALONE, periods=(1,)), losses.InARow(1))
    gains = dict(zip(((e.source, e.arrived) for e in result.automaton.edges), result.gains["L"], strict=True))
    observer = result.observer()
    observer.reset([0.0])
    for _ in range(3):
        observer.step(None, [None])
    assert observer.unforeseen == 2
    assert observer.step(None, [1.0]) == pytest.approx(gains[1, (True,)][0])
    assert gains[1, (True,)] != pytest.approx(gains[0, (True,)], rel=1e-3)


@pytest.mark.parametrize("between", [1, 4])
@pytest.mark.parametrize("kind", STAMPED)
def test_with_time_stamps_it_is_equal_over_many_steps(kind: str, between: int, tmp_path: Path) -> None:
    """A sample at each instant, or only an input at most of them."""
    observer, rng, t = stamped(kind), np.random.default_rng(9), -1.0
    compiled = CompiledWithStamps(observer, tmp_path)
    observer.reset([1.0, -1.0, 0.5])
    compiled.reset([1.0, -1.0, 0.5])
    for k in range(STEPS):
        t += rng.uniform(*STAMPS) / between
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
    assert np.allclose(
        found, getattr(observer.predict(t + 0.2), "x", observer.predict(t + 0.2)), rtol=EXACT, atol=EXACT
    )
    assert compiled.step(None, t + 0.1)[0] == 1
    assert compiled.step(None, t - 0.001, [1.0])[0] == 1


@pytest.mark.parametrize("kind", STAMPED)
def test_with_time_stamps_refusals_change_nothing_and_another_gain_is_noticed(kind: str, tmp_path: Path) -> None:
    observer, other = stamped(kind), stamped(kind, 1.01)
    compiled = CompiledWithStamps(observer, tmp_path)
    for each in (compiled, observer, other):
        each.reset(np.ones(3))
    assert compiled.predict(0.0)[0] == 1
    for run in (observer, other):
        run.step([1.0, 1.0], t=0.0)
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
    answer, found = compiled.step([1.0, 2.0], 0.1)
    assert answer == 0 and bytes(compiled.state) != kept
    assert np.allclose(found, observer.step([1.0, 2.0], t=0.1), atol=EXACT)
    assert not np.allclose(found, other.step([1.0, 2.0], t=0.1), atol=EXACT)


def test_the_gate_with_time_stamps(tmp_path: Path) -> None:
    plain = stamped("kalman")
    gated = StampedKalman(plain.plant, gate=5.0)
    compiled, rng = CompiledWithStamps(gated, tmp_path), np.random.default_rng(4)
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


def single_sensor() -> StampedKalman:
    """The smallest, of which compilers see most."""
    return StampedKalman(NoisyPlant([[0, 1], [0, -1]], [[1, 0]], Q=[[0, 0], [0, 1]], R=[0.01]))


@pytest.mark.parametrize("observer", [single_sensor, *(partial(stamped, kind) for kind in STAMPED)])
def test_compilers_warn_of_nothing(observer: Callable[[], Any], tmp_path: Path) -> None:
    assert warnings_of(observer().to_c("own"), tmp_path) == []


def test_a_warning_is_seen(tmp_path: Path) -> None:
    assert warnings_of("int own(void) { int never; return never; }", tmp_path)
