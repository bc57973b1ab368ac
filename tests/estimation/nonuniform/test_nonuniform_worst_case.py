"""Sampled plants and filters that are refused; hulls; what a storage function proves: never less than is attained."""

from __future__ import annotations

import math
from functools import partial

import control
import numpy as np
import pytest
import scipy.integrate
from hypothesis import given, settings
from sampled_cases import (
    MOTOR,
    MOTOR_RANGE,
    OSCILLATOR,
    OSCILLATOR_RANGE,
    motor_filter,
    oscillator_filter,
    random_plant,
    some_filter,
    stable_plants,
)

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.nonuniform.bounds import guarantee
from replication.estimation.nonuniform.bounds import worst_case as sequences
from replication.estimation.nonuniform.bounds.guarantee import DEGREE, Enclosure, certify, enclose, guaranteed_level
from replication.estimation.nonuniform.bounds.path_lyapunov import ContextTree, ErrorSystem
from replication.estimation.nonuniform.bounds.worst_case import (
    error_ratio,
    repeated,
    sequence_gain,
    sequence_gains,
    simulate_error,
    worst_sequence,
)
from replication.estimation.nonuniform.filters import Filter, error_system, periodic_gain
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import design_for_periods, robust_design
from replication.estimation.nonuniform.stamped.design import LOOSE, StampedFilter, StampedPlant, proved_design

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
    for bound in (guaranteed_level, partial(worst_sequence, horizon=100)):
        with pytest.raises(InfeasibleError, match="spectral radius"):
            bound(OSCILLATOR, unstable, PeriodRange(0.01, 0.1))


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
CUTS = ((0.2,), (0.099,), (0.001,), (0.08, 0.03), (0.05, 0.05), (float("nan"),), (-1.0,), ("a",))
"""Outside the range or out of order."""
levelled = partial(guaranteed_level, MOTOR, FITTING, MOTOR_RANGE)


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


@pytest.mark.parametrize("size", [0.5, 2.0, 6.0])
def test_what_a_hull_misses_is_no_more_than_the_bound_also_where_modes_grow(size):
    one = np.ones((1, 1))
    hull = Enclosure(one[None], one, one[None], np.array([1.0]), size * one)
    missed = math.exp(size) - sum(size**k / math.factorial(k) for k in range(DEGREE + 1))
    assert missed <= hull.remainder()[0] <= missed * (DEGREE + 2) * math.exp(size)


# Levels for every sequence


def test_trees_stay_complete_and_closed():
    rng = np.random.default_rng(0)
    tree = ContextTree.one_step(3)
    for _ in range(8):
        tree = tree.split([tree.leaves[i] for i in rng.choice(len(tree.leaves), 2, replace=False)])
        known = set(tree.leaves)
        for _ in range(100):
            word = tuple(rng.integers(0, 3, 30).tolist())
            assert sum(word[:k] in known for k in range(1, 31)) == 1
        assert len(tree.transitions()) == 3 * len(tree.leaves)
        for before, letter, after in tree.transitions():
            longer = (letter, *tree.leaves[after])
            assert longer[: len(tree.leaves[before])] == tree.leaves[before]


def test_gain_of_a_sequence_is_the_largest_singular_value():
    rng = np.random.default_rng(4)
    periods = rng.uniform(OSCILLATOR_RANGE.h_l, OSCILLATOR_RANGE.h_u, 40)
    subject = oscillator_filter()
    for per_duration in (False, True):
        gain, w = sequence_gain(OSCILLATOR, subject, periods, per_duration=per_duration)
        weights = np.sqrt(periods) if per_duration else np.ones(40)
        columns = [simulate_error(OSCILLATOR, subject, periods, u[:, None])[1:, 0] for u in np.eye(40)]
        whole = np.append(weights[1:], weights[-1])[:, None] * np.array(columns).T / weights
        assert gain == pytest.approx(np.linalg.norm(whole, 2), rel=1e-10)
        e = simulate_error(OSCILLATOR, subject, periods, w)
        assert error_ratio(periods, w, e, per_duration=per_duration) == pytest.approx(gain, rel=1e-9)
        together = subject.errors(OSCILLATOR, np.array([periods[::-1], periods]), w)
        np.testing.assert_allclose(together[1], e, atol=1e-14)
        assert np.abs(together[0] - e).max() > 0.1 * np.abs(e).max()


