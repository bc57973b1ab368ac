"""The difference of two results files: what changed, in which order it is told, and its causes."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from cases import EXPERIMENT, RUN, altered, claim, errata_of, file_of, paper, recorded, results_file
from msgspec.structs import replace

from replication.audit.inspect.compare import Cause, FieldChange, compare, moved, render
from replication.audit.model import Evidence, Proof, SolverRecord, Verdict
from replication.audit.store.records import ClaimRecord, ResultsFile


def record(value: float = 1.3268, **more: Any) -> ClaimRecord:
    return recorded(Evidence(method="m", value=value), uses=("toy-run",), **more)


HONEST = file_of(paper(claim()), record())
OLD = results_file(record())
MOVED = results_file(record(1.3269))
SOLVER = SolverRecord(name="s", version="1", status="solved", options={"eps": 1e-9})


def only(old: ResultsFile, new: ResultsFile) -> tuple[Cause, ...]:
    (change,) = compare(old, new)
    return change.causes


def test_equal_files_have_no_change() -> None:
    assert compare(OLD, OLD) == []
    assert render([]) == ["No claim changed."]


def test_seconds_and_lines_of_code_are_no_change() -> None:
    other = results_file(altered(record(), seconds=99.0, code="papers/toy.py:7"))
    assert compare(OLD, other) == []


@pytest.mark.parametrize(
    ("new", "causes"),
    [
        (MOVED, (Cause.UNEXPLAINED,)),
        (results_file(record(printed="1.34")), (Cause.CLAIM,)),
        (results_file(record(statement="Another.")), (Cause.CLAIM,)),
        (replace(MOVED, experiments=(replace(EXPERIMENT, key="k1"),)), (Cause.CODE,)),
        (replace(MOVED, experiments=(replace(EXPERIMENT, key="k1", inputs={"n": 3}),)), (Cause.INPUTS,)),
        (replace(MOVED, experiments=(replace(EXPERIMENT, solvers=(SOLVER,)),)), (Cause.SOLVER,)),
        (replace(MOVED, run=replace(RUN, lock_sha256="l1")), (Cause.LOCK,)),
        (replace(MOVED, run=replace(RUN, packages={"numpy": "2.2"})), (Cause.PACKAGES,)),
        (replace(MOVED, run=replace(RUN, python="3.12.0")), (Cause.PACKAGES,)),
        (replace(MOVED, run=replace(RUN, cpu="another")), (Cause.MACHINE,)),
        (replace(MOVED, run=replace(RUN, commit="c1")), (Cause.SOURCES,)),
        (replace(MOVED, run=replace(RUN, dirty=True)), (Cause.SOURCES,)),
        (replace(MOVED, run=replace(RUN, lock_sha256="l1", cpu="another")), (Cause.LOCK, Cause.MACHINE)),
    ],
)
def test_causes_are_what_is_known_to_differ(new: ResultsFile, causes: tuple[Cause, ...]) -> None:
    assert only(OLD, new) == causes


def test_another_key_under_another_lock_is_not_blamed_on_the_code() -> None:
    new = replace(MOVED, run=replace(RUN, lock_sha256="l1"), experiments=(replace(EXPERIMENT, key="k1"),))
    assert only(OLD, new) == (Cause.LOCK,)


def test_a_proof_that_no_longer_holds_is_a_cause() -> None:
    evidence = Evidence(method="m", value=1.33, as_printed=Evidence(method="m", value=2.0))
    files = []
    for proof in (Proof(holds=True, text=""), Proof(holds=False, text="")):
        made = recorded(evidence, proof, erratum="toy.e1")
        files.append(results_file(made, errata=tuple(errata_of(made, proof).values())))
    change, beside = compare(*files)
    assert beside.record == "erratum toy.e1" and beside.causes == ()
    assert (change.old, change.new) == (Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.DIFFERS)
    assert change.causes == (Cause.ERRATUM,)


def test_changed_verdicts_come_first_then_ids() -> None:
    old = results_file(*(record(id=f"toy.{name}") for name in "abcd"))
    new = results_file(
        record(1.3269, id="toy.a"), record(1.34, id="toy.c"), record(id="toy.d"), record(1.3269, id="toy.e")
    )
    changes = compare(old, new)
    assert [change.record for change in changes] == ["toy.b", "toy.c", "toy.e", "toy.a"]
    assert [change.causes[0] for change in changes[:3]] == [Cause.GONE, Cause.UNEXPLAINED, Cause.NEW]


def test_render_tells_verdicts_numbers_and_causes() -> None:
    lines = render(compare(OLD, results_file(record(1.34))))
    assert lines[0] == "toy.value: reproduced → differs"
    assert any("value: 1.3268 → 1.34 (+9.95e-03 relative)" in line for line in lines)
    assert lines[-1] == f"    cause: {Cause.UNEXPLAINED}"


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


def test_changes_are_plain_json() -> None:
    decoded = msgspec.json.decode(msgspec.json.encode(compare(OLD, results_file(record(1.34)))))
    assert decoded[0]["record"] == "toy.value"
    assert decoded[0]["fields"][0] == {"field": "verdict", "old": "reproduced", "new": "differs"}


def test_what_changed_beside_the_claims_is_listed() -> None:
    assert compare(HONEST, HONEST) == [] and render([]) == ["No claim changed."]
    (erratum,) = HONEST.errata
    moved = replace(erratum, holds=False, quantities={"gap": 2.0}, code="elsewhere:9")
    change = compare(HONEST, replace(HONEST, errata=(moved,)))[-1]
    assert [(field.field, field.old, field.new) for field in change.fields] == [
        ("holds", True, False),
        ("quantities", {}, {"gap": 2.0}),
    ]
    assert compare(HONEST, replace(HONEST, errata=(replace(erratum, code="elsewhere:9"),))) == []
    (page,) = HONEST.papers
    lines = render(compare(HONEST, replace(HONEST, papers=(replace(page, findings=("long " * 99,)),))))
    assert lines[:2] == ["No claim changed.", "paper toy changed"]
    assert lines[2].startswith("    findings: () → ('long ") and len(lines[2]) < 250
    gone = compare(HONEST, replace(HONEST, errata=()))[-1]
    assert gone.record == "erratum toy.e1" and all(field.new is None for field in gone.fields)
