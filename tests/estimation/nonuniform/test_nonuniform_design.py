from functools import partial
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from sampled_cases import MOTOR, MOTOR_RANGE, OSCILLATOR, OSCILLATOR_RANGE, random_plant, stable_plants

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.conic.sdpa import GAP
from replication.estimation.linear.norms import GainBracket
from replication.estimation.nonuniform import robust as exchange
from replication.estimation.nonuniform.facade import analyse, design_stamped, simulate
from replication.estimation.nonuniform.facade import design as design_filter
from replication.estimation.nonuniform.filters import (
    Filter,
    closed_form,
    deadbeat_filter,
    periodic_gain,
    riccati_filter,
    riccati_level,
)
from replication.estimation.nonuniform.plant import DurationPlant, PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import (
    NEGLIGIBLE,
    VIOLATION,
    Solver,
    design_for_periods,
    largest_eigenvalues,
    normalise,
    recover,
    robust_design,
)
from replication.estimation.nonuniform.stamped.design import StampedPlant
from replication.estimation.nonuniform.worst_case import beside, smoother_limit, zero_at_constant_periods

ROUTES = 1e-8
DEGENERATE = 1e-6


def test_routes_to_the_nominal_optimum():
    h = OSCILLATOR_RANGE.middle
    formula = closed_form(OSCILLATOR, h)
    for design in (riccati_level(OSCILLATOR, h), design_for_periods(OSCILLATOR, [h])):
        assert design.level == pytest.approx(formula, rel=ROUTES)
        assert periodic_gain(OSCILLATOR, design.filter, [h]).value == pytest.approx(formula, rel=ROUTES)
    # Without direct feedthrough it is degenerate.
    h = MOTOR_RANGE.middle
    formula = closed_form(MOTOR, h)
    assert riccati_level(MOTOR, h).level == pytest.approx(formula, rel=DEGENERATE)
    assert periodic_gain(MOTOR, deadbeat_filter(MOTOR, h), [h]).value == pytest.approx(formula, rel=ROUTES)
    assert periodic_gain(MOTOR, design_for_periods(MOTOR, [h]).filter, [h]).upper >= formula * (1 - 1e-12)


def test_closed_form_refuses_what_it_does_not_cover():
    rng = np.random.default_rng(2)
    with pytest.raises(InvalidInputError, match="scalar"):
        closed_form(random_plant(rng, 2), 0.1)
    with pytest.raises(InvalidInputError, match="C = L"):
        closed_form(SampledPlant(OSCILLATOR.A, OSCILLATOR.B, OSCILLATOR.C, OSCILLATOR.D, [[0, 1]]), 0.1)
    # All zeros inside the unit circle: the infimum is zero, and the Riccati route says that nothing attains it.
    assert closed_form(OSCILLATOR, OSCILLATOR_RANGE.h_l) == 0.0
    with pytest.raises(InfeasibleError, match="infimum is 0"):
        riccati_level(OSCILLATOR, OSCILLATOR_RANGE.h_l)


@given(plant=stable_plants())
@settings(max_examples=12)
def test_riccati_filter_meets_its_level_and_the_lmi_agrees(plant):
    h = 0.5
    best = riccati_level(plant, h, tolerance=1e-7)
    above = riccati_filter(plant, h, best.level * 1.05)
    assert above is not None
    assert periodic_gain(plant, above.filter, [h]).upper <= best.level * 1.05 * (1 + 1e-7)
    assert riccati_filter(plant, h, best.level * (1 - 1e-3)) is None
    by_lmi = design_for_periods(plant, [h])
    assert by_lmi.level == pytest.approx(best.level, rel=2e-3)


def test_exchange_matches_the_dense_grid_and_holds_between_its_nodes():
    for plant, periods in ((OSCILLATOR, OSCILLATOR_RANGE), (MOTOR, MOTOR_RANGE)):
        normalised = normalise(plant, periods.middle)
        dense = design_for_periods(plant, periods.nodes(129).tolist(), at=normalised, solver=Solver.SDPA)
        everywhere = robust_design(plant, periods)
        assert everywhere.design.level == pytest.approx(dense.level, rel=1e-6)
        transitions = normalised.plant.transitions(periods.nodes(501))
        left = largest_eigenvalues(normalised.plant, everywhere.design.variables, transitions)
        assert left.max() <= VIOLATION
        assert len(everywhere.design.periods) < 8


