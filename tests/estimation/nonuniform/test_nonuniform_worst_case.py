"""Sampled plants and filters that are refused; hulls; what a storage function proves: never less than is attained."""

import math
from functools import partial

import control
import numpy as np
import pytest
from sampled_cases import (
    MOTOR,
    MOTOR_RANGE,
    OSCILLATOR,
    OSCILLATOR_RANGE,
    motor_filter,
    oscillator_filter,
    random_plant,
    some_filter,
)

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.nonuniform import guarantee
from replication.estimation.nonuniform.filters import Filter, periodic_gain
from replication.estimation.nonuniform.guarantee import DEGREE, Enclosure, certify, enclose, guaranteed_level
from replication.estimation.nonuniform.path_lyapunov import ContextTree, ErrorSystem
from replication.estimation.nonuniform.plant import DurationPlant, PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import design_for_periods, robust_design
from replication.estimation.nonuniform.stamped.design import LOOSE, StampedFilter, StampedPlant, proved_design
from replication.estimation.nonuniform.worst_case import (
    error_ratio,
    repeated,
    sequence_gain,
    simulate_error,
    worst_sequence,
)

EXACT = 1e-12
BY_DURATION = DurationPlant(**vars(OSCILLATOR))


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


def test_one_cell_has_nothing_to_tell_apart():
    common = guaranteed_level(MOTOR, motor_filter(), MOTOR_RANGE, max_leaves=1)
    assert guaranteed_level(MOTOR, motor_filter(), MOTOR_RANGE, cuts=(), max_leaves=4).level == common.level


FITTING = Filter([[0.5]], [[0.1]], [[1.0]])
WRONG = Filter([[0.5]], [[0.1, 0.1]], [[1.0]])
SINGLE = np.full(20, 0.05)
GOOD = {"A": [[0, 1], [-16, -4.8]], "B": [[0], [16]], "C": [[1, 0]], "D": [[0.1]], "L": [[1, 0]]}
CUTS = ((0.2,), (0.099,), (0.001,), (0.08, 0.03), (0.05, 0.05), (float("nan"),), (-1.0,), ("a",))
"""Outside the range or out of order."""
levelled = partial(guaranteed_level, MOTOR, FITTING, MOTOR_RANGE)
OTHER_PLANTS = [
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
    ({"L": [[0, 0]]}, "L must not be zero"),
    ({"B": [[0], [0]]}, "B must not be zero"),
]
RANGES = ((0.0, 1.0), (-0.1, 1.0), (2.0, 1.0), (0.1, float("inf")), (float("nan"), 1))
DIRECT = control.ss(OSCILLATOR.A, OSCILLATOR.B, np.eye(2), [[0], [1]])


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
        (lambda: repeated(MOTOR_RANGE, (0, 0), 10), "runs"),
        *((partial(levelled, cuts=cuts, max_leaves=4), "cuts") for cuts in CUTS),
        *((partial(levelled, max_leaves=leaves), "max_leaves") for leaves in (0, -3, 2.5, True)),
        (lambda: Filter(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0))), "empty"),
        (lambda: Filter([[0.5]], np.zeros((1, 0)), [[1.0]]), "B_f must not be empty"),
        (lambda: robust_design(MOTOR, MOTOR_RANGE, max_rounds=0), "max_rounds"),
        (lambda: MOTOR_RANGE.nodes(0), "number of periods"),
        (lambda: design_for_periods(MOTOR, []), "periods"),
        (lambda: design_for_periods(MOTOR, 0.05), "periods"),
        (lambda: design_for_periods(MOTOR, [1.0, -0.5]), "positive"),
        *((partial(SampledPlant, **{**GOOD, **change}), message) for change, message in OTHER_PLANTS),
        *((partial(PeriodRange, *ends), "h_") for ends in RANGES),
        (lambda: SampledPlant.from_statespace(DIRECT, 1), "feedthrough"),
        (lambda: MOTOR.in_coordinates(np.zeros((2, 2))), "invertible"),
        (lambda: MOTOR.in_coordinates(np.eye(3)), "T must have"),
    ],
)
def test_bad_input_is_named_and_gives_no_number(call, message):
    with pytest.raises(InvalidInputError, match=message):
        call()


def test_a_filter_that_is_unstable_has_no_gain():
    for bound in (guaranteed_level, partial(worst_sequence, horizon=100)):
        with pytest.raises(InfeasibleError, match="spectral radius"):
            bound(OSCILLATOR, Filter([[1.01]], [[1.0]], [[1.0]]), PeriodRange(0.01, 0.1))


