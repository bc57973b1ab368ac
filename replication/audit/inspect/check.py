"""Checking a results file without computing anything: its verdicts follow from its numbers, and it fits the papers."""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.judge.policies import same_fact
from replication.audit.judge.proofs import no_theorem, wanted, with_proofs
from replication.audit.judge.validate import unused_readings
from replication.audit.judge.verdict import rejudge
from replication.audit.model import Judgement, StatedClaim, Verdict
from replication.audit.parts import Paper
from replication.audit.run.draw import checksums
from replication.audit.run.runner import Outcome, run
from replication.audit.run.worker import Action, Answer, Task, function_name
from replication.audit.store.cache import Cache, encode
from replication.audit.store.provenance import kernel, python_minor
from replication.audit.store.records import (
    CertificateRecord,
    ClaimRecord,
    ErratumRecord,
    FigureRecord,
    PaperRecord,
    ResultsFile,
    RunRecord,
    shared,
    unlike,
)
from replication.errors import AuditError
from replication.files import sha256


class Cause(StrEnum):
    """What is wrong; a changed verdict and an error are findings of a run, the others faults of the file."""

    FORGED = "forged"
    CHANGED_VERDICT = "changed verdict"
    ERROR = "error"
    SET = "missing or extra"
    TEXT = "text"
    CERTIFICATE = "certificate"
    DERIVED = "not derived"


Name = tuple[str, str]
"""The sort of a record (`claim`, `erratum`, …) and its id, key or name."""

OF_PAPERS = ("paper", "claim", "erratum", "figure", "experiment")
"""The sorts of records that the code of a paper declares."""


class Problem(msgspec.Struct, frozen=True):
    """One thing wrong with a results file. where: the id of the claim, erratum, experiment or figure; message: what."""

    where: str
    message: str
    cause: Cause = Cause.DERIVED

    def __str__(self) -> str:
        return f"{self.where}: {self.cause}: {self.message}"


def check(results: ResultsFile, papers: Sequence[Paper] | None, root: Path | None = None) -> list[Problem]:
    """All that is wrong with `results`, in the order of the file; an empty list if nothing is.

    Verdicts, deviations and reasons must follow from the stored numbers and be the pinned ones, and nothing failed.
    With `papers`, all that the file repeats from the code must be as it stands there (`stated`); with `root`,
    its proofs must be of the certificates that lie there. How the numbers came about only another run shows.
    """
    against = () if papers is None else _against_code(results, papers)
    files = () if root is None else against_files(results, root)
    return [*_problems(results), *unsupported(results), *files, *against]


def _problems(results: ResultsFile) -> Iterator[Problem]:
    """What the file says of itself: its names, its verdicts, its errors, its readings."""
    for (sort, name), count in Counter(key for key, _ in _stored(results)).items():
        if count > 1:
            yield Problem(name, f"the {sort} stands {count} times in the file", Cause.SET)
    errata = {erratum.id: erratum for erratum in results.errata}
    derived = {
        record.id: rejudge(record, errata, readings=results.readings.get(record.paper, ())) for record in results.claims
    }
    for record in results.claims:
        copy = msgspec.structs.replace(record, judgement=derived[record.id])
        yield from _verdict(record, same_fact(copy, derived.get(record.claim.repeats)).judgement)
    for (sort, name), record in results.named("erratum", "figure", "experiment"):
        if record.error:
            yield Problem(f"{sort} {name}", record.error, Cause.ERROR)
    for paper in results.papers:
        claims = [claim for claim in results.claims if claim.paper == paper.key]
        for name in unused_readings(paper.readings, claims):
            yield Problem(paper.key, f"no claim rests on the reading {name!r}", Cause.TEXT)


def _verdict(record: ClaimRecord, derived: Judgement) -> Iterator[Problem]:
    judgement = record.judgement
    for name in type(judgement).__struct_fields__:
        # The reason of an error may be a failure that left no number to derive it from.
        if name == "reason" and Verdict.ERROR in (judgement.verdict, derived.verdict):
            continue
        if (stored_value := getattr(judgement, name)) != (wanted_value := getattr(derived, name)):
            message = f"{name} is {_show(stored_value)}, but the stored numbers give {_show(wanted_value)}"
            yield Problem(record.id, message, Cause.FORGED)
    if judgement.verdict is Verdict.ERROR:
        yield Problem(record.id, judgement.reason, Cause.ERROR)
    elif record.unexpected:
        message = f"{_show(judgement.verdict)}, pinned {_show(record.claim.expected)}: {judgement.reason}"
        yield Problem(record.id, message, Cause.CHANGED_VERDICT)


