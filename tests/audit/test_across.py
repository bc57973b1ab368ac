"""What a sensor costs, as a factor over the ideal one."""

import pytest
from cases import results_file
from msgspec.structs import replace
from sample import paper_record

from replication.audit.parts import CommonLevel
from replication.audit.report.sections.across import across
from replication.audit.store.records import ResultsFile


def level(sensor: str, multiple: int, lower: float, upper: float) -> CommonLevel:
    return CommonLevel(sensor=sensor, multiple=multiple, lower=lower, upper=upper, measure="gain")


def file_with(*levels: CommonLevel) -> ResultsFile:
    return replace(results_file(), papers=(replace(paper_record(()), common=levels),))


def test_factors_are_brackets_over_the_ideal_sensor() -> None:
    shown = across(file_with(level("slow", 1, 2.0, 2.5), level("slow", 3, 5.0, 6.0), level("late", 1, 1.0, 1.0)))
    assert shown is not None
    slow, late = shown.columns
    assert shown.multiples == (1, 3)
    assert (slow.costs[3].least, slow.costs[3].most) == pytest.approx((2.0, 3.0))
    assert (slow.costs[1].least, slow.costs[1].most) == (1.0, 1.0)
    assert set(late.costs) == {1}


def test_without_an_ideal_sensor_there_is_no_factor() -> None:
    assert across(file_with(level("slow", 2, 1.0, 1.0))) is None
    assert across(file_with()) is None