@pytest.mark.parametrize("looks", [sequences.LOOKS, (2,)], ids=["all settle", "one by one"])
@pytest.mark.parametrize("per_duration", [False, True])
@pytest.mark.parametrize("length", [2, 31, 32, 70])
def test_sequences_together_have_the_gains_that_they_have_alone(length, per_duration, looks, monkeypatch):
    monkeypatch.setattr(sequences, "LOOKS", looks)
    monkeypatch.setattr(sequences, "TOGETHER", 3 * length)
    rng = np.random.default_rng(length)
    tried = list(rng.uniform(OSCILLATOR_RANGE.h_l, OSCILLATOR_RANGE.h_u, (7, length)))
    alone = [sequence_gain(OSCILLATOR, oscillator_filter(), one, per_duration=per_duration)[0] for one in tried]
    found = sequence_gains(OSCILLATOR, oscillator_filter(), tried, per_duration=per_duration)
    assert found == pytest.approx(alone, rel=1e-6)


def test_a_single_period_gives_the_textbook_norm():
    h = 0.06
    subject = oscillator_filter()
    norm = periodic_gain(OSCILLATOR, subject, [h]).value
    assert guaranteed_level(OSCILLATOR, subject, PeriodRange(h, h)).level == pytest.approx(norm, rel=2e-4)
    assert worst_sequence(OSCILLATOR, subject, PeriodRange(h, h), horizon=900).level == pytest.approx(norm, rel=2e-3)


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


def test_a_certificate_stands_without_its_solver_and_falls_with_its_matrices():
    subject = oscillator_filter()
    guarantee = guaranteed_level(OSCILLATOR, subject, OSCILLATOR_RANGE, max_leaves=2)
    again = certify(guarantee.system, guarantee.edges, guarantee.tree, guarantee.P, guarantee.level)
    assert again.level <= guarantee.level * (1 + 1e-3)
    spoiled = certify(guarantee.system, guarantee.edges, guarantee.tree, 0.9 * guarantee.P, guarantee.level)
    assert spoiled.level == np.inf or spoiled.level > guarantee.level


@pytest.mark.slow
@given(plant=stable_plants())
@settings(max_examples=6)
def test_guarantee_is_above_every_attack_on_generated_plants(plant):
    periods = PeriodRange(0.2, 0.5)
    subject = some_filter(plant, periods.middle)
    guarantee = guaranteed_level(plant, subject, periods, max_leaves=3)
    attack = worst_sequence(plant, subject, periods, horizon=60)
    assert attack.level <= guarantee.level
    assert attack.level >= 0.99 * max(sequence_gain(plant, subject, np.full(60, h))[0] for h in (0.2, 0.5))


def test_robust_design_keeps_its_promise_for_every_sequence():
    design = robust_design(OSCILLATOR, OSCILLATOR_RANGE).design
    guarantee = guaranteed_level(OSCILLATOR, design.filter, OSCILLATOR_RANGE, max_leaves=1)
    assert guarantee.level == pytest.approx(design.level, rel=2e-3)


def test_duration_weighted_gain_of_a_constant_period_is_the_plain_one():
    subject = motor_filter()
    plain, weighted = (periodic_gain(MOTOR, subject, [0.05] * 2, per_duration=flag).value for flag in (False, True))
    assert weighted == pytest.approx(plain, rel=1e-9)


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
    assert found.P.shape == (1, 2 * n, 2 * n)
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
    rivals = (repeated(OSCILLATOR_RANGE, (burst, rest), 300) for burst in (3, 4, 5) for rest in (46, 50, 54))
    assert found.level > max(sequence_gain(OSCILLATOR, subject, rival)[0] for rival in rivals)


@pytest.mark.parametrize("h", [0.1, 0.4])
def test_the_level_of_a_narrow_range_is_hardly_above_that_of_its_period(h: float) -> None:
    design, proof = proved_design(OSCILLATOR, PeriodRange(h, h * (1 + 1e-6)))
    attained = periodic_gain(OSCILLATOR, design.filter.at(h), [h]).lower
    assert attained <= proof.level <= design.level * (1 + LOOSE) * (1 + 1e-6)


def test_a_storage_that_is_negative_proves_nothing() -> None:
    """An error that grows: P = -4 meets the inequality of a level all the same."""
    plant = StampedPlant([[0.5]], [[1, 0]], [[1]], [[0, 1]], [[1]])
    system = ErrorSystem(plant, StampedFilter(np.zeros((1, 3, 1))), np.eye(1), 1.0, False, np.ones(1))
    found = certify(system, (0.9, 1.0), ContextTree.one_step(1), np.full((1, 1, 1), -4.0), 100.0)
    assert 0.0 < found.needs[0] < 100.0
    assert found.level == np.inf
