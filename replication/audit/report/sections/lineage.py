"""What stands behind the claims: theorems, experiments, allowances, and the rounding of the digits."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction

from replication.audit.inspect.headline import Basis, basis, has_spread
from replication.audit.judge import numerals
from replication.audit.judge.agreement import stored_intervals
from replication.audit.judge.policies import once
from replication.audit.judge.verdict import SMALLEST_PROBABILITY, SMALLEST_PROBABILITY_REASON
from replication.audit.parts import Sensitivity
from replication.audit.store.records import CertificateRecord, ClaimRecord, ExperimentRecord, PaperRecord, ResultsFile
from replication.errors import AuditError

NO_REASON = "No certificate has been made."


@dataclass(frozen=True, kw_only=True)
class Proofs:
    """asked, proved, supported: how many claims there are, are proved, and have theorems beside them. open: the ones
    without any, by reason. listed, twice, machine: how many certificates there are, and how many the second verifier
    and Coq have checked too."""

    certificates: tuple[tuple[CertificateRecord, tuple[ClaimRecord, ...]], ...]
    asked: int
    proved: int
    supported: int
    listed: int
    twice: int
    machine: int
    open: tuple[tuple[str, tuple[ClaimRecord, ...]], ...]


def proofs(results: ResultsFile) -> Proofs | None:
    """What the certificates of `results` prove, each with its claims; None if there is no certificate."""
    if not results.certificates:
        return None
    records = once(results.claims)
    reasons: dict[str, list[ClaimRecord]] = {}
    for claim in records:
        if not claim.judgement.proved and not claim.judgement.supported:
            reasons.setdefault(claim.judgement.unproved or NO_REASON, []).append(claim)
    return Proofs(
        certificates=tuple(
            (certificate, tuple(claim for claim in results.claims if certificate.path in claim.evidence.certificates))
            for certificate in results.certificates
        ),
        asked=len(records),
        proved=sum(claim.judgement.proved for claim in records),
        supported=sum(bool(claim.judgement.supported) for claim in records),
        listed=len(results.certificates),
        twice=sum(certificate.proved and certificate.second for certificate in results.certificates),
        machine=sum(certificate.proved and bool(certificate.machine) for certificate in results.certificates),
        open=tuple((reason, tuple(claims)) for reason, claims in reasons.items()),
    )


Lineage = tuple[PaperRecord, tuple[tuple[ExperimentRecord, tuple[ClaimRecord, ...]], ...]]
"""A paper, and its experiments with the claims that each answers."""


def lineages(results: ResultsFile) -> tuple[Lineage, ...]:
    """Each paper that has an experiment behind a claim, with both in their order."""
    users: dict[str, list[ClaimRecord]] = {}
    for claim in results.claims:
        for name in claim.claim.uses:
            users.setdefault(name, []).append(claim)
    known = [(record, tuple(users[record.name])) for record in results.experiments if record.name in users]
    papers = ((paper, tuple(pair for pair in known if pair[0].paper == paper.key)) for paper in results.papers)
    return tuple((paper, pairs) for paper, pairs in papers if pairs)


Allowance = tuple[str, str, str, tuple[ClaimRecord, ...]]
"""What is compared, how much of it is allowed, why, and the claims that are judged so."""


def allowances(claims: Iterable[ClaimRecord]) -> tuple[Allowance, ...]:
    """Every allowance that a claim uses, once for each size and reason, in the order of the claims."""
    groups: dict[tuple[str, str, str], list[ClaimRecord]] = {}
    for claim in claims:
        for allowance in dict.fromkeys(_of(claim)):
            groups.setdefault(allowance, []).append(claim)
    return tuple((*what, tuple(users)) for what, users in groups.items())


def _of(claim: ClaimRecord) -> Iterator[tuple[str, str, str]]:
    if claim.claim.tolerance is not None:
        yield "distance from the print", f"≤ {claim.claim.tolerance}", claim.claim.tolerance_reason
    if has_spread(claim):
        yield "distance from the print", "as printed with it", f"The text prints {claim.claim.printed}."
    for evidence in (claim.evidence, claim.evidence.as_printed):
        if evidence is not None and evidence.threshold is not None:
            yield "residual of the statement", f"≤ {numerals.short(evidence.threshold)}", evidence.threshold_reason
    if basis(claim) is Basis.DRAW:
        allowed = f"≥ {numerals.short(SMALLEST_PROBABILITY)}"
        yield "probability of a draw as extreme", allowed, SMALLEST_PROBABILITY_REASON


Room = tuple[Sensitivity, float | None]
"""One parameter, moved by up to half a unit of its last place to the side that matters, by linear interpolation.

With the share of that half unit that a claim which agrees bears, 1 if it rounds to its print on all of it; or that a
claim which does not agree takes until it does, None if it never does.
"""


@dataclass(frozen=True, kw_only=True)
class ClaimRoom:
    """One claim and the parameters that it was tried with, first the one whose rounding decides soonest.

    agrees: whether the result rounds to the print at the printed parameters.
    """

    claim: ClaimRecord
    agrees: bool
    rooms: tuple[Room, ...]

    @property
    def deciding(self) -> tuple[Room, ...]:
        """The parameters whose own rounding is enough to end the agreement, or the difference."""
        return tuple(room for room in self.rooms if (room[1] != 1.0 if self.agrees else room[1] is not None))


def rooms(results: ResultsFile) -> tuple[ClaimRoom, ...]:
    """All claims that were tried, in the order of the claims; AuditError if one of them is unknown."""
    claims = {claim.id: claim for claim in results.claims}
    sensitivities: dict[str, list[Sensitivity]] = {}
    for moves in (moves for paper in results.papers for moves in paper.sensitivity):
        if moves.claim not in claims:
            raise AuditError(f"a sensitivity names {moves.claim!r}, which is no claim; correct the paper's experiment")
        sensitivities.setdefault(moves.claim, []).append(moves)
    records = []
    for claim in (claim for claim in results.claims if claim.id in sensitivities):
        intervals = stored_intervals(claim.claim, claim.judgement)
        if len(intervals) != 1:
            raise AuditError(f"a sensitivity names {claim.id!r}, which does not print one number that is a value")
        least, most = intervals[0].ends
        tried = [_room(moves, least, most) for moves in sensitivities[claim.id]]
        tried.sort(key=lambda room: math.inf if room[1] is None else room[1])
        agrees = least <= Fraction(sensitivities[claim.id][0].base) <= most
        records.append(ClaimRoom(claim=claim, agrees=agrees, rooms=tuple(tried)))
    return tuple(records)


def _room(moves: Sensitivity, least: Fraction, most: Fraction) -> Room:
    base = Fraction(moves.base)
    if least <= base <= most:
        return moves, min(_share(base, end, least, most) for end in (moves.low, moves.high))
    nearest = least if base < least else most
    ways = [(nearest - base) / (Fraction(end) - base) for end in (moves.low, moves.high) if end not in (None, base)]
    needed = [way for way in ways if 0 < way <= 1]
    return moves, float(min(needed)) if needed else None


def _share(base: Fraction, end: float | None, least: Fraction, most: Fraction) -> float:
    """How much of the way from `base` to `end` lies within the print; none is known if there is no result there."""
    if end is None:
        return 0.0
    edge = Fraction(end)
    if least <= edge <= most:
        return 1.0
    return float(((most if edge > base else least) - base) / (edge - base))
