"""A results file against itself, the code and another run: what is changed by hand is found, what differs is told."""

from typing import Any

import pytest
from cases import EXPERIMENT, PROOF, RUN, altered, claim, errata_of, file_of, paper, recorded, results_file
from msgspec.structs import replace
from sample import figure

from replication.audit.inspect.check import Cause, check, stated
from replication.audit.inspect.compare import Cause as Reason
from replication.audit.inspect.compare import FieldChange, compare, moved, render
from replication.audit.judge.verdict import rejudge
from replication.audit.model import Evidence, Kind, Proof, Reading, SolverRecord, Verdict
from replication.audit.parts import Table
from replication.audit.store.records import PARTS, ClaimRecord, ResultsFile

PROVED = Proof(holds=True, text="it does")
GOOD = recorded(Evidence(method="m", value=1.3268, lower=1.3267, upper=1.3269))
OFF = recorded(Evidence(method="m", value=1.34), expected=Verdict.DIFFERS)
HOLDS = recorded(Evidence(method="m", holds=True, margin=0.1), kind=Kind.ORDER, expected=Verdict.CONSISTENT)
CITED = recorded(Evidence(method="m", not_checkable="cited"), kind=Kind.CITED, expected=Verdict.UNDETERMINED)
CORRECTED = recorded(
    Evidence(method="m", value=1.33, as_printed=Evidence(method="m", value=2.0)),
    PROVED,
    erratum="toy.e1",
    expected=Verdict.REPRODUCED_AFTER_ERRATUM,
)
FAILED = recorded(None, error="ValueError: singular")


def causes(record: ClaimRecord, proof: Proof | None = PROVED) -> list[Cause]:
    errata = tuple(errata_of(record, proof).values())
    return [problem.cause for problem in check(results_file(record, errata=errata), None)]


@pytest.mark.parametrize("record", [GOOD, OFF, HOLDS, CITED, CORRECTED])
def test_an_honest_record_has_no_problem(record: ClaimRecord) -> None:
    assert causes(record) == []


@pytest.mark.parametrize("record", [GOOD, OFF, HOLDS, CITED, CORRECTED, FAILED])
@pytest.mark.parametrize("verdict", list(Verdict))
def test_a_verdict_cannot_be_set_by_hand(record: ClaimRecord, verdict: Verdict) -> None:
    # Even with the pinned verdict and the reason changed to fit.
    forged = altered(record, verdict=verdict, expected=verdict, reason="because")
    if verdict is not record.verdict:
        assert Cause.FORGED in causes(forged)


@pytest.mark.parametrize(
    ("record", "change"),
    [
        (GOOD, {"value": 1.3368, "lower": None, "upper": None}),
        (GOOD, {"upper": 1.3369}),
        (GOOD, {"deviation_ulp": 0.0}),
        (GOOD, {"intervals": (("1/1", "2/1"),)}),
        (GOOD, {"intervals": ()}),
        (GOOD, {"proved": True}),
        (GOOD, {"reason": "It agrees."}),
        (GOOD, {"printed": "1.34"}),
        (GOOD, {"kind": Kind.ORDER}),
        (GOOD, {"method": ""}),
        (OFF, {"tolerance": "0.1", "tolerance_reason": "it is close"}),
        (OFF, {"not_checkable": "it is hard"}),
        (HOLDS, {"holds": False}),
        (HOLDS, {"margin": -0.1}),
        (CITED, {"not_checkable": ""}),
        (CORRECTED, {"as_printed": Evidence(method="m", value=1.33)}),
        (CORRECTED, {"erratum": "toy.e2"}),
    ],
)
def test_a_number_changed_by_hand_is_found(record: ClaimRecord, change: dict[str, Any]) -> None:
    errata = tuple(errata_of(record, PROVED).values())
    problems = check(results_file(altered(record, **change), errata=errata), None)
    assert Cause.FORGED in [problem.cause for problem in problems]
    assert all(problem.where == record.id for problem in problems)


