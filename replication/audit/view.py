"""What the report shows of a claim, in the order in which it shows it: entries side by side, worst first."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

from markupsafe import Markup

from replication.audit import drawing, numerals
from replication.audit.model import Verdict
from replication.audit.printed import Entry, Printed, decimal_fraction, parse
from replication.audit.records import ClaimRecord
from replication.errors import AuditError

MOST_ENTRIES = 6
MOST_COLUMNS = 2
"""Entries that a row of the claims table lists; a larger list or matrix is shown in full in the evidence."""

WORST_FIRST = (
    Verdict.ERROR,
    Verdict.DIFFERS,
    Verdict.NOT_CHECKABLE,
    Verdict.REPRODUCED_AFTER_ERRATUM,
    Verdict.CONSISTENT,
    Verdict.REPRODUCED,
)
"""Order of the claims table; between error and differs come all verdicts that are not the expected ones."""


@dataclass(frozen=True, kw_only=True)
class EntryView:
    """One printed number beside what was computed for it.

    stands_for: the interval that agrees with the print. head, tail: computed digits up to the last printed place and
    beyond it. deviation: in units of the last printed place. sign: what stands between a real part and this imaginary
    one, in print and as computed, if their own digits have no sign; empty for all other entries.
    """

    label: str
    printed: str
    stands_for: str
    head: str
    tail: str
    full: str
    lower: str
    upper: str
    deviation: float
    inside: bool
    strip: Markup
    sign: tuple[str, str] = ("", "")


@dataclass(frozen=True, kw_only=True)
class ClaimView:
    """A claim as the report shows it; `entries` is empty where printed and computed cannot be set side by side.

    rows: the same entries as they stand in print, row by row, each a tuple of cells, each of one entry or, if complex,
    of two.
    """

    record: ClaimRecord
    entries: tuple[EntryView, ...]
    rows: tuple[tuple[tuple[EntryView, ...], ...], ...]
    strip: Markup
    unexpected: bool

    @property
    def in_row(self) -> bool:
        """Whether the row lists all entries."""
        return 0 < len(self.entries) <= MOST_ENTRIES and max(map(len, self.rows)) <= MOST_COLUMNS

    @property
    def residual(self) -> float | None:
        """What the threshold of a statement is compared with; None without a threshold."""
        threshold, margin = self.record.threshold, self.record.margin
        return None if threshold is None or margin is None else threshold - margin


def views(claims: Iterable[ClaimRecord]) -> tuple[ClaimView, ...]:
    """The claims of one paper, worst first: by verdict, then by deviation, then as they stand in the paper."""
    return tuple(sorted(map(_view, claims), key=_badness))


def anchor(kind: str, name: str) -> str:
    """An id for `name` that is unique, readable and valid in HTML and in a URL, whatever characters the name has."""
    return f"{kind}-" + re.sub(r"[^A-Za-z0-9.-]", lambda match: f"_{ord(match.group()):x}_", name)


def _badness(view: ClaimView) -> tuple[float, float]:
    rank: float = WORST_FIRST.index(view.record.verdict)
    if view.unexpected:
        rank = min(rank, 0.5)
    deviation = view.record.deviation_ulp
    return rank, 0.0 if deviation is None or not math.isfinite(deviation) else -abs(deviation)


def _view(record: ClaimRecord) -> ClaimView:
    try:
        entries, strip = _side_by_side(record)
    except (AuditError, OverflowError, ValueError):
        # The verdict of such a claim is `error`, and its reason says what does not fit.
        entries, strip = (), Markup()
    return ClaimView(
        record=record,
        entries=entries,
        rows=_rows(parse(record.printed), entries) if entries else (),
        strip=strip,
        unexpected=record.verdict != record.expected_verdict,
    )


def _crowded(printed: Printed) -> bool:
    """Whether several numbers stand in a line of the print."""
    return (len(printed.shape) == 2 and printed.shape[1] > 1) or any(len(cell) == 2 for cell in printed.cells)


def _rows(printed: Printed, entries: tuple[EntryView, ...]) -> tuple[tuple[tuple[EntryView, ...], ...], ...]:
    """The entries in the layout of the print: a matrix has its rows, a list one entry below the other."""
    left = iter(entries)
    cells = [tuple(next(left) for _ in cell) for cell in printed.cells]
    width = printed.shape[1] if len(printed.shape) == 2 else 1
    return tuple(tuple(cells[start : start + width]) for start in range(0, len(cells), width))


def _side_by_side(record: ClaimRecord) -> tuple[tuple[EntryView, ...], Markup]:
    """Entries and drawing of a claim; both empty where there are not both a print and a computed number."""
    if not record.printed or record.computed is None:
        return (), Markup()
    printed = parse(record.printed)
    measured = [_Measured.of(*numbers) for numbers in _aligned(printed, record)]
    bands = [_band(printed.relation, entry, _half_width(entry, record.tolerance)) for entry in printed.entries]
    span = max(drawing.span_of([number.mark], band) for number, band in zip(measured, bands, strict=True))
    entries = tuple(_entry(record, printed, index, number, bands[index], span) for index, number in enumerate(measured))
    # Entries of one claim may differ in their band (unequal digits); one row shows the narrowest.
    narrowest = drawing.Band(max(band.low for band in bands), min(band.high for band in bands))
    return entries, drawing.strip([number.mark for number in measured], narrowest)


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
    assert record.computed is not None  # `_side_by_side` has looked
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
    half = _half_width(entry, record.tolerance)
    ends = (numerals.exact(entry.value - half), numerals.exact(entry.value + half))
    return EntryView(
        label=printed.labels[index],
        printed=text,
        stands_for="" if printed.relation else " … ".join(ends),
        head=head,
        tail=tail,
        full=numerals.full(number.value),
        lower="" if number.lower is None else numerals.full(number.lower),
        upper="" if number.upper is None else numerals.full(number.upper),
        deviation=number.mark.value,
        inside=band.holds(number.mark),
        strip=drawing.strip([number.mark], band, span),
        sign=(sign[0], sign[1]) if printed.labels[index].startswith("imaginary part") else ("", ""),
    )