def test_copies_of_a_measurement_change_nothing():
    h = OSCILLATOR_RANGE.middle
    alone = riccati_level(OSCILLATOR, h, tolerance=1e-8)
    for scale in (1.0, 1e4):
        copied = SampledPlant(
            OSCILLATOR.A, OSCILLATOR.B, np.outer([1, scale], OSCILLATOR.C[0]), [[0.1], [0.1 * scale]], OSCILLATOR.L
        )
        both = riccati_level(copied, h, tolerance=1e-8)
        assert both.level == pytest.approx(alone.level, rel=ROUTES)
        assert periodic_gain(copied, both.filter, [h]).value == pytest.approx(alone.level, rel=DEGENERATE)


def test_measurements_that_reveal_the_disturbance_are_refused_or_right():
    """Two noiseless sensors and one disturbance: the innovation becomes singular, and no number may come out wrong."""
    both = SampledPlant([[-1, 1], [0, -2]], [[1], [0.5]], np.eye(2), [[0], [0]], [[0, 1]])
    with pytest.raises(InvalidInputError, match="design_for_periods"):
        riccati_level(both, 0.25)
    # One state: the second sensor is a copy of the first, and |L Gamma| is the optimum.
    copied = SampledPlant([[-0.3]], [[1.2]], [[0.7], [-0.4]], [[0], [0]], [[2]])
    level = abs((copied.L @ copied.discretise(0.25)[1]).item())
    assert riccati_level(copied, 0.25).level == pytest.approx(level, rel=DEGENERATE)


def test_floor_is_a_level_that_the_search_found_infeasible():
    h = OSCILLATOR_RANGE.middle
    floor = riccati_level(OSCILLATOR, h, tolerance=1e-8).infeasible
    assert riccati_filter(OSCILLATOR, h, floor) is None
    assert floor == pytest.approx(closed_form(OSCILLATOR, h), rel=ROUTES * 10)
    assert floor <= closed_form(OSCILLATOR, h)


def test_exchange_that_runs_out_of_rounds_says_how_far_it_came():
    with pytest.raises(SolverError, match=r"level \d.* last grid only.*guaranteed \d"):
        robust_design(MOTOR, MOTOR_RANGE, max_rounds=1)


def test_robust_design_grows_with_the_order_and_the_range():
    """A plant of eight states; ranges of five decades. The level never falls when the range grows."""
    rng = np.random.default_rng(0)
    large = robust_design(random_plant(rng, 8), PeriodRange(0.05, 0.3))
    assert large.violation <= VIOLATION
    assert large.design.report.residuals["gap"] <= GAP
    levels = [robust_design(MOTOR, PeriodRange(0.001, h_u)).design.level for h_u in (0.1, 1.0, 100.0)]
    assert levels[0] < levels[1] < levels[2]


def test_a_solution_short_of_the_accuracy_is_refined():
    """Five states over a wide range: SDPA's first solution ends with a gap far above 1e-6."""
    plant = random_plant(np.random.default_rng(1), 5)
    grid = [0.01, 1.505, 3.0]
    refined = design_for_periods(plant, grid, solver=Solver.SDPA)
    assert refined.report.options["refinement"] >= 1
    assert refined.report.residuals["gap"] <= GAP
    other = design_for_periods(plant, grid)
    assert refined.level == pytest.approx(other.level, rel=1e-5)
    assert max(periodic_gain(plant, refined.filter, [h]).value for h in grid) <= refined.level * (1 + GAP)


