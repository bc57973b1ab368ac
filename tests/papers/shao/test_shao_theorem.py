"""The motor and its command, the theorem of Sec. IV, its counter-example, the limit of the slow rates, stable sets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from computed import result

from papers.shao.experiments.motor import radius
from papers.shao.experiments.theorem import longer_ratios
from papers.shao.experiments.tracking import over_plants
from papers.shao.method.lyapunov import prediction_gap, slow_rate_gap, theorem_constants
from papers.shao.method.motor import Feedforward, Motor, feedforward, simulate, tracking_command
from papers.shao.method.readings import Reading, Structure
from papers.shao.printed import DESIGN, MOTOR, START, literal_loop
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.dualrate.loop import close_loop, stability_radius
from replication.estimation.dualrate.observers import OBSERVERS, Harmonic
from replication.estimation.dualrate.problem import dual_rate_design, make_plant
from replication.estimation.dualrate.response import tracking_error_ratio

COUNTS = {"slow_periods": 2, "substeps": 2}


def test_choices_may_be_named_and_unknown_names_are_refused() -> None:
    named = tracking_command(MOTOR, DESIGN, 1.0, "corrected", "continuous")
    assert named.continuous
    np.testing.assert_array_equal(
        tracking_command(MOTOR, DESIGN, 1.0, "corrected").amplitude,
        tracking_command(MOTOR, DESIGN, 1.0, Feedforward.CORRECTED).amplitude,
    )
    assert Structure(feedforward="corrected").feedforward is Feedforward.CORRECTED
    with pytest.raises(InvalidInputError, match="feedforward must be one of 'printed', 'corrected', got 'exact'"):
        feedforward(MOTOR, 1j, "exact")
    with pytest.raises(InvalidInputError, match="observer must be one of"):
        Reading(observer="kalman")


def test_parameters_and_gains_that_do_not_fit_are_named() -> None:
    with pytest.raises(InvalidInputError, match="inertia must be positive"):
        Motor(resistance=1, flux=1, inductance=1, pole_pairs=1, friction=1, inertia=-1, torque_constant=1)
    plant = make_plant([[0, 1], [-1, -0.1]], [[0], [1]], [[1, 0]])
    other = replace(DESIGN, model=plant, feedback=np.zeros((1, 2)), injection=np.full((2, 1), 0.5))
    with pytest.raises(InvalidInputError, match=r"gain K of shape \(1, 3\), got \(1, 2\)"):
        tracking_command(MOTOR, other, 1.0, Feedforward.PRINTED)


def test_what_cannot_be_simulated_is_named() -> None:
    harmonic = literal_loop("alternating_predictive", 1.0).harmonic
    with pytest.raises(InvalidInputError, match="cannot simulate 'kalman'"):
        simulate(DESIGN, "kalman", harmonic, START, START, **COUNTS)
    with pytest.raises(InvalidInputError, match="one amplitude for each of the 1 inputs, got 2"):
        simulate(DESIGN, "fast_sensor", Harmonic(1.0, np.zeros(2)), START, START, **COUNTS)
    with pytest.raises(InvalidInputError, match="number of sub-steps must be at least 1"):
        simulate(DESIGN, "fast_sensor", harmonic, START, START, slow_periods=2, substeps=0)


@pytest.mark.parametrize("start", [["a", 0, 0], [1j, 0, 0], [[0], 1, 2], [0, np.nan, 0]])
def test_estimates_that_are_not_real_numbers_are_named(start: object) -> None:
    harmonic = literal_loop("alternating_predictive", 1.0).harmonic
    with pytest.raises(InvalidInputError, match=r"ζ\(0\) must be 3 finite real numbers"):
        simulate(DESIGN, "fast_sensor", harmonic, START, start, **COUNTS)


SCALAR = dual_rate_design(make_plant([[1]], [[1]], [[1]]), feedback=[[-2]], injection=[[2]], period=1e-3, ratio=5)
APO, RUNNING = "alternating_predictive", "running_prediction"


def test_every_period_allowed_by_the_theorem_is_unstable() -> None:
    allowed = SCALAR.period / theorem_constants(SCALAR).condition
    for period in np.geomspace(allowed / 100, allowed, 8):
        design = replace(SCALAR, period=float(period))
        assert theorem_constants(design).condition < 1.001
        assert stability_radius(close_loop(design, OBSERVERS[APO])) > 1
        assert stability_radius(close_loop(design, OBSERVERS[RUNNING])) < 1


def by_hand(ratio: int) -> float:
    """The radius of the restarted predictor's loop over (x, ζ) from powers of its step over (x, ζ, ȳ), h = e^T − 1."""
    h = np.expm1(SCALAR.period)
    step = np.array([[1 + h, -2 * h, 0], [0, (1 - 2 * h) / (1 + h), 2 * h / (1 + h)], [0, -h, 1]])
    period = (np.linalg.matrix_power(step, ratio) @ [[1, 0], [0, 1], [1, 0]])[:2]
    return float(np.abs(np.linalg.eigvals(period)).max())


