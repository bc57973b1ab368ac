"""The opening of the report: what shows the result of each paper.

A paper declares headline and picture in its brief. One that does not is told by its first finding, and shown by the
entries of its first table, so that a project of any field has an opening.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from replication.audit.brief import Bars, Curve, Entries, Pair, Traces
from replication.audit.judge import numerals
from replication.audit.report.claim import ClaimView
from replication.audit.report.entries import EntryView
from replication.audit.report.explore import Axes, axes, shown_part, table
from replication.audit.report.paper import PaperView, TableView
from replication.errors import AuditError

MOST_ROWS, MOST_COLUMNS = 3, 8
"""Entries of a table that stand for a paper without a picture of its own."""
SHOWN = 1.5
GAP = 4.0
"""Units of the last printed place that a box shows on either side of the print."""


@dataclass(frozen=True)
class Trace:
    """One curve: path in the frame, the height of its name, its first and its last value."""

    curve: Curve
    path: str
    height: float
    first: float
    last: float


@dataclass(frozen=True, kw_only=True)
class TracesView:
    """Curves with axes, up to an end on the abscissa, with its unit."""

    picture: Traces
    end: float
    unit: str
    curves: tuple[Trace, ...]
    axes: Axes


@dataclass(frozen=True, kw_only=True)
class BarView:
    """A printed number and the bound beside it, as they are drawn; lower, times: rounded down."""

    label: str
    printed: ClaimView
    bound: ClaimView
    drawn: tuple[float, float]
    lower: float
    times: float


@dataclass(frozen=True, kw_only=True)
class Boxed:
    """One entry of a table. at: where ours lies, in per cent of the drawing; instead: what the print should say.

    ours: with two places more than the print.
    """

    view: ClaimView
    entry: EntryView | None
    at: float
    ours: str
    instead: str


@dataclass(frozen=True, kw_only=True)
class EntriesView:
    """Entries of tables; box: where the box of the print begins and how wide it is, in per cent of the drawing.

    A single row is drawn entry by entry, each with its box; several are a table.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Boxed | None, ...]], ...]
    text: str = ""
    box = (50 - 25 / SHOWN, 50 / SHOWN)


def picture_of(paper: PaperView, figures: Path) -> TracesView | tuple[BarView, ...] | EntriesView | None:
    """What shows the result of a paper, if anything does; figures: where the tables of the figures lie.

    Raises AuditError where its picture names a figure, column or claim that the paper does not have.
    """
    picture = paper.record.brief.picture if paper.record.brief is not None else None
    if isinstance(picture, Traces):
        drawn = {figure.record.name for figure in paper.figures if figure.drawing}
        return _traces(picture, table(figures / f"{picture.figure}.csv")) if picture.figure in drawn else None
    if isinstance(picture, Bars):
        return tuple(_pair(pair, paper) for pair in picture.pairs)
    if isinstance(picture, Entries):
        listed = [(name, tuple(_boxed(_claim(cell, paper)) for cell in cells)) for name, cells in picture.rows]
        return EntriesView(columns=picture.columns, rows=tuple(listed), text=picture.text)
    return next(filter(None, map(_of_table, paper.tables)), None)


def _claim(name: str, paper: PaperView) -> ClaimView:
    known = {view.record.id.partition(".")[2]: view for view in paper.claims}
    if name not in known:
        raise AuditError(f"the picture of {paper.record.key} shows {name!r}, which is no claim of it; correct the name")
    return known[name]


def _pair(pair: Pair, paper: PaperView) -> BarView:
    printed, bound = _claim(pair.printed, paper), _claim(pair.bound, paper)
    lower = bound.record.evidence.lower
    if not printed.entries or printed.entries[0].value is None or not isinstance(lower, int | float):
        raise AuditError(
            f"the picture of {paper.record.key} sets {pair.printed!r} against {pair.bound!r}, which lack a "
            "printed number or a lower bound; choose others"
        )
    value = float(printed.entries[0].value)
    return BarView(
        label=pair.label,
        printed=printed,
        bound=bound,
        drawn=(value, float(lower)),
        lower=float(numerals.at_least(float(lower), 4)),
        times=float(numerals.at_least(float(lower) / value, 3)),
    )


def _boxed(view: ClaimView) -> Boxed:
    if len(view.entries) != 1 or not view.entries[0].tail or view.entries[0].interval is None:
        return Boxed(view=view, entry=None, at=50, ours=view.ours, instead="")
    (entry,) = view.entries
    value, places = float(entry.full.replace(numerals.MINUS, "-")), len(entry.printed.partition(".")[2])
    at = 50 + 50 * min(max(entry.deviation, -SHOWN), SHOWN) / SHOWN
    if not entry.inside:  # a gap to the box that can be seen
        at = math.copysign(max(abs(at - 50), EntriesView.box[1] / 2 + GAP), at - 50) + 50
    return Boxed(
        view=view,
        entry=entry,
        at=round(at, 1),
        ours=f"{value:.{places + 2}f}",
        instead="" if entry.inside else f"{value:.{places}f}",
    )


def _of_table(shown: TableView) -> EntriesView | None:
    """Its first rows that hold a number to compare."""
    rows = []
    for cells in shown.rows:
        boxed = tuple(None if cell.claim is None else _boxed(cell.claim) for cell in cells[1:])[:MOST_COLUMNS]
        if any(cell is not None and cell.entry is not None for cell in boxed):
            rows.append((cells[0].text, boxed))
    columns = shown.record.header[1 : MOST_COLUMNS + 1]
    return EntriesView(columns=columns, rows=tuple(rows[:MOST_ROWS])) if rows else None


def _traces(picture: Traces, columns: Mapping[str, tuple[float, ...]]) -> TracesView:
    across, *values = shown_part(columns, picture, *(curve.columns[0] for curve in picture.curves))
    frame = axes(across, [0.0, *(v for line in values for v in line)], margin=20)
    curves = []
    for curve, line in zip(picture.curves, values, strict=True):
        last = [number for number in line if math.isfinite(number)][-1]
        path, height = frame.path(across, line), round(frame.y(last), 1)
        curves.append(Trace(curve, path, height, first=line[0], last=line[-1]))
    unit = "".join(f"\N{NO-BREAK SPACE}{unit}" for unit in re.findall(r"\((\w+)\)", picture.x)[:1])
    return TracesView(picture=picture, end=across[-1], unit=unit, curves=tuple(curves), axes=frame)
