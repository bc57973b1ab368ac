"""`design` with the goals h2 and mixed: what it makes least, what it refuses, and the curve between the goals."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

import control
import numpy as np
import pytest

from replication.drawing.panels import draw
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation import multirate
from replication.estimation.multirate import facade
from replication.estimation.multirate.optimum import DESIGN_MARGIN, optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import distinct_offsets
from replication.estimation.multirate.result import balanced, mean_error_facts, rms_error

CART = control.ss([[1.0, 0.1], [0.0, 0.98]], [[0.0, 0.0], [0.1, 0.2]], [[0.0, 1.0], [1.0, 0.0]], 0, 0.1)
GIVEN: dict[str, Any] = {"periods": (1, 4), "noise": [0.5, 0.1], "disturbances": [0]}
EQUAL = 1e-9


def design(**changes: Any) -> multirate.MultirateResult:
    return multirate.design(CART, **{**GIVEN, **changes})


def value(result: multirate.MultirateResult, what: str) -> float:
    found = result.fact(what).value
    assert isinstance(found, float)
    return found


def test_each_goal_is_best_at_what_it_makes_least() -> None:
    hinf, mixed, h2 = (design(goal=goal) for goal in ("hinf", "mixed", "h2"))
    rms = [rms_error(result.problem, result.gains["L"]) for result in (hinf, mixed, h2)]
    assert hinf.value < mixed.value < h2.value
    assert rms[0] > rms[1] > rms[2]
    assert value(mixed, "rms error") == rms[1]
    assert value(h2, "rms error") == pytest.approx(value(h2, "rms error of the Kalman filter"))
    assert value(h2, "rms error, limit of any smoother") < rms[2]
    assert h2.value == pytest.approx(value(hinf, "level of the Kalman filter"))


def test_mixed_loses_the_same_share_of_both() -> None:
    result = design(goal="mixed")
    over_level = result.value / value(result, "optimum")
    over_error = value(result, "rms error") / value(result, "rms error of the Kalman filter")
    assert 1 < over_level == pytest.approx(over_error, rel=1e-5)
    assert result.value <= value(result, "level of the design")


def test_mixed_with_a_level_keeps_it() -> None:
    asked = design().value * 1.2
    result = design(goal="mixed", level=asked)
    assert result.value <= asked == value(result, "level of the design")
    np.testing.assert_array_equal(result.gains["L"], design(level=asked).gains["L"])


def test_where_the_goals_agree_mixed_is_the_kalman_filter() -> None:
    """White states carry nothing over: the best prediction is zero under either goal."""
    plant = MultiratePlant(A=[[0.0]], B_d=[[1.0]], C=[[1.0]], D=[[1.0]])
    result = multirate.design(plant, periods=(1,), goal="mixed")
    kalman = multirate.design(plant, periods=(1,), goal="h2")
    assert value(result, "rms error") == pytest.approx(value(kalman, "rms error"), rel=1e-6)


def test_the_curve_joins_both_goals_and_keeps_every_level() -> None:
    result = design()
    curve = result.tradeoff(9)
    best, kalman = value(result, "optimum"), design(goal="h2")
    assert curve.level[0] == pytest.approx(best, rel=10 * DESIGN_MARGIN)
    assert curve.gain[0] == pytest.approx(best, rel=1e-6)
    assert np.all(curve.gain <= curve.level * (1 + EQUAL))
    assert np.all(np.diff(curve.level[:-1]) > 0)
    assert np.all(np.diff(curve.gain) > 0)
    assert np.all(np.diff(curve.rms) < 0)
    assert curve.gain[-1] == pytest.approx(kalman.value)
    assert curve.rms[-1] == pytest.approx(value(kalman, "rms error"))
    for k in (2, 5):
        again = design(goal="mixed", level=float(curve.level[k]))
        assert (again.value, value(again, "rms error")) == pytest.approx((curve.gain[k], curve.rms[k]))


def test_the_curve_prints_and_plots_itself() -> None:
    curve = design().tradeoff(3)
    assert "infinite" in str(curve)
    assert curve.to_dict()["level"][-1] is None
    (panel,) = curve.panels()
    assert draw((panel,)) is not None
    for shown, measure in ((panel.x, curve.gain), (next(iter(panel.lines.values())), curve.rms)):
        np.testing.assert_allclose((1 + np.asarray(shown) / 100) * measure.min(), measure, rtol=EQUAL)
    for bad, message in ((1, "at least 2"), (2.5, "whole number"), (10_000, "at most 1000")):
        with pytest.raises(InvalidInputError, match=message):
            design().tradeoff(bad)  # type: ignore[arg-type]


def test_covariances_stand_for_their_factors() -> None:
    plain = design(goal="h2")
    matrices = design(goal="h2", noise=None, R=np.diag([0.25, 0.01]), Q=[[1.0]], S=[[0.0, 0.0]])
    np.testing.assert_allclose(matrices.gains["L"], plain.gains["L"], atol=EQUAL)
    louder = design(noise=None, R=4 * np.diag([0.25, 0.01]), Q=[[4.0]])
    assert louder.value == pytest.approx(2 * design().value)
    analysed = multirate.analyse(CART, plain.gains["L"], **{**GIVEN, "noise": None}, R=np.diag([0.25, 0.01]))
    assert analysed.value == pytest.approx(plain.value)


def test_kalman_gains_are_those_of_control() -> None:
    result = design(goal="h2", periods=(1, 1))
    plant = result.problem.plant
    L, P, _ = control.dlqe(plant.A, plant.B_d, plant.C, np.eye(1), plant.D @ plant.D.T)
    np.testing.assert_allclose(result.gains["P"][0], P, atol=EQUAL)
    np.testing.assert_allclose(result.gains["K"][0], np.linalg.solve(plant.A, L), atol=EQUAL)
    V = plant.C @ P @ plant.C.T + plant.D @ plant.D.T
    np.testing.assert_allclose(result.gains["V"][0], V, atol=EQUAL)
    np.testing.assert_allclose(result.gains["F"][0], P - P @ plant.C.T @ np.linalg.solve(V, plant.C @ P), atol=EQUAL)


def test_the_best_offsets_of_the_filter_have_the_least_mean_error() -> None:
    plant = MultiratePlant(A=[[0.9, 0.3], [0, 0.8]], B_d=[[0], [1]], C=[[1, 0], [1, 0.5]], D=np.diag([0.3, 1]))
    found = multirate.design(plant, periods=(4, 4), offsets="best", goal="h2")
    each = [multirate.design(plant, periods=(4, 4), offsets=offsets, goal="h2") for offsets in distinct_offsets((4, 4))]
    assert value(found, "rms error") == pytest.approx(min(value(result, "rms error") for result in each))
    assert value(found, "rms error") < value(each[0], "rms error")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"goal": "h3"}, "goal must be one of 'hinf', 'h2', 'mixed'"),
        ({"goal": "h2", "level": 1.0}, "level belongs to the goals hinf and mixed"),
        ({"P0": np.eye(2)}, "P0 belongs to the goal h2"),
        ({"goal": "h2", "P0": [[1, 2], [2, 1]]}, "P0 must be positive semidefinite"),
        ({"goal": "h2", "P0": np.eye(3)}, "P0 must have 2 rows"),
        ({"R": np.eye(2)}, "but not both"),
        ({"noise": None}, "give the sensor noise"),
        ({"Q": [[-1.0]]}, r"Q\[0\]\[0\] is a variance"),
        ({"S": [[1.0, 0.0]]}, "S does not fit Q and R"),
    ],
)
def test_each_bad_argument_has_its_own_error_before_anything_runs(changes: dict[str, Any], message: str) -> None:
    with (
        patch.object(facade, "optimum", side_effect=AssertionError("computed before the check")),
        pytest.raises(InvalidInputError, match=message),
    ):
        design(**changes)


def test_the_good_arguments_beside_them_are_computed_with() -> None:
    with (
        patch.object(facade, "optimum", side_effect=AssertionError("computed")),
        pytest.raises(AssertionError, match="computed"),
    ):
        design(goal="h2", P0=np.eye(2), S=[[0.1, 0.0]])


def test_arrays_have_their_own_covariances() -> None:
    plant = MultiratePlant.from_covariances(A=[[0.5]], C=[[1]], Q=[[1]], R=[[1]])
    with pytest.raises(InvalidInputError, match="from_covariances takes Q, R and S"):
        multirate.design(plant, periods=(1,), Q=[[1.0]])


@pytest.mark.parametrize("goal", ["hinf", "mixed"])
def test_a_level_out_of_reach_names_the_least(goal: str) -> None:
    best = value(design(), "optimum")
    with pytest.raises(InfeasibleError, match=f"the least is {best:.6g}"):
        design(goal=goal, level=0.9 * best)


def test_a_filter_that_looks_back_too_far_is_refused() -> None:
    result = design(goal="h2")
    assert isinstance(result, multirate.KalmanResult)
    for bad in (-1, 1.5, True, 1001):
        with pytest.raises(InvalidInputError, match="lag must be"):
            result.filter(lag=bad)  # type: ignore[arg-type]


def test_poor_sensors_are_told_of_by_the_mean_error() -> None:
    plant = MultiratePlant(A=[[0.9]], B_d=[[1]], C=[[1]], D=[[50]])
    result = multirate.design(plant, periods=(3,), goal="h2")
    told = [str(fact.value) for fact in result.evidence if fact.what == "advice"]
    assert any("rms error without sensors" in words for words in told)
    without = value(result, "rms error without sensors")
    assert without == pytest.approx(np.sqrt(1 / (1 - 0.9**2)))
    (own, *_) = mean_error_facts(result.problem, np.zeros((3, 1, 1)))
    assert own.value == pytest.approx(without)


def test_a_level_hardly_below_that_of_the_kalman_filter_is_told() -> None:
    plant = MultiratePlant(A=[[0.9]], B_d=[[1]], C=[[1]], D=[[1]])
    result = multirate.design(plant, periods=(1,))
    close = result.value > 0.9 * value(result, "level of the Kalman filter")
    told = [fact for fact in result.evidence if fact.what == "advice" and "Kalman" in str(fact.value)]
    assert close == bool(told)
    assert not [fact for fact in design().evidence if fact.what == "advice"]


def test_the_balance_is_found_from_the_ends_alone() -> None:
    problem = design().problem
    found = balanced(problem, optimum(problem))
    assert np.isfinite(found.level)
    assert problem.error_system(found.gains).spectral_radius() < 1


def test_the_frequencies_of_a_gain_end_at_half_a_turn_over_the_period() -> None:
    result = design()
    (panel,) = result.panels()
    period = result.problem.plant.dt * result.problem.schedule.period
    assert result.problem.schedule.period == 4 and panel.x[0] == 0.0
    assert panel.x[-1] == pytest.approx(np.pi / period, rel=EQUAL)
