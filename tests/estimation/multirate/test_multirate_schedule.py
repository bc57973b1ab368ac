"""Sensing schedules and the search of the best timing."""

from __future__ import annotations

from itertools import product
from math import gcd

import numpy as np
import pytest
from multirate_examples import PAPER, problem

from replication.errors import InvalidInputError
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


def test_sensor_i_measures_with_its_period_and_offset() -> None:
    schedule = SensingSchedule((2, 3, 4), (1, 2, 3))
    assert schedule.period == 12
    for k, i in product(range(36), range(3)):
        assert (i in schedule.measured(k)) == ((k - schedule.offsets[i]) % schedule.periods[i] == 0)


def test_arrays_and_lists_are_sequences() -> None:
    assert SensingSchedule([2, 3], np.array([1, 0])) == SensingSchedule((2, 3), (1, 0))  # type: ignore[arg-type]


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
    every = {
        offsets: optimum(problem(PAPER, (4, 2), offsets)).value for offsets in product(range(4), range(2))
    }  # fmt: skip
    assert search.optima[search.best].value == pytest.approx(min(every.values()), rel=AGREEMENT)
    assert search.synchronous.value == pytest.approx(every[0, 0], rel=AGREEMENT)
    assert len(np.unique(np.round(list(every.values()), 7))) <= 2


@pytest.mark.parametrize(
    ("periods", "offsets", "message"),
    [
        ((), (), "at least one sensor"),
        ((0, 2), (), r"periods\[0\] must be at least 1"),
        ((2, -3), (), r"periods\[1\] must be at least 1"),
        ((2, 2.5), (), r"periods\[1\] must be a whole number, got 2.5"),
        ((2, 3.0), (), r"periods\[1\] must be a whole number"),
        ((True, 2), (), r"periods\[0\] must be a whole number"),
        (("2", 3), (), r"periods\[0\] must be a whole number"),
        ((2, float("nan")), (), r"periods\[1\] must be a whole number"),
        (3, (), "periods must be a sequence"),
        ("23", (), "periods must be a sequence"),
        (None, (), "periods must be a sequence"),
        ([[2], [3]], (), "periods must be a sequence"),
        ((2, 3), (0,), "one entry per sensor"),
        ((2, 3), (0, 1, 0), "one entry per sensor"),
        ((2, 3), 1, "offsets must be a sequence"),
        ((2, 3), (0, 3), r"offsets\[1\] must be a whole number from 0 to 2, got 3"),
        ((2, 3), (-1, 0), r"offsets\[0\] must be a whole number from 0 to 1, got -1"),
        ((2, 3), (0, 1.0), r"offsets\[1\] must be a whole number"),
        ((2, 3), (0, True), r"offsets\[1\] must be a whole number"),
        ((2, 3), (0, None), r"offsets\[1\] must be a whole number"),
    ],
)
def test_a_bad_schedule_is_named(periods: object, offsets: object, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        SensingSchedule(periods, offsets)  # type: ignore[arg-type]


def test_bad_periods_of_a_search_are_named() -> None:
    for periods in ((2, 0), (2, 1.5), 4):
        with pytest.raises(InvalidInputError, match="periods"):
            search_timing(PAPER, periods)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="leave 1000000 sets of offsets"):
        search_timing(PAPER, (10,) * 7)


def test_periods_that_hardly_ever_meet_are_refused_though_each_is_short() -> None:
    with pytest.raises(InvalidInputError, match="repeat together only every"):
        SensingSchedule((997, 1009, 1013))