@pytest.mark.parametrize("size", [0.5, 2.0, 6.0])
def test_what_a_hull_misses_is_no_more_than_the_bound_also_where_modes_grow(size):
    one = np.ones((1, 1))
    hull = Enclosure(one[None], one, one[None], np.array([1.0]), size * one)
    missed = math.exp(size) - sum(size**k / math.factorial(k) for k in range(DEGREE + 1))
    assert missed <= hull.remainder()[0] <= missed * (DEGREE + 2) * math.exp(size)


# Levels for every sequence


@pytest.mark.parametrize("length", [2, 31, 32, 40, 70])
def test_gain_of_a_sequence_is_the_largest_singular_value(length):
    rng = np.random.default_rng(4)
    periods = rng.uniform(OSCILLATOR_RANGE.h_l, OSCILLATOR_RANGE.h_u, length)
    subject = oscillator_filter()
    columns = [simulate_error(OSCILLATOR, subject, periods, u[:, None])[1:, 0] for u in np.eye(length)]
    for plant in (OSCILLATOR, BY_DURATION):
        gain, w = sequence_gain(plant, subject, periods)
        weights = np.sqrt(periods) if plant is BY_DURATION else np.ones(length)
        whole = np.append(weights[1:], weights[-1])[:, None] * np.array(columns).T / weights
        assert gain == pytest.approx(np.linalg.norm(whole, 2), rel=1e-10)
        e = simulate_error(OSCILLATOR, subject, periods, w)
        assert error_ratio(plant, periods, w, e) == pytest.approx(gain, rel=1e-9)
        together = subject.errors(OSCILLATOR, np.array([periods[::-1], periods]), w)
        np.testing.assert_allclose(together[1], e, atol=1e-14)
        assert np.abs(together[0] - e).max() > 0.1 * np.abs(e).max()


@pytest.mark.parametrize(
    ("plant", "periods", "make"),
    [(OSCILLATOR, OSCILLATOR_RANGE, oscillator_filter), (MOTOR, MOTOR_RANGE, motor_filter)],
)
def test_brackets_nest_when_more_is_known(plant, periods, make):
    subject = make()
    guarantee = guaranteed_level(plant, subject, periods, max_leaves=5)
    assert guarantee.level < guaranteed_level(plant, subject, periods, max_leaves=1).level
    short, long = (worst_sequence(plant, subject, periods, horizon=k).level for k in (40, 120))
    assert short < long < guarantee.level
    rng = np.random.default_rng(1)
    for _ in range(5):
        word = rng.uniform(periods.h_l, periods.h_u, 12).tolist()
        assert periodic_gain(plant, subject, word).value < guarantee.level


def test_robust_design_keeps_its_promise_for_every_sequence():
    design = robust_design(OSCILLATOR, OSCILLATOR_RANGE).design
    guarantee = guaranteed_level(OSCILLATOR, design.filter, OSCILLATOR_RANGE, max_leaves=1)
    assert guarantee.level == pytest.approx(design.level, rel=2e-3)


UNITS = 2e-3
"""Certificates of the same system in other units agree so far: each is loose by at most half of it."""


@pytest.mark.parametrize("unit", [1e-12, 1e-6, 1e6])
def test_units_do_not_matter_to_the_guarantee(unit):
    p, f = MOTOR, motor_filter()
    level = guaranteed_level(p, f, MOTOR_RANGE, max_leaves=2).level
    estimated = SampledPlant(p.A, p.B, p.C, p.D, p.L * unit), Filter(f.A, f.B, f.C * unit)
    disturbed = SampledPlant(p.A, p.B * unit, p.C, p.D * unit, p.L), f
    for plant, subject in (estimated, disturbed):
        moved = guaranteed_level(plant, subject, MOTOR_RANGE, max_leaves=2).level
        assert moved == pytest.approx(unit * level, rel=UNITS, abs=0)


@pytest.mark.parametrize("unit", [1e-12, 1e6])
def test_units_do_not_matter_to_the_robust_design(unit):
    for p, periods in ((MOTOR, MOTOR_RANGE), (OSCILLATOR, OSCILLATOR_RANGE)):
        moved = robust_design(SampledPlant(p.A, p.B * unit, p.C, p.D * unit, p.L), periods).design.level
        assert moved == pytest.approx(unit * robust_design(p, periods).design.level, rel=1e-6, abs=0)


