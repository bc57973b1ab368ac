"""A printed value and what was computed for it, number by number: digits below each other, interval, drawing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from markupsafe import Markup

from replication.audit.judge import numerals
from replication.audit.judge.agreement import Measured, Target, measure
from replication.audit.judge.printed import Printed
from replication.audit.model import Evidence

# A computed number and its bracket, drawn to scale against the interval that rounds to the printed value.
#
# All lengths are in units of the last printed place, measured from the printed value. Drawings hold numbers of ours
# only, so they are markup without escapes; colours come from the style sheet of the report by class.


WIDTH, HEIGHT = 132, 18
MARGIN = 7
ROW_SPAN = 1.5
"""Units shown on either side in a row of the claims table: one scale for all rows, so that they can be compared."""


@dataclass(frozen=True)
class Mark:
    """One computed number: its distance from the printed value and that of the ends of its bracket, if it has one."""

    value: float
    lower: float | None = None
    upper: float | None = None


@dataclass(frozen=True)
class Band:
    """The interval that agrees with the print; infinite on one side for a relation such as `<0.001`."""

    low: float
    high: float

    def holds(self, mark: Mark) -> bool:
        """Whether the bracket, or the value where there is none, lies in the interval."""
        low = mark.value if mark.lower is None else mark.lower
        high = mark.value if mark.upper is None else mark.upper
        return self.low <= low and high <= self.high


def span_of(marks: Sequence[Mark], band: Band) -> float:
    """Units on either side that show all of `marks` and the finite ends of `band`, at least `ROW_SPAN`."""
    ends = [band.low, band.high, *(mark.value for mark in marks)]
    ends += [end for mark in marks for end in (mark.lower, mark.upper) if end is not None]
    return max([ROW_SPAN, *(1.1 * abs(end) for end in ends if math.isfinite(end))])


def strip(marks: Sequence[Mark], band: Band, span: float = ROW_SPAN) -> Markup:
    """Draw `marks` on one axis of `span` units either side; what lies beyond it is an arrow at that end."""
    parts = [
        f'<rect class="band" x="{_x(band.low, span)}" y="2" '
        f'width="{_short(_clip(band.high, span) - _clip(band.low, span))}" height="{HEIGHT - 4}"/>',
        f'<path class="axis" d="M{MARGIN},{HEIGHT / 2:g}H{WIDTH - MARGIN}M{WIDTH / 2:g},2V{HEIGHT - 2}"/>',
        *(_bracket(mark, span) for mark in marks if mark.lower is not None or mark.upper is not None),
        *(_point(mark, band, span) for mark in marks),
    ]
    label = _label(marks, band)
    return Markup(
        f'<svg class="strip" role="img" aria-label="{label}" viewBox="0 0 {WIDTH} {HEIGHT}">{"".join(parts)}</svg>'
    )


def _bracket(mark: Mark, span: float) -> str:
    low = _x(mark.value if mark.lower is None else mark.lower, span)
    high = _x(mark.value if mark.upper is None else mark.upper, span)
    return f'<path class="bracket" d="M{low},{HEIGHT / 2 - 4:g}v8M{low},{HEIGHT / 2:g}H{high}m0,-4v8"/>'


def _point(mark: Mark, band: Band, span: float) -> str:
    kind = "in" if band.holds(mark) else "out"
    middle = HEIGHT / 2
    if abs(mark.value) <= span:
        return f'<circle class="{kind}" cx="{_x(mark.value, span)}" cy="{middle:g}" r="3.2"/>'
    tip, base = (WIDTH - 1, WIDTH - MARGIN) if mark.value > 0 else (1, MARGIN)
    return f'<path class="{kind}" d="M{tip},{middle:g}L{base},{middle - 4:g}V{middle + 4:g}z"/>'


def _label(marks: Sequence[Mark], band: Band) -> str:
    outside = sum(not band.holds(mark) for mark in marks)
    subject = "bracket" if any(mark.lower is not None for mark in marks) else "computed value"
    if len(marks) == 1:
        return f"{subject} {'not within' if outside else 'within'} what the print allows"
    return f"{len(marks) - outside} of {len(marks)} entries within what the print allows"


def _clip(units: float, span: float) -> float:
    clipped = min(max(units, -span), span)
    return WIDTH / 2 + clipped / span * (WIDTH / 2 - MARGIN)


def _x(units: float, span: float) -> str:
    return _short(_clip(units, span))


def _short(number: float) -> str:
    return f"{number:.2f}".rstrip("0").rstrip(".")


IMAGINARY = "imaginary part"
_LADDER = ("Computed", "Lower bound", "Upper bound")


@dataclass(frozen=True, kw_only=True)
class EntryView:
    """One printed number beside what was computed for it.

    value, interval: the printed number, and the ends of what it stands for, None beside a relation. head, tail:
    computed digits up to the last printed place and beyond it, which are the number `shown`. agreed: how many
    characters of the head agree with the print, all of them if the number lies in the interval; none beside a relation.
    deviation: in units of the last printed place. sign: what stands between a real part and this imaginary one, in
    print and as computed, if their own digits have no sign; empty for all other entries. pads: blank columns before
    print and head that put all decimal points of the claim below each other. literal: a single print as it stands in
    the text, where that is more or other than the digits in `printed`.
    """

    label: str
    printed: str
    interval: tuple[Fraction, Fraction] | None
    head: str
    tail: str
    agreed: int
    full: str
    lower: str
    upper: str
    deviation: float
    inside: bool
    strip: Markup
    sign: tuple[str, str] = ("", "")
    pads: tuple[int, int] = (0, 0)
    literal: str = ""
    value: Fraction | None = None
    shown: float = 0.0

    @property
    def imaginary(self) -> bool:
        """Whether this is the imaginary part of a complex number, which stands behind its real part."""
        return self.label.startswith(IMAGINARY)

    @property
    def digits(self) -> tuple[tuple[str, str], ...]:
        """The computed digits in parts, each with what it is: `agreed`, `off` or just `head`, and the `tail`.

        A number that begins like the print and does not round to it is off with its first digit beyond the print.
        """
        rest, tail = self.head[self.agreed :], self.tail
        if not self.inside and not rest:
            digit = next((i for i, character in enumerate(tail) if character.isdigit()), -1) + 1
            rest, tail = tail[:digit], tail[digit:]
        return ("agreed", self.head[: self.agreed]), ("head" if self.inside else "off", rest), ("tail", tail)

    @property
    def ladder(self) -> tuple[tuple[str, int, str, str], ...]:
        """What stands below each other in the evidence: name, blank columns, digits as in the print, the other ones."""
        names = ("In digits" if self.literal else "Printed", *_LADDER)
        named = zip(names, (self.printed, self.full, self.lower, self.upper), strict=True)
        steps = [(name, digits, numerals.agreement(self.printed, digits)) for name, digits in named if digits]
        widest = max(numerals.places(digits) for _, digits, _ in steps)
        return tuple((name, widest - numerals.places(text), text[:same], text[same:]) for name, text, same in steps)


def side_by_side(target: Target, evidence: Evidence) -> tuple[tuple[EntryView, ...], Markup]:
    """Entries and drawing of a claim; raises AuditError if the computed numbers are not in the layout of the print."""
    measured = measure(target, evidence)
    marks = [_mark(number) for number in measured]
    bands = [_band(target.printed.relation, number) for number in measured]
    span = max(span_of([mark], band) for mark, band in zip(marks, bands, strict=True))
    numbers = zip(measured, marks, bands, strict=True)
    entries = [_entry(target.printed, number, mark, band, span) for number, mark, band in numbers]
    # Entries of one claim may differ in their band (unequal digits); one row shows the narrowest.
    narrowest = Band(max(band.low for band in bands), min(band.high for band in bands))
    return _as_they_stand(target.printed, _below_each_other(entries)), strip(marks, narrowest)


def _as_they_stand(printed: Printed, entries: tuple[EntryView, ...]) -> tuple[EntryView, ...]:
    """The only entry of a print with its text, if that is not just its digits; points then need not meet."""
    text = printed.text.replace("-", numerals.MINUS)
    if len(entries) != 1 or text == entries[0].printed:
        return entries
    return (replace(entries[0], literal=text, pads=(0, 0)),)


def _below_each_other(entries: Sequence[EntryView]) -> tuple[EntryView, ...]:
    """The entries with their pads; an imaginary part stands behind its real part and has none."""
    texts = [(entry.printed, entry.head) for entry in entries if not entry.imaginary]
    widest = max(numerals.places(text) for pair in texts for text in pair)
    return tuple(
        entry
        if entry.imaginary
        else replace(entry, pads=(widest - numerals.places(entry.printed), widest - numerals.places(entry.head)))
        for entry in entries
    )


def _mark(number: Measured) -> Mark:
    """Distances from the print in units of its last place; an end that is not known is far away."""
    if not number.has_bracket:
        return Mark(float(number.deviation))
    low, high = number.bracket.low, number.bracket.high
    return Mark(
        float(number.deviation),
        -math.inf if low is None else float(number.units(low)),
        math.inf if high is None else float(number.units(high)),
    )


def _band(relation: str, number: Measured) -> Band:
    if number.interval is not None:
        low, high = number.interval.ends
        return Band(float(number.units(low)), float(number.units(high)))
    if relation in "<≤":
        return Band(-math.inf, math.nextafter(0.0, -1.0) if relation == "<" else 0.0)
    return Band(math.nextafter(0.0, 1.0) if relation == ">" else 0.0, math.inf)


def _entry(printed: Printed, number: Measured, mark: Mark, band: Band, span: float) -> EntryView:
    entry, value = number.entry, float(number.value)
    low, high = (number.bracket.low, number.bracket.high) if number.has_bracket else (None, None)
    beyond = numerals.CROWDED if _crowded(printed) else numerals.BEYOND
    head, tail = numerals.at_print(value, entry.unit, beyond, low, high)
    text = f"{printed.relation}{entry.text}".replace("-", numerals.MINUS)
    sign = tuple("±" if entry.absolute else "" if shown[0] in "+−" else "+" for shown in (text, head))
    inside = band.holds(mark)
    return EntryView(
        label=number.label,
        printed=text,
        interval=None if number.interval is None else number.interval.ends,
        head=head,
        tail=tail,
        agreed=len(head) if inside and not printed.relation else numerals.agreement(text, head),
        full=numerals.full(value),
        lower="" if low is None else numerals.full(float(low)),
        upper="" if high is None else numerals.full(float(high)),
        deviation=mark.value,
        inside=inside,
        strip=strip([mark], band, span),
        value=Fraction(entry.value),
        shown=float(f"{head}{tail}".replace(numerals.MINUS, "-")) if tail else value,
        sign=(sign[0], sign[1]) if number.label.startswith(IMAGINARY) else ("", ""),
    )


def _crowded(printed: Printed) -> bool:
    """Whether several numbers stand in a line of the print."""
    return (len(printed.shape) == 2 and printed.shape[1] > 1) or any(len(cell) == 2 for cell in printed.cells)
