"""A printed value and what was computed for it, number by number: digits below each other, interval, drawing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from markupsafe import Markup

from replication.audit.judge import numerals
from replication.audit.judge.printed import Entry, Printed, decimal_fraction, parse
from replication.audit.report import number_line as drawing
from replication.audit.store.records import ClaimRecord

IMAGINARY = "imaginary part"
_LADDER = ("Printed", "Computed", "Lower bound", "Upper bound")


@dataclass(frozen=True, kw_only=True)
class EntryView:
    """One printed number beside what was computed for it.

    interval: the ends of what agrees with the print, None beside a relation. head, tail: computed digits up to the last
    printed place and beyond it. agreed: how many characters of the head agree with the print, all of them if the number
    lies in the interval; none beside a relation. deviation: in units of the last printed place. sign: what stands
    between a real part and this imaginary one, in print and as computed, if their own digits have no sign; empty for
    all other entries. pads: blank columns before print and head that put all decimal points of the claim below each
    other.
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
        named = zip(_LADDER, (self.printed, self.full, self.lower, self.upper), strict=True)
        steps = [(name, digits, numerals.agreement(self.printed, digits)) for name, digits in named if digits]
        widest = max(numerals.places(digits) for _, digits, _ in steps)
        return tuple((name, widest - numerals.places(text), text[:same], text[same:]) for name, text, same in steps)


def side_by_side(record: ClaimRecord) -> tuple[tuple[EntryView, ...], Markup]:
    """Entries and drawing of a claim; both empty where there are not both a print and a computed number."""
    if not record.printed or record.computed is None:
        return (), Markup()
    printed = parse(record.printed)
    measured = [_Measured.of(*numbers) for numbers in _aligned(printed, record)]
    bands = [_band(printed.relation, entry, _half_width(entry, record.tolerance)) for entry in printed.entries]
    span = max(drawing.span_of([number.mark], band) for number, band in zip(measured, bands, strict=True))
    entries = [_entry(record, printed, index, number, bands[index], span) for index, number in enumerate(measured)]
    # Entries of one claim may differ in their band (unequal digits); one row shows the narrowest.
    narrowest = drawing.Band(max(band.low for band in bands), min(band.high for band in bands))
    return _below_each_other(entries), drawing.strip([number.mark for number in measured], narrowest)


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


@dataclass(frozen=True)
class _Measured:
    """A computed number and the ends of its bracket as compared with `entry`: in size where only that is printed."""

    entry: Entry
    value: float
    lower: float | None
    upper: float | None

    @classmethod
    def of(cls, entry: Entry, value: float, lower: float | None, upper: float | None) -> _Measured:
        if not entry.absolute:
            return cls(entry, value, lower, upper)
        if lower is None or upper is None:
            return cls(entry, abs(value), None, None)
        inner, outer = sorted((abs(lower), abs(upper)))
        return cls(entry, abs(value), 0.0 if lower < 0 < upper else inner, outer)

    @property
    def mark(self) -> drawing.Mark:
        """Distances from the print in units of its last place; an end that is not known is far away."""
        if self.lower is None and self.upper is None:
            return drawing.Mark(self._units(self.value))
        low = -math.inf if self.lower is None else self._units(self.lower)
        return drawing.Mark(self._units(self.value), low, math.inf if self.upper is None else self._units(self.upper))

    def _units(self, number: float) -> float:
        return float((Fraction(number) - self.entry.value) / self.entry.unit)


def _aligned(printed: Printed, record: ClaimRecord) -> Iterable[tuple[Entry, float, float | None, float | None]]:
    columns = (
        (None,) * len(printed.entries) if numbers is None else printed.align(name, numbers)
        for name, numbers in (("lower bound", record.lower), ("upper bound", record.upper))
    )
    assert record.computed is not None  # `side_by_side` has looked
    return zip(printed.entries, printed.align("computed value", record.computed), *columns, strict=True)


def _half_width(entry: Entry, tolerance: str | None) -> Fraction:
    return entry.unit / 2 if tolerance is None else decimal_fraction(tolerance)


def _band(relation: str, entry: Entry, half: Fraction) -> drawing.Band:
    if not relation:
        units = float(half / entry.unit)
        return drawing.Band(-units, units)
    if relation in "<≤":
        return drawing.Band(-math.inf, math.nextafter(0.0, -1.0) if relation == "<" else 0.0)
    return drawing.Band(math.nextafter(0.0, 1.0) if relation == ">" else 0.0, math.inf)


def _entry(
    record: ClaimRecord, printed: Printed, index: int, number: _Measured, band: drawing.Band, span: float
) -> EntryView:
    entry = number.entry
    head, tail = numerals.at_print(number.value, entry.unit, numerals.CROWDED if _crowded(printed) else numerals.BEYOND)
    text = f"{printed.relation}{entry.text}".replace("-", numerals.MINUS)
    sign = tuple("±" if entry.absolute else "" if shown[0] in "+−" else "+" for shown in (text, head))
    inside = band.holds(number.mark)
    half = _half_width(entry, record.tolerance)
    return EntryView(
        label=printed.labels[index],
        printed=text,
        interval=None if printed.relation else (entry.value - half, entry.value + half),
        head=head,
        tail=tail,
        agreed=len(head) if inside and not printed.relation else numerals.agreement(text, head),
        full=numerals.full(number.value),
        lower="" if number.lower is None else numerals.full(number.lower),
        upper="" if number.upper is None else numerals.full(number.upper),
        deviation=number.mark.value,
        inside=inside,
        strip=drawing.strip([number.mark], band, span),
        sign=(sign[0], sign[1]) if printed.labels[index].startswith(IMAGINARY) else ("", ""),
    )


def _crowded(printed: Printed) -> bool:
    """Whether several numbers stand in a line of the print."""
    return (len(printed.shape) == 2 and printed.shape[1] > 1) or any(len(cell) == 2 for cell in printed.cells)
