"""Decisions of a run, a check and an archive, on the functions alone: what `lab` tries in processes of their own."""

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import pytest
from cases import RUN, claim, paper, recorded, results_file
from msgspec import structs
from test_proofs import GAIN, LEVEL, certificate, stated

from replication.audit.judge.proofs import Wanted
from replication.audit.judge.proofs import record as certificate_record
from replication.audit.model import Erratum, Evidence, Kind, Proof, Verdict
from replication.audit.parts import Paper
from replication.audit.publish import terminal
from replication.audit.publish.linked_data import without_empty
from replication.audit.report.claim import views
from replication.audit.report.told import _targets
from replication.audit.run import certify, worker
from replication.audit.run.assemble import assemble
from replication.audit.run.runner import _longest_first
from replication.audit.run.tracing import traced
from replication.audit.run.worker import Action, Step, processes
from replication.audit.store.cache import Dependencies, Entry
from replication.audit.store.records import CertificateRecord, ClaimRecord, ResultsFile, unlike
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError

SOURCES = SourceTree({})


def assembled(made: Paper, *certificates: CertificateRecord) -> ResultsFile:
    """The results of a paper whose experiments gave nothing."""
    needed = Dependencies(function="m:f", inputs="{}")
    entry = Entry(dependencies=needed, seconds=0.5, solvers=(), result=None)
    computed = {one.name: Step(one.name, Action.COMPUTED, "", 0.5, needed, entry) for one in made.experiments}
    return assemble([made], computed, RUN, SOURCES, certificates, {})[0]


def of_claim(results: ResultsFile, name: str) -> ClaimRecord:
    return next(record for record in results.claims if record.id == name)


def test_a_certificate_proves_the_claims_that_it_names_and_no_others() -> None:
    says = stated(Kind.VALUE).says
    claims = [claim(id=name, says=says, reading="none", answer=lambda _: LEVEL) for name in ("toy.c1", "toy.c2")]
    found = assembled(paper(*claims), certificate(of=GAIN, lower="13255/10000", upper="13265/10000"))
    assert of_claim(found, "toy.c1").judgement.proved and not of_claim(found, "toy.c2").judgement.proved


@pytest.mark.parametrize(
    ("inference", "verdict"), [(False, Verdict.REPRODUCED_AFTER_ERRATUM), (True, Verdict.COMPATIBLE)]
)
def test_what_agrees_by_an_inference_is_compatible(inference: bool, verdict: Verdict) -> None:
    erratum = Erratum(
        id="toy.e1", place="eq. (1)", printed="a", meant="b", prove=lambda _: Proof(holds=True, text="t"),
        inference=inference,
    )  # fmt: skip
    made = claim(printed="3.13", meant="1.33", erratum="toy.e1", answer=lambda _: Evidence(method="m", value=1.33))
    assert of_claim(assembled(paper(made, errata=(erratum,))), made.id).verdict is verdict


@pytest.mark.parametrize(("proof", "holds", "error"), [(Proof(holds=True, text="t"), True, ""), (True, False, "Proof")])
def test_an_erratum_holds_by_a_proof_alone(proof: Any, holds: bool, error: str) -> None:
    erratum = Erratum(id="toy.e1", place="eq. (1)", printed="a", meant="b", prove=lambda _: proof)
    (record,) = assembled(paper(claim(), errata=(erratum,))).errata
    assert record.holds is holds and error in record.error and bool(record.error) is bool(error)
    # What the report says of it is shaken where it does not hold.
    (target,) = _targets(structs.replace(results_file(), errata=(record,), claims=())).values()
    assert target.shaken is not holds


def test_what_took_longest_is_begun_first_and_before_it_what_never_ran() -> None:
    plans: list[Any] = [
        (SimpleNamespace(name=name), SimpleNamespace(last_seconds=seconds))
        for name, seconds in (("short", 1.0), ("long", 9.0), ("new", None), ("middle", 3.0))
    ]
    assert [task.name for task in _longest_first(plans)] == ["new", "long", "middle", "short"]


