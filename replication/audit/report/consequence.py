"""What hangs on a claim: as declared, or by one rule for all papers from its kind, its place and what is printed."""

from __future__ import annotations

import re
from collections.abc import Iterator

from replication.audit.brief import Consequence
from replication.audit.model import Kind
from replication.audit.store.records import StatedClaim

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
