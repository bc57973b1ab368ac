"""The stability theorem: its constants, the counter-example, the limit of the slow rates, stable sets."""

from dataclasses import replace

import numpy as np
import pytest
from dualrate_examples import MOTOR_DESIGN, motor_loop, random_design

from papers.shao.method.lyapunov import prediction_gap, slow_rate_gap, theorem_constants
from papers.shao.method.sweeps import over_plants, radii_over_periods, radii_over_ratios, stable_periods
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.dualrate.loop import close_loop, stability_radius
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import dual_rate_design, make_plant
from replication.estimation.dualrate.tracking import tracking_error_ratio

SCALAR = dual_rate_design(make_plant([[1]], [[1]], [[1]]), feedback=[[-2]], injection=[[2]], period=1e-3, ratio=5)
APO = OBSERVERS["alternating_predictive"]
RUNNING = OBSERVERS["running_prediction"]


def test_every_period_allowed_by_the_theorem_is_unstable() -> None:
    allowed = SCALAR.period / theorem_constants(SCALAR).condition
    for period in np.geomspace(allowed / 100, allowed, 8):
        design = replace(SCALAR, period=float(period))
        assert theorem_constants(design).condition < 1.001
        assert stability_radius(close_loop(design, APO)) > 1
        assert stability_radius(close_loop(design, RUNNING)) < 1


def test_lyapunov_equation_and_constants_of_the_scalar_loop() -> None:
    constants = theorem_constants(SCALAR)
    np.testing.assert_allclose(constants.P, [[0.5, 0.5], [0.5, 1.5]], atol=1e-12)
    root = np.sqrt(constants.smallest)
    np.testing.assert_allclose(np.array(constants.alpha[:3]) * root, [5, 16, 1], rtol=1e-12)
    assert constants.holds
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
    design = random_design(np.random.default_rng(seed), 4)
    for builder, share in ((APO, 1 / 4), (RUNNING, 1.0), (OBSERVERS["fast_sensor"], 1.0)):
        near, nearer = (slow_rate_gap(design, builder, period=period, share=share) for period in (1e-3, 5e-4))
        assert nearer == pytest.approx(near / 2, rel=0.1)
    assert slow_rate_gap(design, APO, period=1e-4, share=1.0) > 0.01


def test_true_plants_that_differ_are_swept_with_the_command_of_the_model() -> None:
    """The nominal plant gives the nominal numbers; a reversed input has no steady state."""
    nominal = motor_loop("alternating_predictive", 1.0)
    A, B, C = MOTOR_DESIGN.model.state, MOTOR_DESIGN.model.input, MOTOR_DESIGN.model.output
    plants = [MOTOR_DESIGN.model, make_plant(A, 1.2 * B, C), make_plant(A, -B, C)]
    same, other, reversed_input = over_plants(nominal, APO, plants)
    assert same == pytest.approx((stability_radius(nominal), tracking_error_ratio(nominal)), rel=1e-9)
    assert other[0] != pytest.approx(same[0], rel=1e-3)
    assert reversed_input[0] > 1
    assert reversed_input[1] is None


def test_stable_sets_bound_what_the_radii_say() -> None:
    grid = list(np.linspace(0.002, 0.3, 150))
    intervals = stable_periods(MOTOR_DESIGN, APO, grid)
    assert len(intervals) > 1, "sampling folds the fast mode"
    for first, last in intervals:
        assert stability_radius(close_loop(replace(MOTOR_DESIGN, period=(first + last) / 2), APO)) < 1
    inner = [end for interval in intervals for end in interval][1:]
    np.testing.assert_allclose(radii_over_periods(MOTOR_DESIGN, APO, inner), 1.0, atol=1e-5)
    ratios = radii_over_ratios(MOTOR_DESIGN, APO, [1, 5])
    assert ratios[1] == stability_radius(close_loop(MOTOR_DESIGN, APO))
    with pytest.raises(InvalidInputError, match="increasing"):
        stable_periods(MOTOR_DESIGN, APO, [0.2, 0.1])
