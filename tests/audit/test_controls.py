"""The controls of the report: alterations are tried wherever they fit, and one that goes unnoticed is told."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from cases import altered, recorded, results_file
from msgspec.structs import replace
from sample import claim, paper_record
from tables import rows

from replication.audit.data import read_printed
from replication.audit.declare import Part, experiment, paper
from replication.audit.inspect import headline as module
from replication.audit.inspect.headline import Control, moved, notes
from replication.audit.judge.printed import parse, sensitivities, spread
from replication.audit.judge.verdict import rejudge
from replication.audit.model import AGREES, Evidence, Experiment, Judgement, Kind, Proof, Verdict
from replication.audit.parts import Paper, Sensitivity
from replication.audit.report.claim import targets
from replication.audit.report.sections import lineages, rooms
from replication.audit.run.assemble import assemble
from replication.audit.run.worker import Action, Step
from replication.audit.store.cache import Dependencies, Entry
from replication.audit.store.records import ResultsFile
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError, InfeasibleError


def controls(results: ResultsFile) -> tuple[Control, ...]:
    return module.controls(results, targets(results.claims))


@pytest.fixture(scope="module")
def results(made: ResultsFile) -> ResultsFile:
    return made


@pytest.mark.parametrize(
    ("printed", "expected"),
    [
        ("1.33", ["1.34", "1.32"]),
        (".2357", ["0.2358", "0.2356"]),
        ("−0.0000", ["-0.0001"]),
        ("[0.5 -1; 0 2]", ["[0.6 -1; 0 2]", "[0.4 -1; 0 2]", "[0.5 -2; 0 2]", "[0.5 -0; 0 2]", "[0.5 -1; 1 2]",
                           "[0.5 -1; 0 3]", "[0.5 -1; 0 1]"]),
        ("66,033", ["66034", "66032"]),
        ("1.2×10^-3", ["0.0013", "0.0011"]),
        ("1.2–1.4", ["(1.3, 1.4)", "(1.1, 1.4)", "(1.2, 1.5)", "(1.2, 1.3)"]),
        ("(1, 2±0.5i)", ["(2, 2±0.5i)", "(0, 2±0.5i)", "(1, 3±0.5i)", "(1, 1±0.5i)", "(1, 2±0.6i)", "(1, 2±0.4i)"]),
    ],
)  # fmt: skip
def test_each_number_is_moved_by_its_last_place(printed: str, expected: list[str]) -> None:
    assert list(moved(parse(printed))) == expected


def test_every_alteration_is_caught_where_nothing_wider_is_allowed(results: ResultsFile) -> None:
    strict = replace(results, claims=tuple(claim for claim in results.claims if claim.claim.tolerance is None))
    made = controls(strict)
    assert len(made) >= 4
    assert all(control.tried and control.caught == control.tried and not control.missed for control in made)


def test_of_a_misprinted_result_what_is_meant_is_moved(results: ResultsFile) -> None:
    more = {"erratum": results.errata[0].id, "meant": "269", "proof": Proof(holds=True, text="t")}
    evidence = Evidence(method="ln 2 / k", value=268.6617)
    made = claim("half", Kind.VALUE, Verdict.REPRODUCED_AFTER_ERRATUM, "296", evidence, **more)
    found = {control.altered: control for control in controls(replace(results, claims=(made,), certificates=()))}
    control = found["a printed number moved by a unit of its last place"]
    assert (control.tried, control.caught, control.missed) == (2, 2, ())


@pytest.mark.parametrize(
    ("printed", "value", "more", "tried"),
    [
        ("30.8", 30.85, {}, 0),
        ("30.9", 30.85, {}, 0),
        ("30.8", 30.84, {}, 2),
        ("33.0 ± 5.1", (33.0, 5.1), {"uncertainty": "sd"}, 4),
        ("33.0 ± 5.1", 33.0, {"uncertainty": "none"}, 2),
    ],
)
def test_what_agrees_with_two_prints_or_with_two_numbers(
    results: ResultsFile, printed: str, value: Any, more: dict[str, Any], tried: int
) -> None:
    made = claim("mean", Kind.VALUE, Verdict.REPRODUCED, printed, Evidence(method="mean", value=value), **more)
    found = {one.altered: one for one in controls(replace(results, claims=(made,), certificates=()))}
    assert all(one.caught == one.tried for one in found.values())
    assert sum("moved by a unit" in name and one.tried for name, one in found.items()) == tried


def test_a_judge_that_always_agrees_is_found_out(results: ResultsFile, monkeypatch: pytest.MonkeyPatch) -> None:
    blind = Judgement(verdict=Verdict.REPRODUCED, reason="always")
    monkeypatch.setattr(module, "rejudge", lambda record, errata, target, readings: blind)
    by_name: dict[str, Control] = {control.expected: control for control in controls(results)}
    assert by_name["no agreement"].caught == 0
    assert by_name["no agreement"].missed
    assert by_name["agreement"].caught == by_name["agreement"].tried


def test_a_tolerance_wider_than_a_unit_is_listed(results: ResultsFile) -> None:
    claim = next(c for c in results.claims if c.verdict is Verdict.REPRODUCED and c.judgement.deviation_ulp is not None)
    wide = altered(claim, tolerance="1000", tolerance_reason="for the test")
    (prints, *_) = controls(replace(results, claims=(wide,)))
    assert prints.missed == (wide,)
    assert prints.caught == 0


def test_lineage_joins_each_claim_to_its_experiments(results: ResultsFile) -> None:
    joined = {(record.name, claim.id) for _, pairs in lineages(results) for record, claims in pairs for claim in claims}
    known = {record.name for record in results.experiments}
    assert joined == {(name, c.id) for c in results.claims for name in c.claim.uses if name in known} != set()
    assert all(record.paper == paper.key for paper, pairs in lineages(results) for record, _ in pairs)


def test_sections_are_left_out_without_claims(results: ResultsFile, tmp_path: Path) -> None:
    empty = replace(results, claims=())
    assert controls(empty) == ()
    assert lineages(empty) == ()


def test_what_is_denied_is_judged_as_a_statement_that_does_not_hold(results: ResultsFile) -> None:
    """And not refused as evidence that contradicts itself, which would count as noticed too."""
    errata, tried = {erratum.id: erratum for erratum in results.errata}, 0
    for made in results.claims:
        for name, record, known in module._alterations(made, errata, None):
            if name == "a statement that holds turned into one that does not":
                verdict = rejudge(record, known, readings=results.readings.get(made.paper, ())).verdict
                tried += 1
                assert verdict not in (Verdict.ERROR, *AGREES)
    assert tried >= 2


# Parameters moved within their rounding, and the room that a claim has


def total(numbers: Any) -> dict[str, float]:
    return {"toy.sum": sum(numbers["A"][0]) + 10 * numbers["A"][1][1] + numbers["b"] + sum(numbers["c"])}


def test_each_printed_number_with_decimals_is_moved_alone() -> None:
    found = spread({"A": "[0.5 -1; 0 .25]", "b": "3.0", "c": "(1, 2.50)"}, total)["rows"]
    assert {row["base"] for row in found} == {0.5 - 1 + 2.5 + 3 + 3.5}
    assert [(row["parameter"], row["printed"]) for row in found] == [
        ("A(1,1)", "0.5"), ("A(2,2)", ".25"), ("b", "3.0"), ("c(2)", "2.50"),
    ]  # fmt: skip
    moves = [row["high"] - row["base"] for row in found]
    assert moves == pytest.approx([0.05, 0.05, 0.05, 0.005])
    assert [row["low"] for row in found] == pytest.approx([8.5 - move for move in moves])
    assert [(one.claim, one.parameter, one.base) for one in sensitivities({"rows": found})] == [
        ("toy.sum", row["parameter"], 8.5) for row in found
    ]


def test_a_parameter_without_a_result_is_told_and_other_errors_are_not_hidden() -> None:
    def fragile(numbers: Any) -> dict[str, float]:
        if numbers["a"] > 0.5:
            raise InfeasibleError("too large")
        return {"toy.a": numbers["a"]}

    (row,) = spread({"a": "0.5"}, fragile)["rows"]
    assert row["high"] is None
    assert row["low"] == pytest.approx(0.45)
    with pytest.raises(ZeroDivisionError):
        spread({"a": "0.5"}, lambda numbers: {"x": 1 / 0})


def file_with(printed: str, value: float, *ends: tuple[float | None, float | None]) -> ResultsFile:
    claim = recorded(Evidence(method="m", value=value), printed=printed)
    moves = tuple(
        Sensitivity(claim=claim.id, parameter=f"p{i}", printed="0.5", base=value, low=low, high=high)
        for i, (low, high) in enumerate(ends)
    )
    paper = replace(paper_record((claim.id,)), sensitivity=moves)
    return replace(results_file(claim), papers=(paper,))


@pytest.mark.parametrize(("value", "ends", "agrees", "shares", "deciding"), rows("rooms"))
def test_room_is_the_part_of_the_rounding_that_the_claim_bears_or_that_reaches_its_print(
    value: float, ends: Any, agrees: bool, shares: Any, deciding: tuple[str, ...]
) -> None:
    """The first to decide leads; what never reaches the print, or moves nothing, comes last."""
    (found,) = rooms(file_with("1.33", value, *ends))
    assert found.agrees is agrees
    expected = [(name, None if share is None else pytest.approx(share)) for name, share in shares]
    assert [(moves.parameter, share) for moves, share in found.rooms] == expected
    assert [moves.parameter for moves, _ in found.deciding] == [*deciding]


def test_an_unknown_claim_is_an_error() -> None:
    file = file_with("1.33", 1.33, (1.33, 1.33))
    with pytest.raises(AuditError, match="which is no claim"):
        rooms(replace(file, claims=()))


PRINTED = """
[patients]
place = "Sec. 2"
value = "0.75"
[doses]
place = "Table 1, {key}"
value = { low = "1.20", high = "9.99" }
[size]
place = "Sec. 1"
value = "0.75"
"""


@pytest.fixture
def data(tmp_path: Path) -> Any:
    (tmp_path / "printed.toml").write_text(PRINTED, encoding="utf-8")
    return read_printed(tmp_path / "printed.toml")


def asked(
    printed: str, answer: Callable[[Any], Evidence], done: dict[str, Step], *made: Experiment
) -> tuple[Paper, ResultsFile]:
    """A paper with one claim, which rests on these experiments, and the file of its run."""
    part, about = Part("Sec. 2", reading="none"), dict.fromkeys(("title", "venue", "doi", "summary", "bibtex"), "")
    part.value("it", printed, statement="It is computed.")(answer)
    whole = paper(key="toy", authors=(), year=2020, parts=(part,), experiments=made, **about)
    return whole, assemble([whole], done, results_file().run, SourceTree({}), (), {})[0]


@pytest.mark.parametrize(
    ("name", "answer", "moved"),
    [
        ("patients", lambda data: Evidence(method="copied", value=float(data["patients"])), "0.76"),
        ("patients", lambda data: Evidence(method="scaled", value=0.999 * float(data["patients"])), "0.76"),
        ("patients", lambda data: bracket(float(data["patients"])), "0.76"),
        ("high", lambda data: Evidence(method="copied", value=float(data["doses"]["high"])), "9.98"),
        ("high", lambda data: Evidence(method="copied", value=float(dict(data["doses"].items())["high"])), "9.98"),
        ("patients", lambda data: Evidence(method="another number", value=float(data["size"])), ""),
        ("patients", lambda data: Evidence(method="a bit of it", value=0.75 + 1e-3 * float(data["patients"])), ""),
        ("patients", lambda data: Evidence(method="compared", value=0.751, note=f"Not {data['patients']}."), ""),
        ("patients", lambda data: Evidence(method="computed", value=0.751), ""),
    ],
)
def test_a_claim_does_not_answer_itself(data: Any, name: str, answer: Callable[[Any], Evidence], moved: str) -> None:
    printed = data["doses"]["high"] if name == "high" else data["patients"]
    _, file = asked(printed, lambda results: answer(data), {})
    error = file.claims[0].judgement.reason if file.claims[0].verdict is Verdict.ERROR else ""
    assert ("claim toy.it answers itself: with " + moved in error) if moved else not error, error


def test_a_print_that_is_no_number_may_be_read(tmp_path: Path) -> None:
    (tmp_path / "printed.toml").write_text('[word]\nplace = "Sec. 2"\nvalue = "unstable"\n', encoding="utf-8")
    data = read_printed(tmp_path / "printed.toml")
    part = Part("Sec. 2", reading="none")

    @part.order("it", data["word"])
    def it(results: Any) -> Evidence:
        """It is so."""
        return Evidence(method="by its poles", holds=data["word"] == "unstable", margin=1.0)

    about = dict.fromkeys(("title", "venue", "doi", "summary", "bibtex"), "")
    whole = paper(key="toy", authors=(), year=2020, parts=(part,), experiments=(), **about)
    file, _, _ = assemble([whole], {}, results_file().run, SourceTree({}), (), {})
    assert file.claims[0].verdict is Verdict.CONSISTENT


@pytest.mark.parametrize(("value", "told"), [(0.75, True), (0.7501, False)])
def test_an_experiment_does_not_hand_its_print_back(tmp_path: Path, data: Any, value: float, told: bool) -> None:
    dependencies = Dependencies(function="", inputs="{}")
    entry = Entry(dependencies=dependencies, seconds=0.0, solvers=(), result=value)
    done = Step("toy.back", Action.COMPUTED, "", 0.0, dependencies, entry)
    back = experiment("back", float, x=[{"of": data["patients"]}])
    whole, file = asked(
        data["patients"],
        lambda results: Evidence(method="by an experiment", value=results["back"]),
        {"toy.back": done},
        back,
    )
    assert (file.claims[0].verdict is Verdict.ERROR) is told
    assert told is ("toy.back is given 0.75 and its value is exactly that" in file.claims[0].judgement.reason)
    (note,) = [note for note in notes([whole], file, (), tmp_path, tmp_path) if "only comes back" in note]
    assert note.endswith(": toy.it")


def bracket(end: float) -> Evidence:
    return Evidence(method="bracketed by itself", value=0.75, lower=0.74, upper=end)
