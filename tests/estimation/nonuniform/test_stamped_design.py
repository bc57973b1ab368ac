"""The filter scheduled over the known period: its levels against the robust filter, Riccati, simulation, no sensor."""

import importlib
import warnings
from functools import cache
from unittest.mock import patch

import numpy as np
import pytest
import scipy.linalg
import threadpoolctl
from hypothesis import given, settings
from sampled_cases import MOTOR, MOTOR_RANGE, OSCILLATOR, OSCILLATOR_RANGE, random_plant, some_filter, stable_plants

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation import nonuniform
from replication.estimation.nonuniform import result as stamped_module
from replication.estimation.nonuniform import worst_case as bracket_module
from replication.estimation.nonuniform.facade import design_stamped
from replication.estimation.nonuniform.filters import periodic_gain, riccati_filter, riccati_level
from replication.estimation.nonuniform.guarantee import guaranteed_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import robust_design
from replication.estimation.nonuniform.stamped import design as proof_module
from replication.estimation.nonuniform.stamped.design import (
    LOOSE,
    StampedFilter,
    StampedPlant,
    kalman_filter,
    prove,
    proved_design,
    stamped_design,
)
from replication.estimation.nonuniform.worst_case import (
    floor_of_any_filter,
    sequence_gain,
    simulate_error,
    smoother_limit,
    worst_sequence,
    zero_at_constant_periods,
)

OMEGA = 2 * np.pi * 0.8
SWING = SampledPlant([[0, 1], [-(OMEGA**2), -0.6]], [[0, 0], [OMEGA**2, 0]], [[1, 0]], [[0, 0.1]], [[1, 0]])
"""An oscillator of 0.8 Hz, hardly damped, sampled every 10 to 100 ms."""
SWING_RANGE = PeriodRange(0.01, 0.1)
UNSTABLE = StampedPlant([[1.5, 2], [-1, 0.2]], [[1, 0], [1, 0]], [[1, 0]], [[0, 0.1]], [[0, 1], [1, 1]])
INTEGRATORS = StampedPlant([[0, 1], [0, 0]], [[0, 0], [1, 0]], [[1, 0]], [[0, 0.1]], np.eye(2))
RANGE = PeriodRange(0.05, 0.4)
LEVELS = 1e-5
EFFORT = {"leaves": 4, "horizon": 60}
SHORT = {"horizon": 20}


@cache
def unstable():
    """The result for an unstable plant, with a short bound from below."""
    return design_stamped(UNSTABLE, periods=RANGE, horizon=20)


@cache
def swing():
    """The design alone for the oscillator."""
    return stamped_design(SWING, SWING_RANGE)


@pytest.mark.parametrize(
    ("plant", "periods", "share"),
    [(OSCILLATOR, OSCILLATOR_RANGE, 1.0), (MOTOR, MOTOR_RANGE, 1.0), (SWING, SWING_RANGE, 0.25)],
)
def test_knowing_the_period_is_worth_what_it_should(plant, periods, share):
    """Its guaranteed level is at most a share of what the robust filter attains."""
    stamped = design_stamped(plant, periods=periods, **SHORT)
    robust = nonuniform.design(plant, periods=periods, **EFFORT)
    assert stamped.value <= share * robust.bracket.lower
    assert stamped.value <= stamped.fact("level without sensors").value
    assert stamped.fact("least level of any filter").value <= stamped.bracket.upper
    assert 0 < stamped.bracket.lower <= stamped.bracket.upper


@given(plant=stable_plants())
@settings(max_examples=3)
def test_the_level_is_never_above_the_robust_one_and_holds_for_sequences(plant):
    periods, rng = PeriodRange(0.1, 0.7), np.random.default_rng(1)
    found = stamped_design(plant, periods)
    assert found.level <= robust_design(plant, periods).design.level * (1 + LEVELS)
    proved = prove(plant, found)
    assert proved.level <= found.level * 1.002
    for _ in range(3):
        sequence = rng.choice([periods.h_l, periods.h_u, rng.uniform(0.1, 0.7)], 60)
        assert sequence_gain(plant, found.filter, sequence)[0] <= proved.level * (1 + 1e-9)


@pytest.mark.parametrize("plant", [OSCILLATOR, UNSTABLE, INTEGRATORS, random_plant(np.random.default_rng(5), 4)])
def test_at_one_period_it_is_the_optimum_of_the_riccati_recursion(plant):
    h = 0.11
    found = stamped_design(plant, PeriodRange(h, h))
    assert riccati_filter(plant, h, found.level * (1 + 1e-4)) is not None
    assert riccati_filter(plant, h, found.level * (1 - 1e-4)) is None
    assert periodic_gain(plant, found.filter, [h]).value == pytest.approx(found.level, rel=1e-4)
    if plant is OSCILLATOR:
        assert found.level == pytest.approx(riccati_level(plant, h).level, rel=LEVELS)


