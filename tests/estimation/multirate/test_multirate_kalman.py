"""The steady-state Kalman filter, white-noise performance, time responses and worst cases."""

from dataclasses import replace
from typing import Any
from unittest.mock import patch

import control
import numpy as np
import pytest
from multirate_examples import PAPER, problem

from replication.drawing.panels import draw
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation import dualrate, multirate
from replication.estimation.dualrate.slow.result import MARGIN
from replication.estimation.linear.norms import l2_gain, worst_case_response
from replication.estimation.linear.periodic import simulate
from replication.estimation.multirate import facade
from replication.estimation.multirate import optimum as search
from replication.estimation.multirate.kalman import kalman_centre, kalman_design, semidefinite, stabilises, state_units
from replication.estimation.multirate.optimum import DESIGN_MARGIN, optimal_design
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import distinct_offsets
from replication.estimation.multirate.result import mean_error_facts
from tests.tolerances import ROUNDING


def test_only_gains_that_stabilise_pass_for_it() -> None:
    growing = problem(replace(PAPER, A=PAPER.A / np.max(np.abs(np.linalg.eigvals(PAPER.A))) * 1.2), (1, 1))
    centre = kalman_centre(growing)
    maps = centre.scaled.maps()
    assert stabilises(centre.scaled, centre.states, maps)
    assert not stabilises(centre.scaled, 0 * centre.states, maps)


def test_the_worst_case_stays_below_the_norm_and_tends_to_it() -> None:
    paper = problem(PAPER, (2, 3))
    system = paper.error_system(optimal_design(paper).gains)
    norm = l2_gain(system)
    ratios = [worst_case_response(system, horizon).ratio for horizon in (1, 6, 24, 96, 288)]
    assert ratios == sorted(ratios)
    assert ratios[-1] <= norm.upper
    assert ratios[-1] >= 0.995 * norm.lower


def test_the_worst_case_is_the_response_to_its_own_input() -> None:
    paper = problem(PAPER, (3, 1))
    system = paper.error_system(kalman_design(paper).gains)
    worst = worst_case_response(system, 30)
    np.testing.assert_allclose(simulate(system, worst.inputs), worst.outputs, atol=ROUNDING)
    assert np.linalg.norm(worst.inputs) == pytest.approx(1.0)
    rng = np.random.default_rng(7)
    for _ in range(50):
        v = rng.normal(size=worst.inputs.shape)
        assert np.linalg.norm(simulate(system, v)) <= worst.ratio * np.linalg.norm(v)


@pytest.mark.parametrize(("push", "noise"), [(10.0, 0.01), (0.01, 10.0)])
def test_the_unit_of_a_state_is_the_smaller_of_what_pushes_it_and_what_hides_it(push: float, noise: float) -> None:
    plant = MultiratePlant(A=[[0.5]], B_d=[[push]], C=[[1.0]], D=[[noise]])
    (unit,) = state_units(problem(plant, (1,)))
    assert unit < 0.1


def test_a_solution_that_does_not_stabilise_is_none() -> None:
    centre = kalman_centre(problem(PAPER, (2, 3)))
    levels = (2 * centre.floor + 10.0,)
    ((states, slack),) = search._solutions(centre, levels)
    assert states is not None and slack > 0
    with patch.object(search, "stabilises", return_value=False):
        assert search._solutions(centre, levels) == [(None, -1.0)]


def test_one_negative_direction_is_not_semidefinite() -> None:
    assert semidefinite(np.stack([np.eye(2), np.diag([1.0, 0.0])]))
    assert not semidefinite(np.stack([np.eye(2), np.diag([1.0, -0.5])]))


def test_the_value_of_an_optimum_is_the_end_that_is_attained() -> None:
    found = search.optimum(problem(PAPER, (2, 3)))
    wide = replace(found, lower=1.0, upper=2.0)
    assert replace(wide, limited_by="noncausal").value == 1.0
    assert replace(wide, limited_by="causal").value == 2.0


CART = control.ss(
    [[1.0, 0.1], [0.0, 0.98]], [[0.0, 0.0], [0.1, 0.2]], [[0.0, 1.0], [1.0, 0.0]], [[0.0, 0.3], [0.0, -0.2]], 0.1
)
GIVEN: dict[str, Any] = {"periods": (1, 4), "noise": [0.5, 0.1], "disturbances": [0]}
EQUAL = 1e-9


