"""What changed between two results files, claim by claim, and what may have caused it."""

from collections.abc import Iterator
from enum import StrEnum
from typing import Any

import msgspec

from replication.audit.model import StatedClaim, Verdict
from replication.audit.store.records import DECIDING, ClaimRecord, ExperimentRecord, ResultsFile, unlike

TEXT = tuple(name for name in StatedClaim.__struct_fields__ if name != "id")
"""What the code says of a claim."""
SHOWN = 200
"""Characters that are shown of a value beside the claims."""


class Cause(StrEnum):
    """What is known to differ between the runs and bears on the claim, the likeliest first."""

    NEW = "only the new file has the claim"
    GONE = "only the old file has the claim"
    CLAIM = "the claim itself was changed"
    ERRATUM = "the outcome of the erratum's proof changed"
    INPUTS = "other inputs of its experiments"
    SOLVER = "another solver, or other options of it"
    CODE = "other code or data of its experiments"
    LOCK = "other lock of packages"
    PACKAGES = "other versions of Python or packages"
    MACHINE = "another machine, BLAS or number of threads"
    SOURCES = "other sources, outside the experiments"
    UNEXPLAINED = "moved though nothing known changed"


OF_RUN = {
    Cause.LOCK: ("lock_sha256",),
    Cause.PACKAGES: ("packages", "python"),
    Cause.MACHINE: ("cpu", "platform", "blas", "threads"),
    Cause.SOURCES: ("commit", "package_version"),
}
"""The fields of a run that tell each of these causes."""


class FieldChange(msgspec.Struct, frozen=True, kw_only=True):
    """A field of a record with its old and its new value."""

    field: str
    old: Any
    new: Any


class Change(msgspec.Struct, frozen=True, kw_only=True):
    """How one record changed: a claim, by its id, or another one, by its sort and name.

    old, new: verdicts of a claim; causes: all that may have caused its change.
    """

    record: str
    fields: tuple[FieldChange, ...]
    old: Verdict | None = None
    new: Verdict | None = None
    causes: tuple[Cause, ...] = ()


def compare(old: ResultsFile, new: ResultsFile) -> list[Change]:
    """The claims that differ in verdict, text or numbers, changed verdicts first, then by id; then the other records.

    Seconds, wording of methods, and lines of code are not compared. Numbers are compared exactly.
    """
    before, after = _records(old), _records(new)
    claims = [{record.id: record for record in results.claims} for results in (old, new)]
    changes = []
    for name in before.keys() | after.keys():
        first, second = (known.get(name) for known in claims)
        pairs = [pair for pair in unlike(before.get(name, {}), after.get(name, {})) if pair[0] != "code"]
        fields = tuple(FieldChange(field=field, old=left, new=right) for field, left, right in pairs)
        if not fields:
            continue
        causes: tuple[Cause, ...] = ()
        if first and second:
            causes = tuple(_causes(first, second, old, new)) or (Cause.UNEXPLAINED,)
        elif first or second:
            fields, causes = (), (Cause.NEW if second else Cause.GONE,)
        was, now = (record.verdict if record else None for record in (first, second))
        changes.append(Change(record=name, old=was, new=now, causes=causes, fields=fields))
    return sorted(changes, key=lambda change: (not change.causes, change.old == change.new, change.record))


def _records(results: ResultsFile) -> dict[str, dict[str, Any]]:
    others = results.named("paper", "erratum", "figure", "certificate")
    records = {f"{sort} {name}": msgspec.to_builtins(record) for (sort, name), record in others}
    return {record.id: _compared(record) for record in results.claims} | records


def _cut(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def render(changes: list[Change]) -> list[str]:
    """The changes as lines of text: one for each record, indented below it the fields, and of a claim the causes."""
    lines = [] if any(change.causes for change in changes) else ["No claim changed."]
    for change in changes:
        if not change.causes:
            lines.append(f"{change.record} changed")
            lines += [f"    {field.field}: {_cut(field.old)} → {_cut(field.new)}" for field in change.fields]
            continue
        verdict = str(change.new) if change.old == change.new else f"{change.old or '—'} → {change.new or '—'}"
        lines.append(f"{change.record}: {verdict}")
        lines += [
            f"    {field.field}: {field.old!r} → {field.new!r}{moved(field) and f' ({moved(field)})'}"
            for field in change.fields
        ]
        lines.append(f"    cause: {'; '.join(change.causes)}")
    return lines


def _compared(record: ClaimRecord) -> dict[str, Any]:
    """What is compared of a claim, as plain values; of the evidence for the text as printed, the numbers."""
    claim, evidence, judgement = record.claim, record.evidence, record.judgement
    printed = evidence.as_printed
    fields = {
        "verdict": judgement.verdict,
        **{name: getattr(claim, name) for name in TEXT},
        **{name: getattr(evidence, name) for name in (*DECIDING, "not_checkable")},
        "proved": judgement.proved,
        "supported": judgement.supported,
        "as_printed": None if printed is None else {name: getattr(printed, name) for name in DECIDING},
        "quantities": evidence.quantities,
    }
    return dict(msgspec.to_builtins(fields))


def _causes(old: ClaimRecord, new: ClaimRecord, before: ResultsFile, after: ResultsFile) -> Iterator[Cause]:
    if any(getattr(old.claim, name) != getattr(new.claim, name) for name in TEXT):
        yield Cause.CLAIM
    if _proof(old, before) != _proof(new, after):
        yield Cause.ERRATUM
    runs = before.run, after.run
    used = {run.name: run for run in before.experiments if run.name in old.claim.uses}
    pairs = [(used[run.name], run) for run in after.experiments if run.name in used]
    if any(first.inputs != second.inputs for first, second in pairs):
        yield Cause.INPUTS
    if any(_settings(first) != _settings(second) for first, second in pairs):
        yield Cause.SOLVER
    # A key covers sources, inputs, lock, Python and packages: it tells of other code only if the rest is the same.
    same_setting = not _differ(runs, "lock_sha256", "python", "packages")
    if same_setting and any(first.key != second.key and first.inputs == second.inputs for first, second in pairs):
        yield Cause.CODE
    for cause, names in OF_RUN.items():
        # The functions that answer claims are not part of any experiment; a dirty tree may hold any of them.
        if _differ(runs, *names) or (cause is Cause.SOURCES and any(run.dirty for run in runs)):
            yield cause


def _settings(experiment: ExperimentRecord) -> tuple[Any, ...]:
    return tuple((solver.name, solver.version, solver.options) for solver in experiment.solvers)


def _proof(record: ClaimRecord, results: ResultsFile) -> list[tuple[bool, bool]]:
    return [(erratum.holds, bool(erratum.error)) for erratum in results.errata if erratum.id == record.claim.erratum]


def _differ(pair: tuple[Any, Any], *names: str) -> bool:
    return any(getattr(pair[0], name) != getattr(pair[1], name) for name in names)


def moved(field: FieldChange) -> str:
    """How far a single number moved, relative to its old size; empty for anything else."""
    if not isinstance(field.old, float) or not isinstance(field.new, float) or field.old == 0:
        return ""
    return f"{(field.new - field.old) / abs(field.old):+.2e} relative"
