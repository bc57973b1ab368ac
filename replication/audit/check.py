"""Checking a results file without computing anything: its verdicts follow from its numbers, and it fits the papers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum

import msgspec

from replication.audit.model import Claim, Paper, Verdict
from replication.audit.records import SCHEMA_VERSION, ClaimRecord, ErratumRecord, ResultsFile
from replication.audit.verdict import rejudge


class Cause(StrEnum):
    """What is wrong; a changed verdict and an error are findings of a run, the others faults of the file."""

    SCHEMA = "schema"
    FORGED = "forged"
    CHANGED_VERDICT = "changed verdict"
    ERROR = "error"
    CLAIM_SET = "claims"
    CLAIM_TEXT = "claim text"


class Problem(msgspec.Struct, frozen=True, kw_only=True):
    """One thing wrong with a results file. where: the id of the claim, erratum, experiment or figure; message: what."""

    where: str
    cause: Cause
    message: str

    def __str__(self) -> str:
        return f"{self.where}: {self.cause}: {self.message}"


_PINNED: dict[str, Callable[[Claim], object]] = {
    "place": lambda claim: claim.place,
    "kind": lambda claim: claim.kind,
    "statement": lambda claim: claim.statement,
    "printed": lambda claim: claim.printed,
    "expected_verdict": lambda claim: claim.expected,
    "tolerance": lambda claim: claim.tolerance,
    "tolerance_reason": lambda claim: claim.tolerance_reason,
    "erratum": lambda claim: claim.erratum,
    "experiments": lambda claim: claim.uses,
}


def check(results: ResultsFile, papers: Sequence[Paper] | None) -> list[Problem]:
    """All that is wrong with `results`, in the order of the file; an empty list if nothing is.

    Every verdict, its deviation and its reason must follow from the stored numbers; every verdict must be the pinned
    one; nothing may have ended in an error. With `papers`, the claims of the file and of the code must be the same.
    """
    problems = [*_schema(results), *_repeated(results)]
    errata = {erratum.id: erratum for erratum in results.errata}
    for record in results.claims:
        problems.extend(_verdict(record, errata))
    problems.extend(_errors(results))
    if papers is not None:
        problems.extend(_claims(results, papers))
    return problems


def _schema(results: ResultsFile) -> Iterator[Problem]:
    if results.schema_version != SCHEMA_VERSION:
        message = f"the file has schema version {results.schema_version}, wanted {SCHEMA_VERSION}; run the audit again"
        yield Problem(where="schema_version", cause=Cause.SCHEMA, message=message)


def _repeated(results: ResultsFile) -> Iterator[Problem]:
    for what, ids in (
        ("claim", [claim.id for claim in results.claims]),
        ("erratum", [erratum.id for erratum in results.errata]),
    ):
        for name, count in Counter(ids).items():
            if count > 1:
                yield Problem(where=name, cause=Cause.CLAIM_SET, message=f"the {what} stands {count} times in the file")


def _verdict(record: ClaimRecord, errata: dict[str, ErratumRecord]) -> Iterator[Problem]:
    derived = rejudge(record, errata)
    pairs: list[tuple[str, object, object]] = [
        ("verdict", record.verdict, derived.verdict),
        ("deviation_ulp", record.deviation_ulp, derived.deviation_ulp),
    ]
    # The reason of an error may be a failure that left no number to derive it from.
    if Verdict.ERROR not in (record.verdict, derived.verdict):
        pairs.append(("reason", record.reason, derived.reason))
    for field, stored, wanted in pairs:
        if stored != wanted:
            message = f"{field} is {_show(stored)}, but the stored numbers give {_show(wanted)}"
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


def _claims(results: ResultsFile, papers: Sequence[Paper]) -> Iterator[Problem]:
    stored = {record.id: record for record in results.claims}
    coded = {claim.id: (paper.key, claim) for paper in papers for claim in paper.claims}
    for name in sorted(coded.keys() - stored.keys()):
        yield Problem(where=name, cause=Cause.CLAIM_SET, message="the claim is in the code and not in the file")
    for name in sorted(stored.keys() - coded.keys()):
        yield Problem(where=name, cause=Cause.CLAIM_SET, message="the claim is in the file and not in the code")
    for name, record in stored.items():
        if name in coded:
            key, claim = coded[name]
            pinned = {"paper": key, **{field: pin(claim) for field, pin in _PINNED.items()}}
            for field, wanted in pinned.items():
                if getattr(record, field) != wanted:
                    message = f"{field} is {_show(getattr(record, field))} in the file and {_show(wanted)} in the code"
                    yield Problem(where=name, cause=Cause.CLAIM_TEXT, message=message)


def _show(value: object) -> str:
    return repr(str(value)) if isinstance(value, str) else repr(value)
