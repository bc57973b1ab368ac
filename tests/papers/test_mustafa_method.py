"""What serves the nonuniform-sampling paper alone: (10) and (13), Algorithm 1, the small-gain intervals, stability."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from papers.mustafa import certificates
from papers.mustafa.experiments.identities import random_case
from papers.mustafa.experiments.levels import problem
from papers.mustafa.method import (
    AS_PRINTED,
    CORRECT,
    End,
    Step4,
    UpperEnd,
    build_grid,
    covered_interval,
    delta_block,
    lmi13,
    modal_transform,
    printed_design,
    robust_lmi_design,
    small_gain_alpha,
    stability,
)
from papers.mustafa.printed import example
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.nonuniform.filters import Filter, error_system, periodic_gain
from replication.estimation.nonuniform.nominal import closed_form
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import robust_design, variable_basis
from replication.verify.run import check

OSCILLATOR, OSCILLATOR_RANGE = problem(**example(1))
MOTOR, MOTOR_RANGE = problem(**example(2))
EXACT = 1e-12
ROUTES = 1e-8


@st.composite
def stable_plants(draw):
    """Random stable plants of order 1 to 3 with two disturbances."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return random_case(rng, draw(st.integers(1, 3)), 2, 1, 1)[0]


def test_the_printed_inequality_gives_the_nominal_optimum():
    h = OSCILLATOR_RANGE.middle
    formula = closed_form(OSCILLATOR, h)
    design = printed_design(OSCILLATOR, [h])
    assert design.level == pytest.approx(formula, rel=ROUTES)
    assert periodic_gain(OSCILLATOR, design.filter, [h]).value == pytest.approx(formula, rel=ROUTES)


def test_cell_that_breaks_the_small_gain_condition_is_named_before_the_solver():
    with pytest.raises(InfeasibleError, match="use more cells"):
        robust_lmi_design(OSCILLATOR, PeriodRange(0.01, 0.12), 1)


def test_an_unstable_filter_is_told_from_a_stable_one():
    assert not stability(OSCILLATOR, Filter([[1.01]], [[1.0]], [[1.0]])).stable
    assert stability(OSCILLATOR, Filter([[0.99]], [[1.0]], [[1.0]])).stable


def test_bad_input_is_named_and_gives_no_number():
    with pytest.raises(InvalidInputError, match="B_f"):
        stability(MOTOR, Filter([[0.5]], [[0.1, 0.1]], [[1.0]]))
    with pytest.raises(InvalidInputError, match="periods"):
        printed_design(MOTOR, [])


def test_lmi_13_is_10_bordered_by_the_uncertainty_channel():
    """Eliminating xi = Delta eta with the multiplier gives (10) at every period of the cell, up to what is lost."""
    design = robust_lmi_design(OSCILLATOR, OSCILLATOR_RANGE, 8)
    for h in OSCILLATOR_RANGE.nodes(25):
        gain = periodic_gain(OSCILLATOR, design.filter, [float(h)]).value
        assert gain <= design.level * (1 + 1e-6)
    rng = np.random.default_rng(0)
    plant, _ = random_case(rng, 2, 1, 1, 1)
    frame = modal_transform(plant.A)
    basis = variable_basis(plant)
    Phi, Gamma = plant.discretise(0.3)
    whole = lmi13(plant, frame, Phi, Gamma, 0.1, basis, np.zeros(len(basis.delta)))
    assert whole.shape[-1] == 6 * 2 + 1 + 1
    assert np.array_equal(whole, np.swapaxes(whole, 1, 2))


def test_robust_lmi_design_improves_with_more_cells_and_never_beats_the_common_optimum():
    levels = [robust_lmi_design(OSCILLATOR, OSCILLATOR_RANGE, cells).level for cells in (4, 8, 16)]
    assert levels[0] > levels[1] > levels[2]
    assert levels[2] > robust_design(OSCILLATOR, OSCILLATOR_RANGE).design.level


def test_delta_block_of_both_signs():
    for theta in (-0.3, 0.2):
        whole = delta_block(MOTOR, theta)
        Phi = np.eye(2) + MOTOR.A @ whole
        forward, _ = MOTOR.discretise(abs(theta))
        assert np.allclose(Phi if theta > 0 else np.linalg.inv(Phi), forward, atol=1e-12)