@pytest.mark.parametrize(("plant", "periods"), [(SWING, SWING_RANGE), (UNSTABLE, RANGE), (INTEGRATORS, RANGE)])
def test_the_running_observer_has_the_error_whose_gain_is_proved(plant, periods):
    """Plant and observer side by side, each with its own transitions, under the worst sequence and disturbance."""
    result = design_stamped(plant, periods=periods, B_u=[[0.0], [1.0]], horizon=20)
    attack, observer = result.gain.attack, result.observer()
    x, t, errors, rng = np.zeros(plant.order), 0.0, [], np.random.default_rng(2)
    for h, w in zip(attack.periods, attack.w, strict=True):
        u = rng.standard_normal(1)
        observer.step(plant.C @ x + plant.D @ w, t=t, u=u)
        drive = plant.B @ w + np.array([0.0, 1.0]) * u
        whole = scipy.linalg.expm(h * np.block([[plant.A, drive[:, None]], [np.zeros((1, plant.order + 1))]]))
        x, t = whole[:-1, :-1] @ x + whole[:-1, -1], t + h
        errors.append(plant.L @ (x - observer.predict(t)))
    ratio = np.linalg.norm(errors) / np.linalg.norm(attack.w)
    assert ratio == pytest.approx(result.gain.attack.level, rel=1e-6)
    assert observer.outside == 0
    simulated = nonuniform.simulate(result)
    assert np.allclose(simulated.signals["error"][1:], errors, atol=1e-6 * np.max(np.abs(errors)))


@pytest.mark.parametrize("cells", [1, 2])
def test_where_hulls_are_loose_they_are_halved_until_the_level_of_the_design_is_proved(cells):
    found = stamped_design(MOTOR, MOTOR_RANGE, cells=cells)
    assert prove(MOTOR, found).level <= found.level * (1 + LOOSE) * (1 + 1e-6)
    with patch.object(proof_module, "LOOSE", 0.1):
        assert prove(MOTOR, found).level > found.level * (1 + 3 * LOOSE)


def test_more_cells_lower_the_level_towards_that_of_no_filter():
    """The gain after a long period is another one than after a short one."""
    for plant, periods in ((UNSTABLE, RANGE), (MOTOR, MOTOR_RANGE)):
        one, two, eight = (stamped_design(plant, periods, cells=count).level for count in (1, 2, 8))
        least = floor_of_any_filter(plant, periods, one)
        assert least < eight < two < one
    assert eight < 0.7 * one


def test_what_enters_the_hulls_is_what_steps_the_error():
    for plant, subject in ((MOTOR, some_filter(SWING, 0.05)), (UNSTABLE, StampedFilter(np.arange(4.0)[None, :, None]))):
        Phi, Gamma = plant.discretise(0.2)
        state, drive = subject.error_step(plant, Phi, Gamma)
        n = plant.order
        assert np.allclose(np.hstack([Phi, Gamma]) @ subject.entry(plant), np.hstack([state, drive])[:n], atol=1e-14)
        w = np.random.default_rng(0).standard_normal((5, plant.B.shape[1]))
        e, errors = np.zeros(len(state)), [np.zeros(len(plant.L))]
        for one in w:
            e = state @ e + drive @ one
            errors.append(subject.error_output(plant) @ e)
        assert np.allclose(simulate_error(plant, subject, np.full(5, 0.2), w), errors, atol=1e-12)


def test_units_of_states_time_and_outputs_change_no_level():
    plain = swing().level
    T = np.array([[1e4, 1.0], [0.0, 1e-3]])
    assert stamped_design(SWING.in_coordinates(T), SWING_RANGE).level == pytest.approx(plain, rel=LEVELS)
    slow = SampledPlant(SWING.A / 60, SWING.B / 60, 1e3 * SWING.C, 1e3 * SWING.D, SWING.L)
    assert stamped_design(slow, PeriodRange(0.6, 6.0)).level == pytest.approx(plain, rel=LEVELS)


