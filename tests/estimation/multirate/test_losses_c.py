"""The C form of an observer that counts losses does what Python does, also where more is lost than was foreseen."""

from __future__ import annotations

import ctypes
import functools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation import multirate
from replication.estimation.multirate import MultiratePlant, losses
from tests.estimation.compiled import EXACT, STEPS, Compiled

CART = MultiratePlant(
    A=[[0.98, 0.1], [-0.05, 0.97]],
    B_d=[[0], [0.1]],
    B_u=[[0], [0.2]],
    C=[[0, 1], [1, 0]],
    D=np.diag([0.5, 0.1]),
    D_u=[[0.3], [0]],
)
ALONE = MultiratePlant(A=[[0.9]], B_d=[[1]], C=[[1]], D=[[0.5]])
KINDS = {
    "each sensor": (CART, (1, 2), losses.InARow((2, 1))),
    "packets": (CART, (2, 3), losses.InARow(1, together=True)),
    "one sensor, no inputs": (ALONE, (2,), losses.InARow(3)),
    "random": (CART, (1, 2), losses.Markov(after_arrival=0.1, after_loss=0.5)),
}


@functools.cache
def result_of(kind: str) -> losses.LossResult:
    plant, periods, model = KINDS[kind]
    return losses.design(multirate.design(plant, periods=periods), model)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_equal_over_many_steps(kind: str, tmp_path: Path) -> None:
    observer, rng = result_of(kind).observer(), np.random.default_rng(11)
    compiled, start = Compiled(observer, tmp_path), rng.standard_normal(observer.states)
    observer.reset(start)
    compiled.reset(start)
    for k in range(STEPS):
        u, y = rng.standard_normal(observer.inputs), rng.standard_normal(observer.measurements)
        often = 0.6 if (k // 100) % 2 else 0.2
        y = np.where(rng.random(len(y)) < often, math.nan, y)
        answer, found = compiled.step(u, y)
        assert answer == 0
        assert np.allclose(found, observer.step(u if observer.inputs else None, y), rtol=EXACT, atol=EXACT)
    orders = ctypes.cast(compiled.state, ctypes.POINTER(ctypes.c_ulong))
    order = len(observer._state)
    assert [orders[order], orders[order + 1]] == [observer.missed, observer.unforeseen]
    assert observer.missed > STEPS / 20
    assert (observer.unforeseen > 0) is (kind != "random")


@pytest.mark.slow
def test_another_gain_is_noticed(tmp_path: Path) -> None:
    result = result_of("each sensor")
    compiled = Compiled(result.observer(), tmp_path)
    other = replace(result, gains={**result.gains, "L": result.gains["L"] * 1.01}).observer()
    compiled.reset([1.0, 1.0])
    other.reset([1.0, 1.0])
    assert not np.allclose(compiled.step([0.5], [1.0, 2.0])[1], other.step([0.5], [1.0, 2.0]), rtol=EXACT, atol=EXACT)


@pytest.mark.slow
def test_what_python_refuses_changes_nothing(tmp_path: Path) -> None:
    observer: Any = result_of("each sensor").observer()
    compiled = Compiled(observer, tmp_path)
    compiled.reset([1.0, 1.0])
    kept = bytes(compiled.state)
    assert compiled.step([1.0], [math.inf, 1.0])[0] == 1
    assert compiled.step([math.nan], [1.0, 1.0])[0] == 1
    assert bytes(compiled.state) == kept
    assert compiled.step([1.0], [1.0, 1.0])[0] == 0
    assert bytes(compiled.state) != kept
    with pytest.raises(InvalidInputError, match="C identifier"):
        observer.to_c("double")


def test_after_more_losses_than_were_foreseen_the_gain_is_that_after_losses() -> None:
    """Not that after an arrival: the estimate is as uncertain as after the most losses that the gains are made for."""
    best = multirate.design(ALONE, periods=(1,))
    result = losses.design(best, losses.InARow(1))
    gains = dict(zip(((e.source, e.arrived) for e in result.automaton.edges), result.gains["L"], strict=True))
    observer = result.observer()
    observer.reset([0.0])
    for _ in range(3):
        observer.step(None, [None])
    assert observer.unforeseen == 2
    assert observer.step(None, [1.0]) == pytest.approx(gains[1, (True,)][0])
    assert gains[1, (True,)] != pytest.approx(gains[0, (True,)], rel=1e-3)
