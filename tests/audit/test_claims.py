"""Claims that are not well formed are refused together, each mistake with the name at fault."""

from dataclasses import replace as replace_data
from typing import Any

import pytest
from cases import claim, paper, recorded
from msgspec.structs import replace
from sample import figure
from tables import rows

from replication.audit.declare import Part
from replication.audit.judge.validate import unused_readings, validate_claims, validate_theorems
from replication.audit.model import Evidence, Experiment, Kind, Outcome, Reading, Results, Verdict
from replication.audit.parts import Paper, ScopeItem, Table
from replication.errors import AuditError
from replication.verify.predicate import Predicate, Term, in_words, term

NORM = Reading(name="norm", place="eq. (3)", text="the Euclidean norm")


def test_well_formed_papers_pass() -> None:
    table = Table(place="Table 1", caption="", header=("a", "b"), rows=(("claim:toy.value", "text"),))
    first = paper(claim(erratum="toy.e1"), figures=(figure("toy-fig1"),), tables=(table,))
    validate_claims([first, paper(claim(id="other.value", reading="norm"), key="other", readings=(NORM,))])


@pytest.mark.parametrize(
    ("papers", "words"),
    [
        *(([paper(claim(**fields))], words) for fields, words in rows("fields")),
        ([paper(claim(expected=Verdict.ERROR))], ["'toy.value'", "error"]),
        ([paper(claim(expected=Verdict.REPRODUCED_AFTER_ERRATUM))], ["'toy.value'", "names no erratum"]),
        ([paper(claim(), claim())], ["claim id 'toy.value'", "2 times"]),
        ([paper(), paper()], ["paper key 'toy'", "2 times"]),
        ([paper(figures=(replace_data(figure("toy-fig1"), uses=("toy-x",)),))], ["figure 'toy-fig1'", "'toy-x'"]),
        ([paper(figures=(figure("fig1"),))], ["figure name 'fig1'"]),
        ([paper(experiments=(Experiment(name="toy.a/b", function=len),))], ["'toy.a/b' cannot name a file"]),
        ([paper(claim(), scope=())], ["claim 'toy.value'", "no scope item"]),
        ([paper(scope=(ScopeItem(part="II", claims=("toy.no",)),))], ["'II'", "claim 'toy.no'"]),
        ([paper(scope=(ScopeItem(part="II", figures=("toy-no",)),))], ["'II'", "figure 'toy-no'"]),
        ([paper(scope=(ScopeItem(part="II"),))], ["'II'", "no reason"]),
        (
            [paper(tables=(Table(place="T1", caption="", header=("entry",), rows=(("claim:toy.no",),)),))],
            ["table 'T1'", "'toy.no'"],
        ),
        ([paper(claim(), readings=(NORM, NORM))], ["'norm'", "2 times"]),
        ([paper(claim(), readings=(replace(NORM, name="none"),))], ["called 'none'"]),
        ([paper(claim(), readings=(replace(NORM, place=""),))], ["'norm'", "place"]),
        ([paper(claim(), readings=(replace(NORM, text=""),))], ["'norm'", "text"]),
    ],
)
def test_mistake_is_named(papers: list[Paper], words: list[str]) -> None:
    with pytest.raises(AuditError) as caught:
        validate_claims(papers)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_all_mistakes_of_all_papers_are_reported_together() -> None:
    first = paper(claim(reading="norm", erratum="toy.e2"), scope=())
    second = paper(claim(id="wrong.value"), key="other")
    with pytest.raises(AuditError) as caught:
        validate_claims([first, second])
    lines = str(caught.value).splitlines()
    assert lines[0].endswith("4 mistakes:")
    assert len(lines) == 5


def test_a_reading_that_nobody_uses_is_found() -> None:
    family = Evidence(method="m", outcomes=(Outcome(reading="norm", value=1.33),))
    readings = (NORM, replace(NORM, name="start"))
    names = readings
    assert unused_readings(names, [recorded(family, readings=readings)]) == ("start",)
    assert unused_readings(names, [recorded(Evidence(method="m", value=1.3), reading="start", readings=readings)]) == (
        "norm",
    )
    assert unused_readings(names, [recorded(None)]) == ()


# What claims say as data: how it is declared, what is refused before anything runs, and how it reads in words


