"""The sentences of a brief, each link of which leads to a claim that says the same.

Numbers in them are filled in from the run, as `Brief` describes, and `{name:rounded}` is the computed
number rounded as the print is. A card has several sentences, each as short as any other.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from replication.audit.brief import Brief
from replication.audit.judge import numerals
from replication.audit.judge.agreement import rounds_to
from replication.audit.judge.numerals import LINK, require_short
from replication.audit.model import Policy, Verdict
from replication.audit.report.claim import anchor
from replication.audit.store.records import ClaimRecord, PaperRecord, ResultsFile
from replication.errors import AuditError

HOLDS, FAILS, OPEN, ANYTHING = "+", "-", "?", "any"
_NUMBER = re.compile(r"\{([\w.\-]+)(?::(\w+)(?::([\w.\-]+))?)?\}")
DIGITS, LOWER_DIGITS = 5, 3
"""Significant digits of a computed number, and of a lower bound, in a sentence."""

_SAYS = {
    Verdict.REPRODUCED: HOLDS,
    Verdict.CONSISTENT: HOLDS,
    Verdict.REPRODUCED_AFTER_ERRATUM: HOLDS + FAILS,
    Verdict.DIFFERS: FAILS,
    Verdict.REFUTED: FAILS,
    Verdict.COMPATIBLE: OPEN,
    Verdict.UNDETERMINED: OPEN,
    Verdict.ERROR: "",
}
"""What a sentence may say of a claim with that verdict: that it holds, that it does not as printed, that it is open."""
_NAMES = {HOLDS: "holds", FAILS: "does not hold as printed", OPEN: "is a guess"}


@dataclass(frozen=True, kw_only=True)
class Target:
    """What a link leads to. says: what may be said of it; shaken: whether the run found it other than expected.

    record: the claim, if it is one.
    """

    link: str
    says: str
    shaken: bool
    record: ClaimRecord | None = None


@dataclass(frozen=True, kw_only=True)
class Told:
    """A sentence in parts, each with its link or none; shaken: whether a claim it rests on has changed its verdict.

    numbers: those of the run in it. proofs: the certificates of the claims that it links.
    """

    parts: tuple[tuple[str, str], ...]
    shaken: bool
    numbers: tuple[float, ...] = ()
    proofs: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The sentence without its links."""
        return "".join(words for words, _ in self.parts)


@dataclass(frozen=True, kw_only=True)
class BriefView:
    """A brief as the report shows it; lines: what holds, what to correct, what remains a guess."""

    verdict: Told
    headline: Told
    card: Told
    lines: tuple[tuple[str, Told], ...]


def briefs(results: ResultsFile) -> dict[str, BriefView]:
    """The briefs of the papers that have one, by key; AuditError where one says what the results do not."""
    known = _targets(results)
    return {paper.key: _view(paper, paper.brief, known) for paper in results.papers if paper.brief is not None}


def _targets(results: ResultsFile) -> dict[str, Target]:
    """By id. A number that needs a correction does not hold as printed; one within a solver's accuracy is no error."""
    targets = {
        erratum.id: Target(
            link=anchor("erratum", erratum.id), says=OPEN if erratum.inference else FAILS, shaken=not erratum.holds
        )
        for erratum in results.errata
    }
    for claim in results.claims:
        corrected = claim.verdict is Verdict.COMPATIBLE and Policy.ERRATUM in claim.judgement.policies
        says = _SAYS[claim.verdict] + (FAILS if corrected else "")
        targets[claim.id] = Target(link=anchor("claim", claim.id), says=says, shaken=claim.unexpected, record=claim)
    return targets


