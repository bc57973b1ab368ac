"""The summary of a report in words, every number in it counted from the claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from enum import StrEnum

from replication.audit.model import Kind, Verdict
from replication.audit.records import ClaimRecord, ErratumRecord
from replication.audit.verdict import NUMERIC


class Basis(StrEnum):
    """What a claim is judged by: the digits that are printed, a yes or no, or the probability of the printed draw."""

    DIGITS = "in printed digits"
    STATEMENT = "as statements"
    DRAW = "as random draws"


_WORDS = {
    Verdict.REPRODUCED: ("agrees", "agree", "with the print"),
    Verdict.REPRODUCED_AFTER_ERRATUM: ("agrees", "agree", "once a documented misprint is corrected"),
    Verdict.DIFFERS: ("differs", "differ", "from the print or its statement"),
    Verdict.CONSISTENT: ("holds", "hold", "as a qualitative or statistical statement"),
    Verdict.NOT_CHECKABLE: ("cannot", "cannot", "be checked"),
    Verdict.ERROR: ("ended", "ended", "in an error"),
}
_SPLIT = (Verdict.REPRODUCED, Verdict.REPRODUCED_AFTER_ERRATUM)
"""Verdicts that sound like agreement of digits, so the sentence says in what they agree."""


def basis(claim: ClaimRecord) -> Basis:
    """What the verdict on a claim that could be judged rests on."""
    if claim.kind in NUMERIC:
        return Basis.DIGITS
    return Basis.DRAW if claim.kind is Kind.STATISTICAL and claim.probability is not None else Basis.STATEMENT


def counts(claims: Iterable[ClaimRecord]) -> dict[Verdict, int]:
    """How many claims have each verdict, in the order of `Verdict`; zeros included."""
    found = Counter(claim.verdict for claim in claims)
    return {verdict: found[verdict] for verdict in Verdict}


def sentence(claims: Sequence[ClaimRecord]) -> str:
    """The verdict on all claims in words, computed from them."""
    if not claims:
        return "There is no claim to judge."
    parts = [_part(verdict, claims) for verdict, number in counts(claims).items() if number]
    listed = " and ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))
    changed = sum(claim.verdict != claim.expected_verdict for claim in claims)
    expected = (
        f"{changed} {'verdict is' if changed == 1 else 'verdicts are'} not as expected."
        if changed
        else "Every verdict is the expected one."
    )
    return f"Of {len(claims)} {'claim' if len(claims) == 1 else 'claims'}, {listed}. {expected}"


def caveats(claims: Sequence[ClaimRecord], errata: Iterable[ErratumRecord]) -> tuple[str, ...]:
    """What the counts of verdicts do not say by themselves, each in a sentence with its number."""
    inferred = {erratum.id for erratum in errata if erratum.inference}
    found = (
        (
            [c for c in claims if c.verdict is Verdict.REPRODUCED_AFTER_ERRATUM and c.erratum in inferred],
            "reproduced after an erratum that is an inference, not a proof",
        ),
        ([c for c in claims if c.tolerance is not None], "with printed digits and a tolerance other than half a unit"),
        ([c for c in claims if c.threshold is not None], "whose statement holds up to a threshold of ours"),
        ([c for c in claims if basis(c) is Basis.DRAW], "judged by the probability of a random draw"),
        ([c for c in claims if not c.cross_check], "without a check by a second method"),
        ([c for c in claims if c.proved], "with a bracket proved in exact or ball arithmetic"),
    )
    return tuple(f"Claims {words}: {len(chosen)} of {len(claims)}." for chosen, words in found if claims)


def _part(verdict: Verdict, claims: Sequence[ClaimRecord]) -> str:
    chosen = [claim for claim in claims if claim.verdict is verdict]
    singular, plural, rest = _WORDS[verdict]
    text = f"{len(chosen)} {plural if len(chosen) != 1 else singular} {rest}"
    if verdict not in _SPLIT:
        return text
    found = Counter(map(basis, chosen))
    return f"{text} ({', '.join(f'{found[kind]} {kind}' for kind in Basis if found[kind])})"
