"""The levels beside that of a delay observer: by other code where there is some, and where all is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest

from replication.estimation import delay
from replication.estimation.api.results import Evidence
from replication.estimation.delay.exact.central import ladder_model
from replication.estimation.delay.exact.loop import plant_terms
from replication.estimation.delay.exact.smoothing import kalman_level, worth
from replication.estimation.delay.spectrum import hinf_gain

EYE = np.eye(2)
TANKS = delay.delay_system([[-1, 0.2], [0.5, -2]], [[[0, 0], [0.5, 0.2]]], [0.4], EYE, EYE, [[1, 0]])


def noisy(size: float, **changes: Any) -> delay.DelayPlant:
    given: dict[str, Any] = {
        "a0": [[-1, 0.2], [0.5, -2]],
        "a": [[[0, 0], [0.5, 0.2]]],
        "delays": [0.4],
        "b": [[1, 0, 0], [0, 1, 0]],
        "c10": EYE,
        "c2": [[1, 0]],
        "d21": [[0, 0, size]],
    }
    return delay.DelayPlant(**{**given, **changes})


def facts(plant: Any, level: float) -> dict[str, Evidence]:
    return {fact.what: fact for fact in worth(plant_terms(plant), level)}


def test_without_sensors_it_is_the_gain_of_the_plant() -> None:
    found = facts(TANKS, 1.0)
    assert found["level without sensors"].value == pytest.approx(hinf_gain(TANKS).upper, rel=1e-4)
    assert found["level of the Kalman filter"].value == "none"
    unstable = noisy(0.3, a0=[[0.5, 0.2], [0.5, -2]])
    assert facts(unstable, 1.0)["level without sensors"].value == "infinite"
    integrator = noisy(0.3, a0=[[0, 0.2], [0, -2]], a=[[[0, 0], [0, 0.2]]])
    assert facts(integrator, 1.0)["level without sensors"].value in ("open", "infinite")


def test_the_levels_are_in_order() -> None:
    result = delay.design(noisy(0.3))
    kalman, limit, without = (
        result.fact(what).value
        for what in ("level of the Kalman filter", "limit of any smoother", "level without sensors")
    )
    assert isinstance(kalman, float) and isinstance(limit, float) and isinstance(without, float)
    least = result.fact("least level of any observer").value
    assert limit <= least * (1 + 1e-6) and least <= kalman * (1 + 1e-6) and kalman < without
    assert "advice" not in {fact.what for fact in result.evidence}


def test_poor_sensors_are_told_of() -> None:
    found = facts(noisy(1e3), 1.36)
    assert "without sensors" in str(found["advice"].value)
    kalman, without = found["level of the Kalman filter"].value, found["level without sensors"].value
    assert kalman == pytest.approx(without, rel=1e-3)


def test_a_model_with_more_moments_changes_nothing() -> None:
    levels = [kalman_level(ladder_model(plant_terms(noisy(0.3)), order)) for order in (6, 12)]
    assert levels[0] == pytest.approx(levels[1], rel=1e-8)


def test_without_delays_it_is_the_filter_of_control() -> None:
    model = ladder_model(plant_terms(noisy(0.3)), 3)
    direct = replace(model, dz=0.2 * np.ones_like(model.dz))
    for each in (model, direct):
        L, _, _ = control.lqe(each.a, each.b, each.cy, np.eye(3), each.dy @ each.dy.T)
        Lz = each.dz @ each.dy.T / (each.dy @ each.dy.T)
        closed = each.a - L @ each.cy, each.b - L @ each.dy, each.cz - Lz @ each.cy, each.dz - Lz @ each.dy
        omega = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 4000)])
        gains = [
            np.linalg.norm(
                closed[3] + closed[2] @ np.linalg.solve(1j * w * np.eye(len(each.a)) - closed[0], closed[1]), 2
            )
            for w in omega
        ]
        assert kalman_level(each) == pytest.approx(max(gains), rel=1e-5)


def test_white_noise_finds_its_filter_best() -> None:
    """The level of another gain is another number: the comparison above can fail."""
    model = ladder_model(plant_terms(noisy(0.3)), 3)
    louder = replace(model, dy=1.5 * model.dy)
    assert kalman_level(louder) != pytest.approx(kalman_level(model), rel=1e-3)
