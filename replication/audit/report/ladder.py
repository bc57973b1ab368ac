"""From what a print stands for to what is proved: the same number three times, each rung on a finer scale.

The first rung shows the interval that rounds to the print, the second the way from the computed number to the nearer
end of it, the third the proved bracket. All places are in per cent of the drawing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from replication.audit.model import Verdict
from replication.audit.report.claim import ClaimView
from replication.audit.report.entries import EntryView
from replication.audit.report.templates import claim_of
from replication.audit.store.records import PaperRecord

MOST = 8
"""Ladders of a paper."""
FARTHEST = 2
"""Units of the last printed place that the first rung shows on either side."""

Ends = tuple[Fraction, Fraction]


@dataclass(frozen=True, kw_only=True)
class Rung:
    """One scale. factor: how many times finer than the first. box: the part of it that rounds to the print.

    ours: the bracket, a line where it is thinner than one. end: the nearer end of the interval.
    """

    factor: int
    box: tuple[float, float] | None
    ours: tuple[float, float]
    end: float | None


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """One claim; gap: from the bracket to the nearer end of the interval. inside: whether the bracket lies in it.

    end: the nearer end. bracket: what is proved, rounded outwards. room: how many times its width goes into the gap.
    """

    view: ClaimView
    entry: EntryView
    inside: bool
    gap: float
    end: Fraction
    bracket: Ends
    room: int
    rungs: tuple[Rung, Rung, Rung]


def ladders(paper: PaperRecord, claims: Sequence[ClaimView]) -> tuple[Ladder, ...]:
    """The proved numbers of the paper's tables, each once, first those outside their interval, then the closest."""
    cells = {claim_of(cell) for table in paper.tables for row in table.rows for cell in row}
    own = [view for view in claims if view.record.id in cells and view.record.counted]
    found = [made for view in own if (made := _ladder(view)) is not None]
    # Several claims of one place may print the same digits; the first of them stands for all.
    distinct = {(made.view.record.claim.place, made.entry.printed): made for made in reversed(found)}.values()
    chosen = sorted(distinct, key=lambda made: (made.inside, made.gap / float(_width(made))))[:MOST]
    return tuple(sorted(chosen, key=lambda made: (made.inside, made.view.place)))


def _width(made: Ladder) -> Fraction:
    interval = made.entry.interval
    assert interval is not None  # `_ladder` makes none without
    return interval[1] - interval[0]


def _ladder(view: ClaimView) -> Ladder | None:
    """None unless one printed number has a proved bracket, in sight of its interval, from which its verdict follows."""
    evidence, judgement = view.record.evidence, view.record.judgement
    if len(view.entries) != 1 or not judgement.proved or view.record.verdict is Verdict.ERROR:
        return None
    (entry,) = view.entries
    low, high = evidence.lower, evidence.upper
    if entry.interval is None or not isinstance(low, int | float) or not isinstance(high, int | float):
        return None
    ours, box = (Fraction(low), Fraction(high)), entry.interval
    inside = box[0] <= ours[0] and ours[1] <= box[1]
    if abs(entry.deviation) > FARTHEST or ours[0] >= ours[1] or (not inside and ours[1] > box[0] and ours[0] < box[1]):
        return None
    below, above = ours[0] - box[0], box[1] - ours[1]
    end, gap = (box[0], abs(below)) if abs(below) <= abs(above) else (box[1], abs(above))
    if not inside:
        end, gap = (box[0], box[0] - ours[1]) if ours[1] <= box[0] else (box[1], ours[0] - box[1])
    # Whether it agrees hangs on more than this bracket, such as a second reading: no verdict for a drawing.
    if not gap or inside is (view.record.verdict is Verdict.DIFFERS):
        return None
    return Ladder(
        view=view,
        entry=entry,
        inside=inside,
        gap=float(gap),
        end=end,
        bracket=_outward(ours),
        room=_two_digits(gap / (ours[1] - ours[0])),
        rungs=_rungs(box, ours, end),
    )


def _outward(ours: Ends) -> Ends:
    """The bracket with as many digits as show its width."""
    unit = Fraction(10) ** math.floor(math.log10(ours[1] - ours[0]))
    return math.floor(ours[0] / unit) * unit, math.ceil(ours[1] / unit) * unit


def _two_digits(number: Fraction) -> int:
    """A large number to two digits, a whole one in any case."""
    return int(round(number, min(0, 1 - math.floor(math.log10(number)))))


def _rungs(box: Ends, ours: Ends, end: Fraction) -> tuple[Rung, Rung, Rung]:
    width = box[1] - box[0]
    first = (min(box[0], ours[0]) - width / 4, max(box[1], ours[1]) + width / 4)
    near = (min(end, ours[0]), max(end, ours[1]))
    second = _widened(near, Fraction(1, 3))
    third = _widened(ours, Fraction(1, 2))
    scale = first[1] - first[0]
    return (
        _rung(first, scale, box, ours, None),
        _rung(second, scale, box, ours, end),
        _rung(third, scale, box, ours, None),
    )


def _widened(ends: Ends, part: Fraction) -> Ends:
    margin = (ends[1] - ends[0]) * part
    return ends[0] - margin, ends[1] + margin


def _rung(window: Ends, scale: Fraction, box: Ends, ours: Ends, end: Fraction | None) -> Rung:
    def at(number: Fraction) -> float:
        return round(float(100 * (number - window[0]) / (window[1] - window[0])), 2)

    low, high = (min(max(at(number), 0.0), 100.0) for number in box)
    return Rung(
        factor=_two_digits(scale / (window[1] - window[0])),
        box=(low, high) if low < high else None,
        ours=(at(ours[0]), at(ours[1])),
        end=None if end is None else at(end),
    )
