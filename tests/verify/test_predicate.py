"""What theorems export: known quantities and classes of estimators, of the plant that they are about and no other."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from flint import fmpq

from replication.verify.multirate.levels import UNDER
from replication.verify.predicate import (
    ESTIMATORS,
    QUANTITIES,
    Exported,
    Predicate,
    Says,
    as_data,
    differences,
    exported,
    in_words,
    same,
    term,
    unit_of,
)
from replication.verify.run import STATEMENTS, check
from replication.verify.subjects import papers, theorems
from replication.verify.theorem import Found

ROOT = Path(__file__).parents[2]
SAID = [(name, says) for name, one in STATEMENTS.items() for says in one.says]


def certificate(name: str) -> dict[str, Any]:
    return dict(json.loads((ROOT / "certificates" / f"{name}.json").read_bytes()))


def test_every_theorem_that_supports_a_claim_says_something_as_data() -> None:
    wanted = [entry for paper in papers() for entry in theorems(paper)[0].values() if entry.claims]
    assert sorted({entry.statement for entry in wanted if not STATEMENTS[entry.statement].says}) == []


@pytest.mark.parametrize(("name", "says"), SAID, ids=[name for name, _ in SAID])
def test_what_is_exported_is_known_and_in_the_words_of_the_sentence(name: str, says: Says) -> None:
    if not callable(says.quantity):
        assert says.quantity in QUANTITIES
    for estimators in () if callable(says.estimators) else filter(None, says.estimators):
        assert ESTIMATORS[estimators] in STATEMENTS[name].wording(STATEMENTS[name].source)


def test_a_theorem_exports_the_plant_the_setting_and_the_bounds_of_its_certificate() -> None:
    made = certificate("okajima2023/gains-33")
    said, *_ = check(made, ROOT).says
    assert said.of == term("gain", "gains-33", sensors=[0, 1], periods=[2, 3], offsets=[0, 0])
    assert said.items == ((made["bound"]["lower"], made["bound"]["upper"]),)
    assert differences(said.of, "none", said) == []


MADE = {"paper": "toy", "plant": {"name": "lag"}, "parameters": {"N": 2, "relative": "1/8"}}


def test_a_term_has_the_plant_the_parameters_and_the_bounds_unless_it_says_otherwise() -> None:
    whole = Found(lower=fmpq(1, 2), upper=fmpq(3), holds=True)
    (usual,) = exported(Says(quantity="gain"), MADE, {}, whole)
    assert usual == Exported(of=term("gain", "lag", N=2), unit="1", items=(("1/2", "3"),))
    (fact,) = exported(Says(quantity="observability", universal=True), MADE, {}, whole)
    assert fact == Exported(of=term("observability", N=2), unit="yes or no", holds=True)
    (own,) = exported(
        Says(quantity="gain"), {**MADE, "paper": None, "plant": None}, {}, Found(items=((None, fmpq(1)),))
    )
    assert (own.of.plant, own.items) == ("own plant ", ((None, "1"),))


def test_a_term_may_be_chosen_from_the_parameters() -> None:
    chosen = Says(
        quantity=lambda parameters: "gain" if parameters["N"] == 2 else "poles",
        estimators=("one-step predictors", "all estimators"),
        readings=lambda parameters: (f"of {parameters['N']}",),
        setting=lambda parameters: {"M": parameters["N"] + 1},
        found=lambda known: Found(lower=known["low"]),
    )
    first, second = as_data((chosen,), "toy", MADE, {"low": fmpq(7)}, Found())
    assert first == Exported(
        of=term("gain", "lag", "one-step predictors", M=3), unit="1", readings=("of 2",), items=(("7", None),)
    )
    assert second.of.estimators == "all estimators"
    for source, readings in (("toy", ("of 2",)), ("", ("of 2",)), ("other", ("none",))):
        assert {one.readings for one in as_data((chosen,), source, MADE, {"low": None}, Found())} == {readings}


def test_an_own_plant_never_has_the_name_or_the_reading_of_a_papers_one() -> None:
    made = certificate("okajima2023/optimum-case-a")
    first, *_ = check(made, ROOT).says
    own, *_ = check(made | {"paper": None, "claims": []}, ROOT).says
    assert (first.of.plant, first.readings) == ("stable", UNDER)
    assert (own.of.plant, own.readings) == ("own plant stable", ("none",))
    assert differences(first.of, "predictors", own) == [
        "another plant: own plant stable, not stable",
        "under the reading none only, not predictors",
    ]


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        (term("gain", "toy", N=3), "for N 1, not 3"),
        (term("gain", "toy"), "for N 1 of all"),
        (term("gain", "toy", N=1, M=2), "not for M 2"),
        (term("gain", "", N=1), "another plant: toy, not all"),
        (term("gain", "toy", N=True), "for N 1, not true"),
        (
            term("observability", "toy", N=1),
            "it is about the worst-case gain of given gains, not the observability of (C, A)",
        ),
        (term("gain", "toy", "all estimators", N=1), "for no class of estimators, not for all estimators"),
    ],
)
def test_the_difference_of_two_terms_is_told_in_words(wanted: Any, told: str) -> None:
    assert differences(wanted, "none", Exported(of=term("gain", "toy", N=1), unit="1")) == [told]


GAIN = "the worst-case gain of given gains (plant toy)"


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (Predicate(of=term("gain", "toy"), relation="is", to="2", unit="1"), f"{GAIN} is 2"),
        (Predicate(of=term("gain", "toy"), relation="at most", to="2", unit="s"), f"{GAIN} is at most 2 s"),
        (Predicate(of=term("gain"), relation="less than", to=term("gain", "toy")), f"{GAIN[:-12]} is less than {GAIN}"),
        (Predicate(of=term("observability")), "the observability of (C, A) holds"),
        (
            Predicate(of=term("observability"), relation="fails", reading="predictors"),
            "the observability of (C, A) fails, under the reading predictors",
        ),
        (Predicate(of=term("observability"), reading="none"), "the observability of (C, A) holds"),
    ],
)
def test_what_is_said_is_told_in_words(said: Predicate, words: str) -> None:
    assert in_words(said) == words


def test_a_quantity_has_a_unit_and_one_that_is_not_known_none() -> None:
    assert [unit_of(name) for name in ("gain", "observability", "common period", "luck")] == [
        "1",
        "yes or no",
        "instants",
        "",
    ]


def test_a_quantity_of_a_paper_has_its_unit_behind_it() -> None:
    assert unit_of("final size [percent]") == "percent"
    assert in_words(Predicate(of=term("final size [percent]"))) == "final size holds"


def test_json_is_the_same_in_any_order_and_of_one_type_only() -> None:
    assert same({"a": 1, "b": [2]}, {"b": [2], "a": 1})
    assert not same({"a": 1}, {"a": True})
