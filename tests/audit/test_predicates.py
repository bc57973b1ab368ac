"""What claims say as data: how it is declared, what is refused before anything runs, and how it reads in words."""

from __future__ import annotations

from typing import Any

import pytest
from cases import claim, paper

from replication.audit.declare import Part
from replication.audit.judge.validate import validate_claims, validate_theorems
from replication.audit.model import Evidence, Kind, Results
from replication.errors import AuditError
from replication.verify.predicate import Predicate, Term, in_words, term

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
