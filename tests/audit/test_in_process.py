"""Decisions of a run, a check and an archive, on the functions alone: what `lab` tries in processes of their own."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import pytest
from cases import RUN, claim, paper, recorded, results_file
from msgspec import structs
from test_proofs import GAIN, LEVEL, certificate, joined_with, stated

from replication.audit.data import read_printed
from replication.audit.inspect import check as derive
from replication.audit.inspect.check import _moved
from replication.audit.inspect.headline import factor
from replication.audit.judge.proofs import Wanted
from replication.audit.judge.proofs import record as certificate_record
from replication.audit.judge.validate import require_typed
from replication.audit.judge.verdict import make_record
from replication.audit.model import Erratum, Evidence, Experiment, Kind, Proof, Verdict
from replication.audit.parts import Paper
from replication.audit.project import Project, Settings
from replication.audit.publish import archive, terminal
from replication.audit.publish.linked_data import without_empty
from replication.audit.report.claim import views
from replication.audit.report.opening.told import _targets
from replication.audit.run import certify, worker
from replication.audit.run.assemble import assemble
from replication.audit.run.draw import checksums as figure_checksums
from replication.audit.run.pool import Action, Step, processes
from replication.audit.run.runner import _longest_first
from replication.audit.run.tracing import traced
from replication.audit.store.cache import Dependencies, Entry
from replication.audit.store.records import CertificateRecord, ClaimRecord, ResultsFile
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError
from replication.verify.predicate import Predicate

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


def test_a_result_that_is_too_large_is_an_error() -> None:
    needed = Dependencies(function="json:loads", inputs="")
    task = worker.Task("toy.big", needed, '{"s": "[1, 2, 3, 4, 5, 6]"}', {})
    assert worker.compute(task).text is not None
    with patch.object(worker, "LARGEST", 10):
        answer = worker.compute(task)
    assert answer.text is None and "the result of toy.big has" in answer.error


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


def test_inputs_of_an_experiment_must_be_a_dictionary() -> None:
    def with_inputs(inputs: Any) -> Paper:
        return paper(claim(), experiments=(Experiment(name="toy-run", function=dict, inputs=inputs),))

    require_typed([with_inputs({"n": 2})], SOURCES)
    with pytest.raises(AuditError, match=r"experiment 'toy-run': inputs is \[2\]; give a dictionary"):
        require_typed([with_inputs([2])], SOURCES)


@pytest.mark.parametrize("found", [paper(claim(), key="other"), "a string", None])
def test_the_package_of_a_paper_must_define_the_paper_of_its_key(tmp_path: Path, found: Any) -> None:
    project = Project(tmp_path, Settings())
    with (
        patch("importlib.import_module", return_value=SimpleNamespace(PAPER=found)),
        pytest.raises(AuditError, match="papers/toy must define PAPER, a Paper whose key is 'toy'"),
    ):
        project._paper("toy")
    right = paper(claim())
    with patch("importlib.import_module", return_value=SimpleNamespace(PAPER=right)):
        assert project._paper("toy") is right


def test_each_leaf_that_differs_is_told() -> None:
    stored, found = {"a": [1, 2], "b": {"c": 3}}, {"a": [1, 4], "b": {"c": 5}}
    assert list(_moved("", stored, stored)) == []
    assert [text.partition(" is ")[0] for text in _moved("", stored, found)] == ["a[1]", "b.c"]
    for other in ([1], [1, 2, 3]):
        assert list(_moved("a", [1, 2], other)) == [f"a is [1, 2], and the kept results give {other}"]


def test_a_factor_is_one_of_all_numbers() -> None:
    def differing(*value: float) -> ClaimRecord:
        made = claim(kind=Kind.MATRIX, printed="[6.00 7.00]", expected=Verdict.DIFFERS)
        return make_record(made, Evidence(method="m", value=value), code="", seconds=0.0)

    assert factor(differing(360.0, 420.0)) == "60"
    assert factor(differing(360.0, 7.5)) == ""


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


def test_a_file_of_an_archive_that_was_changed_or_is_missing_is_named(tmp_path: Path) -> None:
    sums = []
    for name in ("kept", "edited", "gone"):
        (tmp_path / name).write_text(name)
        sums.append(f"{hashlib.sha256(name.encode()).hexdigest()}  {name}\n")
    (tmp_path / archive.MANIFEST).write_text("".join(sums))
    assert archive.changed_files(tmp_path) == ()
    (tmp_path / "edited").write_text("other")
    (tmp_path / "gone").unlink()
    assert archive.changed_files(tmp_path) == ("edited: changed", "gone: missing")


def test_what_can_be_run_can_be_run_when_it_is_unpacked(tmp_path: Path) -> None:
    for name, mode in (("run.sh", 0o755), ("text", 0o644)):
        (tmp_path / name).write_text(name)
        (tmp_path / name).chmod(mode)
    with patch.multiple(
        archive,
        read_results=lambda path: SimpleNamespace(run=None, figures=()),
        _require_unedited=lambda root, run: "c0",
        _sources=lambda root: ["run.sh", "text"],
        BUILT=(),
        read_software=lambda root: None,
        export_texts=lambda results, software: {},
        register_texts=lambda results, software: {},
        brings_the_tool=lambda root: True,
        crate=lambda *arguments: {},
    ):
        archive.write_archive(tmp_path, tmp_path / "all.zip")
    with zipfile.ZipFile(tmp_path / "all.zip") as packed:
        modes = {Path(one.filename).name: one.external_attr >> 16 for one in packed.infolist()}
    assert modes["run.sh"] & 0o111 == 0o111 and modes["text"] & 0o111 == 0


def test_a_theorem_in_another_unit_proves_nothing() -> None:
    proof = certificate(of=GAIN, lower="13255/10000", upper="13265/10000")
    for unit, proved in (("1", True), ("dB", False)):
        said = Predicate(of=GAIN, relation="is", to="1.33", unit=unit, reading="none")
        assert joined_with(Kind.VALUE, LEVEL, (proof,), said)[1] is proved


def test_yes_or_no_is_no_printed_number(tmp_path: Path) -> None:
    path = tmp_path / "printed.toml"
    for text, fits in (("3", True), ("true", False), ("1.5", False)):
        path.write_text(f'[n]\nplace = "Sec. I"\nvalue = {{ a = {text} }}\n')
        if fits:
            assert read_printed(path)["n"] == {"a": 3}
        else:
            with pytest.raises(AuditError, match="write a printed number as a string"):
                read_printed(path)


def test_what_begins_with_an_underscore_is_no_paper(tmp_path: Path) -> None:
    for name in ("toy", "_shared"):
        (tmp_path / "papers" / name).mkdir(parents=True)
        (tmp_path / "papers" / name / "__init__.py").write_text("")
    assert Project(tmp_path, Settings()).keys == ("toy",)


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


def test_figures_must_be_as_the_run_left_them(tmp_path: Path) -> None:
    (tmp_path / "one.csv").write_text("x")
    (tmp_path / "one.svg").write_text("<svg/>")
    left = figure_checksums(tmp_path, "one")
    drawn = {"one": SimpleNamespace(files=left)}
    again: Any = SimpleNamespace(results=results_file(), drawn=drawn, environment=None, log=())
    nothing: Any = {"_environment": lambda *args, **more: (), "_here": lambda *args: True, "_unknown": lambda *args: ()}
    with patch.multiple(derive, **nothing):
        assert list(derive.differences(results_file(), again, tmp_path)) == []
        (tmp_path / "one.csv").write_text("y")
        (problem,) = derive.differences(results_file(), again, tmp_path)
    assert problem.where == "one" and "not as the run left them" in problem.message


@pytest.mark.parametrize(("now", "dirty"), [(("c0", False), False), (("c0", True), False), (("c1", False), False),
                                            (("c0", False), True)])  # fmt: skip
def test_only_results_of_these_very_sources_are_packed(tmp_path: Path, now: tuple[str, bool], dirty: bool) -> None:
    run: Any = SimpleNamespace(commit="c0", dirty=dirty)
    with patch.object(archive, "git_state", return_value=now):
        if now == ("c0", False) and not dirty:
            assert archive._require_unedited(tmp_path, run) == "c0"
        else:
            with pytest.raises(AuditError, match="commit, then `replication run`"):
                archive._require_unedited(tmp_path, run)


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