@pytest.mark.parametrize(("plant", "periods"), [(OSCILLATOR, OSCILLATOR_RANGE), (MOTOR, MOTOR_RANGE)])
def test_algorithm_1_literal_stalls_and_correct_covers(plant, periods):
    for reading in (*AS_PRINTED[Step4.SET_MINUS], *AS_PRINTED[Step4.CUT]):
        assert build_grid(plant, periods, reading).end is End.STALLED
    assert all(build_grid(plant, periods, one, limit=9).end is not End.COVERED for one in AS_PRINTED[Step4.UNCUT])
    grid = build_grid(plant, periods, CORRECT)
    assert grid.end is End.COVERED
    reached = periods.h_l
    for interval in grid.intervals:
        assert interval.lower < reached + 1e-15
        reached = max(reached, interval.upper)
    assert reached > periods.h_u
    # Step 1 comes before step 3: a grid of N_0 elements ends the run even if it covers.
    for limit in (1, len(grid.periods)):
        assert build_grid(plant, periods, CORRECT, limit=limit).end is End.LIMIT
    assert build_grid(plant, periods, CORRECT, limit=len(grid.periods) + 1).end is End.COVERED


@given(plant=stable_plants())
@settings(max_examples=20)
def test_lemma_2_reconfiguration(plant):
    h, theta = 0.5, -0.2
    Phi, Gamma = plant.discretise(h)
    moved_Phi, moved_Gamma = plant.discretise(h + theta)
    Delta = delta_block(plant, theta)
    size = 1 + np.linalg.norm(Delta) * (np.linalg.norm(plant.A) + np.linalg.norm(plant.B))
    assert np.linalg.norm(Phi + Delta @ plant.A @ Phi - moved_Phi) <= 1e-11 * size
    assert np.linalg.norm(Gamma + Delta @ (plant.A @ Gamma + plant.B) - moved_Gamma) <= 1e-11 * size


def test_alpha_is_that_of_the_whole_error_system_whatever_the_filter():
    rng = np.random.default_rng(1)
    alpha = small_gain_alpha(OSCILLATOR, 0.06)
    for _ in range(3):
        any_filter = Filter(0.3 * rng.standard_normal((2, 2)), rng.standard_normal((2, 1)), rng.standard_normal((1, 2)))
        stage = error_system(OSCILLATOR, any_filter, 0.06)
        Phi, _ = OSCILLATOR.discretise(0.06)
        seen = np.hstack([OSCILLATOR.A @ Phi, np.zeros((2, 2))])
        angles = np.linspace(0, np.pi, 2001)
        gains = [
            np.linalg.norm(seen @ np.linalg.solve(np.exp(1j * t) * np.eye(4) - stage.A, np.eye(4, 2)), 2)
            for t in angles
        ]
        assert max(gains) <= alpha * (1 + EXACT)
        assert max(gains) >= alpha * (1 - 1e-5)


def test_covered_interval_is_where_the_bound_of_lemma_3_reaches_one():
    h, gain = 1.0, 3.0
    for A in ([[-2.0, 1.0], [0.0, -1.0]], [[-2.0, 5.0], [0.0, -1.0]]):
        plant = SampledPlant(A, [[1], [1]], [[1, 1]], [[1]], [[1, 0]])
        interval = covered_interval(plant, h, gain, UpperEnd.CORRECTED)
        for end, sign in ((interval.lower, -1), (interval.upper, 1)):
            mu = np.linalg.eigvalsh((sign * plant.A + sign * plant.A.T) / 2)[-1]
            assert gain * np.expm1(mu * abs(end - h)) / mu == pytest.approx(1.0, rel=EXACT)
    slow = SampledPlant([[-4.0]], [[1]], [[1]], [[1]], [[1]])
    assert covered_interval(slow, h, gain).upper == np.inf


def test_brackets_of_the_small_gain_hold_for_three_states() -> None:
    A = [[0, 1, 0], [-4, -1, 2], [0, 0, -3]]
    B, L = [[0, 0], [1, 0], [0, 1]], [[0, 1, 0], [1, 0, 1]]
    system = SampledPlant(A, B, [[1, 0, 0]], [[0.1, 0.2]], L)
    alpha, made = certificates._bracket(system, PeriodRange(1 / 20, np.pi / 30).middle, 1e-6)
    assert Fraction(made["lower"]) < alpha < Fraction(made["upper"]) < Fraction(made["lower"]) * Fraction("1.000003")


@pytest.mark.parametrize("name", ["nominal-1-upper", "nominal-2-lower", "printed-filter-lower", "grid-2", "stall-1"])
def test_theorems_of_the_paper_are_made_again(name: str) -> None:
    theorem = check(certificates.make(name))
    assert theorem.sentence
