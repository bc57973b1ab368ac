"""What `report/results.json` holds, as types: reading validates, writing is canonical, the JSON Schema is derived."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from replication.audit.model import CommonLevel, Kind, Numbers, ScopeItem, Sensitivity, SolverRecord, Verdict
from replication.errors import AuditError
from replication.files import write_atomically

SCHEMA_VERSION = 2
Name = str


class Reading(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The numbers of one evidence that decide a verdict; the fields are those of `Evidence`."""

    value: Numbers | None = None
    lower: Numbers | None = None
    upper: Numbers | None = None
    holds: bool | None = None
    margin: float | None = None
    threshold: float | None = None
    threshold_reason: str = ""
    probability: float | None = None


class ClaimRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A claim with its evidence and its verdict, as `verdict.judge` derived it; `make_record` is the only maker.

    Everything that the verdict depends on is stored, so that `verdict.rejudge` can derive it again.

    deviation_ulp: (computed − printed) in units of the last printed place, the largest in size over the entries.
    as_printed: the numbers of the text as printed, for a claim with an erratum (`computed` is then the corrected one).
    not_checkable: the reason given for that verdict, else empty.
    code: file:line of the function that answers the claim. seconds: of the experiments that it uses, together.
    reason: why this verdict, in one sentence.
    proved: whether the bracket, or the statement, is a theorem; `certificates` are the files that prove it.
    unproved: why no theorem is possible, if that is so.
    """

    id: str
    paper: Name
    place: str
    kind: Kind
    statement: str
    printed: str
    computed: Numbers | None
    lower: Numbers | None
    upper: Numbers | None
    proved: bool
    deviation_ulp: float | None
    tolerance: str | None
    tolerance_reason: str
    verdict: Verdict
    expected_verdict: Verdict
    reason: str
    method: str
    cross_check: str
    code: str
    seconds: float
    erratum: str | None
    as_printed: Reading | None
    holds: bool | None
    margin: float | None
    threshold: float | None
    threshold_reason: str
    probability: float | None
    quantities: dict[str, float]
    solvers: tuple[SolverRecord, ...]
    note: str
    not_checkable: str
    experiments: tuple[str, ...]
    certificates: tuple[str, ...]
    unproved: str


class ErratumRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An erratum with the outcome of its proof; `error` is the failure if the proof could not be run."""

    id: str
    paper: Name
    place: str
    printed: str
    meant: str
    inference: bool
    holds: bool
    text: str
    quantities: dict[str, float]
    code: str
    error: str


class ExperimentRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Provenance of one experiment: what ran, on what, how long it took when it ran, what the solvers said."""

    name: str
    paper: Name
    function: str
    code: str
    inputs: dict[str, Any]
    key: str
    seconds: float
    solvers: tuple[SolverRecord, ...]
    error: str


class CertificateRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A certificate as the run verified it. path: below the project; claims: ids of those that it supports.

    sentence: the theorem; reason: why it is not proved, else empty. lower, upper, items: proved bounds as rationals.
    """

    paper: Name
    name: str
    path: str
    sha256: str
    claims: tuple[str, ...]
    statement: str
    proved: bool
    reason: str
    sentence: str
    lower: str | None
    upper: str | None
    holds: bool | None
    items: tuple[tuple[str | None, str | None], ...]


class FigureRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A figure as the report shows it; the files lie in `figures/` under `name`, with the checksum of the data."""

    name: str
    paper: Name
    place: str
    title: str
    caption: str
    published: bool
    alt: str
    csv_sha256: str
    error: str


class TableRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of a paper in its own shape; a cell `claim:ID` stands for that claim."""

    place: str
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class PaperRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the report says of a source paper beside its claims; notebook: name of its tutorial, or empty."""

    key: Name
    title: str
    authors: tuple[str, ...]
    year: int | None
    venue: str
    doi: str
    summary: str
    bibtex: str
    notebook: str = ""
    findings: tuple[str, ...]
    formulas: tuple[tuple[str, str], ...]
    tables: tuple[TableRecord, ...]
    scope: tuple[ScopeItem, ...]
    sensitivity: tuple[Sensitivity, ...] = ()
    common: tuple[CommonLevel, ...] = ()


class RunRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Provenance of a run: the sources, the lock, the machine. `date` is SOURCE_DATE_EPOCH when that is set."""

    package_version: str
    date: str
    commit: str
    dirty: bool | None
    lock_sha256: str
    python: str
    packages: dict[str, str]
    blas: str
    threads: int
    cpu: str
    platform: str


class ResultsFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The whole of `report/results.json`."""

    schema_version: int
    run: RunRecord
    papers: tuple[PaperRecord, ...]
    claims: tuple[ClaimRecord, ...]
    errata: tuple[ErratumRecord, ...]
    figures: tuple[FigureRecord, ...]
    experiments: tuple[ExperimentRecord, ...]
    certificates: tuple[CertificateRecord, ...]


def to_json(results: ResultsFile) -> bytes:
    """Canonical bytes: fields in the order of declaration, dictionaries sorted, two spaces, one newline at the end."""
    return msgspec.json.format(msgspec.json.encode(results, order="deterministic"), indent=2) + b"\n"


def write_results(path: Path, results: ResultsFile) -> None:
    """Write `results` at `path`, whole or not at all."""
    write_atomically(path, to_json(results))


def read_results(path: Path) -> ResultsFile:
    """Read and validate a results file; raises AuditError that names the file and the wrong or unknown field."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=ResultsFile)
    except FileNotFoundError:
        raise AuditError(f"{path} does not exist; make it with `python -m replication run`") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise AuditError(f"{path} is not a results file: {error}; run `python -m replication run`") from None


def json_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of `ResultsFile`, which `docs/results.schema.json` publishes."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **msgspec.json.schema(ResultsFile)}
