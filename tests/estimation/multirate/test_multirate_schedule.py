"""Sensing schedules and the search of the best timing."""

from dataclasses import replace
from itertools import product
from math import gcd
from unittest.mock import patch

import numpy as np
import pytest
import scipy.linalg
from multirate_examples import PAPER, problem

from replication.errors import InvalidInputError
from replication.estimation import multirate
from replication.estimation.linear.norms import GainBracket
from replication.estimation.linear.periodic import PeriodicSystem, Stage, simulate
from replication.estimation.multirate import MultiratePlant
from replication.estimation.multirate import optimum as search
from replication.estimation.multirate.optimum import optimum, search_timing
from replication.estimation.multirate.problem import SensingSchedule, distinct_offsets
from tests.tolerances import AGREEMENT


def test_the_example_of_the_paper() -> None:
    """Eqs. (5)-(12): periods 3 and 6, with offsets 0 and 0, and 0 and 1."""
    together, apart = SensingSchedule((3, 6)), SensingSchedule((3, 6), (0, 1))
    assert together.period == 6
    assert together.mask.astype(int).tolist() == [[1, 1], [0, 0], [0, 0], [1, 0], [0, 0], [0, 0]]
    assert apart.mask.astype(int).tolist() == [[1, 0], [0, 1], [0, 0], [1, 0], [0, 0], [0, 0]]
    np.testing.assert_array_equal(apart.selection(7), np.diag([0.0, 1.0]))
    assert [apart.measured(k) for k in range(3)] == [(0,), (1,), ()]
    assert SensingSchedule([3, 6], np.array([0, 1])) == apart  # type: ignore[arg-type]


@pytest.mark.parametrize(("first", "second"), [(2, 3), (3, 3), (4, 6), (6, 4), (8, 12), (5, 1)])
def test_two_sensors_have_as_many_timings_as_their_common_divisor(first: int, second: int) -> None:
    assert list(distinct_offsets((first, second))) == [(0, theta) for theta in range(gcd(first, second))]


@pytest.mark.parametrize("periods", [(2, 4), (2, 2, 4), (3, 6, 2)])
def test_every_timing_is_a_shift_of_exactly_one_that_is_listed(periods: tuple[int, ...]) -> None:
    listed = list(distinct_offsets(periods))
    N = SensingSchedule(periods).period

    def shifts(offsets: tuple[int, ...]) -> set[tuple[int, ...]]:
        return {tuple((theta + s) % p for theta, p in zip(offsets, periods, strict=True)) for s in range(N)}

    for offsets in product(*(range(p) for p in periods)):
        assert len(shifts(offsets) & set(listed)) == 1


def test_the_search_holds_the_optimum_of_every_timing() -> None:
    search = search_timing(PAPER, (4, 2))
    assert set(search.optima) == {(0, 0), (0, 1)}
    every = {both: optimum(problem(PAPER, (4, 2), both)).value for both in product(range(4), range(2))}
    assert search.optima[search.best].value == pytest.approx(min(every.values()), rel=AGREEMENT)
    assert search.synchronous.value == pytest.approx(every[0, 0], rel=AGREEMENT)
    assert len(np.unique(np.round(list(every.values()), 7))) <= 2


def oscillator(frequency: float) -> MultiratePlant:
    A = scipy.linalg.expm(0.05 * np.array([[0.0, 1.0], [-(frequency**2), 0.0]]))
    return MultiratePlant(A=A, B_d=0.05 * np.eye(2), C=[[1.0, 0.0]], D=[[0.1]], dt=0.05)


@pytest.mark.parametrize("goal", ["hinf", "h2"])
def test_an_undamped_plant_has_no_finite_level_without_sensors_however_its_modes_round(goal: str) -> None:
    plants = [oscillator(frequency) for frequency in np.linspace(0.5, 20.0, 12)]
    # Rounding puts some of them within the circle: the error would be said to die out by itself.
    assert any(np.max(np.abs(np.linalg.eigvals(plant.A))) < 1.0 for plant in plants)
    for plant in plants:
        found = multirate.design(plant, periods=(3,), goal=goal)
        assert found.fact("level without sensors").value == "infinite"
        assert np.isfinite(found.value)