def _view(paper: PaperRecord, brief: Brief, known: Mapping[str, Target]) -> BriefView:
    def told(sentence: str, sign: str = "") -> Told:
        return _told(sentence, sign, paper.key, known)

    card = [told(sentence) for sentence in sentences(brief.card)]
    return BriefView(
        verdict=told(brief.verdict, ANYTHING),
        headline=told(brief.headline, ANYTHING),
        card=Told(
            parts=tuple(part for text in card for part in (*text.parts, (" ", "")))[:-1],
            shaken=any(text.shaken for text in card),
            numbers=tuple(number for text in card for number in text.numbers),
        ),
        lines=(
            ("What holds", told(brief.holds, HOLDS)),
            ("What to correct", told(brief.correct, FAILS)),
            ("What remains a guess", told(brief.guess, OPEN)),
        ),
    )


_ENDS = re.compile(r"(?<!\bSec\.)(?<!\bFig\.)(?<!\beq\.)(?<!\bal\.)(?<=[.!?])\s+(?=[A-Z\[{])")


def sentences(text: str) -> list[str]:
    """The sentences of a text, of which each may be as long as `require_short` says; Sec. 3 ends none."""
    return _ENDS.split(text)


def _told(sentence: str, line: str, key: str, known: Mapping[str, Target]) -> Told:
    filled = {numeral[0]: _filled(numeral, key, known) for numeral in _NUMBER.finditer(sentence)}
    sentence = _NUMBER.sub(lambda numeral: filled[numeral[0]][0], sentence)
    parts: list[tuple[str, str]] = []
    proofs: list[str] = []
    end, shaken = 0, False
    for match in LINK.finditer(require_short(sentence)):
        words, sign, name = match.groups()
        target = _target(name, key, known)
        mark = sign or line
        if not mark or (mark not in (*target.says, ANYTHING) and not target.shaken):
            raise AuditError(
                f"the brief of {key} says that {name!r} {_NAMES.get(mark, 'is something, without a sign before it')}, "
                f"and the results do not: correct {sentence!r}"
            )
        shaken = shaken or target.shaken
        parts += [(sentence[end : match.start()], ""), (words, target.link)]
        proofs += target.record.evidence.certificates if target.record is not None else ()
        end = match.end()
    numbers = tuple(number for _, number in filled.values() if math.isfinite(number))
    return Told(parts=(*parts, (sentence[end:], "")), shaken=shaken, numbers=numbers, proofs=tuple(proofs))


def _target(name: str, key: str, known: Mapping[str, Target]) -> Target:
    target = known.get(f"{key}.{name}")
    if target is None:
        raise AuditError(f"the brief of {key} links {name!r}, which is no claim or erratum of it; correct the name")
    return target


def _filled(numeral: re.Match[str], key: str, known: Mapping[str, Target]) -> tuple[str, float]:
    """What a name in braces becomes, and the number in it."""
    name, how, divisor = numeral.groups()
    record = _target(name, key, known).record
    refused = AuditError(f"the brief of {key} tells a number as {numeral[0]}, which has no single one; link it instead")
    if record is None or isinstance(record.evidence.value, tuple):
        raise refused
    value, lower = record.evidence.value, record.evidence.lower
    if value is None:  # a run that found nothing has a report all the same, and says so
        return "(not computed)", math.nan
    if how is None:
        return numerals.short(value, DIGITS), float(value)
    if how == "not":
        printed, rounded = rounds_to(record.claim.printed, value)
        instead = numerals.exact(rounded)
        if rounded == printed:
            raise AuditError(f"the brief of {key} says that {record.claim.printed} is not {instead}; correct it")
        return f"{instead}, not {record.claim.printed}", float(instead)
    if how == "rounded":
        shown = numerals.exact(rounds_to(record.claim.printed, value)[1])
        return shown, float(shown)
    if not isinstance(lower, int | float):
        raise refused
    if how == "over":
        under = _target(divisor or "", key, known).record
        lower /= float(rounds_to(under.claim.printed, 0)[0]) if under is not None else math.nan
    shown = numerals.at_least(lower, LOWER_DIGITS)
    return shown, float(shown)
