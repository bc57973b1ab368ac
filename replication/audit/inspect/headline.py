"""The summary of a report: one sentence of verdict, every number counted, and notes on what nobody would see.

And its negative controls: what is wrong on purpose must be found, when stored verdicts are derived from altered input.
"""

import contextlib
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from replication.audit.inspect.coverage import faults
from replication.audit.judge.agreement import BY_DIGITS, Target, measure
from replication.audit.judge.numerals import numbers_in
from replication.audit.judge.policies import once
from replication.audit.judge.printed import Printed, flat, has_uncertainty
from replication.audit.judge.verdict import rejudge
from replication.audit.model import AGREES, CORRECTED, DISAGREES, NO_READING, NUMERIC, Kind, Policy, Verdict
from replication.audit.parts import Paper
from replication.audit.store.records import ClaimRecord, ErratumRecord, ResultsFile
from replication.errors import AuditError, listed
from replication.scaffold import plain_templates


class Basis(StrEnum):
    """What a claim is judged by: the digits that are printed, a yes or no, or the probability of the printed draw."""

    DIGITS = "in printed digits"
    STATEMENT = "as statements"
    DRAW = "as random draws"


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
    numbers = Counter(claim.verdict for claim in once(claims))
    return {verdict: numbers[verdict] for verdict in Verdict}


