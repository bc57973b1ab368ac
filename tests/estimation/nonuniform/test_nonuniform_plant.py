import math

import control
import numpy as np
import pytest
import scipy.integrate
from hypothesis import given, settings
from sampled_cases import MOTOR, MOTOR_RANGE, OSCILLATOR, motor_filter, random_plant, stable_plants

from papers.mustafa.method import dense_design, floor_for_any_filter
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.nonuniform.bounds.guarantee import DEGREE, Enclosure, enclose, guaranteed_level
from replication.estimation.nonuniform.bounds.worst_case import repeated, sequence_gain, simulate_error, worst_sequence
from replication.estimation.nonuniform.filters import Filter, error_system, periodic_gain
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import design_for_periods, robust_design

EXACT = 1e-12


@pytest.mark.parametrize(("h_l", "h_u"), [(0.0, 1.0), (-0.1, 1.0), (2.0, 1.0), (0.1, float("inf")), (float("nan"), 1)])
def test_bad_ranges_are_refused(h_l, h_u):
    with pytest.raises(InvalidInputError, match="h_"):
        PeriodRange(h_l, h_u)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"A": [[0.1, 1], [0, -1]]}, "Hurwitz"),
        ({"A": [[0, 1], [-1, 0]]}, "Hurwitz"),
        ({"D": [[0.1, 0.2]]}, "D must have 1 columns"),
        ({"L": [[1, 0, 0]]}, "L must have 2 columns"),
        ({"B": [[1], [2], [3]]}, "B must have 2 rows"),
        ({"C": [[0, 0]]}, "not observable"),
        ({"A": [[-1, 0], [0, -2]]}, "not observable"),
        ({"B": [[np.nan], [1]]}, "finite"),
        ({"B": [[0], [1e300]]}, "other units"),
        ({"B": [[0], [1e-300]]}, "other units"),
    ],
)
def test_bad_plants_are_refused(change, message):
    good = {"A": [[0, 1], [-16, -4.8]], "B": [[0], [16]], "C": [[1, 0]], "D": [[0.1]], "L": [[1, 0]]}
    SampledPlant(**good)
    with pytest.raises(InvalidInputError, match=message):
        SampledPlant(**{**good, **change})


def test_filter_that_does_not_fit_or_is_unstable_is_refused():
    wrong = Filter(np.eye(2) / 2, np.ones((2, 2)), np.ones((1, 2)))
    with pytest.raises(InvalidInputError, match="B_f"):
        error_system(OSCILLATOR, wrong, 0.1)
    unstable = Filter([[1.01]], [[1.0]], [[1.0]])
    with pytest.raises(InfeasibleError, match="spectral radius"):
        guaranteed_level(OSCILLATOR, unstable, PeriodRange(0.01, 0.1))


def test_runs_of_no_period_are_refused():
    with pytest.raises(InvalidInputError, match="runs"):
        repeated(PeriodRange(0.01, 0.12), (0, 0), 10)


def test_statespace_in_and_out():
    system = control.ss(OSCILLATOR.A, OSCILLATOR.B, np.vstack([OSCILLATOR.C, OSCILLATOR.L]), [[0.1], [0]])
    assert np.array_equal(SampledPlant.from_statespace(system, 1).D, OSCILLATOR.D)
    with pytest.raises(InvalidInputError, match="continuous-time"):
        SampledPlant.from_statespace(control.ss(OSCILLATOR.A, OSCILLATOR.B, np.eye(2), 0, 0.1), 1)
    with pytest.raises(InvalidInputError, match="feedthrough"):
        SampledPlant.from_statespace(control.ss(OSCILLATOR.A, OSCILLATOR.B, np.eye(2), [[0], [1]]), 1)
    with pytest.raises(InvalidInputError, match="measured"):
        SampledPlant.from_statespace(system, 2)
    out = Filter([[0.5]], [[1.0]], [[2.0]]).to_statespace()
    assert out.isdtime(strict=True)
    assert out(1.0) == pytest.approx(4.0)


