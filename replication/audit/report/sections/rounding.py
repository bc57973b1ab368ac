"""What agreement to the digits rests on: what a verdict allows, and how much rounding of parameters a claim bears."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from replication.audit.inspect.headline import Basis, basis, has_spread
from replication.audit.judge import numerals
from replication.audit.judge.agreement import stored_intervals
from replication.audit.judge.verdict import SMALLEST_PROBABILITY, SMALLEST_PROBABILITY_REASON
from replication.audit.parts import Sensitivity
from replication.audit.store.records import ClaimRecord, ResultsFile
from replication.errors import AuditError


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
    if has_spread(claim):
        yield "distance from the print", "as printed with it", f"The text prints {claim.claim.printed}."
    for evidence in (claim.evidence, claim.evidence.as_printed):
        if evidence is not None and evidence.threshold is not None:
            yield "residual of the statement", f"≤ {numerals.short(evidence.threshold)}", evidence.threshold_reason
    if basis(claim) is Basis.DRAW:
        allowed = f"≥ {numerals.short(SMALLEST_PROBABILITY)}"
        yield "probability of a draw as extreme", allowed, SMALLEST_PROBABILITY_REASON


@dataclass(frozen=True, kw_only=True)
class Room:
    """One parameter, moved by up to half a unit of its last place to the side that matters, by linear interpolation.

    share: of that half unit, how much a claim that agrees bears, 1 if it rounds to its print on all of it; of one that
    does not agree, how much it takes until it does, None if it never does.
    """

    moves: Sensitivity
    share: float | None


@dataclass(frozen=True, kw_only=True)
class ClaimRoom:
    """One claim and the parameters that it was tried with, first the one whose rounding decides soonest.

    agrees: whether the result rounds to the print at the printed parameters.
    """

    claim: ClaimRecord
    agrees: bool
    rooms: tuple[Room, ...]

    @property
    def breaking(self) -> tuple[Room, ...]:
        """The parameters whose own rounding is enough to break the agreement."""
        return tuple(room for room in self.rooms if self.agrees and room.share != 1.0)

    @property
    def reaching(self) -> tuple[Room, ...]:
        """The parameters whose own rounding is enough to reach an agreement that there is not."""
        return tuple(room for room in self.rooms if not self.agrees and room.share is not None)


def rooms(results: ResultsFile) -> tuple[ClaimRoom, ...]:
    """All claims that were tried, in the order of the claims; AuditError if one of them is unknown."""
    claims = {claim.id: claim for claim in results.claims}
    found: dict[str, list[Sensitivity]] = {}
    for moves in (moves for paper in results.papers for moves in paper.sensitivity):
        if moves.claim not in claims:
            raise AuditError(f"a sensitivity names {moves.claim!r}, which is no claim; correct the paper's experiment")
        found.setdefault(moves.claim, []).append(moves)
    return tuple(_claim_room(claim, found[claim.id]) for claim in results.claims if claim.id in found)


def _claim_room(claim: ClaimRecord, tried: Sequence[Sensitivity]) -> ClaimRoom:
    intervals = stored_intervals(claim.claim, claim.judgement)
    if len(intervals) != 1:
        raise AuditError(f"a sensitivity names {claim.id!r}, which does not print one number that is a value")
    least, most = intervals[0].ends
    made = sorted(
        (_room(moves, least, most) for moves in tried), key=lambda room: math.inf if room.share is None else room.share
    )
    return ClaimRoom(claim=claim, agrees=least <= Fraction(tried[0].base) <= most, rooms=tuple(made))


def _room(moves: Sensitivity, least: Fraction, most: Fraction) -> Room:
    base = Fraction(moves.base)
    if least <= base <= most:
        return Room(moves=moves, share=min(_share(base, end, least, most) for end in (moves.low, moves.high)))
    nearest = least if base < least else most
    ways = [(nearest - base) / (Fraction(end) - base) for end in (moves.low, moves.high) if end not in (None, base)]
    needed = [way for way in ways if 0 < way <= 1]
    return Room(moves=moves, share=float(min(needed)) if needed else None)


def _share(base: Fraction, end: float | None, least: Fraction, most: Fraction) -> float:
    """How much of the way from `base` to `end` lies within the print; none is known if there is no result there."""
    if end is None:
        return 0.0
    there = Fraction(end)
    if least <= there <= most:
        return 1.0
    return float(((most if there > base else least) - base) / (there - base))
