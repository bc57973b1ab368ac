"""Does a theorem say what a claim says? The predicates of the claim, decided by what its certificates export."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import msgspec

from replication.audit.judge.agreement import Interval, Target, compared, negated
from replication.audit.model import Evidence, StatedClaim
from replication.audit.store.records import CertificateRecord
from replication.errors import AuditError
from replication.verify.predicate import NO_READING, Exported, Predicate, Term, differences, in_words

NO_PREDICATE = "The claim states no predicate that a theorem could be compared with."
Offer = tuple[str, Exported]
"""A term of a theorem, with the name of the theorem."""


@dataclass(frozen=True, kw_only=True)
class Match:
    """What the theorems of a claim say of it.

    by_reading: whether all its predicates under a reading hold, None where they are not decided. difference: in words,
    what the theorems do not say. bounds: what they prove of the number of its first predicate.
    """

    by_reading: Mapping[str, bool | None]
    difference: str
    bounds: tuple[Interval, ...]

    @property
    def proved(self) -> bool:
        """Whether the claim is decided, one way or the other, under each reading that it rests on."""
        return bool(self.by_reading) and None not in self.by_reading.values()


def match(claim: StatedClaim, evidence: Evidence, certificates: Sequence[CertificateRecord]) -> Match:
    """Decide a claim by certificates of its paper that are proved; raises AuditError if they contradict each other.

    It rests on its own reading and, where the evidence tells outcomes under several, on each of these.
    """
    if not claim.says:
        return Match(by_reading={}, difference=NO_PREDICATE, bounds=())
    paper = claim.id.partition(".")[0]
    offers = [(one.name, said) for one in certificates if one.paper == paper and one.proved for said in one.says]
    decided = [(predicate, _decided(predicate, claim, offers)) for predicate in claim.says]
    # A claim without a reading of its own may have outcomes under several, of which the text leaves the choice.
    own = [claim.reading] if claim.reading and not (claim.reading == NO_READING and evidence.outcomes) else []
    readings = dict.fromkeys([*own, *(one.reading for one in claim.says), *(one.reading for one in evidence.outcomes)])
    by_reading = {name: _all([holds for one, holds in decided if one.reading == name]) for name in readings}
    missing = [_lacking(one, claim, offers) for one, holds in decided if holds is None]
    told = {one.reading for one in claim.says}
    missing += [f"nothing is said under the reading {name}" for name in readings if name not in told]
    first = claim.says[0]
    return Match(
        by_reading=by_reading,
        difference=_told(missing, by_reading),
        bounds=_bounds(first.of, first, offers),
    )


def _all(decided: Sequence[bool | None]) -> bool | None:
    """A conjunction: false as soon as one part is, true if all are; nothing is said by none."""
    if False in decided:
        return False
    return None if None in decided or not decided else True


def _told(missing: Sequence[str], by_reading: Mapping[str, bool | None]) -> str:
    """What is decided under some readings, then what is not."""
    if not missing:
        return ""
    words = {True: "says", False: "denies"}
    ways = {holds: [name for name, found in by_reading.items() if found is holds] for holds in words}
    decided = [f"A theorem {words[holds]} it under {', '.join(names)}. " for holds, names in ways.items() if names]
    told = "; ".join(missing)
    return f"{''.join(decided)}{told[:1].upper()}{told[1:]}."


def _fitting(term: Term, predicate: Predicate, offers: Iterable[Offer]) -> list[Exported]:
    """What is exported of exactly this term, under this reading."""
    like = term.quantity, term.plant, term.estimators
    near = (one for _, one in offers if (one.of.quantity, one.of.plant, one.of.estimators) == like)
    near = (one for one in near if one.unit == predicate.unit and predicate.reading in one.readings)
    near = (one for one in near if one.of.setting == term.setting)
    # Settings that are equal may still differ in type.
    return [one for one in near if not differences(term, predicate.reading, one)]


def _decided(predicate: Predicate, claim: StatedClaim, offers: Sequence[Offer]) -> bool | None:
    """Whether a predicate holds by these theorems; None if they do not say."""
    if predicate.relation in ("holds", "fails"):
        said = {one.holds for one in _fitting(predicate.of, predicate, offers)} - {None}
        if len(said) > 1:
            raise AuditError(f"the theorems on {claim.id} contradict each other: one says that it holds, one not")
        return said == {predicate.relation == "holds"} if said else None
    ours = _bounds(predicate.of, predicate, offers)
    if isinstance(predicate.to, Term):
        theirs = _bounds(predicate.to, predicate, offers)
        return compared(predicate.relation, ours[0], theirs[0]) if len(ours) == len(theirs) == 1 else None
    text = str(predicate.to)
    if predicate.relation in ("is", "is not"):
        other = {} if text == claim.printed else {"printed": text, "tolerance": None}
        return _equal(predicate, ours, Target.of(msgspec.structs.replace(claim, **other)))
    limit = Fraction(text)
    return compared(predicate.relation, ours[0], Interval(limit, limit)) if len(ours) == 1 else None


def _equal(predicate: Predicate, ours: Sequence[Interval], target: Target) -> bool | None:
    """Whether bounds lie in what each number of a print stands for; of a conjugate pair the imaginary part in size."""
    if len(ours) != len(target.intervals):
        return None
    entries = zip(ours, target.printed.entries, target.intervals, strict=True)
    parts = [(one.size() if entry.absolute else one).within(stands) for one, entry, stands in entries]
    return negated(_all(parts)) if predicate.relation == "is not" else _all(parts)


def _bounds(term: Term, predicate: Predicate, offers: Iterable[Offer]) -> tuple[Interval, ...]:
    """The narrowest bounds of each number of a term; none if theorems on it bound different counts of numbers."""
    found = [one.items for one in _fitting(term, predicate, offers) if any(end for pair in one.items for end in pair)]
    if len({len(items) for items in found}) != 1:
        return ()
    narrow = tuple(_narrowest(pairs) for pairs in zip(*found, strict=True))
    for one in narrow:
        if one.low > one.high:
            raise AuditError(
                f"the theorems on {in_words(predicate)} contradict each other: one says at least {one.low}, another "
                f"at most {one.high}; one of their statements or certificates is wrong"
            )
    return narrow


def _narrowest(pairs: Iterable[tuple[str | None, str | None]]) -> Interval:
    lows, highs = zip(*pairs, strict=True)
    low = max((Fraction(end) for end in lows if end is not None), default=-math.inf)
    return Interval(low, min((Fraction(end) for end in highs if end is not None), default=math.inf))


def _lacking(predicate: Predicate, claim: StatedClaim, offers: Sequence[Offer]) -> str:
    """What the nearest theorem says instead."""
    for term in predicate.terms:
        if not _fitting(term, predicate, offers):
            near = [(differences(term, predicate.reading, one), name) for name, one in offers]
            if not near:
                return "No theorem that supports it says anything as data"
            told, name = min(near, key=lambda found: len(found[0]))
            return f"The nearest theorem, {name}, says it otherwise: {'; '.join(told)}"
    return f"The proved bounds do not decide whether {in_words(predicate)}"
