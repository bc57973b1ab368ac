"""The C form of an observer does what `reset` and `step` do, over many steps, and compiles without a warning."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from tests.estimation.api.api_plants import result_of
from tests.estimation.compiled import EXACT, STEPS, Compiled

WITH_C = ("dualrate", "multirate", "nonuniform")


def measurements(method: str, rng: np.random.Generator, size: int) -> np.ndarray[Any, Any]:
    """Some do not come: single ones where the observer completes them, else whole samples."""
    y = rng.standard_normal(size)
    lost = rng.random(1 if method == "nonuniform" else size) < 0.2
    return np.where(lost, np.nan, y)


@pytest.mark.parametrize("method", WITH_C)
def test_it_is_equal_over_many_steps(method: str, tmp_path: Path) -> None:
    observer, rng = result_of(method).observer(), np.random.default_rng(9)
    compiled, start = Compiled(observer, tmp_path), rng.standard_normal(observer.states)
    observer.reset(start)
    compiled.reset(start)
    for _ in range(STEPS):
        u, y = rng.standard_normal(observer.inputs), measurements(method, rng, observer.measurements)
        answer, found = compiled.step(u, y)
        assert answer == 0
        assert np.allclose(found, observer.step(u if observer.inputs else None, y), rtol=EXACT, atol=EXACT)
    assert observer.missed > STEPS / 100


@pytest.mark.parametrize("method", WITH_C)
def test_another_gain_is_noticed(method: str, tmp_path: Path) -> None:
    observer, rng = result_of(method).observer(), np.random.default_rng(9)
    compiled, other = Compiled(observer, tmp_path), result_of(method).observer()
    phase = other.phases[0]
    other.phases = (type(phase)(**{**vars(phase), "injection": phase.injection * 1.01}), *other.phases[1:])
    start, y = np.zeros(observer.states), rng.standard_normal(observer.measurements)
    compiled.reset(start)
    found = compiled.step(np.zeros(observer.inputs), y)[1]
    assert np.allclose(found, observer.step(np.zeros(observer.inputs), y), atol=EXACT)
    assert not np.allclose(found, other.step(np.zeros(observer.inputs), y), atol=EXACT)


@pytest.mark.parametrize("method", WITH_C)
def test_what_python_refuses_changes_nothing(method: str, tmp_path: Path) -> None:
    observer = result_of(method).observer()
    compiled = Compiled(observer, tmp_path)
    compiled.reset(np.ones(observer.states))
    known, y = np.ones(observer.inputs), np.ones(observer.measurements)
    kept = bytes(compiled.state)
    assert compiled.step(known, [math.inf, *y[1:]])[0] == 1
    if observer.inputs:
        assert compiled.step([math.nan, *known[1:]], y)[0] == 1
    if method == "nonuniform" and observer.measurements > 1:
        assert compiled.step(known, [math.nan, *y[1:]])[0] == 1
    assert bytes(compiled.state) == kept
    assert compiled.step(known, y)[0] == 0
    assert bytes(compiled.state) != kept


def test_a_bad_name_and_a_history_have_messages() -> None:
    with pytest.raises(InvalidInputError, match="C identifier"):
        result_of("multirate").observer().to_c("int")
    with pytest.raises(InvalidInputError, match="no periodic recursion"):
        result_of("delay").observer(0.01).to_c()
