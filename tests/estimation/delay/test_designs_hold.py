"""Integrators, slow modes, biases, averages, two delays, any units: closed forms, and a sample of the benchmark."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks import delay_designs
from replication.errors import SolverError
from replication.estimation.delay import DelayPlant, design, exact_gain, limit
from replication.estimation.delay.exact import limit as limits
from replication.estimation.delay.general import design as designs

LEAST = "least level of any observer"


def cart(friction: float, delay: float, noise: float) -> DelayPlant:
    """A double integrator whose position comes late."""
    more: dict[str, Any] = {"c2_delayed": [[[1, 0]]], "d21": [[0, noise]]}
    return DelayPlant([[0, 1], [0, -friction]], [delay], [[0, 0], [1, 0]], [[1, 0]], [[0, 0]], **more)


def lag(rate: float, **sensor: Any) -> DelayPlant:
    """One slow state, and a sensor with noise."""
    return DelayPlant([[rate]], [2.0], [[1, 0]], [[1]], [[0]], d21=[[0, 1]], **sensor)


@pytest.mark.parametrize(("friction", "delay", "noise"), [(0.0, 0.05, 0.01), (1e-3, 1.0, 1.0), (0.3, 0.05, 1.0)])
def test_a_cart_seen_late(friction: float, delay: float, noise: float) -> None:
    A, one = np.array([[0.0, 1.0], [0.0, -friction]]), np.array([[1.0, 0.0]])
    case = delay_designs.Case("cart", A * delay, np.array([[0.0], [delay]]), one, one, np.array([noise]), (1.0,))
    plant = cart(friction, delay, noise)
    level = delay_designs.closed_level(case)
    assert limit(plant).level == pytest.approx(level, rel=1e-7)
    result = design(plant, goal="h2")
    rms = delay_designs.closed_rms(case) * delay**-0.5
    assert result.fact("rms error of z").value == pytest.approx(rms, rel=1e-7)
    assert result.fact("least rms error of any observer").value == pytest.approx(rms, rel=1e-7)
    assert result.fact(LEAST).value == pytest.approx(level, rel=1e-7)
    # Another sensor is another level.
    assert abs(limit(cart(friction, delay, 1.01 * noise)).level / level - 1.0) > 1e-3


@pytest.mark.parametrize("sensor", [{"c2_delayed": [[[1.0]]]}, {"c2_spread": [[[1.0]]]}])
def test_a_slow_mode_tends_to_an_integrator(sensor: dict[str, Any]) -> None:
    levels = [limit(lag(rate, **sensor)) for rate in (0.0, -1e-6, -1e-5)]
    assert all(found.settled for found in levels)
    for found in levels[1:]:
        assert found.level == pytest.approx(levels[0].level, rel=2e-5)
    # A rate of a tenth is no integrator any more.
    assert abs(limit(lag(-0.1, **sensor)).level / levels[0].level - 1.0) > 1e-2


@pytest.mark.parametrize("index", [0, 2, 3, 5, 6, 9])
def test_a_sample_of_the_benchmark(index: int) -> None:
    """Each of another family or other units; five have a closed form, the recycle a chain of samples."""
    row = delay_designs.measured(index, hinf=index in (3, 6))
    assert ("mixed" in row) == (index in (3, 6))
    assert row["errors"] == [] and delay_designs.faults(row) == []
    assert row["settled"]


def test_the_benchmark_tells_what_is_off() -> None:
    row = delay_designs.measured(3, hinf=False)
    for name in ("limit", "rms", "least rms"):
        assert delay_designs.faults({**row, name: row[name] * 1.01})
    assert delay_designs.faults({**row, "proved": 0.99 * row["limit"]})
    both = {"proved": 2.0 * row["limit"], "exact": row["limit"], "hinf rms": row["rms"]}
    assert delay_designs.faults({**row, **both, "mixed": (row["limit"], row["rms"])}) == []
    assert delay_designs.faults({**row, **both, "mixed": (row["limit"], 1.01 * row["rms"])})


def test_a_least_level_above_an_attained_one_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = lag(0.0, c2_delayed=[[[1.0]]])
    least = limit(plant)
    monkeypatch.setattr(designs, "limit", lambda _: replace(least, level=1.2 * least.level))
    fact = designs.known_levels(plant, least.level)[0]
    assert fact.value == "open" and "attained" in fact.method
    monkeypatch.setattr(designs, "limit", lambda _: replace(least, moving=0.1 * least.level))
    fact = designs.known_levels(plant)[0]
    assert fact.value == "open" and "do not agree" in fact.method
    monkeypatch.undo()
    assert designs.known_levels(plant, least.level)[0].value == least.level


def test_rounding_is_told_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    def singular(*_: Any) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    plant = lag(0.0, c2_delayed=[[[1.0]]])
    observer = design(plant, goal="h2").gains_of  # type: ignore[union-attr]
    monkeypatch.setattr(limits, "limit_of", singular)
    with pytest.raises(SolverError, match="rounding decides"):
        limit(plant)
    monkeypatch.setattr("replication.estimation.delay.general.observer.gain_bracket", singular)
    with pytest.raises(SolverError, match="rounding decides"):
        exact_gain(observer)
