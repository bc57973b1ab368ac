"""What `report/results.json` holds, as types: reading validates, and writing is canonical."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.model import (
    Erratum,
    Evidence,
    Judgement,
    Kind,
    Proof,
    Reading,
    SolverRecord,
    StatedClaim,
    Verdict,
)
from replication.audit.parts import CommonLevel, Sensitivity, StatedPaper
from replication.audit.project import Settings
from replication.errors import AuditError
from replication.files import write_atomically
from replication.verify.predicate import Exported

SCHEMA_VERSION = 3
COMMAND = "replication.audit.run.command:execute"
"""The function of experiments that are commands."""
DECIDING = (
    *("value", "lower", "upper", "holds", "margin", "threshold", "threshold_reason", "probability", "draws"),
    *("outcomes", "over_inputs"),
)
"""The fields of an evidence that a verdict is made from."""


class ClaimRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A claim, what was computed for it, and what comparing the two gives, as `verdict.make_record` made it.

    Everything that the verdict depends on is stored, so that `verdict.rejudge` can derive it again.
    """

    claim: StatedClaim
    evidence: Evidence
    judgement: Judgement

    @property
    def id(self) -> str:
        """The one name of the claim."""
        return self.claim.id

    @property
    def paper(self) -> str:
        """The key of its paper, with which the id begins."""
        return self.id.partition(".")[0]

    @property
    def counted(self) -> bool:
        """Whether totals count it: it says what no other claim does, and the text says it."""
        return not (self.claim.repeats or self.claim.ours)

    @property
    def timed(self) -> bool:
        """Whether it prints seconds that another computer took."""
        return self.claim.kind is Kind.CITED and self.claim.unit == "s"

    @property
    def rested(self) -> set[str]:
        """The names of the readings that it was answered under, also for the text as printed."""
        printed = self.evidence.as_printed
        outcomes = (*self.evidence.outcomes, *(printed.outcomes if printed else ()))
        return {self.claim.reading, *(outcome.reading for outcome in outcomes)}

    @property
    def verdict(self) -> Verdict:
        """Its verdict."""
        return self.judgement.verdict

    @property
    def unexpected(self) -> bool:
        """Whether the verdict is not the pinned one."""
        return self.judgement.verdict is not self.claim.expected


class ErratumRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An erratum with the outcome of its proof; `error` is the failure if the proof could not be run."""

    id: str
    paper: str
    place: str
    printed: str
    meant: str
    inference: bool
    holds: bool
    text: str
    quantities: dict[str, float]
    code: str
    error: str
    scan: bool = False

    @classmethod
    def of(cls, paper: str, erratum: Erratum, proof: Proof | None, *, code: str = "", error: str = "") -> ErratumRecord:
        """That of an erratum as its paper declares it; proof: None after the failure that `error` tells."""
        proof = proof or Proof(holds=False, text="")
        outcome = {name: getattr(proof, name) for name in Proof.__struct_fields__}
        return cls(paper=paper, code=code, error=error, **shared(cls, erratum), **outcome)


class ExperimentRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Provenance of one experiment: what ran, on what, how long it took when it ran, what the solvers said.

    read: what it read while it ran, which its key covers. untraced: what it did that no key can cover.
    version: what the program of a command prints of its version; empty for what is no command, or declares none.
    """

    name: str
    paper: str
    function: str
    code: str
    inputs: dict[str, Any]
    key: str
    seconds: float
    solvers: tuple[SolverRecord, ...]
    error: str
    read: tuple[str, ...] = ()
    untraced: tuple[str, ...] = ()
    version: str = ""

    @property
    def line(self) -> str:
        """The line of a command; empty for what is none."""
        return shlex.join(self.inputs["command"]) if self.function == COMMAND else ""


class CertificateRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A certificate as the run verified it. path: below the project; claims: ids of those that it supports.

    sentence: the theorem; reason: why it is not proved, else empty. lower, upper, items: proved bounds as rationals.
    machine: below the project, the statement that Coq proved of this very file; empty if it did not. second: whether
    the second arithmetic, too, proved the same of it.
    says: the terms that the theorem speaks of, with what it proves of each.
    """

    paper: str
    name: str
    path: str
    sha256: str
    claims: tuple[str, ...]
    statement: str
    proved: bool
    reason: str = ""
    sentence: str = ""
    lower: str | None = None
    upper: str | None = None
    holds: bool | None = None
    items: tuple[tuple[str | None, str | None], ...] = ()
    machine: str = ""
    second: bool = False
    says: tuple[Exported, ...] = ()


class FigureRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A figure as the report shows it; the files lie in `figures/` under `name`, with the checksum of the data.

    code: `file:line` of the function that draws it.
    """

    name: str
    paper: str
    place: str
    title: str
    caption: str
    published: bool
    alt: str
    csv_sha256: str
    error: str
    code: str