@pytest.mark.parametrize("proof", [None, Proof(holds=False, text="it does not")])
def test_a_corrected_claim_falls_with_its_proof(proof: Proof | None) -> None:
    assert Cause.FORGED in causes(CORRECTED, proof)


def test_a_proof_that_failed_does_not_count_even_if_marked_as_holding() -> None:
    (erratum,) = errata_of(CORRECTED, PROVED).values()
    problems = check(results_file(CORRECTED, errata=(replace(erratum, error="ValueError: no"),)), None)
    assert (CORRECTED.id, Cause.FORGED) in [(problem.where, problem.cause) for problem in problems]


def test_a_changed_verdict_is_a_problem_and_a_pinned_difference_is_none() -> None:
    (problem,) = check(results_file(altered(OFF, expected=Verdict.REPRODUCED)), None)
    assert problem.cause is Cause.CHANGED_VERDICT
    assert "'differs'" in str(problem) and "'reproduced'" in str(problem) and "1.34" in str(problem)


@pytest.mark.parametrize(
    ("inferred", "verdict"), [(True, Verdict.COMPATIBLE), (False, Verdict.REPRODUCED_AFTER_ERRATUM)]
)
def test_a_record_judged_again_knows_whether_its_erratum_is_an_inference(inferred: bool, verdict: Verdict) -> None:
    evidence = Evidence(method="m", value=1.33, as_printed=Evidence(method="m", value=2.0))
    record = recorded(evidence, PROOF, erratum="toy.e1", inferred=inferred)
    errata = {name: replace(one, inference=inferred) for name, one in errata_of(record, PROOF).items()}
    assert record.verdict is verdict and rejudge(record, errata) == record.judgement
    others = {name: replace(one, inference=not inferred) for name, one in errata.items()}
    assert rejudge(record, others).verdict is not verdict


def test_errors_are_problems_with_their_text() -> None:
    (problem,) = check(results_file(FAILED), None)
    assert (problem.cause, problem.message) == (Cause.ERROR, "ValueError: singular")
    broken = replace(results_file(), experiments=(replace(EXPERIMENT, error="ValueError: no"),))
    (problem,) = check(broken, None)
    assert (problem.where, problem.cause, problem.message) == ("experiment toy-run", Cause.ERROR, "ValueError: no")


def test_repeated_claims_are_problems() -> None:
    assert [problem.cause for problem in check(results_file(GOOD, GOOD), None)] == [Cause.SET]


def test_claims_of_file_and_code_are_the_same_set() -> None:
    code = [paper(claim(), claim(id="toy.new"))]
    old = altered(GOOD, id="toy.old")
    problems = check(file_of(code[0], GOOD, old), code)
    assert [(problem.where, problem.cause) for problem in problems] == [
        ("toy.new", Cause.SET),
        ("toy.old", Cause.SET),
    ]
    assert check(file_of(paper(claim()), GOOD), [paper(claim())]) == []


CODE = paper(claim(), figures=(figure("toy-fig1"),), tables=(Table(place="T", caption="", header=("a",), rows=()),))
HONEST = file_of(CODE, GOOD)
NORM = Reading(name="norm", place="eq. (3)", text="the Euclidean norm")


@pytest.mark.parametrize("key", stated([CODE]), ids=" ".join)
def test_what_the_file_repeats_from_the_code_cannot_be_changed(key: tuple[str, str]) -> None:
    """Field by field; the name of a record, with which it is looked for, is a part that is missing."""
    sort = key[0]
    part, naming = PARTS[sort]
    (record,) = getattr(HONEST, part)
    for field, value in stated([CODE])[key].items():
        other: Any = not value if isinstance(value, bool) else "x"
        if isinstance(value, tuple):
            other = (NORM,) if field == "readings" else (*value, *value) or ("x",)
        said = replace(record.claim if sort == "claim" else record, **{field: other})
        forged = replace(record, claim=said) if sort == "claim" else said
        problems = check(replace(HONEST, **{part: (forged,)}), [CODE])
        told = [one for one in problems if one.cause is Cause.TEXT and one.message.startswith(f"{field} is")]
        assert told if field not in (naming, "paper") else problems, field