@given(plant=stable_plants())
@settings(max_examples=20)
def test_gamma_is_the_integral_of_phi(plant):
    h = 0.37
    Phi, Gamma = plant.discretise(h)
    integral, _ = scipy.integrate.quad_vec(lambda t: plant.discretise(h - t)[0] @ plant.B if t < h else plant.B, 0, h)
    assert np.linalg.norm(Gamma - integral) <= 1e-9 * (1 + np.linalg.norm(Gamma))
    # Half a period twice is a whole one.
    P2, G2 = plant.discretise(h / 2)
    assert np.linalg.norm(P2 @ P2 - Phi) <= 1e-11
    assert np.linalg.norm(P2 @ G2 + G2 - Gamma) <= 1e-10 * (1 + np.linalg.norm(Gamma))


@pytest.mark.parametrize("frame", [np.eye(3), np.diag([4.0, 1.0, 1.0]), np.array([[4, 1, 0], [0, 1, 0], [0, 0, 2.0]])])
@pytest.mark.parametrize("degree_of_zoom", [1, 8])
def test_every_period_lies_in_its_hull(degree_of_zoom, frame):
    """Barycentric check in the one direction where it is easy: support functions of random directions."""
    rng = np.random.default_rng(5)
    start, stop = np.array([0.02]), np.array([0.02 + 0.1 / degree_of_zoom])
    hull = enclose(OSCILLATOR, start, stop)
    remainder = hull.remainder(frame)[0]
    inverse = np.linalg.inv(frame)
    vertices = frame @ hull.vertices[0] @ inverse
    inside = frame @ OSCILLATOR.transitions(np.linspace(start[0], stop[0], 41)) @ inverse
    for _ in range(50):
        direction = rng.standard_normal(inside.shape[1:])
        direction /= np.linalg.norm(direction)
        reach = np.max(np.tensordot(vertices, direction, axes=2))
        assert np.max(np.tensordot(inside, direction, axes=2)) <= reach + remainder * np.sqrt(3) + EXACT


def test_state_coordinates_do_not_matter_to_the_gain():
    rng = np.random.default_rng(3)
    plant = random_plant(rng, 3)
    any_filter = Filter(0.4 * np.eye(2), rng.standard_normal((2, 1)), rng.standard_normal((1, 2)))
    moved = plant.in_coordinates(rng.standard_normal((3, 3)))
    periods = [0.2, 0.5, 0.3]
    here, there = periodic_gain(plant, any_filter, periods), periodic_gain(moved, any_filter, periods)
    assert there.value == pytest.approx(here.value, rel=1e-9)
    shifted = periodic_gain(plant, any_filter, periods[1:] + periods[:1])
    assert shifted.value == pytest.approx(here.value, rel=1e-9)
    assert MOTOR.order == 2


@pytest.mark.parametrize(
    "cuts", [(0.2,), (0.099,), (0.001,), (0.08, 0.03), (0.05, 0.05), (float("nan"),), (-1.0,), ("a",)]
)
def test_cuts_outside_the_range_or_out_of_order_are_refused(cuts):
    with pytest.raises(InvalidInputError, match="cuts"):
        guaranteed_level(MOTOR, motor_filter(), MOTOR_RANGE, cuts=cuts, max_leaves=4)


@pytest.mark.parametrize("max_leaves", [0, -3, 2.5, True])
def test_number_of_leaves_is_a_positive_integer(max_leaves):
    with pytest.raises(InvalidInputError, match="max_leaves"):
        guaranteed_level(MOTOR, motor_filter(), MOTOR_RANGE, max_leaves=max_leaves)


def test_one_cell_has_nothing_to_tell_apart():
    common = guaranteed_level(MOTOR, motor_filter(), MOTOR_RANGE, max_leaves=1)
    assert guaranteed_level(MOTOR, motor_filter(), MOTOR_RANGE, cuts=(), max_leaves=4).level == common.level