class PaperRecord(StatedPaper, frozen=True, kw_only=True):
    """What the report says of a source paper beside its claims."""

    findings: tuple[str, ...]
    sensitivity: tuple[Sensitivity, ...]
    common: tuple[CommonLevel, ...]

    @property
    def cited(self) -> str:
        """How a text refers to it: surnames and year."""
        return self.named if self.year else f"{self.named} (undated)"

    @property
    def named(self) -> str:
        """The same in a sentence, where a year that is not known is not missed."""
        names = [(author.split() or [author])[-1] for author in self.authors] or [self.key]
        who = f"{names[0]} et al." if len(names) > 2 else " and ".join(names)
        return f"{who} ({self.year})" if self.year else who


class RunRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Provenance of a run: the sources, the lock, the machine. `date` is SOURCE_DATE_EPOCH when that is set.

    unlocked: packages that are installed in another version than the lock says.
    """

    package_version: str
    date: str
    commit: str
    dirty: bool | None
    lock_sha256: str
    python: str
    packages: dict[str, str]
    unlocked: tuple[str, ...] = ()
    blas: str
    threads: int
    cpu: str
    platform: str


PARTS = {
    "paper": ("papers", "key"),
    "claim": ("claims", "id"),
    "erratum": ("errata", "id"),
    "figure": ("figures", "name"),
    "experiment": ("experiments", "name"),
    "certificate": ("certificates", "path"),
}
"""The sorts of records: the part of the file that holds them, and what names one."""


class ResultsFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The whole of `report/results.json`."""

    schema_version: int
    project: Settings = Settings()
    run: RunRecord
    papers: tuple[PaperRecord, ...]
    claims: tuple[ClaimRecord, ...]
    errata: tuple[ErratumRecord, ...]
    figures: tuple[FigureRecord, ...]
    experiments: tuple[ExperimentRecord, ...]
    certificates: tuple[CertificateRecord, ...]

    def named(self, *sorts: str) -> Iterator[tuple[tuple[str, str], Any]]:
        """The records of these sorts, each with its sort and its id, key, name or path."""
        for sort in sorts:
            part, name = PARTS[sort]
            yield from (((sort, getattr(record, name)), record) for record in getattr(self, part))

    @property
    def readings(self) -> dict[str, tuple[Reading, ...]]:
        """What each paper reads into its text, by its key."""
        return {paper.key: paper.readings for paper in self.papers}


def shared(record: type[msgspec.Struct], declared: Any) -> dict[str, Any]:
    """The fields that a record has in common with what the code declares, its functions aside."""
    fields = {name: getattr(declared, name, shared) for name in record.__struct_fields__}
    return {name: value for name, value in fields.items() if not callable(value)}


def to_json(results: ResultsFile) -> bytes:
    """Canonical bytes: fields in the order of declaration, dictionaries sorted, two spaces, one newline at the end."""
    return msgspec.json.format(msgspec.json.encode(results, order="deterministic"), indent=2) + b"\n"


def write_results(path: Path, results: ResultsFile) -> None:
    """Write `results` at `path`, whole or not at all."""
    write_atomically(path, to_json(results))


def read_results(path: Path, *, whole: bool = True) -> ResultsFile:
    """Read and validate a results file; whole: with every field, without which it may only be compared.

    Raises AuditError that names the file and the wrong, missing or unknown field, or the schema that is not read.
    """
    try:
        content = msgspec.json.decode(path.read_bytes())
        version = msgspec.convert(content, _Version).schema_version
        if version != SCHEMA_VERSION:
            raise AuditError(
                f"{path} has schema version {version}, and this program reads {SCHEMA_VERSION}; "
                "make it again with `python -m replication run`"
            )
        results = msgspec.convert(content, ResultsFile)
        # A run writes every field: one that was taken out, or put into a predicate, must not pass.
        for where, value, written in unlike(content, msgspec.to_builtins(results)) if whole else ():
            place, _, field = where.rpartition(".")
            message = f"`{field}` is {value!r:.80}, where a run writes {written!r:.80}"
            raise msgspec.ValidationError(f"{message} - at `$.{place}`")
    except FileNotFoundError:
        raise AuditError(f"{path} does not exist; make it with `python -m replication run`") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise AuditError(f"{path} is not a results file: {error}; run `python -m replication run`") from None
    return results


class _Version(msgspec.Struct):
    schema_version: int


def unlike(one: Any, other: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Each leaf at which two values differ, with both; None where one of them has none."""
    if isinstance(one, dict) and isinstance(other, dict):
        for name in (*one, *(name for name in other if name not in one)):
            inner = f"{path}.{name}" if path else name
            both = name in one and name in other
            yield from unlike(one[name], other[name], inner) if both else [(inner, one.get(name), other.get(name))]
    elif isinstance(one, list | tuple) and isinstance(other, list | tuple) and len(one) == len(other):
        for index, pair in enumerate(zip(one, other, strict=True)):
            yield from unlike(*pair, f"{path}[{index}]")
    elif one != other:
        yield path, one, other
