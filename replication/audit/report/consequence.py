"""What hangs on a claim, as declared or by one rule for all papers, and how a paper stands by its gravest claims."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from replication.audit.brief import Consequence
from replication.audit.judge.policies import once
from replication.audit.model import Kind, Verdict
from replication.audit.store.records import ClaimRecord, ResultsFile, StatedClaim

_THEOREM = re.compile(r"(theorem|lemma|corollary|proposition|algorithm)s?\b", re.IGNORECASE)
_HEADLINE = re.compile(r"(abstract|conclusions?|introduction|blog|sec\. I)\b", re.IGNORECASE)
_TABLE = re.compile(r"(table|figs?\.|figure)\b|.*,\s+(table|figs?\.)$", re.IGNORECASE)
_FORMULA = re.compile(r".*parameters|eqs?\.|equations?\b", re.IGNORECASE)
_NUMBERS = (Kind.VALUE, Kind.BOUND, Kind.STATISTICAL)

MEANING = {
    Consequence.THEOREM: ("Theorems and guarantees", "what the paper proves or promises"),
    Consequence.HEADLINE: ("Headline results", "what its text leads with"),
    Consequence.TABLE: ("Table and figure entries", "single printed values"),
    Consequence.DIGIT: ("Other printed numbers", "sizes, gains, parameters"),
    Consequence.REMARK: ("Steps and remarks", "formulas, asides, citations"),
}


FAILS = (Verdict.REFUTED, Verdict.DIFFERS)
STANDS = (Verdict.REPRODUCED, Verdict.CONSISTENT, Verdict.REPRODUCED_AFTER_ERRATUM)
PROMISES = (Consequence.THEOREM, Consequence.HEADLINE)


@dataclass(frozen=True, kw_only=True)
class Standing:
    """How a paper stands; claims that repeat a number are not counted.

    theorems: claims on its theorems and guarantees. refuted, broken: how many of these are false, or fail in any way.
    sound: whether there are some and all hold; corrected: whether one holds only once a misprint is corrected. open:
    whether one of them, or a headline result, holds under one reading of the text and fails under another. failing: of
    all claims. claims: how many there are.
    """

    theorems: int
    refuted: int
    broken: int
    sound: bool
    corrected: bool
    open: bool
    failing: int
    claims: int

    @property
    def rank(self) -> tuple[bool, bool]:
        """The order of papers: first a false guarantee, then one that hangs on the reading, then the others."""
        return not self.broken, not self.open


def standing(claims: Iterable[ClaimRecord]) -> Standing:
    """How the paper with these claims stands."""
    own = once(tuple(claims))
    promised = [claim for claim in own if consequence(claim.claim) in PROMISES]
    theorems = [claim for claim in promised if consequence(claim.claim) is Consequence.THEOREM]
    return Standing(
        theorems=len(theorems),
        refuted=sum(claim.verdict is Verdict.REFUTED for claim in theorems),
        broken=sum(claim.verdict in FAILS for claim in theorems),
        sound=bool(theorems) and all(claim.verdict in STANDS for claim in theorems),
        corrected=any(claim.claim.erratum and claim.verdict not in FAILS for claim in theorems),
        open=any(map(_depends_on_the_reading, promised)),
        failing=sum(claim.verdict in FAILS for claim in own),
        claims=len(own),
    )


def standings(results: ResultsFile) -> dict[str, Standing]:
    """How each paper stands, by its key, in the one order in which papers are shown."""
    found = {p.key: standing(claim for claim in results.claims if claim.paper == p.key) for p in results.papers}
    return dict(sorted(found.items(), key=lambda item: item[1].rank))


def _depends_on_the_reading(claim: ClaimRecord) -> bool:
    return claim.verdict is Verdict.UNDETERMINED and {True, False} <= {one.holds for one in claim.evidence.outcomes}


def consequence(claim: StatedClaim) -> Consequence:
    """The declared consequence; else the gravest by any place of the claim, of which a semicolon parts several."""
    if claim.consequence is not None:
        return claim.consequence
    if claim.kind is Kind.CITED:
        return Consequence.REMARK
    order = list(Consequence)
    return min((_by_place(claim, place.strip()) for place in claim.place.split(";")), key=order.index)


def _by_place(claim: StatedClaim, place: str) -> Consequence:
    for found in _named(place):
        return found
    if not claim.printed:
        return Consequence.REMARK
    # A level in the text is what a reader takes home; a count or an equation's matrix is not.
    level = claim.kind in _NUMBERS and "." in claim.printed and not _FORMULA.match(place)
    return Consequence.HEADLINE if level else Consequence.DIGIT


def _named(place: str) -> Iterator[Consequence]:
    if _THEOREM.match(place):
        yield Consequence.THEOREM
    if _TABLE.match(place):
        yield Consequence.TABLE
    if _HEADLINE.match(place):
        yield Consequence.HEADLINE
