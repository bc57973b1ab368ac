"""Papers as they are declared: claims on their answers, parts in order, short names inside and full ones outside."""

import inspect
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from replication.audit.data import PrintedValue
from replication.audit.declare import Part, below, experiment, paper, positive
from replication.audit.judge.validate import validate_claims
from replication.audit.model import Erratum, Evidence, Kind, Proof, Reading, Results, Verdict
from replication.audit.parts import CommonLevel, Figure, FigureData, Paper, Sensitivity, Table
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError

ABOUT: dict[str, Any] = {
    "key": "toy", "title": "T", "authors": ("A",), "year": None, "venue": "", "doi": "", "summary": "", "bibtex": "",
}  # fmt: skip
PRINTED = PrintedValue("1.14", "Table 1, column (2,1)", "s")


def compute(base: float) -> float:
    return base


def answer(results: Results) -> Evidence:
    """The optimal level
    for both sensors.
    """
    return Evidence(method="read", value=results["motor"])


def level(name: str, results: Results) -> Evidence:
    return Evidence(method="read", value=results[name])


def proof(results: Results) -> Proof:
    return Proof(holds=results["motor"] > 0, text=", ".join(results))


def drawn(results: Results) -> FigureData:
    return FigureData(columns={"x": (results["motor"],)})


def levels(results: Results) -> tuple[Sensitivity, ...]:
    row = {"claim": "table1.n21", "parameter": "A", "printed": "1", "base": results["motor"], "low": None, "high": 1.0}
    return (Sensitivity(**row),)


def common(results: Results) -> tuple[CommonLevel, ...]:
    return (CommonLevel(sensor="slow", multiple=1, lower=0.0, upper=results["motor"], measure="gain"),)


def sample() -> Paper:
    table, motor = Part("Table 1", reading="none", figures="levels", also="motor.speed"), Part("Sec. V", reading="none")
    table.value("table1.n21", PRINTED, pinned="differs", erratum="slip")(answer)
    motor.order("motor.speed", place="Sec. V", statement="It turns.")(partial(level, "motor"))
    motor.cited("motor.seconds", "3", place="Sec. V", statement="It takes 3 s.", reason="of that computer")
    figure = Figure(
        name="levels", place="Fig. 1", title="L", caption="", published=True, uses=("motor",), data=drawn,
        plot=repr, alt=repr,
    )  # fmt: skip
    return paper(
        **ABOUT,
        parts=[table, motor, Part("Sec. VI", reason="a conclusion")],
        experiments=[experiment("motor", compute, base=PRINTED), experiment("other", compute, base=2)],
        errata=[Erratum(id="slip", place="p", printed="a", meant="b", prove=proof)],
        figures=[figure],
        tables=[Table(place="Table 1", caption="", header=("printed", "ours"), rows=((PRINTED, "claim:table1.n21"),))],
        findings=lambda results: tuple(sorted(results)),
        sensitivity=levels,
        common=common,
    )


RESULTS = {"toy.motor": 2.0, "toy.other": 3.0, "another.motor": 9.0}


def test_names_are_in_full_outside() -> None:
    made = sample()
    validate_claims([made])
    assert [claim.id for claim in made.claims] == ["toy.table1.n21", "toy.motor.speed", "toy.motor.seconds"]
    assert [claim.erratum for claim in made.claims] == ["toy.slip", None, None]
    assert [entry.name for entry in made.experiments] == ["toy.motor", "toy.other"]
    assert made.errata[0].id == "toy.slip"
    assert (made.figures[0].name, made.figures[0].uses) == ("toy-levels", ("toy.motor",))
    assert made.tables[0].rows == (("1.14", "claim:toy.table1.n21"),)
    assert type(made.tables[0].rows[0][0]) is str


def test_the_scope_is_the_parts_in_their_order() -> None:
    assert [(item.part, item.claims, item.figures, item.reason) for item in sample().scope] == [
        ("Table 1", ("toy.table1.n21", "toy.motor.speed"), ("toy-levels",), ""),
        ("Sec. V", ("toy.motor.speed", "toy.motor.seconds"), (), ""),
        ("Sec. VI", (), (), "a conclusion"),
    ]


def test_a_section_that_two_parts_declare_is_one_item_of_the_scope() -> None:
    first, again = (Part("Sec. 1", reading="none", figures=figures) for figures in ((), "levels"))
    for part, name in ((first, "a"), (again, "b")):
        part.value(name, PRINTED)(answer)
    (item,) = paper(**ABOUT, parts=[first, again], experiments=[]).scope
    assert (item.part, item.claims, item.figures) == ("Sec. 1", ("toy.a", "toy.b"), ("toy-levels",))


def test_each_kind_is_a_method_and_pins_agreement() -> None:
    pinned = dict.fromkeys((Kind.VALUE, Kind.MATRIX, Kind.BOUND), Verdict.REPRODUCED)
    pinned |= dict.fromkeys((Kind.ORDER, Kind.FEASIBLE), Verdict.CONSISTENT) | {Kind.STATISTICAL: Verdict.COMPATIBLE}
    for kind, verdict in pinned.items():
        part = Part("p")
        assert getattr(part, kind)("a.b", PRINTED)(answer) is answer
        (claim,) = part.claims
        assert (claim.kind, claim.expected, claim.printed, claim.place) == (kind, verdict, "1.14", PRINTED.place)
        assert type(claim.printed) is str
    part.statistical("a", place="Fig. 2")(answer)
    assert part.claims[-1].expected is Verdict.CONSISTENT, "a statement over draws"
    (cited,) = [claim for claim in sample().claims if claim.kind is Kind.CITED]
    assert (cited.expected, cited.printed) == (Verdict.UNDETERMINED, "3")
    with pytest.raises(AuditError, match=r"claim 'a\.b' has no statement"):
        Part("p").cited("a.b", PRINTED, reason="of that computer")