def test_the_restarted_predictor_diverges_where_the_sensor_is_slow_enough() -> None:
    """(18) is the same for every M; another formula finds the same ratio, and a simulation by hand the same growth."""
    longer = result("shao.longer")
    ratio = longer["ratio"]
    assert by_hand(ratio - 1) < 1.0 < by_hand(ratio)
    assert longer["radius"] == pytest.approx([by_hand(ratio - 1), by_hand(ratio)], abs=1e-9)
    assert all(
        value > 1.0 and value == pytest.approx(by_hand(int(M)), rel=1e-6) for M, value in longer["beyond"].items()
    )
    assert theorem_constants(replace(SCALAR, ratio=ratio)).condition == theorem_constants(SCALAR).condition < 1.0
    drawn = result("shao.divergence")
    x, zeta, last, step = 1.0, 0.0, (0.0, 0.0), SCALAR.period
    for k in range(4000):  # (1) and (7) by hand, y_p by (6)
        measured = x if k % SCALAR.ratio == 0 else np.exp(step) * last[0] + np.expm1(step) * last[1]
        u, last = -2.0 * zeta, (zeta, -2.0 * zeta)
        x = np.exp(step) * x + np.expm1(step) * u
        zeta = np.exp(-step) * zeta - np.expm1(-step) * (u + 2.0 * measured)
    assert drawn["own"][APO][drawn["time"].index(4.0)] == pytest.approx(x, rel=1e-9)
    with pytest.raises(InfeasibleError, match="stable at M = 1100"):
        longer_ratios(1100, 2000, [])


def test_lyapunov_equation_and_constants_of_the_scalar_loop() -> None:
    constants = theorem_constants(SCALAR)
    np.testing.assert_allclose(constants.P, [[0.5, 0.5], [0.5, 1.5]], atol=1e-12)
    root = np.sqrt(constants.smallest)
    np.testing.assert_allclose(np.array(constants.alpha[:3]) * root, [5, 16, 1], rtol=1e-12)
    assert constants.condition < 1
    with pytest.raises(InfeasibleError, match="needs A \\+ B K and A − L C Hurwitz"):
        theorem_constants(replace(SCALAR, feedback=np.array([[0.5]])))


def test_prediction_error_does_not_vanish_with_the_period() -> None:
    gaps = [prediction_gap(replace(SCALAR, period=period)) for period in (1e-3, 1e-4, 1e-5)]
    assert gaps[2][0] == pytest.approx(gaps[1][0], rel=1e-3)
    assert gaps[2][1] == pytest.approx(gaps[1][1] / 10)
    assert gaps[2][0] > 100 * gaps[2][1]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_slow_rates_tend_to_a_fraction_of_the_observer_gain(seed: int) -> None:
    """With (6) the gain acts once in M periods; with the running prediction it acts in full."""
    rng = np.random.default_rng(seed)
    design = dual_rate_design(
        make_plant(rng.normal(size=(3, 3)), rng.normal(size=(3, 1)), rng.normal(size=(1, 3))),
        feedback=0.3 * rng.normal(size=(1, 3)),
        injection=0.3 * rng.normal(size=(3, 1)),
        period=0.2,
        ratio=4,
    )
    for name, share in ((APO, 1 / 4), (RUNNING, 1.0), ("fast_sensor", 1.0)):
        near, nearer = (slow_rate_gap(design, name, period=period, share=share) for period in (1e-3, 5e-4))
        assert nearer == pytest.approx(near / 2, rel=0.1)
    assert slow_rate_gap(design, APO, period=1e-4, share=1.0) > 0.01


def test_true_plants_that_differ_are_swept_with_the_command_of_the_model() -> None:
    """The nominal plant gives the nominal numbers; a reversed input has no steady state."""
    nominal = literal_loop("alternating_predictive", 1.0)
    A, B, C = DESIGN.model.A, DESIGN.model.B_u, DESIGN.model.C
    plants = [DESIGN.model, make_plant(A, 1.2 * B, C), make_plant(A, -B, C)]
    same, other, reversed_input = over_plants(nominal, APO, plants)
    assert same == pytest.approx([stability_radius(nominal), 100 * tracking_error_ratio(nominal)], rel=1e-9)
    assert other[0] != pytest.approx(same[0], rel=1e-3)
    assert reversed_input[0] > 1
    assert reversed_input[1] is None


@pytest.mark.parametrize("change", [{"period": 0.0}, {"period": -1e-3}, {"ratio": 0}, {"ratio": 2.5}])
def test_a_replaced_design_is_checked_again(change: dict[str, float]) -> None:
    with pytest.raises(InvalidInputError, match=r"period T must be positive|rate ratio M must be"):
        theorem_constants(replace(DESIGN, **change))


@pytest.mark.parametrize("period", [0.0, -1e-2])
def test_periods_that_are_not_positive_have_no_radius_and_no_rates(period: float) -> None:
    with pytest.raises(InvalidInputError, match="period T must be positive"):
        radius(DESIGN, APO, period=period)
    with pytest.raises(InvalidInputError, match="period T must be positive"):
        slow_rate_gap(DESIGN, APO, period=period, share=1.0)