@pytest.mark.parametrize(("again", "made"), [(False, ["toy/open"]), (True, ["toy/open", "toy/proved"])])
def test_certificates_that_are_proved_are_left_alone_unless_asked_for_again(
    tmp_path: Path, again: bool, made: list[str]
) -> None:
    asked: list[str] = []

    def compute(tasks: Sequence[worker.Task], jobs: int) -> list[worker.Answer]:
        asked.extend(task.name for task in tasks)
        return []

    with patch.multiple(
        certify,
        papers=lambda root: ["toy"],
        theorems=lambda key, root: ({"open": None, "proved": None}, {}),
        verify=lambda path, root: SimpleNamespace(theorem="It is so." if path.stem == "proved" else None),
        processes=compute,
    ):
        assert list(certify.certify(tmp_path, (), again=again, jobs=1)) == []
    assert asked == made


def test_each_leaf_that_differs_is_told() -> None:
    stored, found = {"a": [1, 2], "b": {"c": 3}, "d": None}, {"a": [1, 4], "b": {"c": 5}}
    assert list(unlike(stored, stored)) == []
    assert list(unlike(stored, found)) == [("a[1]", 2, 4), ("b.c", 3, 5), ("d", None, None)]
    assert list(unlike({}, {"e": 1})) == [("e", None, 1)]
    for other in ([1], [1, 2, 3]):
        assert list(unlike([1, 2], other, "a")) == [("a", [1, 2], other)]


def test_a_certificate_that_ended_in_an_error_is_not_proved() -> None:
    subject = {"sha256": "0", "subject": {"c.json": "0"}}
    wanted = Wanted(paper="toy", name="c", claims=("toy.c1",), statement="s.t", path="c.json", **subject)
    failed = certificate_record(wanted, None, "it failed")
    assert not failed.proved and failed.reason == "it failed"
    result = {"sentence": "So.", "reason": "", "lower": None, "upper": None, "holds": True, "items": [], "says": []}
    proved = certificate_record(wanted, result, "")
    assert proved.proved
    (told,) = terminal.unproved(SimpleNamespace(certificates=(proved, failed)))  # type: ignore[arg-type]
    assert told is failed


def test_there_is_at_least_one_process() -> None:
    for jobs in (0, -2):
        with pytest.raises(AuditError, match=f"the number of jobs must be at least 1, got {jobs}"):
            list(processes([], jobs))


def test_what_is_read_counts_and_what_is_written_does_not(tmp_path: Path) -> None:
    (tmp_path / "read").write_text("1")
    with traced(tmp_path) as found:
        (tmp_path / "read").read_text()
        (tmp_path / "written").write_text("2")
        (tmp_path / "written").read_text()
    (tmp_path / "later").write_bytes(b"")
    (tmp_path / "later").read_bytes()
    assert [Path(path).name for path in found.read if Path(path).parent == tmp_path] == ["read"]


def test_an_error_is_told_as_an_error_and_not_as_a_changed_verdict() -> None:
    failed = recorded(None, error="it failed", id="toy.failed")
    moved = recorded(Evidence(method="m", value=2.5), id="toy.moved")
    results: Any = SimpleNamespace(claims=(failed, moved, recorded(Evidence(method="m", value=1.33))))
    assert failed.unexpected and moved.unexpected
    assert terminal.unexpected(results) == (moved,)


def test_fields_that_say_nothing_are_left_out() -> None:
    assert without_empty({"a": "", "b": [], "c": None, "d": 0, "e": ["x"]}) == {"d": 0, "e": ["x"]}


def test_the_residual_of_a_claim_is_what_the_margin_leaves_of_the_threshold() -> None:
    evidence = Evidence(method="m", holds=True, margin=0.75, threshold=1.0, threshold_reason="why")
    (view,) = views([recorded(evidence, kind=Kind.ORDER, printed="")], {})
    assert view.residual == 0.25