def test_sensors_that_tell_nothing_leave_the_level_of_none_and_are_told():
    deaf = SampledPlant(SWING.A, SWING.B, SWING.C, [[0, 1e3]], SWING.L)
    result = design_stamped(deaf, periods=SWING_RANGE, **SHORT)
    none = guaranteed_level(deaf, StampedFilter(np.zeros((1, 4, 1))), SWING_RANGE, max_leaves=EFFORT["leaves"])
    assert result.value <= none.level
    assert result.value >= result.fact("least level of any filter").value
    assert "level without sensors" in result.fact("advice").value
    with pytest.raises(KeyError):
        design_stamped(SWING, periods=SWING_RANGE, horizon=20).fact("advice")


def test_baselines_are_those_of_the_frequency_response():
    plant, h = random_plant(np.random.default_rng(3), 3, m=3, r=2, s=2), 0.4
    Phi, Gamma = plant.discretise(h)
    gains = []
    for angle in np.linspace(0, np.pi, 181):
        response = np.linalg.solve(np.exp(1j * angle) * np.eye(3) - Phi, Gamma)
        hidden = scipy.linalg.null_space(plant.C @ response + plant.D)
        gains.append(np.linalg.norm(plant.L @ response @ hidden, 2))
    assert smoother_limit(plant, h) == pytest.approx(max(gains), rel=1e-9)
    assert smoother_limit(plant, h) <= riccati_level(plant, h).level
    assert smoother_limit(MOTOR, 0.05) == 0.0
    assert zero_at_constant_periods(UNSTABLE, [0.1]) is None
    assert zero_at_constant_periods(INTEGRATORS, [0.1]) is None
    assert 0 < smoother_limit(INTEGRATORS, 0.1) < stamped_design(INTEGRATORS, PeriodRange(0.1, 0.1)).level


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"measured": 1}, "measured belongs"),
        ({"B_u": [[1.0]]}, "B_u must have 2 rows"),
        ({"cells": 0}, "at least 1"),
        ({"cells": "many", "periods": (0.2, 0.2)}, "cells must be a whole number, got 'many'"),
        ({"cells": 1000}, "cells must be at most 64, got 1000"),
    ],
)
def test_what_cannot_be_designed_is_refused(change, message):
    given_ = {"plant": UNSTABLE, "periods": (0.05, 0.4), **change}
    with pytest.raises(InvalidInputError, match=message):
        design_stamped(given_.pop("plant"), **given_)


def test_redundant_sensors_and_certificates_that_need_slack():
    plain = stamped_design(INTEGRATORS, RANGE)
    copied = StampedPlant(INTEGRATORS.A, INTEGRATORS.B, [[1, 0], [100, 0]], [[0, 0.1], [0, 10]], INTEGRATORS.L)
    assert stamped_design(copied, RANGE).level == pytest.approx(plain.level, rel=LEVELS)
    assert plain.level < stamped_design(INTEGRATORS, RANGE, slack=1e-3).level < plain.level * 1.005

    answers = iter([SolverError("no certificate"), prove(INTEGRATORS, plain)])
    with patch.object(proof_module, "prove", side_effect=answers):
        assert proved_design(INTEGRATORS, RANGE)[0].level > plain.level
    assert proved_design(INTEGRATORS, RANGE)[0].level == plain.level


def test_a_flat_spectrum_has_a_worst_disturbance_too():
    """At the optimum of one period all frequencies hurt alike, and Lanczos does not tell them apart."""
    found = swing()
    level, w = sequence_gain(SWING, found.filter, np.full(60, SWING_RANGE.h_u))
    e = simulate_error(SWING, found.filter, np.full(60, SWING_RANGE.h_u), w)
    assert np.linalg.norm(e) / np.linalg.norm(w) == pytest.approx(level, rel=1e-9)
    columns = [simulate_error(SWING, found.filter, np.full(60, 0.1), u.reshape(60, 2))[1:, 0] for u in np.eye(120)]
    assert level == pytest.approx(np.linalg.norm(np.array(columns), 2), rel=1e-6)