@pytest.mark.parametrize("part", ["papers", "errata", "figures", "experiments"])
def test_no_part_can_be_taken_out_or_put_in_twice(part: str) -> None:
    assert check(HONEST, [CODE]) == []
    records = getattr(HONEST, part)
    (problem,) = check(replace(HONEST, **{part: ()}), [CODE])
    assert problem.cause is Cause.SET and "in the code and not in the file" in problem.message
    (problem,) = check(replace(HONEST, **{part: (*records, *records)}), [CODE])
    assert problem.cause is Cause.SET and "stands 2 times" in problem.message


def test_the_readings_of_a_file_are_those_of_the_code_and_decide_again() -> None:
    code = paper(claim(reading="norm"), readings=(NORM,))
    record = recorded(Evidence(method="m", value=1.33), reading="norm", readings=(NORM,))
    file = file_of(code, record)
    assert check(file, [code]) == []
    guess = replace(NORM, inference=True)
    forged = replace(file, papers=(replace(file.papers[0], readings=(guess,)),))
    problems = check(forged, [code])
    assert {problem.cause for problem in problems} == {Cause.FORGED, Cause.TEXT}
    assert "the stored numbers give 'compatible'" in str(problems[0])
    unused = replace(file, papers=(replace(file.papers[0], readings=(NORM, replace(NORM, name="start"))),))
    assert "toy: text: no claim rests on the reading 'start'" in map(str, check(unused, None))


def record(value: float = 1.3268, **more: Any) -> ClaimRecord:
    return recorded(Evidence(method="m", value=value), uses=("toy-run",), **more)


WHOLE = file_of(paper(claim()), record())
OLD = results_file(record())
MOVED = results_file(record(1.3269))


def test_a_claim_of_the_file_rests_on_experiments_of_the_code() -> None:
    file = file_of(paper(claim()), recorded(Evidence(method="m", value=1.3268), uses=("toy-gone",)))
    assert any("uses toy-gone, which is no experiment" in str(problem) for problem in check(file, [paper(claim())]))


SOLVER = SolverRecord(name="s", version="1", status="solved", options={"eps": 1e-9})


def only(old: ResultsFile, new: ResultsFile) -> tuple[Reason, ...]:
    (change,) = compare(old, new)
    return change.causes


def test_seconds_and_lines_of_code_are_no_change() -> None:
    other = results_file(altered(record(), seconds=99.0, code="papers/toy.py:7"))
    assert compare(OLD, other) == []


@pytest.mark.parametrize(
    ("new", "causes"),
    [
        (MOVED, (Reason.UNEXPLAINED,)),
        (results_file(record(printed="1.34")), (Reason.CLAIM,)),
        (results_file(record(statement="Another.")), (Reason.CLAIM,)),
        (replace(MOVED, experiments=(replace(EXPERIMENT, key="k1"),)), (Reason.CODE,)),
        (replace(MOVED, experiments=(replace(EXPERIMENT, key="k1", inputs={"n": 3}),)), (Reason.INPUTS,)),
        (replace(MOVED, experiments=(replace(EXPERIMENT, solvers=(SOLVER,)),)), (Reason.SOLVER,)),
        (replace(MOVED, run=replace(RUN, lock_sha256="l1")), (Reason.LOCK,)),
        (replace(MOVED, run=replace(RUN, packages={"numpy": "2.2"})), (Reason.PACKAGES,)),
        (replace(MOVED, run=replace(RUN, python="3.12.0")), (Reason.PACKAGES,)),
        (replace(MOVED, run=replace(RUN, cpu="another")), (Reason.MACHINE,)),
        (replace(MOVED, run=replace(RUN, commit="c1")), (Reason.SOURCES,)),
        (replace(MOVED, run=replace(RUN, dirty=True)), (Reason.SOURCES,)),
        (replace(MOVED, run=replace(RUN, lock_sha256="l1", cpu="another")), (Reason.LOCK, Reason.MACHINE)),
        # Under another lock another key tells nothing of the code.
        (
            replace(MOVED, run=replace(RUN, lock_sha256="l1"), experiments=(replace(EXPERIMENT, key="k1"),)),
            (Reason.LOCK,),
        ),
    ],
)
def test_causes_are_what_is_known_to_differ(new: ResultsFile, causes: tuple[Reason, ...]) -> None:
    assert only(OLD, new) == causes


