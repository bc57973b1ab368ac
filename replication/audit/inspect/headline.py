"""The summary of a report: one sentence of verdict, what to bear in mind, and every number in them counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from replication.audit.judge.policies import once
from replication.audit.judge.printed import has_uncertainty
from replication.audit.judge.proofs import NUMERIC
from replication.audit.model import NO_READING, Kind, Verdict
from replication.audit.store.records import ClaimRecord, ErratumRecord, ResultsFile


class Basis(StrEnum):
    """What a claim is judged by: the digits that are printed, a yes or no, or the probability of the printed draw."""

    DIGITS = "in printed digits"
    STATEMENT = "as statements"
    DRAW = "as random draws"


_WORDS = {
    Verdict.REPRODUCED: ("agrees", "agree", "with the print"),
    Verdict.REPRODUCED_AFTER_ERRATUM: ("agrees", "agree", "once a documented misprint is corrected"),
    Verdict.COMPATIBLE: ("agrees", "agree", "under an inference or as a random draw"),
    Verdict.CONSISTENT: ("holds", "hold", "as a qualitative or statistical statement"),
    Verdict.DIFFERS: ("differs", "differ", "from the print"),
    Verdict.REFUTED: ("is", "are", "refuted"),
    Verdict.UNDETERMINED: ("is", "are", "not settled by the text"),
    Verdict.ERROR: ("ended", "ended", "in an error"),
}
_SPLIT = (Verdict.REPRODUCED, Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.COMPATIBLE)
"""Verdicts that sound like agreement of digits, so the sentence says in what they agree."""


def basis(claim: ClaimRecord) -> Basis:
    """What the verdict on a claim that could be judged rests on."""
    if claim.claim.kind in NUMERIC:
        return Basis.DIGITS
    drawn = claim.claim.kind is Kind.STATISTICAL and claim.evidence.probability is not None
    return Basis.DRAW if drawn else Basis.STATEMENT


def has_spread(claim: ClaimRecord) -> bool:
    """Whether it is judged by digits, and the text prints their uncertainty."""
    return basis(claim) is Basis.DIGITS and has_uncertainty(claim.claim.printed)


def counts(claims: Iterable[ClaimRecord]) -> dict[Verdict, int]:
    """How many claims have each verdict, in the order of `Verdict`, repeats aside; zeros included."""
    found = Counter(claim.verdict for claim in once(claims))
    return {verdict: found[verdict] for verdict in Verdict}


@dataclass(frozen=True, kw_only=True)
class Caveat:
    """Something that the counts of verdicts do not say by themselves: how many claims it is true of."""

    words: str
    number: int


@dataclass(frozen=True, kw_only=True)
class Headline:
    """What leads the report.

    total: claims, without those that repeat a fact and remarks of ours. unexpected: claims whose verdict is not the
    pinned one.
    counted: numbers in words.
    """

    sentence: str
    total: int
    repeated: int
    counts: Mapping[Verdict, int]
    proved: int
    supported: int
    caveats: tuple[Caveat, ...]
    unexpected: tuple[ClaimRecord, ...]
    counted: tuple[int, ...]


def headline(results: ResultsFile) -> Headline:
    """Count the claims of `results`, and say it."""
    claims = once(results.claims)
    unexpected = tuple(claim for claim in results.claims if claim.unexpected)
    by_basis = Counter((claim.verdict, basis(claim)) for claim in claims)
    return Headline(
        sentence=sentence(results.claims),
        total=len(claims),
        repeated=sum(bool(claim.claim.repeats) for claim in results.claims),
        counts=counts(claims),
        proved=sum(claim.judgement.proved for claim in claims),
        supported=sum(bool(claim.judgement.supported) for claim in claims),
        caveats=caveats(claims, results.errata),
        unexpected=unexpected,
        counted=(len(claims), len(unexpected), *by_basis.values()),
    )


def sentence(claims: Sequence[ClaimRecord]) -> str:
    """The verdict on all claims in words, computed from them; a number that a text repeats counts once."""
    if not claims:
        return "There is no claim to judge."
    every, claims = claims, once(claims)
    parts = [_part(verdict, claims) for verdict, number in counts(claims).items() if number]
    listed = " and ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))
    changed = sum(claim.unexpected for claim in every)
    expected = (
        f"{changed} {'verdict is' if changed == 1 else 'verdicts are'} not as expected."
        if changed
        else "Every verdict is as expected."
    )
    text = f"Of {len(claims)} {'claim' if len(claims) == 1 else 'claims'}, {listed}. {expected}"
    return f"{text} {theorems(claims)}".strip()


def theorems(claims: Iterable[ClaimRecord]) -> str:
    """How many verdicts rest on theorems, how many of them against the claim, how many are supported; empty if none."""
    claims = tuple(claims)
    proved = sum(claim.judgement.proved for claim in claims)
    against = sum(claim.judgement.proved and claim.verdict in (Verdict.DIFFERS, Verdict.REFUTED) for claim in claims)
    supported = sum(bool(claim.judgement.supported) for claim in claims)
    if not proved and not supported:
        return ""
    many = f"{proved} {'verdict rests on a theorem' if proved == 1 else 'verdicts rest on theorems'}"
    many += f", {against} of them against the claim" if against else ""
    return f"{many}; theorems support {supported} more." if supported else f"{many}."


def caveats(claims: Sequence[ClaimRecord], errata: Iterable[ErratumRecord]) -> tuple[Caveat, ...]:
    """What the counts of verdicts do not say by themselves."""
    inferred = {erratum.id for erratum in errata if erratum.inference}
    found = {
        "compatible by an erratum that is an inference, not a proof": (
            c.verdict is Verdict.COMPATIBLE and c.claim.erratum in inferred for c in claims
        ),
        "that rest on a reading of the text": (c.claim.reading not in ("", NO_READING) for c in claims),
        "with printed digits and a tolerance other than half a unit": (
            c.claim.tolerance is not None or has_spread(c) for c in claims
        ),
        "whose statement holds up to a threshold of ours": (c.evidence.threshold is not None for c in claims),
        "judged by the probability of a random draw": (basis(c) is Basis.DRAW for c in claims),
        "with neither a check by a second method nor a proof": (
            not (c.evidence.cross_check or c.judgement.proved) for c in claims
        ),
    }
    return tuple(Caveat(words=words, number=sum(true)) for words, true in found.items())


def _part(verdict: Verdict, claims: Sequence[ClaimRecord]) -> str:
    chosen = [claim for claim in claims if claim.verdict is verdict]
    singular, plural, rest = _WORDS[verdict]
    text = f"{len(chosen)} {plural if len(chosen) != 1 else singular} {rest}"
    if verdict not in _SPLIT:
        return text
    found = Counter(map(basis, chosen))
    return f"{text} ({', '.join(f'{found[kind]} {kind}' for kind in Basis if found[kind])})"
