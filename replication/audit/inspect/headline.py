"""The summary of a report: one sentence of verdict, every number counted, and notes on what nobody would see."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from pathlib import Path

from replication.audit.inspect.coverage import faults
from replication.audit.judge.policies import once
from replication.audit.judge.printed import has_uncertainty
from replication.audit.judge.proofs import NUMERIC, flat
from replication.audit.judge.typed import numbers_in
from replication.audit.judge.uncertainty import BY_DIGITS
from replication.audit.model import NO_READING, Kind, Verdict
from replication.audit.parts import Paper
from replication.audit.store.records import ClaimRecord, ErratumRecord, ResultsFile
from replication.errors import listed


class Basis(StrEnum):
    """What a claim is judged by: the digits that are printed, a yes or no, or the probability of the printed draw."""

    DIGITS = "in printed digits"
    STATEMENT = "as statements"
    DRAW = "as random draws"


_WORDS = {
    Verdict.REPRODUCED: ("agrees", "agree", "with the print"),
    Verdict.REPRODUCED_AFTER_ERRATUM: ("agrees", "agree", "once a documented misprint is corrected"),
    Verdict.COMPATIBLE: ("is", "are", "possible: under an inference or as a random draw"),
    Verdict.CONSISTENT: ("holds", "hold", "as a qualitative or statistical statement"),
    Verdict.DIFFERS: ("differs", "differ", "from the print"),
    Verdict.REFUTED: ("is", "are", "refuted"),
    Verdict.UNDETERMINED: ("is", "are", "undetermined by the text"),
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
    stated = claim.claim
    return basis(claim) is Basis.DIGITS and stated.uncertainty not in BY_DIGITS and has_uncertainty(stated.printed)


def counts(claims: Iterable[ClaimRecord]) -> dict[Verdict, int]:
    """How many claims have each verdict, in the order of `Verdict`, repeats aside; zeros included."""
    found = Counter(claim.verdict for claim in once(claims))
    return {verdict: found[verdict] for verdict in Verdict}


GROUPS = {
    "hold": (Verdict.REPRODUCED, Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.CONSISTENT),
    "possible": (Verdict.COMPATIBLE,),
    "fail": (Verdict.DIFFERS, Verdict.REFUTED),
    "undetermined": (Verdict.UNDETERMINED,),
    "in error": (Verdict.ERROR,),
}
"""The words of every badge, card and heading, and which verdicts each counts."""
_ONE = {"hold": "holds", "fail": "fails"}


def plain(verdict: Verdict) -> str:
    """The verdict in the words of `GROUPS`, and whether it needs a correction."""
    word = next(word for word, verdicts in GROUPS.items() if verdict in verdicts)
    return _ONE.get(word, word) + " once corrected" * (verdict is Verdict.REPRODUCED_AFTER_ERRATUM)


@dataclass(frozen=True, kw_only=True)
class Tally:
    """How many claims stand how, by the words of `GROUPS`; timed: run times of another computer, told apart."""

    numbers: Mapping[str, int]
    timed: int

    @property
    def words(self) -> str:
        """The numbers that are not zero, run times last and apart; `0 hold` stays."""
        listed = ", ".join(
            f"{number} {_ONE.get(word, word) if number == 1 else word}"
            for word, number in self.numbers.items()
            if number or word == "hold"
        )
        timed = f"; {self.timed} run time{'s' * (self.timed != 1)} cannot be checked" if self.timed else ""
        return f"{listed}{timed}"


def tally(claims: Iterable[ClaimRecord]) -> Tally:
    """How the claims stand; repeats and remarks of ours aside."""
    counted = once(claims)
    found = counts(counted)
    timed = sum(claim.timed for claim in counted)
    numbers = {word: sum(found[verdict] for verdict in verdicts) for word, verdicts in GROUPS.items()}
    return Tally(numbers=numbers | {"undetermined": numbers["undetermined"] - timed}, timed=timed)


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
    """How many claims theorems decide, how many of these against the claim, how many they support; empty if none."""
    claims = tuple(claims)
    proved = sum(claim.judgement.proved for claim in claims)
    against = sum(claim.judgement.proved and claim.verdict in (Verdict.DIFFERS, Verdict.REFUTED) for claim in claims)
    supported = sum(bool(claim.judgement.supported) for claim in claims)
    if not proved and not supported:
        return ""
    sides = f", {against} of them against the claim" if against else ""
    more = f"; they support {supported} more in part" if supported else ""
    return f"Theorems decide {proved} of {len(claims)} claims{sides}{more}."


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
    timed = sum(claim.timed for claim in chosen) if verdict is Verdict.UNDETERMINED else 0
    if verdict not in _SPLIT:
        return f"{text} ({timed} run time{'s' * (timed != 1)} among them)" if timed else text
    found = Counter(map(basis, chosen))
    return f"{text} ({', '.join(f'{found[kind]} {kind}' for kind in Basis if found[kind])})"


SIGN = "−1"
FACTORS = {
    SIGN: -1.0,
    **{f"10^{power}": 10.0**power for power in (*range(-9, 0), *range(1, 10))},
    **{"2π": 2 * math.pi, "1/(2π)": 1 / (2 * math.pi), "180/π": 180 / math.pi, "π/180": math.pi / 180},
    **{f"{number:g}": number for number in (60.0, 3600.0, 4.184)},  # minutes, hours, calories
    **{f"1/{number:g}": 1 / number for number in (60.0, 3600.0, 4.184)},
}
"""By which a number is off whose sign was lost, or that is in another unit."""


NEAR = 0.01
"""How far the number of a second method may lie from the computed one, relatively."""


def notes(
    papers: Sequence[Paper], results: ResultsFile, unused: Sequence[str], figures: Path, folder: Path
) -> Iterator[str]:
    """Experiments that nothing uses, claims without a second method, figures that are left over,
    lists of what a text prints that do not fit it.

    unused: names of experiments whose results nobody read. figures: where the figures were drawn. folder: that of the
    papers.
    """
    if unused:
        yield f"no claim, erratum, figure or finding uses {listed(unused)}"
    if results.run.unlocked:
        yield f"not as locked: {listed(results.run.unlocked)}"
    bare = [claim for claim in results.claims if not (claim.claim.uses or claim.judgement.proved)]
    if numbers := [claim.id for claim in bare if claim.evidence.value is not None]:
        yield f"a number that rests on no experiment: {listed(numbers)}"
    if statements := [claim.id for claim in bare if claim.evidence.value is None and claim.evidence.holds is not None]:
        yield f"a statement that rests on no experiment: {listed(statements)}"
    loose = [f"{', '.join(one.untraced)} ({one.name})" for one in results.experiments if one.untraced]
    if loose:
        yield f"not traced, and so computed again by every run: {listed(loose)}"
    if unborne := [erratum.id for erratum in results.errata if not (erratum.holds or erratum.error)]:
        yield f"an erratum that its own proof does not bear out: {listed(unborne)}"
    pairs = [(claim, one) for paper in papers for claim in paper.claims for one in paper.experiments]
    if asked := [claim.id for claim, one in pairs if one.name in claim.uses and one.is_given(claim)]:
        yield f"the print is an input of what the number rests on, so look whether it only comes back: {listed(asked)}"
    unchecked = [
        claim.id
        for claim in results.claims
        if claim.verdict not in (Verdict.UNDETERMINED, Verdict.ERROR)
        and not (claim.evidence.cross_check or claim.judgement.proved)
    ]
    if unchecked:
        yield f"neither a check by a second method nor a proof: {listed(unchecked)}"
    for claim in results.claims:
        if said := contradiction(claim):
            yield f"{claim.id}: the check by a second method says {said}, which is not what was computed; look at both"
        if claim.verdict is Verdict.DIFFERS and (words := factor(claim)):
            cause = "a sign lost" if words == SIGN else "another unit, or a decimal comma"
            yield f"{claim.id}: the computed number is {words} times the print; {cause}?"
    for paper in papers:
        drawn = {figure.name for figure in paper.figures}
        files = sorted({path for path in figures.glob(f"{paper.key}-*") if path.stem not in drawn})
        if files:
            yield f"no figure is called {listed([path.name for path in files])}; remove what is left in {figures}"
        listed_there = (folder / paper.key / "coverage.toml").is_file()
        if wrong := faults(folder / paper.key, paper) if listed_there else []:
            count = f"{len(wrong)} fault{'s' if len(wrong) > 1 else ''}"
            more = f"see `replication coverage {paper.key}`; the first: {wrong[0]}"
            yield f"coverage.toml of {paper.key} has {count}, {more}"


def contradiction(claim: ClaimRecord) -> str:
    """The numbers of the second method, if some are of the size of what was computed and none is `NEAR` to it.

    A unit of the last printed place is near as well; others may count samples, or say how far the two are apart.
    """
    computed = [] if claim.evidence.value is None else [abs(number) for number in flat(claim.evidence.value) if number]
    unit = max((float(Fraction(high) - Fraction(low)) for low, high in claim.judgement.intervals), default=0.0)
    said = [float(number.replace(",", "")) for number in numbers_in(claim.evidence.cross_check)]
    alike = [one for one in said if any(0.1 < one / number < 10 for number in computed)]
    agree = any(abs(one - number) <= max(unit, NEAR * number) for one in alike for number in computed)
    return "" if agree else " and ".join(f"{one:g}" for one in alike)


def factor(claim: ClaimRecord) -> str:
    """The usual factor by which all numbers of a claim are off, as another unit or place of the point leaves it."""
    numbers = [] if claim.evidence.value is None else list(flat(claim.evidence.value))
    ends = [(float(Fraction(low)), float(Fraction(high))) for low, high in claim.judgement.intervals]
    if not numbers or len(numbers) != len(ends) or any(low * high <= 0 for low, high in ends):
        return ""  # zero is a multiple of each number
    if any(high - low > min(abs(low), abs(high)) for low, high in ends):
        return ""  # "1" is a tenth of most numbers from 5 to 15
    for words, times in FACTORS.items():
        if all(low <= number / times <= high for number, (low, high) in zip(numbers, ends, strict=True)):
            return words
    return ""
