"""Claims that are not well formed are refused together, each mistake with the name at fault."""

from __future__ import annotations

from typing import Any

import pytest
from cases import claim, paper, recorded
from msgspec.structs import replace

from replication.audit.judge.validate import unused_readings, validate_claims
from replication.audit.model import Evidence, Kind, Outcome, Reading, Verdict
from replication.audit.parts import Figure, FigureData, Paper, ScopeItem, Table
from replication.errors import AuditError


def figure(name: str, **more: Any) -> Figure:
    given: dict[str, Any] = {
        "place": "Fig. 1",
        "title": "t",
        "caption": "c",
        "published": True,
        "uses": (),
        "data": lambda results: FigureData(columns={}),
        "plot": lambda data: None,
        "alt": lambda data: "",
    }
    return Figure(name=name, **(given | more))


NORM = Reading(name="norm", place="eq. (3)", text="the Euclidean norm")


def test_well_formed_papers_pass() -> None:
    table = Table(place="Table 1", caption="", header=("a",), rows=(("claim:toy.value", "text"),))
    first = paper(claim(uses=("toy-run",), erratum="toy.e1"), figures=(figure("toy-fig1"),), tables=(table,))
    validate_claims([first, paper(claim(id="other.value", reading="norm"), key="other", readings=(NORM,))])


@pytest.mark.parametrize(
    ("papers", "words"),
    [
        ([paper(claim(), claim())], ["claim id 'toy.value'", "2 times"]),
        ([paper(), paper()], ["paper key 'toy'", "2 times"]),
        ([paper(claim(id="other.value"))], ["'other.value'", "'toy.'"]),
        ([paper(claim(id="toy"))], ["'toy'", "dots"]),
        ([paper(claim(id="toy.Value"))], ["'toy.Value'", "lower-case"]),
        ([paper(claim(uses=("toy-other",)))], ["claim 'toy.value'", "'toy-other'"]),
        ([paper(claim(erratum="toy.e2"))], ["claim 'toy.value'", "'toy.e2'"]),
        ([paper(figures=(figure("toy-fig1", uses=("toy-x",)),))], ["figure 'toy-fig1'", "'toy-x'"]),
        ([paper(figures=(figure("fig1"),))], ["figure name 'fig1'"]),
        ([paper(claim(), scope=())], ["claim 'toy.value'", "no scope item"]),
        ([paper(scope=(ScopeItem(part="II", claims=("toy.no",)),))], ["'II'", "claim 'toy.no'"]),
        ([paper(scope=(ScopeItem(part="II", figures=("toy-no",)),))], ["'II'", "figure 'toy-no'"]),
        ([paper(scope=(ScopeItem(part="II"),))], ["'II'", "no reason"]),
        (
            [paper(tables=(Table(place="T1", caption="", header=(), rows=(("claim:toy.no",),)),))],
            ["table 'T1'", "'toy.no'"],
        ),
        ([paper(claim(expected=Verdict.ERROR))], ["'toy.value'", "error"]),
        ([paper(claim(expected=Verdict.REPRODUCED_AFTER_ERRATUM))], ["'toy.value'", "names no erratum"]),
        ([paper(claim(meant="1.34"))], ["'toy.value'", "1.34", "needs that print, and its erratum"]),
        (
            [paper(claim(erratum="toy.e1", meant="1.34"))],
            ["'toy.value' (Table 1) corrects '1.33' to '1.34'", "'toy.e1' (eq. (1)) 'a' to 'b'", "look into the text"],
        ),
        ([paper(claim(tolerance="0.1"))], ["'toy.value'", "together"]),
        ([paper(claim(tolerance_reason="why"))], ["'toy.value'", "together"]),
        ([paper(claim(optimum=True, kind=Kind.ORDER))], ["'toy.value' of kind order", "optimum"]),
        ([paper(claim(reading=""))], ["'toy.value' names no reading", 'say reading="none"']),
        ([paper(claim(reading="norm"))], ["'toy.value'", "'norm'", "does not exist"]),
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
    first = paper(claim(uses=("toy-a", "toy-b"), erratum="toy.e2"), scope=())
    second = paper(claim(id="wrong.value"), key="other")
    with pytest.raises(AuditError) as caught:
        validate_claims([first, second])
    lines = str(caught.value).splitlines()
    assert lines[0].endswith("5 mistakes:")
    assert len(lines) == 6


def test_a_reading_that_nobody_uses_is_found() -> None:
    family = Evidence(method="m", outcomes=(Outcome(reading="norm", value=1.33),))
    readings = (NORM, replace(NORM, name="start"))
    names = readings
    assert unused_readings(names, [recorded(family, readings=readings)]) == ("start",)
    assert unused_readings(names, [recorded(Evidence(method="m", value=1.3), reading="start", readings=readings)]) == (
        "norm",
    )
    assert unused_readings(names, [recorded(None)]) == ()
