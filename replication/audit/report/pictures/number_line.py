"""A computed number and its bracket, drawn to scale against the interval that rounds to the printed value.

All lengths are in units of the last printed place, measured from the printed value. Drawings hold numbers of ours only,
so they are markup without escapes; colours come from the style sheet of the report by class.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

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
