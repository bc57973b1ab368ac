"""What the report shows of a claim, in the order in which it shows it: entries side by side, worst first."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

from markupsafe import Markup

from replication.audit.judge.printed import Printed, parse
from replication.audit.model import Verdict
from replication.audit.report.entries import EntryView, side_by_side
from replication.audit.store.records import ClaimRecord
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
class ClaimView:
    """A claim as the report shows it; `entries` is empty where printed and computed cannot be set side by side.

    place: number of the claim in the order of the paper. residual: what the threshold of a statement is compared with.
    within: how many entries agree with the print. rows: the same entries as they stand in print, row by row,
    each a tuple of cells, each of one entry or, if complex, of two.
    """

    record: ClaimRecord
    place: int
    entries: tuple[EntryView, ...]
    rows: tuple[tuple[tuple[EntryView, ...], ...], ...]
    within: int
    residual: float | None
    strip: Markup
    unexpected: bool

    @property
    def in_row(self) -> bool:
        """Whether the row lists all entries."""
        return 0 < len(self.entries) <= MOST_ENTRIES and max(map(len, self.rows)) <= MOST_COLUMNS


def views(claims: Iterable[ClaimRecord]) -> tuple[ClaimView, ...]:
    """The claims of one paper, worst first: by verdict, then by deviation, then as they stand in the paper."""
    return tuple(sorted(itertools.starmap(_view, enumerate(claims)), key=_badness))


def anchor(kind: str, name: str) -> str:
    """An id for `name` that is unique, readable and valid in HTML and in a URL, whatever characters the name has."""
    return f"{kind}-" + re.sub(r"[^A-Za-z0-9.-]", lambda match: f"_{ord(match.group()):x}_", name)


def _badness(view: ClaimView) -> tuple[float, float]:
    rank: float = WORST_FIRST.index(view.record.verdict)
    if view.unexpected:
        rank = min(rank, 0.5)
    deviation = view.record.deviation_ulp
    return rank, 0.0 if deviation is None or not math.isfinite(deviation) else -abs(deviation)


def _view(place: int, record: ClaimRecord) -> ClaimView:
    try:
        entries, strip = side_by_side(record)
    except (AuditError, OverflowError, ValueError):
        # The verdict of such a claim is `error`, and its reason says what does not fit.
        entries, strip = (), Markup()
    return ClaimView(
        record=record,
        place=place,
        entries=entries,
        rows=_rows(parse(record.printed), entries) if entries else (),
        within=sum(entry.inside for entry in entries),
        residual=None if record.threshold is None or record.margin is None else record.threshold - record.margin,
        strip=strip,
        unexpected=record.verdict != record.expected_verdict,
    )


def _rows(printed: Printed, entries: tuple[EntryView, ...]) -> tuple[tuple[tuple[EntryView, ...], ...], ...]:
    """The entries in the layout of the print: a matrix has its rows, a list one entry below the other."""
    left = iter(entries)
    cells = [tuple(next(left) for _ in cell) for cell in printed.cells]
    width = printed.shape[1] if len(printed.shape) == 2 else 1
    return tuple(tuple(cells[start : start + width]) for start in range(0, len(cells), width))