def test_statement_and_reading_are_those_of_docstring_and_part_unless_given() -> None:
    part = Part("p", reading="start")
    part.value("a", PRINTED)(answer)
    part.value("b", PRINTED, statement="Given.", place="Sec. 2", reading="norm")(partial(partial(level), "motor"))
    made = paper(**ABOUT, parts=[part], experiments=(), readings=(Reading(name="start", place="p", text="at rest"),))
    assert [claim.statement for claim in made.claims] == ["The optimal level for both sensors.", "Given."]
    assert ([claim.reading for claim in made.claims], made.claims[1].place) == (["start", "norm"], "Sec. 2")
    assert [reading.name for reading in made.readings] == ["start"]


@pytest.mark.parametrize(
    ("told", "function", "message"),
    [
        ({"printed": 1.14, "place": "p"}, answer, r"claim 'a\.b' prints 1\.14; write a string"),
        ({"printed": "1.14"}, answer, r"claim 'a\.b' has no place; give place="),
        ({"printed": PrintedValue("1.14")}, answer, r"claim 'a\.b' has no place"),
        ({"printed": PRINTED}, partial(level, "motor"), r"claim 'a\.b' has no statement; give statement="),
        ({"printed": PRINTED}, lambda results: Evidence(method=""), r"claim 'a\.b' has no statement"),
        (
            {"printed": PRINTED, "pinned": "agrees"},
            answer,
            r"unknown verdict of claim 'a\.b': 'agrees'; there are:",
        ),
    ],
)
def test_a_claim_that_says_too_little_is_refused(told: dict[str, Any], function: Any, message: str) -> None:
    part = Part("p")
    with pytest.raises(AuditError, match=message):
        part.value("a.b", **told)(function)
    assert part.claims == []


@pytest.mark.parametrize("name", ["toy.level", "toy."])
def test_a_name_with_the_key_in_front_is_refused(name: str) -> None:
    claims = Part("p")
    claims.value(name, PRINTED)(answer)
    for told in (
        {"parts": [claims]},
        {"parts": [Part("p", also=name)]},
        {"experiments": [experiment(name, compute, base=1)]},
        {"experiments": [replace(experiment("a", compute, base=1), needs=(name,))]},
        {"tables": [Table(place="p", caption="", header=(), rows=((f"claim:{name}",),))]},
    ):
        with pytest.raises(AuditError, match=r"begins with the key of its paper; leave 'toy\.' out"):
            paper(**{**ABOUT, "parts": (), "experiments": (), **told})
    with pytest.raises(AuditError, match=r"leave 'toy-' out"):
        paper(**ABOUT, parts=[Part("p", figures="toy-levels")], experiments=())


def test_inputs_of_an_experiment_are_plain() -> None:
    inputs = experiment("motor", compute, plant={"A": PRINTED}, rows=[PRINTED, [1]], pair=(PRINTED, 2.5)).inputs
    assert inputs == {"plant": {"A": "1.14"}, "rows": ["1.14", [1]], "pair": ("1.14", 2.5)}
    assert {type(text) for text in (inputs["plant"]["A"], inputs["rows"][0], inputs["pair"][0])} == {str}


def test_code_is_located_where_the_paper_defines_it() -> None:
    tree = SourceTree({"tests": Path(__file__).parents[1]})
    made = sample()

    def line(function: Any) -> str:
        return f"tests/audit/test_declare.py:{inspect.getsourcelines(function)[1]}"

    located = [tree.location(claim.answer) for claim in made.claims[:2]]
    assert located == [line(answer), line(level)]
    assert tree.location(made.errata[0].prove) == line(proof)
    assert tree.location(made.figures[0].data) == line(drawn)


def test_evidence_of_a_margin_and_of_a_residual() -> None:
    for margin in (0.5, 0.0, -1.0):
        evidence = positive(margin, method="counted")
        assert (evidence.holds, evidence.margin, evidence.threshold) == (margin > 0, margin, None)
    for residual, holds in ((0.25, True), (1.0, False), (2.0, False)):
        evidence = below(residual, 1.0, "rounding", method="counted", note="n")
        assert (evidence.holds, evidence.margin, evidence.threshold) == (holds, 1.0 - residual, 1.0)
        assert (evidence.threshold_reason, evidence.note) == ("rounding", "n")


@pytest.mark.parametrize(("printed", "fits"), [("1.41", False), (PRINTED, True), ("1.14", True), ("eq. (2)", True)])
def test_a_number_of_an_erratum_is_one_that_is_printed(printed: str, fits: bool) -> None:
    table = Part("Table 1", reading="none")
    table.value("n21", PRINTED, statement="A gain.")(answer)
    slip = Erratum(id="slip", place="p. 2", printed=printed, meant="b", prove=proof)
    told = nullcontext() if fits else pytest.raises(AuditError, match=r"'slip' .p. 2. has '1.41' as printed, which no")
    with told:
        paper(**ABOUT, parts=[table], experiments=[], errata=[slip])