def unsupported(results: ResultsFile) -> Iterator[Problem]:
    """Claims whose bracket, or mark, is not what the certificates of the file prove; those that prove nothing."""
    for claim in results.claims:
        supporting = [entry for entry in results.certificates if claim.id in entry.claims]
        paths, certificates = tuple(entry.path for entry in supporting), claim.evidence.certificates
        if certificates != paths:
            message = f"certificates is {certificates!r}, but those of the file that name it are {paths!r}"
            yield Problem(claim.id, message, Cause.FORGED)
        elif claim.evidence.method and (difference := _difference(claim, supporting)):
            yield Problem(claim.id, difference, Cause.FORGED)
    for entry in results.certificates:
        if not entry.proved:
            yield Problem(entry.path, entry.reason or "it is not proved, and no reason is given", Cause.ERROR)


def _difference(record: ClaimRecord, supporting: Sequence[CertificateRecord]) -> str:
    """What joining the claim with its certificates again would change; empty if nothing."""
    try:
        joined, proved, supported = with_proofs(record.claim, record.evidence, supporting)
    except AuditError as error:
        return str(error)
    if joined != record.evidence:
        return "the bracket is not the one that its certificates prove"
    judgement = record.judgement
    if judgement.proved != proved:
        return f"proved is {judgement.proved}, but its certificates say otherwise"
    return "" if judgement.supported == supported else "what its certificates do not say is told otherwise"


def against_files(results: ResultsFile, root: Path) -> Iterator[Problem]:
    """Certificates of the file that are not the ones wanted, or not the ones that lie below `root`."""
    listed, reasons = wanted(root, [paper.key for paper in results.papers])
    entries = {entry.path: entry for entry in listed}
    stored = {entry.path: entry for entry in results.certificates}
    for path in sorted(entries.keys() ^ stored.keys()):
        where = "wanted and not in the file" if path in entries else "in the file, not wanted"
        yield Problem(path, f"the certificate is {where}", Cause.CERTIFICATE)
    for path in sorted(entries.keys() & stored.keys()):
        entry, record = entries[path], stored[path]
        if sha256(root / path, "missing") != record.sha256:
            yield Problem(path, "the file is not the one that was verified; run the audit again", Cause.CERTIFICATE)
        if (entry.claims, entry.statement) != (record.claims, record.statement):
            message = "its claims or statement are not those of the theorem that is wanted"
            yield Problem(path, message, Cause.CERTIFICATE)
    for claim in results.claims:
        if claim.judgement.unproved != no_theorem(claim.claim, reasons, bool(claim.evidence.certificates)):
            message = "the reason why there is no theorem is not the one that the paper gives"
            yield Problem(claim.id, message, Cause.CERTIFICATE)


def _against_code(results: ResultsFile, papers: Sequence[Paper]) -> Iterator[Problem]:
    records, code = dict(_stored(results)), stated(papers)
    for names, message in (
        (code.keys() - records.keys(), "in the code and not in the file"),
        (records.keys() - code.keys(), "in the file and not in the code"),
    ):
        for sort, name in sorted(names):
            yield Problem(name, f"the {sort} is {message}", Cause.SET)
    for key, fields in code.items():
        for field, value in fields.items():
            if key in records and (entry := getattr(records[key], field)) != value:
                message = f"{field} is {_show(entry)} in the file and {_show(value)} in the code"
                yield Problem(key[1], message, Cause.TEXT)
    for claim in results.claims:
        if lost := [use for use in claim.claim.uses if ("experiment", use) not in code]:
            yield Problem(claim.id, f"uses {lost[0]}, which is no experiment in the code", Cause.SET)


def stated(papers: Sequence[Paper]) -> dict[Name, dict[str, Any]]:
    """The fields that the code states, by record; the errors of `encode` and `function_name` are those of a run."""
    fields: dict[Name, dict[str, Any]] = {}
    for paper in papers:
        key = {"paper": paper.key}
        fields["paper", paper.key] = shared(PaperRecord, paper)
        stands = [name for name in StatedClaim.__struct_fields__ if name != "uses"]
        fields |= {("claim", claim.id): {name: getattr(claim, name) for name in stands} for claim in paper.claims}
        fields |= {("erratum", erratum.id): shared(ErratumRecord, erratum) | key for erratum in paper.errata}
        fields |= {("figure", figure.name): shared(FigureRecord, figure) | key for figure in paper.figures}
        for experiment in paper.experiments:
            inputs = encode(f"the inputs of {experiment.name}", dict(experiment.inputs), sort=True)
            declared = {"function": function_name(experiment), "inputs": json.loads(inputs)}
            fields["experiment", experiment.name] = declared | key
    return fields


