"""The C and MATLAB forms of observers, filters, and observers that count losses do what Python does."""

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
from replication.estimation.multirate import MultiratePlant, losses
from replication.estimation.multirate.kalman import filter_gains, kalman_design
from replication.estimation.multirate.running import KalmanFilter
from replication.estimation.validation import Array
from tests.estimation.api.api_plants import result_of
from tests.estimation.api.matlab import Interpreted
from tests.estimation.compiled import EXACT, STEPS, Compiled
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
    "each sensor": (TURNING, (1, 2), losses.InARow((2, 1))),
    "packets": (TURNING, (2, 3), losses.InARow(1, together=True)),
    "one sensor, no inputs": (ALONE, (2,), losses.InARow(3)),
    "random": (TURNING, (1, 2), losses.Markov(after_arrival=0.1, after_loss=0.5)),
}
PERIODIC = ("dualrate", "multirate", "nonuniform")
OBSERVERS: dict[str, Callable[[], Any]] = {
    **{method: partial(lambda method: result_of(method).observer(), method) for method in PERIODIC},
    "late": lambda: late("hinf"),
    "late, least mean error": lambda: late("h2"),
    "filter": lambda: kalman(CART),
    "filter in continuous time": lambda: kalman(MOVING),
    "filter with a gate": lambda: kalman(CART, lag=1, gate=2.0),
    "smoother": smoother,
    **{kind: partial(lambda kind: lossy(kind).observer(), kind) for kind in LOSSES},
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
        assert np.allclose(told[there], wanted[there], rtol=EXACT, atol=EXACT)
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
    """The observer with gains that are larger by a millionth."""
    if kind in LOSSES:
        result = lossy(kind)
        return replace(result, gains={**result.gains, "L": result.gains["L"] * (1 + 1e-6)}).observer()
    other = OBSERVERS[kind]()
    first, *more = other.phases
    other.phases = (replace(first, injection=first.injection * (1 + 1e-6)), *more)
    return other


@pytest.mark.parametrize(
    ("form", "kind"),
    [*((form, kind) for form in FORMS for kind in PERIODIC), pytest.param("C", "each sensor", marks=pytest.mark.slow)],
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
    answer, found = same.step(known, y)
    assert answer == 0 and same.memory != kept
    inputs = known if observer.inputs else None
    assert np.allclose(found, observer.step(inputs, y), rtol=EXACT, atol=EXACT)
    assert not np.allclose(found, other.step(inputs, y), rtol=1e-9, atol=1e-9)


def test_bad_names_and_observers_without_a_form_have_messages() -> None:
    for observer in (result_of("multirate").observer(), lossy("one sensor, no inputs").observer()):
        with pytest.raises(InvalidInputError, match="C identifier"):
            observer.to_c("double")
    for bad in ("end", "9a", "a b", 3):
        with pytest.raises(InvalidInputError, match="MATLAB function"):
            result_of("multirate").observer().to_matlab(bad)
    for form in ("to_c", "to_matlab"):
        with pytest.raises(InvalidInputError, match="no periodic recursion"):
            getattr(result_of("delay").observer(0.01), form)()
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
