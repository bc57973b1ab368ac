"""Checking the proofs in a results file: they are of the certificates that lie there, and the claims say no more."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from replication.audit.judge.proofs import sha256, wanted, with_proofs
from replication.audit.model import Evidence
from replication.audit.store.records import CertificateRecord, ClaimRecord, ResultsFile
from replication.errors import AuditError

Fault = tuple[str, str]
"""Where, and what is wrong."""


def unsupported(results: ResultsFile) -> Iterator[Fault]:
    """Claims whose bracket, or mark, is not what the certificates of the file prove."""
    for claim in results.claims:
        supporting = [entry for entry in results.certificates if claim.id in entry.claims]
        paths = tuple(entry.path for entry in supporting)
        if claim.certificates != paths:
            yield claim.id, f"certificates is {claim.certificates!r}, but those of the file that name it are {paths!r}"
        elif claim.method and supporting and (difference := _difference(claim, supporting)):
            yield claim.id, difference


def _difference(claim: ClaimRecord, supporting: Sequence[CertificateRecord]) -> str:
    """What joining the claim with its certificates again would change; empty if nothing."""
    stored = Evidence(
        method=claim.method,
        value=claim.computed,
        lower=claim.lower,
        upper=claim.upper,
        holds=claim.holds,
        proved=False,
    )
    try:
        joined = with_proofs(claim.kind, stored, supporting)
    except AuditError as error:
        return str(error)
    names = ("value", "lower", "upper", "holds")
    if any(getattr(joined, name) != getattr(stored, name) for name in names):
        return "the bracket is not the one that its certificates prove"
    return "" if claim.proved == joined.proved else f"proved is {claim.proved}, but its certificates say otherwise"


def refused(results: ResultsFile) -> Iterator[Fault]:
    """Certificates that are not proved."""
    for entry in results.certificates:
        if not entry.proved:
            yield entry.path, entry.reason or "it is not proved, and no reason is given"


def against_files(results: ResultsFile, root: Path) -> Iterator[Fault]:
    """Certificates of the file that are not the ones wanted, or not the ones that lie below `root`."""
    listed, reasons = wanted(root, [paper.key for paper in results.papers])
    there = {entry.path: entry for entry in listed}
    stored = {entry.path: entry for entry in results.certificates}
    for path in sorted(there.keys() ^ stored.keys()):
        yield path, f"the certificate is {'wanted and not in the file' if path in there else 'in the file, not wanted'}"
    for path in sorted(there.keys() & stored.keys()):
        entry, record = there[path], stored[path]
        if sha256(root / path) != record.sha256:
            yield path, "the file is not the one that was verified; run the audit again"
        if (entry.claims, entry.statement) != (record.claims, record.statement):
            yield path, "its claims or statement are not those of the theorem that is wanted"
    for claim in results.claims:
        if claim.unproved != reasons.get(claim.id, ""):
            yield claim.id, "the reason why there is no theorem is not the one that the paper gives"
