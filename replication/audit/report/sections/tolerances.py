"""All that a verdict allows beyond half a printed unit: tolerances, thresholds of statements, the least probability."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from replication.audit.inspect.headline import Basis, basis
from replication.audit.judge import numerals
from replication.audit.judge.verdict import SMALLEST_PROBABILITY, SMALLEST_PROBABILITY_REASON
from replication.audit.store.records import ClaimRecord


@dataclass(frozen=True)
class Allowance:
    """What is compared, how much of it is allowed, why, and the claims that are judged so."""

    compared: str
    allowed: str
    reason: str
    claims: tuple[ClaimRecord, ...]


def allowances(claims: Iterable[ClaimRecord]) -> tuple[Allowance, ...]:
    """Every allowance that a claim uses, once for each size and reason, in the order of the claims."""
    found: dict[tuple[str, str, str], list[ClaimRecord]] = {}
    for claim in claims:
        for allowance in dict.fromkeys(_of(claim)):
            found.setdefault(allowance, []).append(claim)
    return tuple(Allowance(*what, tuple(users)) for what, users in found.items())


def _of(claim: ClaimRecord) -> Iterator[tuple[str, str, str]]:
    if claim.claim.tolerance is not None:
        yield "distance from the print", f"≤ {claim.claim.tolerance}", claim.claim.tolerance_reason
    for evidence in (claim.evidence, claim.evidence.as_printed):
        if evidence is not None and evidence.threshold is not None:
            yield "residual of the statement", f"≤ {numerals.short(evidence.threshold)}", evidence.threshold_reason
    if basis(claim) is Basis.DRAW:
        allowed = f"≥ {numerals.short(SMALLEST_PROBABILITY)}"
        yield "probability of a draw as extreme", allowed, SMALLEST_PROBABILITY_REASON