GROUPS = {
    "hold": (Verdict.REPRODUCED, Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.CONSISTENT),
    "possible": (Verdict.COMPATIBLE,),
    "fail": DISAGREES,
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
    return grouped(counts(counted), sum(claim.timed for claim in counted))


def grouped(found: Mapping[Verdict, int], timed: int = 0) -> Tally:
    """The tally of what has each verdict; timed: how many of the undetermined are run times."""
    numbers = {word: sum(found[verdict] for verdict in verdicts) for word, verdicts in GROUPS.items()}
    return Tally(numbers=numbers | {"undetermined": numbers["undetermined"] - timed}, timed=timed)


@dataclass(frozen=True, kw_only=True)
class Headline:
    """What leads the report.

    total: claims, without those that repeat a fact and remarks of ours. unexpected: claims whose verdict is not the
    pinned one.
    counted: numbers in words.
    """

    sentence: str
    tally: Tally
    total: int
    repeated: int
    counts: Mapping[Verdict, int]
    proved: int
    caveats: Mapping[str, int]
    unexpected: tuple[ClaimRecord, ...]
    counted: tuple[int, ...]


def headline(results: ResultsFile) -> Headline:
    """Count the claims of `results`, and say it."""
    claims = once(results.claims)
    unexpected = tuple(claim for claim in results.claims if claim.unexpected)
    by_basis = Counter((claim.verdict, basis(claim)) for claim in claims)
    return Headline(
        sentence=sentence(results.claims),
        tally=tally(claims),
        total=len(claims),
        repeated=sum(bool(claim.claim.repeats) for claim in results.claims),
        counts=counts(claims),
        proved=sum(claim.judgement.proved for claim in claims),
        caveats=caveats(claims, results.errata),
        unexpected=unexpected,
        counted=(len(claims), len(unexpected), *by_basis.values()),
    )


_SENTENCES: Any = plain_templates(Path(__file__).parent).get_template("sentence.j2").module


def sentence(claims: Sequence[ClaimRecord]) -> str:
    """The verdict on all claims in words, computed from them; a number that a text repeats counts once."""
    counted, groups = once(claims), []
    for verdict, number in counts(counted).items():
        group = [claim for claim in counted if claim.verdict is verdict]
        timed = sum(claim.timed for claim in group) if verdict is Verdict.UNDETERMINED else 0
        kinds = Counter(map(basis, group))
        groups += [(verdict, number, timed, [(kind, kinds[kind]) for kind in Basis if kinds[kind]])] * bool(number)
    text = _SENTENCES.sentence(len(counted), groups, sum(claim.unexpected for claim in claims))
    return f"{text} {theorems(counted)}".strip()


def theorems(claims: Iterable[ClaimRecord]) -> str:
    """How many claims theorems decide, how many of these against the claim, how many they support; empty if none."""
    claims = tuple(claims)
    proved = [claim for claim in claims if claim.judgement.proved]
    against = sum(claim.verdict in DISAGREES for claim in proved)
    supported = sum(bool(claim.judgement.supported) for claim in claims)
    return str(_SENTENCES.theorems(len(claims), len(proved), against, supported))


def caveats(claims: Sequence[ClaimRecord], errata: Iterable[ErratumRecord]) -> dict[str, int]:
    """What the counts of verdicts do not say by themselves, in words: of how many claims it is true."""
    inferred = {erratum.id for erratum in errata if erratum.inference}
    cases = {
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
    return {words: sum(true) for words, true in cases.items()}


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
    """What a run should look at: what nothing uses, is left over, has no second method, or does not fit its text.

    unused: experiments whose results nobody read. figures: where they were drawn. folder: that of the papers.
    """
    bare = [claim for claim in results.claims if not (claim.claim.uses or claim.judgement.proved)]
    stated = [claim for claim in bare if claim.evidence.value is None and claim.evidence.holds is not None]
    experiments = {experiment.name: experiment for paper in papers for experiment in paper.experiments}
    judged = [claim for claim in results.claims if claim.verdict not in (Verdict.UNDETERMINED, Verdict.ERROR)]
    untraced = [record for record in results.experiments if record.untraced]
    loose = [(f"{', '.join(record.untraced)} ({record.name})", bool(record.line)) for record in untraced]
    lists = {
        "no claim, erratum, figure or finding uses ": unused,
        "not as locked: ": results.run.unlocked,
        "a number that rests on no experiment: ": [claim.id for claim in bare if claim.evidence.value is not None],
        "a statement that rests on no experiment: ": [claim.id for claim in stated],
        "not traced, and so computed again by every run: ": [name for name, of_command in loose if not of_command],
        "not traced: ": [name for name, of_command in loose if of_command],
        "an erratum that its own proof does not bear out: ": [
            erratum.id for erratum in results.errata if not (erratum.holds or erratum.error)
        ],
        "the print is an input of what the number rests on, so look whether it only comes back: ": [
            claim.id for claim in results.claims for name in claim.claim.uses if experiments[name].is_given(claim.claim)
        ],
        "neither a check by a second method nor a proof: ": [
            claim.id for claim in judged if not (claim.evidence.cross_check or claim.judgement.proved)
        ],
    }
    yield from (f"{words}{listed(names)}" for words, names in lists.items() if names)
    for claim in results.claims:
        if text := contradiction(claim):
            yield f"{claim.id}: the check by a second method says {text}, which is not what was computed; look at both"
        if claim.verdict is Verdict.DIFFERS and (words := factor(claim)):
            cause = "a sign lost" if words == SIGN else "another unit, or a decimal comma"
            yield f"{claim.id}: the computed number is {words} times the print; {cause}?"
    for paper in papers:
        drawn = {figure.name for figure in paper.figures}
        files = sorted({path for path in figures.glob(f"{paper.key}-*") if path.stem not in drawn})
        if files:
            yield f"no figure is called {listed([path.name for path in files])}; remove what is left in {figures}"
        if wrong := faults(folder / paper.key, paper):
            count = f"{len(wrong)} fault{'s' if len(wrong) > 1 else ''}"
            more = f"see `replication coverage {paper.key}`; the first: {wrong[0]}"
            yield f"coverage.toml of {paper.key} has {count}, {more}"


def contradiction(claim: ClaimRecord) -> str:
    """The numbers of the second method, if some are of the size of what was computed and none is `NEAR` to it."""
    computed = [] if claim.evidence.value is None else [abs(number) for number in flat(claim.evidence.value) if number]
    unit = max((float(Fraction(high) - Fraction(low)) for low, high in claim.judgement.intervals), default=0.0)
    numbers = [float(number.replace(",", "")) for number in numbers_in(claim.evidence.cross_check)]
    alike = [value for value in numbers if any(0.1 < value / number < 10 for number in computed)]
    agree = any(abs(value - number) <= max(unit, NEAR * number) for value in alike for number in computed)
    return "" if agree else " and ".join(f"{value:g}" for value in alike)


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


EXPECTED = {
    "a printed number moved by a unit of its last place": "no agreement",
    "a statement that holds turned into one that does not": "no agreement",
    "the proof of an erratum taken away": "no agreement",
    "the evidence of a claim taken away": "an error",
    "a print that differs replaced by what was computed": "agreement",
}
"""What each kind of alteration must give."""
_MOVED, _DENIED, _UNPROVED, _EMPTIED, _MENDED = EXPECTED
Errata = Mapping[str, ErratumRecord]


@dataclass(frozen=True, kw_only=True)
class Control:
    """One kind of alteration: what was altered, how often it was tried, and the claims where it went unnoticed."""

    altered: str
    expected: str
    tried: int
    caught: int
    missed: tuple[ClaimRecord, ...]


def controls(results: ResultsFile, targets: Mapping[str, Target]) -> tuple[Control, ...]:
    """Every kind of alteration that `results` has a claim for, tried on each such claim; targets: by claim."""
    errata = {erratum.id: erratum for erratum in results.errata}
    tried: dict[str, list[ClaimRecord | None]] = {altered: [] for altered in EXPECTED}
    for claim in results.claims:
        target, readings = targets.get(claim.id), results.readings.get(claim.paper, ())
        for altered, record, known in _alterations(claim, errata, target):
            # A print that was left alone is not read again.
            judged = rejudge(record, known, target if record.claim is claim.claim else None, readings=readings)
            agrees = judged.verdict in AGREES and Policy.SOLVER not in judged.policies
            tried[altered].append(None if agrees is (EXPECTED[altered] == "agreement") else claim)
    return tuple(
        Control(
            altered=altered,
            expected=EXPECTED[altered],
            tried=len(outcomes),
            caught=outcomes.count(None),
            missed=tuple({claim.id: claim for claim in outcomes if claim is not None}.values()),
        )
        for altered, outcomes in tried.items()
        if outcomes
    )


def _alterations(
    record: ClaimRecord, errata: Errata, target: Target | None
) -> Iterator[tuple[str, ClaimRecord, Errata]]:
    """What can be altered of a claim: the kind, the record, and the errata to judge it with."""
    claim, evidence, erratum = record.claim, record.evidence, record.claim.erratum
    if record.verdict in AGREES:
        if target is not None and basis(record) is Basis.DIGITS and not _wide(record, target):
            if claim.meant and record.verdict in CORRECTED:
                # What is meant was compared; the print was found wrong and would be so with another digit.
                texts = moved(Target.of(replace(claim, printed=claim.meant)).printed)
                claims = [replace(claim, meant=text) for text in texts]
            else:
                claims = [replace(claim, printed=text, uncertainty="") for text in moved(target.printed)]
            yield from ((_MOVED, replace(record, claim=other), errata) for other in claims)
        if evidence.holds is not None and evidence.margin is not None:
            against = tuple(replace(outcome, holds=False, margin=None) for outcome in evidence.outcomes)
            denied = replace(evidence, holds=not evidence.holds, margin=-abs(evidence.margin) - 1, outcomes=against)
            yield _DENIED, replace(record, evidence=denied), errata
        if record.verdict in CORRECTED and erratum is not None:
            yield _UNPROVED, record, {**errata, erratum: replace(errata[erratum], holds=False)}
        nothing = dict.fromkeys(("value", "lower", "upper", "holds", "margin", "probability", "over_inputs"))
        yield _EMPTIED, replace(record, evidence=replace(evidence, **nothing, outcomes=())), errata
    single = claim.kind is Kind.VALUE and isinstance(evidence.value, int | float) and not evidence.outcomes
    if record.verdict is Verdict.DIFFERS and single and target is not None:
        (entry,) = target.printed.entries
        places = max(0, -Decimal(str(float(entry.unit))).adjusted())
        yield _MENDED, replace(record, claim=replace(claim, printed=f"{evidence.value:.{places}f}")), errata


def _wide(record: ClaimRecord, target: Target) -> bool:
    """Whether a claim agrees by more than the rounding of its print.

    So under one reading of several, over rounded inputs, within a printed uncertainty or relation, within what a solver
    leaves open; and half-way between two prints, where it agrees with both.
    """
    evidence, printed = record.evidence, target.printed
    if evidence.outcomes or evidence.over_inputs or printed.relation or any(entry.spread for entry in printed.entries):
        return True
    with contextlib.suppress(AuditError):  # of a record that does not fit, the verdict says so
        return Policy.SOLVER in record.judgement.policies or any(n.tied for n in measure(target, evidence))
    return False


def moved(printed: Printed) -> Iterator[str]:
    """A print with one of its numbers moved by one unit of its last place, up and down, for each number in turn.

    A number that would change its sign is moved up only: its printed form has another length then.
    """
    text = printed.plain
    begin = 0
    for entry in printed.entries:
        digits = entry.text.lstrip("+-")
        begin = text.index(digits, begin)
        end = begin + len(digits)
        unit = Decimal(entry.unit.numerator) / entry.unit.denominator
        for number in (Decimal(digits) + unit, Decimal(digits) - unit):
            if number >= 0:
                yield text[:begin] + format(number, "f") + text[end:]
        begin = end
