"""How a verdict is reached, on two printed numbers of the results: one agrees to its digits, the other does not."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from replication.audit.model import Verdict
from replication.audit.report.claim import ClaimView
from replication.audit.report.entries import EntryView

BOX = (24.0, 76.0)
"""Where the interval of a print begins and ends in the drawing, in per cent; it is one unit wide."""
FARTHEST = 0.9
"""Units from the print that the drawing shows."""


@dataclass(frozen=True, kw_only=True)
class Example:
    """One printed number; at: where the computed one lies in the drawing, in per cent."""

    view: ClaimView
    entry: EntryView
    at: float


def examples(views: Iterable[ClaimView]) -> tuple[Example, ...]:
    """A number that agrees and one that does not, each as near to the edge as there is; fewer if there is none."""
    fitting = [made for view in views if (made := _example(view)) is not None]
    inside = [made for made in fitting if made.view.record.verdict is Verdict.REPRODUCED]
    outside = [made for made in fitting if made.view.record.verdict is Verdict.DIFFERS]
    found = []
    if outside:
        found.append(min(outside, key=_off))
        paper = found[0].view.record.paper
        inside = [made for made in inside if made.view.record.paper == paper] or inside
    if inside:
        found.insert(0, max(inside, key=_off))
    return tuple(found)


def _off(example: Example) -> float:
    return abs(example.entry.deviation)


def _example(view: ClaimView) -> Example | None:
    if len(view.entries) != 1 or view.record.unexpected or view.record.claim.tolerance is not None:
        return None
    (entry,) = view.entries
    if entry.interval is None or not entry.tail or abs(entry.deviation) > FARTHEST or not entry.deviation:
        return None
    return Example(view=view, entry=entry, at=50 + (BOX[1] - BOX[0]) * entry.deviation)