GAIN = Predicate(of=term("gain", "toy"), relation="is", to="1.33", unit="1", reading="none")
STABLE = Predicate(of=term("stable error system", "toy"), unit="yes or no", reading="none")


def answer(results: Results) -> Evidence:
    """A number."""
    return Evidence(method="m", value=1.33)


@pytest.mark.parametrize(
    ("kind", "printed", "of", "relation", "to", "unit"),
    [
        (Kind.VALUE, "1.33", "gain", "is", "1.33", "1"),
        (Kind.BOUND, "<0.001", "gain", "less than", "0.001", "1"),
        (Kind.BOUND, "≥ 2", "gain", "at least", "2", "1"),
        (Kind.FEASIBLE, "", "stable error system", "holds", None, "yes or no"),
        (Kind.VALUE, "6", "common period", "is", "6", "instants"),
    ],
)
def test_a_term_is_said_to_be_as_printed(
    kind: Kind, printed: str, of: str, relation: str, to: str | None, unit: str
) -> None:
    part = Part("Table 1", reading="norm")
    part.claim(kind, "c", printed, place="p", says=term(of, "toy", periods=(2, 3)))(answer)
    (said,) = part.claims[0].says
    assert (said.relation, said.to, said.unit, said.reading) == (relation, to, unit, "norm")
    assert said.of == Term(quantity=of, plant="toy", setting={"periods": [2, 3]})


def changed(said: Predicate, **changes: Any) -> Predicate:
    return Predicate(**(vars(said) | changes))


@pytest.mark.parametrize(
    ("said", "message"),
    [
        (changed(GAIN, of=term("fame")), "speaks of 'fame', which is no known quantity"),
        (changed(GAIN, to=term("fame")), "speaks of 'fame', which is no known quantity"),
        (changed(GAIN, unit=""), "without a unit; it has the unit '1'"),
        (changed(GAIN, unit="s"), "in the unit 's'; it has the unit '1'"),
        (changed(GAIN, of=term("gain", "", "wizards")), "the estimators 'wizards', which are no known class"),
        (changed(GAIN, relation="holds", to=None), "says that 'gain' holds, but its unit is '1'"),
        (changed(STABLE, relation="is", to="1"), "but its unit is 'yes or no'"),
        (changed(GAIN, to=None), "says that 'gain' is nothing"),
        (changed(GAIN, relation="at most", to="many"), "is at most 'many', which is no number"),
        (changed(GAIN, relation="at most", to="1000000"), "a number is what is printed"),
        (changed(GAIN, to="1.34"), "prints '1.33' and says as data"),
        (changed(GAIN, reading="tea leaves"), "under 'tea leaves', a reading that nobody defines"),
    ],
)
def test_what_cannot_be_said_is_refused_before_anything_runs(said: Predicate, message: str) -> None:
    validate_claims([paper(claim(says=(GAIN,)), claim(id="toy.c2", says=(STABLE,)))])
    with pytest.raises(AuditError, match="1 mistake") as refused:
        validate_claims([paper(claim(says=(said,)))])
    assert message in str(refused.value)


def test_a_claim_has_theorems_and_a_predicate_or_a_reason() -> None:
    said, bare = paper(claim(says=(GAIN,))), paper(claim())
    validate_theorems([said], ["toy.value"], [])
    validate_theorems([bare], [], ["toy.value"])
    validate_theorems([paper(claim(kind=Kind.STATISTICAL, id="toy.drawn"), said.claims[0])], ["toy.value"], [])
    validate_theorems([bare], [], ["other.value"])
    with pytest.raises(AuditError, match="value' has theorems and states no predicate"):
        validate_theorems([bare], ["toy.value"], [])
    with pytest.raises(AuditError, match="value' has no theorem and no reason"):
        validate_theorems([said], ["toy.other"], [])


def test_a_predicate_reads_as_a_sentence() -> None:
    order = changed(GAIN, relation="less than", to=term("gain", "other"), reading="norm")
    assert in_words(GAIN) == "the worst-case gain of given gains (plant toy) is 1.33"
    assert in_words(order) == (
        "the worst-case gain of given gains (plant toy) is less than the worst-case gain of given gains (plant other), "
        "under the reading norm"
    )
    assert in_words(STABLE) == "the stability of the error system (plant toy) holds"
