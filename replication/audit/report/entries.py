"""A printed value and what was computed for it, number by number: digits below each other, interval, drawing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from markupsafe import Markup

from replication.audit.judge import numerals
from replication.audit.judge.agreement import Measured, Target, measure
from replication.audit.judge.printed import Printed
from replication.audit.model import Evidence

WIDTH, HEIGHT = 132, 18
MARGIN = 7
ROW_SPAN = 1.5
"""Units shown on either side at least, so that most numbers can be compared on one scale."""


Ends = tuple[float, float]
"""Of what agrees with the print; infinite on one side for a relation such as `<0.001`."""


def within(number: Measured, band: Ends) -> bool:
    """Whether the bracket of a number, or the number where there is none, lies in what agrees with its print."""
    return band[0] <= number.reach[0] and number.reach[1] <= band[1]


def strip(number: Measured, band: Ends, span: float = ROW_SPAN) -> Markup:
    """Draw a number on an axis of `span` units either side; what lies beyond it is an arrow at that end.

    Units are those of the last printed place, from the printed value; only numbers of ours are in it, so it is markup.
    """

    def place(units: float) -> float:
        return WIDTH / 2 + min(max(units, -span), span) / span * (WIDTH / 2 - MARGIN)

    low, high, left, right, dot = (place(units) for units in (*band, *number.reach, float(number.deviation)))
    inside, units, middle = within(number, band), float(number.deviation), HEIGHT / 2
    parts = [
        f'<rect class="band" x="{_short(low)}" y="2" width="{_short(high - low)}" height="{HEIGHT - 4}"/>',
        f'<path class="axis" d="M{MARGIN},{middle:g}H{WIDTH - MARGIN}M{WIDTH / 2:g},2V{HEIGHT - 2}"/>',
    ]
    if number.has_bracket:
        ends = f"M{_short(left)},{middle - 4:g}v8M{_short(left)},{middle:g}H{_short(right)}m0,-4v8"
        parts.append(f'<path class="bracket" d="{ends}"/>')
    kind = "in" if inside else "out"
    if abs(units) <= span:
        parts.append(f'<circle class="{kind}" cx="{_short(dot)}" cy="{middle:g}" r="3.2"/>')
    else:
        tip, base = (WIDTH - 1, WIDTH - MARGIN) if units > 0 else (1, MARGIN)
        parts.append(f'<path class="{kind}" d="M{tip},{middle:g}L{base},{middle - 4:g}V{middle + 4:g}z"/>')
    subject = "bracket" if number.has_bracket else "computed value"
    label = f"{subject} {'within' if inside else 'not within'} what the print allows"
    return Markup(
        f'<svg class="strip" role="img" aria-label="{label}" viewBox="0 0 {WIDTH} {HEIGHT}">{"".join(parts)}</svg>'
    )


def _short(number: float) -> str:
    return f"{number:.2f}".rstrip("0").rstrip(".")


IMAGINARY = "imaginary part"


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
        names = ("In digits" if self.literal else "Printed", "Computed", "Lower bound", "Upper bound")
        named = zip(names, (self.printed, self.full, self.lower, self.upper), strict=True)
        steps = [(name, digits, numerals.agreement(self.printed, digits)) for name, digits in named if digits]
        widest = max(numerals.places(digits) for _, digits, _ in steps)
        return tuple((name, widest - numerals.places(text), text[:same], text[same:]) for name, text, same in steps)


def side_by_side(target: Target, evidence: Evidence) -> tuple[EntryView, ...]:
    """The entries of a claim; raises AuditError if the computed numbers are not in the layout of the print."""
    measured = measure(target, evidence)
    bands = [_band(target.printed.relation, number) for number in measured]
    ends = [*(end for band in bands for end in band), *(e for n in measured for e in (float(n.deviation), *n.reach))]
    span = max([ROW_SPAN, *(1.1 * abs(end) for end in ends if math.isfinite(end))])
    entries = [_entry(target.printed, number, band, span) for number, band in zip(measured, bands, strict=True)]
    return _below_each_other(target.printed, entries)


def _below_each_other(printed: Printed, entries: Sequence[EntryView]) -> tuple[EntryView, ...]:
    """The entries with their pads; an imaginary part stands behind its real part and has none.

    The only entry of a print that is more than its digits gets the text of that; points then need not meet.
    """
    literal = printed.text.replace("-", numerals.MINUS)
    if len(entries) == 1 and literal != entries[0].printed:
        return (replace(entries[0], literal=literal),)
    texts = [(entry.printed, entry.head) for entry in entries if not entry.imaginary]
    widest = max(numerals.places(text) for pair in texts for text in pair)
    return tuple(
        entry
        if entry.imaginary
        else replace(entry, pads=(widest - numerals.places(entry.printed), widest - numerals.places(entry.head)))
        for entry in entries
    )


def _band(relation: str, number: Measured) -> Ends:
    if number.interval is not None:
        low, high = number.interval.ends
        return float(number.units(low)), float(number.units(high))
    if relation in "<≤":
        return -math.inf, math.nextafter(0.0, -1.0) if relation == "<" else 0.0
    return math.nextafter(0.0, 1.0) if relation == ">" else 0.0, math.inf


def _entry(printed: Printed, number: Measured, band: Ends, span: float) -> EntryView:
    entry, value = number.entry, float(number.value)
    low, high = (number.bracket.low, number.bracket.high) if number.has_bracket else (-math.inf, math.inf)
    # Whether several numbers stand in a line of the print.
    crowded = (len(printed.shape) == 2 and printed.shape[1] > 1) or any(len(cell) == 2 for cell in printed.cells)
    head, tail = numerals.at_print(value, entry.unit, numerals.CROWDED if crowded else numerals.BEYOND, low, high)
    text = f"{printed.relation}{entry.text}".replace("-", numerals.MINUS)
    sign = tuple("±" if entry.absolute else "" if shown[0] in "+−" else "+" for shown in (text, head))
    inside = within(number, band)
    return EntryView(
        label=number.label,
        printed=text,
        interval=None if number.interval is None else number.interval.ends,
        head=head,
        tail=tail,
        agreed=len(head) if inside and not printed.relation else numerals.agreement(text, head),
        full=numerals.full(value),
        lower="" if math.isinf(low) else numerals.full(float(low)),
        upper="" if math.isinf(high) else numerals.full(float(high)),
        deviation=float(number.deviation),
        inside=inside,
        strip=strip(number, band, span),
        value=Fraction(entry.value),
        shown=float(f"{head}{tail}".replace(numerals.MINUS, "-")) if tail else value,
        sign=(sign[0], sign[1]) if number.label.startswith(IMAGINARY) else ("", ""),
    )
