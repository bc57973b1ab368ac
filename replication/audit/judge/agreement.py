"""Does a computed number agree with a printed one? Exact comparison of values and brackets with printed intervals.

An uncertainty that a text prints is no wall: what it says is told in standard deviations, by the rules of
docs/verdicts.md, of which `judge_uncertain` is the code.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from statistics import NormalDist

import msgspec

from replication.audit.judge import numerals
from replication.audit.judge.printed import Entry, Printed, by_digits, decimal_fraction, level_of, parse
from replication.audit.model import Evidence, Judgement, StatedClaim, Verdict
from replication.errors import AuditError
from replication.verify.predicate import Relation

SMALLEST_PROBABILITY = 0.01
"""A printed draw is compatible if a draw at least as extreme is at least this probable."""
BOUND, PROBABLE = "bound", "probable"
BY_DIGITS = {
    "sd": "What is printed beside it is a standard deviation of the data, and no uncertainty of it.",
    "none": "It was computed from the same data, and so has no uncertainty.",
}
_NORMAL = NormalDist()
_FORM = re.compile(r"([0-9]+(?:\.[0-9]+)?)\s*(sigma|σ|SD|SE|%)")
KINDS = ("1 sigma", "2 sigma", "68 %", "90 %", "95 %", "99 %", PROBABLE, BOUND, *BY_DIGITS)
"""Examples of what a claim may say; any number of sigma or per cent will do."""


def sigmas(uncertainty: str) -> Fraction | None:
    """How many standard deviations an uncertainty is; None for a bound. Raises AuditError for what it cannot be."""
    match = _FORM.fullmatch("50 %" if uncertainty == PROBABLE else uncertainty)
    number = Fraction(match[1]) if match else Fraction(0)
    if uncertainty == BOUND:
        return None
    if match is None or not 0 < number < (100 if match[2] == "%" else 1000):
        known = ", ".join(f'"{kind}"' for kind in KINDS)
        raise AuditError(
            f"uncertainty is {uncertainty!r}; write one of {known}, or another number of sigma or per cent"
        )
    return _rounded(_NORMAL.inv_cdf(0.5 + float(number) / 200)) if match[2] == "%" else number


def _rounded(number: float) -> Fraction:
    """Six decimals, which are the same on every machine."""
    return Fraction(f"{number:.6f}")


LIMIT = _rounded(_NORMAL.inv_cdf(1 - SMALLEST_PROBABILITY / 2))
"""Standard deviations beyond which a number is too improbable."""


def reach(entry: Entry, uncertainty: str) -> tuple[Fraction, Fraction]:
    """How far from the print, down and up, a number agrees with it."""
    assert entry.spread is not None
    times = sigmas(uncertainty) if uncertainty else None
    below, above = entry.spread
    return (below, above) if times is None else (below * LIMIT / times, above * LIMIT / times)


ACCURACY = Fraction(1, 2**50)
"""Relative accuracy of a float that a few dozen additions made; so near to an end of an interval it is that end.

A number half-way between two prints agrees with both: rules for such ties differ, and so do programs in the last bit.
"""


End = Fraction | float
"""An end of an interval; one that is not known is infinite."""


@dataclass(frozen=True)
class Interval:
    """A closed interval."""

    low: End = -math.inf
    high: End = math.inf

    @property
    def ends(self) -> tuple[Fraction, Fraction]:
        """Both ends of an interval that is bounded."""
        return Fraction(self.low), Fraction(self.high)

    def size(self) -> Interval:
        """The interval of absolute values."""
        if self.low > 0:
            return self
        return Interval(-self.high if self.high < 0 else Fraction(0), max(-self.low, self.high))

    def within(self, other: Interval) -> bool | None:
        """Whether a number that lies in this one lies in another one; None if it may or may not."""
        if self.low > other.high or self.high < other.low:
            return False
        return True if other.low <= self.low and self.high <= other.high else None


MIRRORED: Mapping[Relation, Relation] = {"more than": "less than", "at least": "at most"}


def compared(relation: Relation, ours: Interval, theirs: Interval) -> bool | None:
    """Whether a relation between two numbers follows from bounds of both; None if it is open."""
    if relation in MIRRORED:
        return compared(MIRRORED[relation], theirs, ours)
    if relation == "is not":
        return negated(compared("is", ours, theirs))
    if relation == "is":
        apart = ours.high < theirs.low or theirs.high < ours.low
        return False if apart else True if ours == theirs and ours.low == ours.high else None
    if relation == "less than":
        return True if ours.high < theirs.low else False if theirs.high <= ours.low else None
    return True if ours.high <= theirs.low else False if theirs.high < ours.low else None


def negated(holds: bool | None) -> bool | None:
    """The opposite of what is decided."""
    return None if holds is None else not holds


WIDE = "is too wide to decide"
LIES: Mapping[bool | None, tuple[str, str, str, Verdict]] = {
    False: ("lies outside", "violates", "{found} of {all} entries disagree: ", Verdict.DIFFERS),
    None: (f"{WIDE}, it straddles an end of", WIDE, "{found} of {all} entries undecided: ", Verdict.UNDETERMINED),
    True: ("lies inside", "satisfies", "all {all} entries agree: ", Verdict.REPRODUCED),
}
"""Where a computed number or its bracket lies against what a print stands for; the first found decides.