def test_plants_without_an_answer_have_a_message():
    with pytest.raises(InvalidInputError, match="not observable"):
        StampedPlant([[1, 0], [0, 2]], np.eye(2), [[1, 0]], [[0, 1]], [[1, 0]])
    assert StampedPlant([[0]], [[1, 0]], [[1]], [[0, 0.1]], [[1]]).in_coordinates(np.eye(1)).A == 0
    told = StampedPlant([[-1]], [[1]], [[1], [2]], [[0], [1]], [[1]])
    for plant, periods in ((OSCILLATOR, (0.05, 0.05)), (told, (0.1, 0.2))):
        with pytest.raises(InfeasibleError, match="cannot be told from zero"):
            design_stamped(plant, periods=periods)
    # A rotation that is sampled once a turn stands still in the samples.
    turning = StampedPlant([[0.1, 1], [-1, 0.1]], [[0, 0], [1, 0]], [[1, 0]], [[0, 0.1]], [[0, 1]])
    with pytest.raises(InfeasibleError):
        design_stamped(turning, periods=(np.pi, np.pi))


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        ({"y": [None], "t": 0.3}, "needs all sensors"),
        ({"y": [1.0], "t": 0.1}, "must increase"),
        ({"y": [1.0], "t": 0.05}, "must increase"),
        ({"y": [1.0], "t": 0.3, "u": [1.0]}, "u must be 0"),
    ],
)
def test_samples_that_make_no_sense_leave_the_estimate_unharmed(sample, message):
    observer = unstable().observer()
    with pytest.raises(InvalidInputError, match="there is none yet"):
        observer.predict(0.0)
    observer.step([1.0], t=0.0)
    observer.step([1.2], t=0.1)
    before = observer.estimate, observer.predict(0.2)
    with pytest.raises(InvalidInputError, match=message):
        observer.step(sample.pop("y"), **sample)
    assert np.array_equal(before[0], observer.estimate)
    assert np.array_equal(before[1], observer.predict(0.2))
    observer.step([1.0], t=0.9)
    assert observer.outside == 1


def test_the_ends_of_the_range_lie_inside_it_however_the_time_is_rounded():
    observer = unstable().observer()
    low, high = observer.periods.h_l, observer.periods.h_u
    times = np.cumsum([7.3, low, low, high, high, low, high])
    for time in times:
        observer.step([1.0], t=time)
    assert observer.outside == 0
    observer.step([1.0], t=times[-1] + 0.99 * low)
    assert observer.outside == 1


def test_small_matrices_are_multiplied_on_one_thread():
    """Threads that wait for each other cost most of the time of a design where processors are busy."""
    importlib.import_module("replication.estimation.conic.sdpa")  # brings a BLAS of its own
    seen = []

    def spy(*given, **options):
        pools = threadpoolctl.threadpool_info()
        seen.append({pool["num_threads"] for pool in pools if pool["user_api"] == "blas"})
        return worst_sequence(*given, **options)

    ours, theirs = (patch.object(module, "worst_sequence", spy) for module in (stamped_module, bracket_module))
    with threadpoolctl.threadpool_limits(2), ours, theirs:
        nonuniform.design(SWING, periods=SWING_RANGE, **EFFORT)
        design_stamped(SWING, periods=SWING_RANGE, **SHORT)
        assert 2 in {pool["num_threads"] for pool in threadpoolctl.threadpool_info()}
    assert seen == [{1}, {1}]


def test_constant_periods_count_as_sequences_in_the_lower_end() -> None:
    slow = ([[-0.02]], [[1.0, 0.0]], [[1.0]], [[0.0, 30.0]], [[1.0]])
    robust = nonuniform.design(nonuniform.SampledPlant(*slow), periods=(0.1, 0.11), leaves=1, horizon=100)
    stamped = nonuniform.design_stamped(nonuniform.StampedPlant(*slow), periods=(0.1, 0.11), horizon=100)
    for found, attack in ((robust, robust.gain.attack), (stamped, stamped.gain.attack)):
        constant = found.fact("level at constant periods").value
        assert isinstance(constant, float)
        # No bad sequence of that length comes near what a slow plant does in the long run.
        assert attack.level < 0.95 * constant <= found.bracket.lower <= found.bracket.upper
        assert found.fact("lower end attained by").value == "a constant period"


def test_what_is_forgotten_between_samples_loses_no_first_guess() -> None:
    """Samples see the state at rest, [2, 1] w, and the level is that of no sensor; what grows too far is told so."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tanks = StampedPlant([[-0.5, 1], [0, -1]], [[0, 0], [1, 0]], [[1, 0]], [[0, 0.1]], [[1, 0]])
        design = stamped_design(tanks, PeriodRange(195.0, 205.0), cells=1)
        assert design.level == pytest.approx(2.0, rel=1e-5)
        assert np.allclose(kalman_filter(tanks, 200.0).G[0, :2], [[4 / 4.01], [2 / 4.01]], rtol=1e-9)
    with pytest.raises(InfeasibleError, match=r"grows by 3.49e\+19; sample faster"):
        stamped_design(StampedPlant([[0.1]], [[1, 0]], [[1]], [[0, 0.1]], [[1]]), PeriodRange(450.0, 450.0))