def test_exchange_reaches_the_dense_grid_where_small_violations_cost_much(monkeypatch):
    """Over four decades violations below 5e-7 cost the level more than 1e-6: the rounds go on until they do not."""
    periods = PeriodRange(0.001, 10.0)
    found = robust_design(MOTOR, periods)
    grid, at = np.geomspace(periods.h_l, periods.h_u, 129), normalise(MOTOR, periods.middle)
    dense = design_for_periods(MOTOR, grid, at=at, solver=Solver.SDPA).level
    assert found.shortfall <= NEGLIGIBLE
    assert found.design.level >= dense * (1 - 1e-6)
    monkeypatch.setattr(exchange, "NEGLIGIBLE", 1.0)
    early = robust_design(MOTOR, periods)
    assert early.design.level < dense * (1 - 1e-6)
    assert found.design.level / early.design.level - 1 <= early.shortfall


def test_only_the_last_solution_must_have_a_filter(monkeypatch):
    """Y - Z may be singular on the way, where no filter can be recovered."""
    recovered = []
    monkeypatch.setattr(exchange, "recover", lambda v: recovered.append(v) or recover(v))
    found = robust_design(MOTOR, MOTOR_RANGE)
    assert found.rounds > 1 and found.design.filter.spectral_radius() < 1
    assert [v is found.design.variables for v in recovered] == [True]


def test_a_level_that_may_be_zero_is_told_by_name():
    with pytest.raises(InfeasibleError, match="cannot be told from zero"):
        design_filter(OSCILLATOR, periods=(0.05, 0.05))


def test_a_level_that_its_filter_does_not_have_is_an_error():
    h = OSCILLATOR_RANGE.middle
    level = riccati_level(OSCILLATOR, h).level
    for factor in (0.5, 2.0):
        wrong = GainBracket(factor * level, factor * level, 0.0)
        with (
            patch("replication.estimation.nonuniform.filters.periodic_gain", return_value=wrong),
            pytest.raises(SolverError, match="but its filter has the norm"),
        ):
            riccati_level(OSCILLATOR, h)


def test_a_new_period_meets_the_nearest_inner_one_halfway():
    periods = PeriodRange(1.0, 2.0)
    assert exchange.halfway([1.0, 1.2, 1.5, 2.0], 1.22, periods) == pytest.approx(1.21)
    assert exchange.halfway([1.0, 1.2, 1.5, 2.0], 1.35, periods) == 1.35
    # The ends of the range stay where they are.
    assert exchange.halfway([1.0, 2.0], 1.01, periods) == 1.01


def test_the_limit_of_smoothers_is_that_of_the_worst_period():
    """The sensor has noise of its own, and tells nothing of the disturbance at once."""
    plant = SampledPlant(OSCILLATOR.A, [[0, 0], [16, 0]], [[1, 0]], [[0, 0.1]], [[1, 0]])
    periods = PeriodRange(0.05, 0.5)
    _, facts = beside(plant, riccati_level(plant, 0.2, tolerance=1e-6).filter, periods, (0.0, 9.0), horizon=20)
    limits = [smoother_limit(plant, h) for h in periods.nodes(9)]
    assert min(limits) < max(limits) * (1 - 1e-5)
    [told] = [fact.value for fact in facts if fact.what == "limit of any smoother"]
    assert told == pytest.approx(max(limits), rel=1e-9)
    nothing = [zero_at_constant_periods(plant, [h]) for h in periods.nodes(2)]
    assert zero_at_constant_periods(plant, periods.nodes(2)) == max(nothing) > min(nothing) * (1 + 1e-3)


@pytest.mark.parametrize(
    ("A", "b", "noise", "periods", "goal", "advice"),
    [
        # At constant periods this level is above that of no sensor, over all sequences it is below.
        ([[0, 1], [-25.27, -1.005]], 5, 0.02, (0.01, 0.1), "robust", {160: "know the period"}),
        ([[0, 1], [-4, -0.4]], 1, 0.1, (0.3, 1.2), "nominal", {60: "open whether below", 200: "not below the level"}),
        ([[0, 1], [-4, -0.4]], 1, 50.0, (0.3, 0.3), "robust", {200: "% below the level"}),
    ],
)
def test_the_level_without_sensors_is_over_the_same_sequences(A, b, noise, periods, goal, advice):
    plant = SampledPlant(A, [[0, 0], [b, 0]], [[1, 0]], [[0, noise]], [[0, 1]])
    zero = analyse(plant, Filter([[0]], [[0]], [[0]]), periods=periods, leaves=4, horizon=60)
    for horizon, words in advice.items():
        result = design_filter(plant, periods=periods, goal=goal, leaves=4, horizon=horizon)
        told = result.fact("level without sensors")
        assert zero.bracket.lower <= told.value * (1 + 1e-9) and told.value == pytest.approx(zero.value, rel=1e-3)
        assert words in result.fact("advice").value


