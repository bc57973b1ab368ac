"""Pictures that a reader can move: curves as SVG on round axes, their names and values as text.

The frame is 1000 by 1000 and stretched to its place, so that the text beside it keeps its size. Without a script each
picture stands where its slider begins.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from replication.audit.brief import Curve, Explorer, Picture, Traces
from replication.audit.judge import numerals
from replication.audit.judge.numerals import require_title
from replication.audit.report.claim import ClaimView, standing
from replication.audit.store.records import PaperRecord
from replication.errors import AuditError
from replication.files import read_columns

FRAME = 1000
STEPS = (1.0, 2.0, 5.0, 10.0)
MOST_TICKS = 5

Scale = Callable[[float], float]


def scale_of(numbers: Sequence[float], log: bool, margin: float) -> Scale:
    """From a number to the frame, with some units left free at both ends."""
    moved = [math.log10(number) if log else number for number in numbers]
    low, span = min(moved), (max(moved) - min(moved)) or 1.0
    return lambda number: margin + (FRAME - 2 * margin) * ((math.log10(number) if log else number) - low) / span


def ticks(numbers: Sequence[float], log: bool, scale: Scale) -> tuple[tuple[float, float], ...]:
    """A few round numbers in the range, and where they stand."""
    low, high = min(numbers), max(numbers)
    if log:
        first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
        step = max(1, math.ceil((last - first + 1) / MOST_TICKS))
        round_ones = [10.0**power for power in range(first, last + 1, step)]
        if len(round_ones) < 2:
            round_ones = [low, high]
    else:
        size = (high - low) / MOST_TICKS or 1.0
        power = 10 ** math.floor(math.log10(size))
        step = next(step * power for step in STEPS if step * power >= size)
        round_ones = [n * step for n in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]
    return tuple((float(f"{number:.3g}"), round(scale(number), 1)) for number in round_ones)


@dataclass(frozen=True)
class Axes:
    """The axes of a picture: from numbers to the frame, with the larger number higher, and ticks with their places."""

    x: Scale
    y: Scale
    x_ticks: tuple[tuple[float, float], ...]
    y_ticks: tuple[tuple[float, float], ...]

    def path(self, across: Iterable[float], heights: Iterable[float]) -> str:
        """A line through the points that are finite."""
        points = zip(across, heights, strict=True)
        return "M" + "L".join(f"{self.x(a):.0f} {self.y(b):.0f}" for a, b in points if math.isfinite(b))


def axes(
    across: Sequence[float], heights: Sequence[float], *, log_x: bool = False, log_y: bool = False, margin: float = 0
) -> Axes:
    """Axes that hold these numbers; margin: units that are left free below and above."""
    x, up = scale_of(across, log_x, 0), scale_of(heights, log_y, margin)
    upright = tuple((number, round(FRAME - at, 1)) for number, at in ticks(heights, log_y, up))
    return Axes(x, lambda number: FRAME - up(number), ticks(across, log_x, x), upright)


def spread(heights: Sequence[float], sizes: Sequence[float]) -> list[float]:
    """The heights of names moved apart as little as keeps them from meeting, and all in the frame."""
    order = sorted(range(len(heights)), key=heights.__getitem__)
    placed = list(heights)
    for before, after in itertools.pairwise(order):
        placed[after] = max(placed[after], placed[before] + (sizes[before] + sizes[after]) / 2)
    limit = float(FRAME)
    for index in reversed(order):
        placed[index] = min(placed[index], limit - sizes[index] / 2)
        limit = placed[index] - sizes[index] / 2
    return [round(height) for height in placed]


LINE, LETTERS = 72, 18
"""Height of a line of a name in units of the frame, and how many letters it has; the value stands below."""

Values = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class CurveView:
    """One curve. path: its line or area. value: what is shown where the slider begins, if anything. height: of its
    name, spread so that names do not meet. values, heights: at all positions of the slider, as the script reads them.
    """

    curve: Curve
    path: str
    value: tuple[float, ...]
    at: float | None
    height: float
    values: str
    heights: str
    refuted: bool


@dataclass(frozen=True, kw_only=True)
class PictureView:
    """A picture ready to be drawn. marks: the instants of each sensor, as a path."""

    picture: Picture
    curves: tuple[CurveView, ...]
    axes: Axes
    begin: int
    places: str
    names: str
    x: float
    x_at: float
    steps: int
    limit: float | None
    claim: ClaimView | None
    marks: tuple[tuple[str, str], ...]

    @property
    def level(self) -> float:
        """The value of the claim, if it has one."""
        value = self.claim.record.evidence.value if self.claim else None
        return float(value) if isinstance(value, int | float) else 0.0


def explorers(
    paper: PaperRecord, drawn: Sequence[str], figures: Path, claims: Sequence[ClaimView]
) -> tuple[tuple[Explorer, tuple[PictureView, ...]], ...]:
    """The explorers of a paper with their pictures; those whose figure could not be drawn are left out.

    drawn: names of the figures that could be, whose tables lie in `figures`.

    Raises AuditError where one names a figure, column or claim that the paper does not have.
    """
    known = {view.record.id: view for view in claims}
    # What the opening draws in red: what the paper prints, where one of its theorems fails.
    led, broken = paper.brief.picture if paper.brief else None, standing(view.record for view in claims).broken
    printed = [curve for curve in led.curves if not curve.quiet] if isinstance(led, Traces) and broken else []
    refuted = {name for curve in printed for name in curve.columns}
    views = []
    for explorer in paper.brief.explorers if paper.brief else ():
        require_title(explorer.title)
        selection = [picture for picture in explorer.pictures if picture.figure in drawn]
        pictures = tuple(
            _view(paper.key, picture, table(figures / f"{picture.figure}.csv"), known, refuted) for picture in selection
        )
        if pictures:
            views.append((explorer, pictures))
    return tuple(views)


def table(path: Path) -> dict[str, Values]:
    """The columns of a table: one with a single number holds it throughout, one that is short ends in no number."""
    columns = read_columns(path)
    length = max(map(len, columns.values()))
    return {
        name: numbers * length if len(numbers) == 1 else numbers + (math.nan,) * (length - len(numbers))
        for name, numbers in columns.items()
    }


def shown_part(table: Mapping[str, Values], picture: Picture | Traces, *names: str) -> list[Values]:
    """The abscissa of a picture up to the end of what is shown, and so much of these columns; AuditError if absent."""
    for name in (picture.across, *names):
        if name not in table:
            raise AuditError(f"a picture shows {name!r} of {picture.figure}, which has the columns {', '.join(table)}")
    end = math.inf if picture.last is None else picture.last
    across = tuple(x for x in table[picture.across] if x <= end)
    return [across, *(table[name][: len(across)] for name in names)]


def _view(
    key: str, picture: Picture, table: Mapping[str, Values], known: Mapping[str, ClaimView], refuted: set[str]
) -> PictureView:
    if picture.claim and f"{key}.{picture.claim}" not in known:
        raise AuditError(f"an explorer of {key} names {picture.claim!r}, which is no claim of it; correct the name")
    (across,) = shown_part(table, picture)
    drawn = [_numbers(curve, table, picture) for curve in picture.curves]
    shown = [y for lines in drawn for line in lines for y in line if math.isfinite(y)]
    shown += [picture.limit[0]] if picture.limit else []
    if not across or not shown or (picture.log_y and min(shown) <= 0) or (picture.log_x and min(across) <= 0):
        raise AuditError(f"the explorer {picture.label!r} of {picture.figure} has nothing to draw on such axes")
    drawn_on = axes(across, shown, log_x=picture.log_x, log_y=picture.log_y, margin=60)
    start = across[0] if picture.begin is None else picture.begin
    begin = min(range(len(across)), key=lambda i: abs(across[i] - start))
    # A name stands at the end of its curve, with a second line if it is long, and the value below.
    last = [[[y for y in line if math.isfinite(y)][-1] for line in lines] for lines in drawn]
    ends = [sum(map(drawn_on.y, values)) / len(values) for values in last]
    heights = spread(ends, [LINE * (2 + (len(curve.label) > LETTERS)) for curve in picture.curves])
    return PictureView(
        picture=picture,
        curves=tuple(
            _curve(curve, lines, across, drawn_on, begin, height, refuted)
            for curve, lines, height in zip(picture.curves, drawn, heights, strict=True)
        ),
        axes=drawn_on,
        begin=begin,
        places=" ".join(f"{drawn_on.x(x):.0f}" for x in across),
        names=" ".join(numerals.short(x, 3) for x in across),
        x=across[begin],
        x_at=round(drawn_on.x(across[begin])),
        steps=len(across) - 1,
        limit=round(drawn_on.y(picture.limit[0])) if picture.limit else None,
        claim=known[f"{key}.{picture.claim}"] if picture.claim else None,
        marks=tuple((mark.label, _instants(across, mark.period, mark.offset, drawn_on.x)) for mark in picture.sensors),
    )


def _numbers(curve: Curve, table: Mapping[str, Values], picture: Picture) -> list[Values]:
    """The lines of a curve: one, or both edges of a band."""
    _, *columns = shown_part(table, picture, *curve.columns)
    line = columns[0] if len(columns) == 1 else tuple(math.hypot(*row) for row in zip(*columns, strict=True))
    return [line, *(shown_part(table, picture, curve.upper)[1:] if curve.upper else ())]


def _curve(
    curve: Curve,
    lines: Sequence[Values],
    across: Sequence[float],
    axes: Axes,
    begin: int,
    height: float,
    refuted: set[str],
) -> CurveView:
    def at(i: int) -> float | None:
        ends = [line[i] for line in lines]
        return round(sum(map(axes.y, ends)) / len(ends)) if all(map(math.isfinite, ends)) else None

    # A band is drawn along its one edge, and back along the other.
    whole = [*across, *reversed(across)] if len(lines) > 1 else across
    path = axes.path(whole, [*lines[0], *(y for line in lines[1:] for y in reversed(line))])
    places = range(len(across))
    return CurveView(
        curve=curve,
        refuted=bool(refuted & set(curve.columns)),
        path=f"{path}Z" if len(lines) > 1 else path,
        at=at(begin),
        height=height,
        value=_shown([line[begin] for line in lines]),
        values="|".join(_named([line[i] for line in lines]) for i in places),
        heights=" ".join("" if (y := at(i)) is None else f"{y:.0f}" for i in places).rstrip(),
    )


def _shown(ends: Sequence[float]) -> tuple[float, ...]:
    """A number, or both ends of a band, rounded outwards; nothing where a curve has ended."""
    if not all(map(math.isfinite, ends)):
        return ()
    return numerals.outward(ends[0], ends[-1]) if len(ends) > 1 else tuple(ends)


def _named(ends: Sequence[float]) -> str:
    return " to ".join(numerals.short(end, 4) for end in _shown(ends)) or "none"


def _instants(across: Sequence[float], period: int, offset: int, scale: Scale) -> str:
    return "".join(f"M{scale(x):.0f} 0v10" for x in across if x >= offset and (x - offset) % period == 0)