def _stored(results: ResultsFile) -> list[tuple[Name, Any]]:
    """The records of a results file under the same names."""
    return [(key, record.claim if key[0] == "claim" else record) for key, record in results.named(*OF_PAPERS)]


def _show(value: object) -> str:
    return repr(str(value)) if isinstance(value, str) else repr(value)


def kept(papers: Sequence[Paper], root: Path, cache: Cache) -> Outcome:
    """What the results in the cache give for these papers; raises as `run` does for mistakes in the papers."""

    def nobody(tasks: Sequence[Task]) -> list[Answer]:
        return [Answer(task.name, None, 0.0, "it is not kept") for task in tasks]

    return run(papers, cache=replace(cache, write=False), root=root, executor=nobody)


def differences(results: ResultsFile, again: Outcome, figures: Path) -> Iterator[Problem]:
    """Where the file, or a file of a figure, is not what the cache gives, and what is different there.

    Nothing is computed but what turns results into records; `unfounded` says what the cache no longer holds.
    """
    yield from _changed("project", results.project, again.results.project)
    if not _here(results, again):
        return
    yield from _environment(results.run, again.results.run)
    keys = {record.name: record.key for record in results.experiments}
    others = [record.name for record in again.results.experiments if keys.get(record.name, record.key) != record.key]
    if others:
        more = f" (and of {len(others) - 1} more)" if others[1:] else ""
        message = f"sources, inputs or data{more} are others now, or the key was edited; run the audit again"
        yield Problem(others[0], message)
    unknown = _unknown(results, again)
    stored = dict(results.named(*OF_PAPERS))
    for key, record in again.results.named(*OF_PAPERS):
        if key in stored and getattr(record, "paper", key[1]) not in unknown:
            yield from _changed(key[1], stored[key], record)
    proofs = {record.path: record for record in results.certificates}
    if len(proofs) < len(results.certificates):
        yield Problem("certificates", "one of them stands twice in the file")
    for proof in again.results.certificates:
        if proof.path in proofs and f"{proof.paper}.certificate.{proof.name}" not in _absent(again):
            yield from _changed(proof.path, proofs[proof.path], proof)
    for name, drawn in again.drawn.items():
        if drawn is not None and checksums(figures, name) != drawn.files:
            yield Problem(name, f"{figures / name}.csv and .svg are not as the run left them; run the audit again")


def unfounded(results: ResultsFile, again: Outcome) -> str:
    """Why the numbers of some papers were taken as they stand; empty if none were."""
    if not _here(results, again):
        return "the file was made in another environment than this one, so its numbers were taken as they stand"
    unknown = sorted(_unknown(results, again))
    why = "the cache does not hold the results of this run, so the numbers were taken as they stand"
    return f"{', '.join(unknown)}: {why}; `replication run` computes what is missing" if unknown else ""


def _here(results: ResultsFile, again: Outcome) -> bool:
    """Whether the file was made in this environment: so it says, or one of its keys."""
    keys = {record.key for record in again.results.experiments}
    return not list(_environment(results.run, again.results.run)) or any(row.key in keys for row in results.experiments)


def _environment(run: RunRecord, here: RunRecord) -> Iterator[Problem]:
    """What a run says of its environment and is not so here."""
    fields = ("package_version", "lock_sha256", "packages", "unlocked", "threads")
    same = {name: getattr(run, name) == getattr(here, name) for name in fields}
    same |= {"python": python_minor(run.python) == python_minor(here.python), "blas": kernel() in run.blas}
    for name, holds in same.items():
        if not holds:
            yield Problem(f"run.{name}", f"{getattr(run, name)!r} is not of the environment that the keys are of")


def _unknown(results: ResultsFile, again: Outcome) -> set[str]:
    """The papers of which something is not kept, or kept of another run: what is measured in seconds differs then."""
    seconds = {record.name: record.seconds for record in again.results.experiments}
    papers = {record.paper for record in results.experiments if seconds.get(record.name) != record.seconds}
    absent = _absent(again)
    papers |= {record.paper for record in again.results.experiments if record.name in absent}
    return papers | {record.paper for record in results.figures if record.name in absent}


def _absent(again: Outcome) -> set[str]:
    """The experiments and figures that a run would have to do."""
    failed = {step.name for step in again.log if step.action is Action.FAILED}
    return failed | {name for name, drawn in again.drawn.items() if drawn is None}


def _changed(where: str, stored: Any, result: Any) -> Iterator[Problem]:
    for path, first, second in unlike(msgspec.to_builtins(stored), msgspec.to_builtins(result)):
        yield Problem(where, f"{path} is {first!r}, and the kept results give {second!r}")
