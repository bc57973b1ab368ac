"""The proofs as the report lists them: each theorem with its certificate, and the claims that have none."""

from __future__ import annotations

from dataclasses import dataclass

from replication.audit.model import Kind
from replication.audit.store.records import CertificateRecord, ClaimRecord, ResultsFile

PROVABLE = (Kind.VALUE, Kind.BOUND, Kind.FEASIBLE)
"""Kinds of claims of which a theorem may be asked."""
NO_REASON = "No certificate has been made."


@dataclass(frozen=True, kw_only=True)
class Proofs:
    """asked, proved: how many claims of the provable kinds there are and are proved. open: the other ones by reason."""

    certificates: tuple[tuple[CertificateRecord, tuple[ClaimRecord, ...]], ...]
    asked: int
    proved: int
    open: tuple[tuple[str, tuple[ClaimRecord, ...]], ...]


def proofs(results: ResultsFile) -> Proofs | None:
    """What the certificates of `results` prove, each with its claims; None if there is no certificate."""
    if not results.certificates:
        return None
    asked = [claim for claim in results.claims if claim.claim.kind in PROVABLE]
    reasons: dict[str, list[ClaimRecord]] = {}
    for claim in asked:
        if not claim.judgement.proved:
            reasons.setdefault(claim.judgement.unproved or NO_REASON, []).append(claim)
    return Proofs(
        certificates=tuple(
            (certificate, tuple(claim for claim in results.claims if certificate.path in claim.evidence.certificates))
            for certificate in results.certificates
        ),
        asked=len(asked),
        proved=sum(claim.judgement.proved for claim in asked),
        open=tuple((reason, tuple(claims)) for reason, claims in reasons.items()),
    )