def design(**changes: Any) -> multirate.MultirateResult:
    return multirate.design(CART, **{**GIVEN, **changes})


def value(result: Any, what: str) -> float:
    found = result.fact(what).value
    assert isinstance(found, float)
    return found


def slow(**aims: Any) -> dualrate.SlowRateResult:
    servo = dualrate.make_plant([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])
    result = dualrate.design(servo, period=0.05, ratio=10, at="slow", sensor_noise=[[1e-3]], **aims)
    assert isinstance(result, dualrate.SlowRateResult)
    return result


TRADED = [(design, "rms error", "rms error", DESIGN_MARGIN), (slow, "root mean square", "rms of (x, u)", MARGIN)]
"""Methods that trade gain for mean error, with what the latter is called, and the margin of their least level."""


@pytest.mark.parametrize(("make", "rms", "shown", "margin"), TRADED)
def test_mixed_loses_the_same_share_of_both(make: Any, rms: str, shown: str, margin: float) -> None:
    mean, both, worst = (make(goal=goal) for goal in ("h2", "mixed", "hinf"))
    least = value(worst, "optimum")
    assert 1 < both.value / least == pytest.approx(value(both, rms) / value(mean, rms), rel=1e-5)
    assert worst.value < both.value < mean.value
    assert both.value <= value(both, "level of the design")
    # A level that is not that of the balance would show: the shares part on either side.
    off = make(goal="mixed", level=1.05 * value(both, "level of the design"))
    assert off.value / least - value(off, rms) / value(mean, rms) > 1e-3


@pytest.mark.parametrize(("make", "rms", "shown", "margin"), TRADED)
def test_the_curve_joins_both_goals_and_keeps_every_level(make: Any, rms: str, shown: str, margin: float) -> None:
    worst, mean = make(goal="hinf"), make(goal="h2")
    curve, best = worst.tradeoff(9), value(worst, "optimum")
    assert curve.level[0] == pytest.approx((1 + margin) * best, rel=1e-5)
    assert curve.gain[0] == pytest.approx(worst.value, rel=1e-5)
    assert np.all(curve.gain <= curve.level * (1 + EQUAL)) and np.all(np.diff(curve.level[:-1]) > 0)
    assert np.all(np.diff(curve.gain) > 0) and np.all(np.diff(curve.rms) < 0)
    assert (curve.gain[-1], curve.rms[-1]) == pytest.approx((mean.value, value(mean, rms)), rel=EQUAL)
    for k in (2, 5):
        again = make(goal="mixed", level=float(curve.level[k]))
        assert (again.value, value(again, rms)) == pytest.approx((curve.gain[k], curve.rms[k]), rel=EQUAL)
    np.testing.assert_allclose(mean.tradeoff(3).gain[-1], curve.gain[-1], rtol=1e-12)
    (panel,) = curve.panels()
    assert panel.y_label.startswith(shown) and curve.to_dict()["method"] == worst.method


def test_where_the_goals_agree_mixed_is_the_kalman_filter() -> None:
    """White states carry nothing over: the best prediction is zero under either goal."""
    plant = MultiratePlant(A=[[0.0]], B_d=[[1.0]], C=[[1.0]], D=[[1.0]])
    result = multirate.design(plant, periods=(1,), goal="mixed")
    kalman = multirate.design(plant, periods=(1,), goal="h2")
    assert value(result, "rms error") == pytest.approx(value(kalman, "rms error"), rel=1e-6)


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
    np.testing.assert_array_equal(matrices.problem.plant.D_u, CART.D[:, 1:])
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


@pytest.mark.parametrize("goal", ["hinf", "mixed"])
def test_a_level_out_of_reach_names_the_least(goal: str) -> None:
    best = value(design(), "optimum")
    with pytest.raises(InfeasibleError, match=f"the least is {best:.6g}"):
        design(goal=goal, level=0.9 * best)


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


def test_the_frequencies_of_a_gain_end_at_half_a_turn_over_the_period() -> None:
    result = design()
    (panel,) = result.panels()
    period = result.problem.plant.dt * result.problem.schedule.period
    assert result.problem.schedule.period == 4 and panel.x[0] == 0.0
    assert panel.x[-1] == pytest.approx(np.pi / period, rel=EQUAL)