Each in words, against an interval and a relation, how many of several entries lie so, and the verdict.
"""


def _positive(tolerance: str) -> Fraction:
    with contextlib.suppress(AuditError):
        if (number := decimal_fraction(tolerance)) > 0:
            return number
    raise AuditError(f'the tolerance must be a positive number, such as "0.005", got {tolerance!r}')


@dataclass(frozen=True)
class Target:
    """A printed value, and for each of its numbers the interval that it stands for; none beside a relation."""

    printed: Printed
    intervals: tuple[Interval, ...]

    @classmethod
    def of(cls, claim: StatedClaim, several: bool = False) -> Target:
        """Each printed number ± half a unit of its last place, what its uncertainty allows, or the claim's tolerance.

        several: whether more than one number was computed, so that a print by digits is that of its uncertainty too.
        Raises AuditError if the print cannot be read or the tolerance is not a positive number.
        """
        tolerance = None if claim.tolerance is None else _positive(claim.tolerance)
        printed = parse(claim.printed)
        if claim.uncertainty in BY_DIGITS and printed.entries[0].beside:
            claim, printed = msgspec.structs.replace(claim, uncertainty=""), by_digits(printed, several)
        spread = any(entry.spread for entry in printed.entries)
        if tolerance is not None and spread:
            raise AuditError(f"the print {claim.printed!r} states its own uncertainty; leave the tolerance out")
        if claim.uncertainty and not spread:
            raise AuditError(f"the print {claim.printed!r} states no uncertainty; leave out {claim.uncertainty!r}")
        meaning = (claim.uncertainty or level_of(claim.printed)) if spread else ""
        ends = [(e, reach(e, meaning) if e.spread else (tolerance or e.unit / 2,) * 2) for e in printed.entries]
        intervals = (Interval(entry.value - below, entry.value + above) for entry, (below, above) in ends)
        return cls(printed, () if printed.relation else tuple(intervals))

    @classmethod
    def judged(cls, claim: StatedClaim, judgement: Judgement) -> Target:
        """The same of a claim that was judged, with its intervals; AuditError if these are not those of its numbers."""
        printed, intervals = parse(claim.printed), stored_intervals(claim, judgement)
        if claim.uncertainty in BY_DIGITS:
            printed = by_digits(printed, len(intervals) > 1)
        if len(intervals) != (0 if printed.relation else len(printed.entries)):
            raise AuditError(f"{claim.id} has {len(intervals)} intervals for the printed {claim.printed!r}")
        return cls(printed, intervals)

    @property
    def written(self) -> tuple[tuple[str, str], ...]:
        """The intervals as a judgement holds them."""
        return tuple((_fraction(low), _fraction(high)) for low, high in (interval.ends for interval in self.intervals))


@dataclass(frozen=True)
class Measured:
    """A computed real number with its bracket, as exact fractions, beside the printed entry; without a bracket the
    value stands for it. interval: what the entry stands for, None beside a relation."""

    entry: Entry
    label: str
    interval: Interval | None
    value: Fraction
    bracket: Interval
    has_bracket: bool

    @property
    def deviation(self) -> Fraction:
        """(computed − printed) in units of the last printed place."""
        return Fraction(self.units(self.value))

    def units(self, number: End) -> End:
        """How far a number lies from the print, in units of its last place."""
        return (number - self.entry.value) / self.entry.unit

    @property
    def reach(self) -> tuple[float, float]:
        """The bracket, or the number where there is none, in the same units."""
        return float(self.units(self.bracket.low)), float(self.units(self.bracket.high))

    def agrees(self, relation: str) -> bool | None:
        """Whether it lies in what its entry stands for, or in this relation to it; None if it may or may not."""
        if self.interval is not None:
            return self.bracket.within(self.interval)
        return compared(MARKS[relation], self.bracket, Interval(self.entry.value, self.entry.value))

    @property
    def prefix(self) -> str:
        """The label of its entry before it."""
        return f"{self.label}: " if self.label else ""

    @property
    def tied(self) -> bool:
        """Whether it stands at an end of what its print stands for, half-way to another print."""
        return self.interval is not None and self.value in self.interval.ends

    def settled(self, accuracy: Fraction) -> Measured:
        """The same with ends of the interval, or the limit of a relation, for floats that are no others."""
        ends = (self.entry.value,) if self.interval is None else self.interval.ends

        def near(number: End) -> End:
            reach = [(end, accuracy * abs(end)) for end in ends]
            matches = (end for end, by in reach if number == float(end) or end - by <= number <= end + by)
            printed = self.interval is not None and number == float(self.entry.value)
            return number if printed else next(matches, number)

        bracket = Interval(near(self.bracket.low), near(self.bracket.high))
        return replace(self, value=Fraction(near(self.value)), bracket=bracket)

    def describe(self, *ends: Fraction) -> str:
        """The number or its bracket in digits, enough of them to tell it from `ends`."""
        prefix = self.prefix
        if not self.has_bracket:
            return f"{prefix}computed {numerals.digits(self.value, *ends)}"
        return f"{prefix}bracket {numerals.enclosure(self.bracket.low, self.bracket.high, *ends)}"


def judge_value(target: Target, evidence: Evidence) -> Judgement:
    """Compare every entry with the interval that it stands for, ends included, or with the relation as it stands.

    Any entry outside: differs. All inside: reproduced. Else a bracket is too wide: undetermined. Errors as `measure`.
    """
    measured, printed = measure(target, evidence), target.printed
    lies = [number.agrees(printed.relation) for number in measured]
    decisive = next(answer for answer in LIES if answer in lies)
    indices = [index for index, answer in enumerate(lies) if answer is decisive]
    index = max(indices, key=lambda i: abs(measured[i].deviation))
    inside, related, counted, verdict = LIES[decisive]
    count = counted.format(found=len(indices), all=len(measured)) if len(measured) > 1 else ""
    worst = max(measured, key=lambda number: abs(number.deviation))
    exact = all(number.bracket.low == number.bracket.high == number.entry.value for number in measured)
    if printed.relation:
        reason = f"{worst.describe(worst.entry.value)} {related} the printed {printed.text}"
    else:
        reason = f"{count}{_against(measured[index], target.intervals[index].ends, inside)}"
    if exact and len(measured) > 1:
        reason = f"all {len(measured)} entries equal the printed ones"
    return Judgement(verdict=verdict, reason=_sentence(reason), deviation_ulp=numerals.nearest(worst.deviation))


def judge_uncertain(target: Target, evidence: Evidence, uncertainty: str) -> Judgement:
    """Compare a number that is printed with its uncertainty: by its digits, and else by what the uncertainty is.

    Unsaid, it is tried as a probable error, the widest that is usual.
    """
    (entry,) = target.printed.entries
    uncertainty = uncertainty or level_of(target.printed.text)

    def within(below: Fraction, above: Fraction) -> Judgement:
        interval = Interval(entry.value - below, entry.value + above)
        return judge_value(replace(target, intervals=(interval,)), evidence)

    if (digits := within(entry.unit / 2, entry.unit / 2)).verdict is Verdict.REPRODUCED:
        return digits
    judgement = judge_value(target, evidence)
    verdict, inside = judgement.verdict, judgement.verdict is Verdict.REPRODUCED
    if uncertainty == BOUND:
        words = "The text gives its uncertainty as a bound."
    elif uncertainty:
        assert entry.spread is not None
        verdict = Verdict.COMPATIBLE if inside else verdict
        times, off = sigmas(uncertainty) or Fraction(1), measure(target, evidence)[0].value - entry.value
        z = numerals.short(float(abs(off) * times / entry.spread[off > 0]), 3)
        of_print = "" if times == 1 else f", of which the printed {uncertainty} is {numerals.short(float(times), 3)}"
        words = f"It is off by z = {z} standard deviations{of_print}; {numerals.short(float(LIMIT), 3)} are allowed."
    elif within(*reach(entry, PROBABLE)).verdict is Verdict.DIFFERS:
        words = "What its uncertainty is goes unsaid; it differs even by a probable error, the widest that is usual."
    else:
        verdict = Verdict.COMPATIBLE if inside else Verdict.UNDETERMINED
        words = "What its uncertainty is goes unsaid; it agrees with each that is usual."
        words += ' If the text prints a standard deviation of the data, say uncertainty="sd".'
        if not inside:
            words = f'By a probable error it would agree, by a bound not; say uncertainty="{KINDS[0]}", or what it is.'
    return judgement.further(words, verdict=verdict)


MARKS: Mapping[str, Relation] = {
    "<=": "at most",
    ">=": "at least",
    "<": "less than",
    "≤": "at most",
    ">": "more than",
    "≥": "at least",
}
"""The relations before a printed bound."""


def stored_intervals(claim: StatedClaim, judgement: Judgement) -> tuple[Interval, ...]:
    """The intervals of a judgement as numbers; raises AuditError if they are none."""
    try:
        return tuple(Interval(Fraction(low), Fraction(high)) for low, high in judgement.intervals)
    except (ValueError, ZeroDivisionError):
        raise AuditError(f"the intervals of {claim.id} are not pairs of numbers: {judgement.intervals!r}") from None


def measure(target: Target, evidence: Evidence) -> tuple[Measured, ...]:
    """The computed numbers in the order of the printed ones; in size where only that is printed.

    Raises AuditError if there is no value, or its layout or bracket does not fit.
    """
    printed = target.printed
    if evidence.value is None:
        raise AuditError(f"the evidence holds no value to compare with the printed {printed.text!r}")
    values = [Fraction(value) for value in printed.align("computed value", evidence.value)]
    lows, highs = (
        [unknown] * len(values) if side is None else [Fraction(end) for end in printed.align(name, side)]
        for name, side, unknown in (
            ("lower bound", evidence.lower, -math.inf),
            ("upper bound", evidence.upper, math.inf),
        )
    )
    has_bracket = evidence.lower is not None or evidence.upper is not None
    intervals = target.intervals if not printed.relation else (None,) * len(values)
    measured = []
    columns = zip(printed.entries, printed.labels, intervals, values, lows, highs, strict=True)
    for entry, label, interval, value, low, high in columns:
        bracket = Interval(low, high) if has_bracket else Interval(value, value)
        number = Measured(entry, label, interval, value, bracket, has_bracket)
        if not low <= value <= high:
            text = number.describe(value)
            raise AuditError(f"{text} does not hold its own value {float(value)!r}; one of the two is wrong")
        if entry.absolute:
            number = replace(number, value=abs(value), bracket=bracket.size())
        # What is printed as less than 0.3 is so to the last bit, and 0.3 itself is not.
        measured.append(number.settled(Fraction(0) if printed.relation in ("<", ">") else ACCURACY))
    return tuple(measured)


def _fraction(number: Fraction) -> str:
    return f"{number.numerator}/{number.denominator}"


def _against(number: Measured, ends: tuple[Fraction, Fraction], words: str) -> str:
    if number.bracket.low == number.bracket.high == number.entry.value:
        return f"{number.prefix}{number.entry.text}, as printed"
    whole = number.bracket.low == number.bracket.high and number.value.denominator == 1
    if whole and number.entry.value.denominator == 1 and not ends[0] <= number.value <= ends[1]:
        return f"{number.prefix}{numerals.exact(number.value)}, not {number.entry.text}"
    half = Fraction(1, 2)
    negligible = abs(number.deviation) < Fraction(str(numerals.NEGLIGIBLE))
    deviation = "0" if negligible else numerals.digits(number.deviation, -half, half, least=3)
    interval = f"[{', '.join(numerals.end(end, number.value) for end in ends)}]"
    return (
        f"{number.describe(*ends)} {words} {interval}, the range of the printed {number.entry.text}"
        f" (deviation in units of its last place: {deviation})"
    )


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:] + "."


def stands_there(numbers: Sequence[float], printed: str) -> bool:
    """Whether these are the printed numbers, to the last bit; never raises."""
    with contextlib.suppress(AuditError):
        return list(numbers) == [float(entry.value) for entry in parse(printed).entries]
    return False


def rounds_to(printed: str, value: float | Fraction) -> tuple[Fraction, Fraction]:
    """The first number of a print, and what `value` is when rounded to its last printed place."""
    entry = parse(printed).entries[0]
    return entry.value, round(Fraction(value) / entry.unit) * entry.unit
