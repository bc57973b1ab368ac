"""The common plant: two papers' methods meet where their problems are the same, and costs grow as they must."""

from types import ModuleType

import numpy as np
import pytest

from papers import mustafa, okajima2023
from papers._common import MULTIPLES, PLANT, Told
from papers.mustafa.experiments import levels as irregular
from papers.okajima2023.experiments import designs as slow
from papers.peet2019.experiments import examples as late
from replication.errors import AuditError

AGREEMENT = 1e-9


@pytest.fixture(scope="module")
def found() -> dict[str, list[list[float]]]:
    return slow.on_common_plant(PLANT, list(MULTIPLES))


def test_two_estimators_give_the_same_level_with_the_ideal_sensor(found: dict[str, list[list[float]]]) -> None:
    ((other, _),) = irregular.on_common_plant(PLANT, [1], leaves=2, horizon=50)
    assert other == pytest.approx(found["slow"][0][1], rel=AGREEMENT)
    assert found["late"][0] == found["slow"][0]


def test_slower_and_later_is_never_better(found: dict[str, list[list[float]]]) -> None:
    for name in ("slow", "late"):
        levels = np.array(found[name])
        assert np.all(np.diff(levels[:, 0]) > 0)
        assert np.all(levels[:, 0] <= levels[:, 1])
    # A measurement that comes m - 1 instants late brings more than one every m instants, which is as old at the most.
    assert np.all(np.array(found["late"])[1:, 1] < np.array(found["slow"])[1:, 0])


@pytest.mark.slow
def test_continuous_time_delays_cost_more_the_longer_they_are() -> None:
    levels = np.array(late.on_common_plant(PLANT, list(MULTIPLES), 2))
    assert np.all(levels[:, 0] <= levels[:, 1])
    # The brackets do not even touch.
    assert np.all(levels[1:, 0] > levels[:-1, 1])


@pytest.mark.parametrize("module", [mustafa, okajima2023])
@pytest.mark.parametrize("what", ["errata", "figures"])
def test_what_told_toml_names_and_no_function_makes_is_refused(what: str, module: ModuleType) -> None:
    told = Told.read(str(module.__file__))
    make = getattr(told, what)
    with pytest.raises(AuditError, match=f"do not name the same {what}; only one of them has .*another"):
        make({**dict.fromkeys(told.said[what]), "another": None})


def test_a_finding_is_left_out_or_said_for_each_case_as_its_facts_say() -> None:
    told = Told({"findings": {"one": "One {n}.", "none": "Not {n}.", "each": "{n} in {case}.", "empty": "{case}"}}, {})
    facts = {"n": 0, "none": False, "each": [{"case": "a"}, {"case": "b"}], "empty": []}
    assert told.findings(lambda results: facts)({}) == ("One 0.", "0 in a.", "0 in b.")


def test_a_number_that_told_toml_names_and_nothing_gives_is_refused() -> None:
    with pytest.raises(AuditError, match=r"told.toml has {mincx} in .*; give that number"):
        Told.read(str(okajima2023.__file__)).simple()