def test_wide_ranges_give_a_level_or_a_clear_error():
    """From 20 s on the plant has settled between samples: a longer period changes nothing."""
    subject = motor_filter()
    levels = [guaranteed_level(MOTOR, subject, PeriodRange(0.001, h_u), max_leaves=1).level for h_u in (1, 20, 40)]
    assert levels[0] < levels[1] == pytest.approx(levels[2], rel=UNITS)
    with pytest.raises(InvalidInputError, match="narrow the range"):
        guaranteed_level(MOTOR, subject, PeriodRange(0.01, 1000.0), max_leaves=1)


@pytest.mark.parametrize(("n", "seed"), [(5, 1), (5, 2), pytest.param(8, 0, marks=pytest.mark.slow)])
def test_many_states_get_a_certificate(n, seed):
    """The Lyapunov functions are badly conditioned in the plant's coordinates, where the solver ends early."""
    plant, periods = random_plant(np.random.default_rng(seed), n, 1), PeriodRange(0.1, 2.0)
    subject = some_filter(plant, periods.middle)
    found = guaranteed_level(plant, subject, periods, max_leaves=1)
    assert found.storage.shape == (1, 2 * n, 2 * n)
    constant = max(periodic_gain(plant, subject, [float(h)]).value for h in periods.nodes(9))
    assert constant < found.level < 10 * constant


def test_certificate_that_is_not_found_names_the_level_of_the_samples(monkeypatch):
    monkeypatch.setattr(guarantee, "ROUNDS", 1)
    monkeypatch.setattr(guarantee, "ROUNDINGS", (0.0,))
    plant, periods = random_plant(np.random.default_rng(2), 8, 1), PeriodRange(0.1, 2.0)
    with pytest.raises(SolverError, match=r"level \d.* periods.*narrow the range"):
        guaranteed_level(plant, some_filter(plant, periods.middle), periods, max_leaves=1)


def test_brackets_nest_when_the_partition_is_refined():
    """Each partition halves the cells of the one before; none knows more than the next period's cell."""
    subject = oscillator_filter()
    levels = []
    for cells in (2, 4, 8):
        cuts = OSCILLATOR_RANGE.nodes(cells + 1)[1:-1].tolist()
        levels.append(guaranteed_level(OSCILLATOR, subject, OSCILLATOR_RANGE, cuts=cuts, max_leaves=cells))
    assert [found.leaves for found in levels] == [2, 4, 8]
    assert levels[0].level > levels[1].level > levels[2].level


def test_a_search_of_more_runs_finds_worse_sequences():
    """The pattern of four runs beats every pattern of two whose lengths differ by a few samples from the best."""
    subject = oscillator_filter()
    found = worst_sequence(OSCILLATOR, subject, OSCILLATOR_RANGE, horizon=300)
    assert len(found.runs) > 2
    low, high = OSCILLATOR_RANGE.h_l, OSCILLATOR_RANGE.h_u
    assert repeated(OSCILLATOR_RANGE, (1, 2), 4).tolist() == [high, low, low, high]
    rivals = (repeated(OSCILLATOR_RANGE, (burst, rest), 300) for burst in (3, 4, 5) for rest in (46, 50, 54))
    assert found.level > max(sequence_gain(OSCILLATOR, subject, rival)[0] for rival in rivals)


@pytest.mark.parametrize("h", [0.1, 0.4])
def test_the_level_of_a_narrow_range_is_hardly_above_that_of_its_period(h: float) -> None:
    design, proof = proved_design(OSCILLATOR, PeriodRange(h, h * (1 + 1e-6)))
    attained = periodic_gain(OSCILLATOR, design.filter, [h]).lower
    assert attained <= proof.level <= design.level * (1 + LOOSE) * (1 + 1e-6)


def test_a_storage_that_is_negative_proves_nothing() -> None:
    """An error that grows: P = -4 meets the inequality of a level all the same."""
    plant = StampedPlant([[0.5]], [[1, 0]], [[1]], [[0, 1]], [[1]])
    system = ErrorSystem(plant, StampedFilter(np.zeros((1, 3, 1))), np.eye(1), 1.0, np.ones(1))
    found = certify(system, (0.9, 1.0), ContextTree.one_step(1), np.full((1, 1, 1), -4.0), 100.0)
    assert 0.0 < found.needs[0] < 100.0
    assert found.level == np.inf
