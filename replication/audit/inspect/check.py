"""Checking a results file without computing anything: its verdicts follow from its numbers, and it fits the papers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from enum import StrEnum
from pathlib import Path

import msgspec

from replication.audit.inspect import theorems as check_proofs
from replication.audit.judge.verdict import rejudge
from replication.audit.model import Paper, Verdict
from replication.audit.run.stated import stated, stored
from replication.audit.store.records import SCHEMA_VERSION, ClaimRecord, ErratumRecord, ResultsFile


class Cause(StrEnum):
    """What is wrong; a changed verdict and an error are findings of a run, the others faults of the file."""

    SCHEMA = "schema"
    FORGED = "forged"
    CHANGED_VERDICT = "changed verdict"
    ERROR = "error"
    SET = "missing or extra"
    TEXT = "text"
    CERTIFICATE = "certificate"


class Problem(msgspec.Struct, frozen=True, kw_only=True):
    """One thing wrong with a results file. where: the id of the claim, erratum, experiment or figure; message: what."""

    where: str
    cause: Cause
    message: str

    def __str__(self) -> str:
        return f"{self.where}: {self.cause}: {self.message}"


def check(results: ResultsFile, papers: Sequence[Paper] | None, root: Path | None = None) -> list[Problem]:
    """All that is wrong with `results`, in the order of the file; an empty list if nothing is.

    Every verdict, its deviation and its reason must follow from the stored numbers; every verdict must be the pinned
    one; nothing may have ended in an error. With `papers`, all that the file repeats from the code must be as it stands
    there: the papers, their claims, errata, figures and experiments, by name and by what they say (`pinned.stated`).
    What claims gain by certificates must follow from the proofs in the file; with the project's `root`, those must be
    of the certificates that lie there. They are not verified again: `python verify.py` does that.

    The numbers themselves, the words on how they came about, and the environment are taken as the run left them: what
    they are is known only by computing them again and comparing the files (`compare.compare`).
    """
    problems = [*_schema(results), *_repeated(results)]
    errata = {erratum.id: erratum for erratum in results.errata}
    for record in results.claims:
        problems.extend(_verdict(record, errata))
    problems.extend(_errors(results))
    problems.extend(_proofs(results, root))
    if papers is not None:
        problems.extend(_against_code(results, papers))
    return problems


def _schema(results: ResultsFile) -> Iterator[Problem]:
    if results.schema_version != SCHEMA_VERSION:
        message = f"the file has schema version {results.schema_version}, wanted {SCHEMA_VERSION}; run the audit again"
        yield Problem(where="schema_version", cause=Cause.SCHEMA, message=message)


def _repeated(results: ResultsFile) -> Iterator[Problem]:
    for what, ids in (
        ("claim", [claim.id for claim in results.claims]),
        ("erratum", [erratum.id for erratum in results.errata]),
        ("paper", [paper.key for paper in results.papers]),
        ("figure", [figure.name for figure in results.figures]),
        ("experiment", [experiment.name for experiment in results.experiments]),
    ):
        for name, count in Counter(ids).items():
            if count > 1:
                yield Problem(where=name, cause=Cause.SET, message=f"the {what} stands {count} times in the file")


def _verdict(record: ClaimRecord, errata: dict[str, ErratumRecord]) -> Iterator[Problem]:
    derived = rejudge(record, errata)
    pairs: list[tuple[str, object, object]] = [
        ("verdict", record.verdict, derived.verdict),
        ("deviation_ulp", record.deviation_ulp, derived.deviation_ulp),
    ]
    # The reason of an error may be a failure that left no number to derive it from.
    if Verdict.ERROR not in (record.verdict, derived.verdict):
        pairs.append(("reason", record.reason, derived.reason))
    for field, found, wanted in pairs:
        if found != wanted:
            message = f"{field} is {_show(found)}, but the stored numbers give {_show(wanted)}"
            yield Problem(where=record.id, cause=Cause.FORGED, message=message)
    if record.verdict is Verdict.ERROR:
        yield Problem(where=record.id, cause=Cause.ERROR, message=record.reason)
    elif record.verdict is not record.expected_verdict:
        message = f"{_show(record.verdict)}, pinned {_show(record.expected_verdict)}: {record.reason}"
        yield Problem(where=record.id, cause=Cause.CHANGED_VERDICT, message=message)


def _errors(results: ResultsFile) -> Iterator[Problem]:
    found = [
        *((f"erratum {erratum.id}", erratum.error) for erratum in results.errata),
        *((f"experiment {experiment.name}", experiment.error) for experiment in results.experiments),
        *((f"figure {figure.name}", figure.error) for figure in results.figures),
    ]
    for where, error in found:
        if error:
            yield Problem(where=where, cause=Cause.ERROR, message=error)


def _proofs(results: ResultsFile, root: Path | None) -> Iterator[Problem]:
    faults = [(Cause.FORGED, fault) for fault in check_proofs.unsupported(results)]
    faults += [(Cause.ERROR, fault) for fault in check_proofs.refused(results)]
    if root is not None:
        faults += [(Cause.CERTIFICATE, fault) for fault in check_proofs.against_files(results, root)]
    yield from (Problem(where=where, cause=cause, message=message) for cause, (where, message) in faults)


def _against_code(results: ResultsFile, papers: Sequence[Paper]) -> Iterator[Problem]:
    records, code = stored(results), stated(papers)
    for names, message in (
        (code.keys() - records.keys(), "in the code and not in the file"),
        (records.keys() - code.keys(), "in the file and not in the code"),
    ):
        for sort, name in sorted(names):
            yield Problem(where=name, cause=Cause.SET, message=f"the {sort} is {message}")
    for key, fields in code.items():
        for field, wanted in fields.items():
            if key in records and (found := getattr(records[key], field)) != wanted:
                message = f"{field} is {_show(found)} in the file and {_show(wanted)} in the code"
                yield Problem(where=key[1], cause=Cause.TEXT, message=message)


def _show(value: object) -> str:
    return repr(str(value)) if isinstance(value, str) else repr(value)