def test_a_solution_that_violates_a_period_is_no_answer_where_the_next_one_fails():
    first = design_for_periods(MOTOR, [0.05], solver=Solver.SDPA)
    with (
        patch.object(exchange, "design_for_periods", side_effect=[first, SolverError("lost")]),
        patch.object(exchange, "worst_periods", return_value=[(1.0, 0.07)]),
        pytest.raises(SolverError, match="lost"),
    ):
        robust_design(MOTOR, MOTOR_RANGE)


def test_sampling_periods_must_lie_in_the_range_of_the_level():
    result = design_filter(MOTOR, periods=(0.02, 0.09), horizon=20)
    for periods in ([0.05, 0.091], [0.019, 0.05]):
        with pytest.raises(InvalidInputError, match=r"must lie in \[0.02, 0.09\]"):
            simulate(result, periods)


@pytest.mark.parametrize(("design", "gain"), [(partial(design_filter, leaves=2), "B_f"), (design_stamped, "G_x")])
def test_units_of_the_states_change_neither_gain_nor_level(design, gain):
    tank = StampedPlant([[-1, 0], [1, -0.5]], [[1, 0], [0, 0]], [[0, 1]], [[0, 0.1]], [[1, 0]])
    plain = design(tank, periods=(0.1, 0.3), horizon=16)
    for units in ((1, 1e6), (1, 1e-6), (1e9, 1), (1e-4, 1e5)):
        other = design(tank.in_coordinates(np.diag(units)), periods=(0.1, 0.3), horizon=16)
        assert other.bracket.lower == pytest.approx(plain.bracket.lower, rel=1e-5)
        assert other.value == pytest.approx(plain.value, rel=1e-6)
        np.testing.assert_allclose(other.gains[gain] / np.array(units)[:, None], plain.gains[gain], rtol=1e-3)


def test_units_of_the_states_change_no_limit_of_filters_at_one_period():
    A, B = [[-0.02, 0.02, 0], [0.005, -0.008, 0.003], [0, 2, -6]], [[0.01, 0], [0, 0], [3, 0]]
    plant = SampledPlant(A, B, [[1, 0, 0]], [[0, 0.2]], [[0, 1, 0]])
    plain, moved = (riccati_level(one, 6.0).level for one in (plant, plant.in_coordinates(np.diag([1e-4, 1e5, 1e9]))))
    assert moved == pytest.approx(plain, rel=1e-8)


def test_norms_over_time_are_refused_where_only_part_of_a_design_would_follow_them():
    plant = DurationPlant(**vars(OSCILLATOR))
    calls = (lambda: design_filter(plant, periods=(0.1, 0.2)), lambda: design_stamped(plant, periods=(0.1, 0.2)))
    for call in (*calls, lambda: analyse(plant, Filter([[0.5]], [[1]], [[1]]), periods=(0.1, 0.2))):
        with pytest.raises(InvalidInputError, match="norms over the samples, got a DurationPlant; give a SampledPlant"):
            call()


def test_a_filter_that_hardly_settles_is_told_so():
    tank = SampledPlant([[-1, 0], [1, -0.5]], [[1, 0], [0, 0]], [[0, 1]], [[0, 0.1]], [[1, 0]])
    with pytest.raises(SolverError, match="a mode hardly settles"):
        analyse(tank, Filter([[1 - 1e-9, 0], [0, 0.3]], [[0.1], [0.2]], [[1, 1]]), periods=(0.1, 0.3))