def test_a_proof_that_no_longer_holds_is_a_cause() -> None:
    evidence = Evidence(method="m", value=1.33, as_printed=Evidence(method="m", value=2.0))
    files = []
    for proof in (Proof(holds=True, text=""), Proof(holds=False, text="")):
        made = recorded(evidence, proof, erratum="toy.e1")
        files.append(results_file(made, errata=tuple(errata_of(made, proof).values())))
    change, beside = compare(*files)
    assert beside.record == "erratum toy.e1" and beside.causes == ()
    assert (change.old, change.new) == (Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.DIFFERS)
    assert change.causes == (Reason.ERRATUM,)


def test_changed_verdicts_come_first_then_ids() -> None:
    old = results_file(*(record(id=f"toy.{name}") for name in "abcd"))
    new = results_file(
        record(1.3269, id="toy.a"), record(1.34, id="toy.c"), record(id="toy.d"), record(1.3269, id="toy.e")
    )
    changes = compare(old, new)
    assert [change.record for change in changes] == ["toy.b", "toy.c", "toy.e", "toy.a"]
    assert [change.causes[0] for change in changes[:3]] == [Reason.GONE, Reason.UNEXPLAINED, Reason.NEW]


def test_render_tells_verdicts_numbers_and_causes() -> None:
    lines = render(compare(OLD, results_file(record(1.34))))
    assert lines[0] == "toy.value: reproduced → differs"
    assert any("value: 1.3268 → 1.34 (+9.95e-03 relative)" in line for line in lines)
    assert lines[-1] == f"    cause: {Reason.UNEXPLAINED}"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (-2.0, -1.0, "+5.00e-01 relative"),
        (0.0, 1.0, ""),
        (1, 2, ""),
        (1.0, (2.0,), ""),
        (1.0, 1.0, "+0.00e+00 relative"),
    ],
)
def test_only_a_number_that_was_not_zero_moves_relative_to_its_size(old: Any, new: Any, words: str) -> None:
    assert moved(FieldChange(field="value", old=old, new=new)) == words


def test_what_changed_beside_the_claims_is_listed() -> None:
    assert compare(WHOLE, WHOLE) == [] and render([]) == ["No claim changed."]
    (erratum,) = WHOLE.errata
    moved = replace(erratum, holds=False, quantities={"gap": 2.0}, code="elsewhere:9")
    change = compare(WHOLE, replace(WHOLE, errata=(moved,)))[-1]
    assert [(field.field, field.old, field.new) for field in change.fields] == [
        ("holds", True, False),
        ("quantities.gap", None, 2.0),
    ]
    assert compare(WHOLE, replace(WHOLE, errata=(replace(erratum, code="elsewhere:9"),))) == []
    (page,) = WHOLE.papers
    lines = render(compare(WHOLE, replace(WHOLE, papers=(replace(page, findings=("long " * 99,)),))))
    assert lines[:2] == ["No claim changed.", "paper toy changed"]
    assert lines[2].startswith("    findings: () → ('long ") and len(lines[2]) < 250
    gone = compare(WHOLE, replace(WHOLE, errata=()))[-1]
    assert gone.record == "erratum toy.e1" and all(field.new is None for field in gone.fields)