def test_remainder_of_a_reversed_piece_is_not_understated():
    forward, backward = (enclose(OSCILLATOR, np.array([a]), np.array([b])) for a, b in ((0.1, 0.2), (0.2, 0.1)))
    here, there = OSCILLATOR.transitions(np.array([0.1, 0.2]))
    share = [hull.remainder()[0] / np.linalg.norm(base, 2) for hull, base in ((forward, here), (backward, there))]
    assert share[1] == pytest.approx(share[0], rel=EXACT)


FITTING = Filter([[0.5]], [[0.1]], [[1.0]])
WRONG = Filter([[0.5]], [[0.1, 0.1]], [[1.0]])
SINGLE = np.full(20, 0.05)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sequence_gain(MOTOR, FITTING, -SINGLE), "positive"),
        (lambda: sequence_gain(MOTOR, FITTING, SINGLE[:1]), "two"),
        (lambda: sequence_gain(MOTOR, FITTING, []), "periods"),
        (lambda: sequence_gain(MOTOR, FITTING, [np.nan] * 9), "finite"),
        (lambda: sequence_gain(MOTOR, WRONG, SINGLE), "B_f"),
        (lambda: simulate_error(MOTOR, FITTING, SINGLE, np.zeros((4, 1))), "w must have shape"),
        (lambda: simulate_error(MOTOR, FITTING, SINGLE, np.zeros(20)), "w must have shape"),
        (lambda: worst_sequence(MOTOR, WRONG, MOTOR_RANGE, horizon=20), "B_f"),
        (lambda: worst_sequence(MOTOR, FITTING, MOTOR_RANGE, horizon=20.5), "horizon"),
        (lambda: periodic_gain(MOTOR, FITTING, []), "periods"),
        (lambda: Filter(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0))), "empty"),
        (lambda: Filter([[0.5]], np.zeros((1, 0)), [[1.0]]), "B_f must not be empty"),
        (lambda: robust_design(MOTOR, MOTOR_RANGE, max_rounds=0), "max_rounds"),
        (lambda: dense_design(MOTOR, MOTOR_RANGE, 0), "number of periods"),
        (lambda: floor_for_any_filter(MOTOR, MOTOR_RANGE, 0), "nodes"),
        (lambda: design_for_periods(MOTOR, []), "periods"),
        (lambda: design_for_periods(MOTOR, 0.05), "periods"),
        (lambda: design_for_periods(MOTOR, [1.0, -0.5]), "positive"),
        (lambda: SampledPlant(MOTOR.A, MOTOR.B, MOTOR.C, MOTOR.D, [[0, 0]]), "L must not be zero"),
        (lambda: SampledPlant(MOTOR.A, [[0], [0]], MOTOR.C, MOTOR.D, MOTOR.L), "B must not be zero"),
        (lambda: MOTOR.in_coordinates(np.zeros((2, 2))), "invertible"),
        (lambda: MOTOR.in_coordinates(np.eye(3)), "T must have"),
    ],
)
def test_bad_input_is_named_and_gives_no_number(call, message):
    with pytest.raises(InvalidInputError, match=message):
        call()


def test_numbers_in_text_make_a_range_of_numbers():
    assert PeriodRange("0.1", 0.2) == PeriodRange(0.1, 0.2)


def test_unstable_filter_has_no_worst_sequence():
    with pytest.raises(InfeasibleError, match="spectral radius"):
        worst_sequence(MOTOR, Filter([[1.2]], [[0.1]], [[1.0]]), MOTOR_RANGE, horizon=100)


@pytest.mark.parametrize("size", [0.5, 2.0, 6.0])
def test_what_a_hull_misses_is_no_more_than_the_bound_also_where_modes_grow(size):
    one = np.ones((1, 1))
    hull = Enclosure(one[None], one, one[None], np.array([1.0]), size * one)
    missed = math.exp(size) - sum(size**k / math.factorial(k) for k in range(DEGREE + 1))
    assert missed <= hull.remainder()[0] <= missed * (DEGREE + 2) * math.exp(size)
