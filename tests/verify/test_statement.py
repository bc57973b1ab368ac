"""A declared statement reads its certificate in the order of its tables, says what is proved, and exports it."""

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from flint import fmpq, fmpq_mat
from tampered import committed

from replication.verify.multirate.levels import UNDER
from replication.verify.predicate import (
    ESTIMATORS,
    QUANTITIES,
    Exported,
    Predicate,
    Says,
    as_data,
    differences,
    in_words,
    term,
    unit_of,
)
from replication.verify.reading import integer, matrix, positive, rational, sized
from replication.verify.run import STATEMENTS, check
from replication.verify.statement import UPPER, Depends, collected, statement
from replication.verify.subjects import papers, theorems
from replication.verify.theorem import Found, Refused

# A declared statement reads its certificate in the order of its tables, and says what was proved, rounded safely.


ROOT = Path(__file__).parents[2]


def certificate(**fields: Any) -> dict[str, Any]:
    return {"plant": {"name": ""}, "parameters": {}, "bound": {}, "witness": {}, **fields}


@statement(
    "test.sized",
    parameters={"n": sized(integer, 1), "from": rational},
    bound=UPPER,
    witness={"M": Depends(lambda given: sized(matrix, given.n, given.n))},
    holds=True,
)
def of_size(n: int, from_: fmpq, upper: fmpq, M: fmpq_mat) -> None:
    """The matrix of size {n} has from {from_} on
    at most {upper:up 3}, at least {upper:down 1}.

    A second paragraph.
    """
    assert M.nrows() == n


SIZED = certificate(parameters={"n": 1, "from": "-1/2"}, bound={"upper": "2/3"}, witness={"M": [["7"]]})


def test_a_statement_is_read_proved_and_said() -> None:
    theorem = of_size(SIZED)
    assert theorem.sentence == "The matrix of size 1 has from -1/2 on at most 0.667, at least 0.6."
    assert (theorem.upper, theorem.lower, theorem.holds, theorem.items) == (fmpq(2, 3), None, True, ())


@pytest.mark.parametrize("group", ["parameters", "bound", "witness"])
def test_what_is_not_declared_must_be_empty(group: str) -> None:
    @statement("test.empty")
    def empty() -> Found:
        """Nothing is {what}."""
        return Found(words={"what": "read"})

    assert empty(certificate()).sentence == "Nothing is read." and empty(certificate()).holds is None
    with pytest.raises(Refused, match=f"{group} has the unknown field lower"):
        empty(certificate(**{group: {"lower": "1"}}))


def test_a_statement_without_a_sentence_cannot_be_declared() -> None:
    def silent() -> None:
        pass

    with pytest.raises(RuntimeError, match="run Python without -OO"):
        statement("test.silent")(silent)


def test_statements_are_collected_from_the_modules_of_a_family() -> None:
    family, part = ModuleType("family"), ModuleType("part")
    vars(part).update(of_size=of_size, other=positive)
    vars(family).update(part=part, stray=statement("test.stray")(lambda_with_words))
    assert collected(family) == {"test.sized": of_size}
    vars(part).update(twin=statement("test.sized")(lambda_with_words))
    with pytest.raises(ValueError, match=r"two statements are named test\.sized"):
        collected(family)


def lambda_with_words() -> None:
    """A sentence."""


@pytest.mark.parametrize("name", STATEMENTS)
def test_no_sentence_on_a_plant_of_ones_own_names_a_plant(name: str) -> None:
    """Its name is free: `motor` would be read as that of a paper."""
    try:
        sentence = STATEMENTS[name].wording(None)
    except Refused:
        return
    assert ".name}" not in sentence


# What theorems export: known quantities and classes of estimators, of the plant that they are about and no other.


SAID = [(name, says) for name, one in STATEMENTS.items() for says in one.says]


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
    made = committed("okajima2023/gains-33")
    said, *_ = check(made, ROOT).says
    assert said.of == term("gain", "gains-33", sensors=[0, 1], periods=[2, 3], offsets=[0, 0])
    assert said.items == ((made["bound"]["lower"], made["bound"]["upper"]),)
    assert differences(said.of, "none", said) == []


MADE = {"paper": "toy", "plant": {"name": "lag"}, "parameters": {"N": 2, "relative": "1/8"}}


def test_a_term_has_the_plant_the_parameters_and_the_bounds_unless_it_says_otherwise() -> None:
    whole = Found(lower=fmpq(1, 2), upper=fmpq(3), holds=True)
    (usual,) = as_data((Says(quantity="gain"),), "", MADE, {}, whole)
    assert usual == Exported(of=term("gain", "lag", N=2), unit="1", items=(("1/2", "3"),))
    (fact,) = as_data((Says(quantity="observability", universal=True),), "", MADE, {}, whole)
    assert fact == Exported(of=term("observability", N=2), unit="yes or no", holds=True)
    own_plant = {**MADE, "paper": None, "plant": None}
    (own,) = as_data((Says(quantity="gain"),), "", own_plant, {}, Found(items=((None, fmpq(1)),)))
    assert (own.of.plant, own.items) == ("own plant ", ((None, "1"),))


def test_an_own_plant_never_has_the_name_or_the_reading_of_a_papers_one() -> None:
    made = committed("okajima2023/optimum-case-a")
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


def test_a_quantity_of_a_paper_has_its_unit_behind_it() -> None:
    assert unit_of("final size [percent]") == "percent"
    assert in_words(Predicate(of=term("final size [percent]"))) == "final size holds"