def test_a_plant_that_settles_slowly_has_a_level_without_sensors() -> None:
    plant = MultiratePlant(A=[[1 - 1e-3]], B_d=[[1.0]], C=[[1.0]], D=[[0.1]])
    assert multirate.design(plant, periods=(2,)).fact("level without sensors").value == pytest.approx(1e3, rel=1e-6)
    slower = MultiratePlant(A=[[1 - 1e-9]], B_d=[[1.0]], C=[[1.0]], D=[[0.1]])
    without = multirate.design(slower, periods=(2,)).fact("level without sensors").value
    assert without == "infinite" or (isinstance(without, float) and without >= 1e9 * (1 - 1e-6))


def faint(noise: float) -> MultiratePlant:
    return MultiratePlant(A=[[0.9, 1.0], [0.0, 0.95]], B_d=[[0.0], [1.0]], C=[[1, 0]], D=[[noise]], W=[[0.0, 1.0]])


@pytest.mark.parametrize("noise", [1e-3, 1e-5, 3e-7])
def test_the_optimum_is_reached_as_long_as_rounding_lets_the_noise_be_seen(noise: float) -> None:
    found = multirate.design(faint(noise), periods=(2,))
    optimum = found.fact("optimum").value
    assert isinstance(optimum, float)
    assert optimum * (1 - 1e-9) <= found.value <= optimum * (1 + 1e-3)


@pytest.mark.parametrize("noise", [1e-8, 1e-10, 1e-11, 1e-12])
@pytest.mark.parametrize("level", [None, 4.0])
def test_noise_that_rounding_hides_is_refused_before_a_false_optimum_is_told(noise: float, level: float | None) -> None:
    with pytest.raises(InvalidInputError, match="too little for floating point; give the sensor more noise by D"):
        multirate.design(faint(noise), periods=(2,), level=level)


@pytest.mark.parametrize("share", [0.98, 1.02])
def test_an_optimum_that_its_gains_miss_is_refused_where_the_noise_is_small(share: float) -> None:
    given = problem(faint(1e-8), (2,))
    missed = share * search._Search(given)._least().value
    with (
        patch.object(search, "l2_gain", return_value=GainBracket(missed, missed, 0.0)),
        pytest.raises(InvalidInputError, match="too little for floating point"),
    ):
        optimum(given)


DRIVEN = problem(replace(PAPER, B_u=np.array([[1.0, 0], [0, 2], [1, 1]])), (2, 3), (0, 1))


def test_plant_minus_observer_is_the_error_system() -> None:
    """u moves plant and observer alike, and what is left is driven by d and w as the error system says."""
    rng, plant, T = np.random.default_rng(8), DRIVEN.plant, 60
    result = multirate.design(plant, periods=(2, 3), offsets=(0, 1), goal="h2")
    u, d, w = rng.normal(size=(T, 2)), rng.normal(size=(T, 1)), rng.normal(size=(T, 2))
    x, states = np.zeros(3), []
    for k in range(T):
        states.append(x)
        x = plant.A @ x + plant.B_u @ u[k] + plant.B_d @ d[k]
    measured = np.array(states) @ plant.C.T + w @ plant.D.T
    measured[~DRIVEN.schedule.mask[np.arange(T) % 6]] = 1e3  # what is not measured must not matter
    drives = [(phase, np.hstack([phase.input, phase.injection])) for phase in result.phases().phases]
    observer = PeriodicSystem(tuple(Stage(p.transition, drive, plant.W, np.zeros((3, 4))) for p, drive in drives))
    errors = simulate(result.error_system(), np.hstack([d, w]))
    np.testing.assert_allclose(states @ plant.W.T - simulate(observer, np.hstack([u, measured])), errors, atol=1e-8)
