"""The papers side by side: one plant, a sensor that is slower, less regular or later, and what that costs."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from replication.audit.parts import CommonLevel
from replication.audit.report.explore import axes, spread
from replication.audit.store.records import PaperRecord, ResultsFile


@dataclass(frozen=True, kw_only=True)
class Column:
    """One kind of sensor, by the estimator of a paper.

    costs: by multiple, how many times the level of the ideal sensor that of this one is, at least and at most.
    """

    paper: PaperRecord
    sensor: str
    measure: str
    ideal: CommonLevel
    costs: dict[int, tuple[float, float]]

    @property
    def name(self) -> str:
        """The sensor in short, without how m is meant."""
        return self.sensor.partition(": ")[0]


@dataclass(frozen=True, kw_only=True)
class CostCurve:
    """A column as a curve: dots, a band where only bounds are known; height: of its name, if that is at the edge."""

    column: Column
    path: str
    band: str
    dots: tuple[tuple[float, float], ...]
    height: float


@dataclass(frozen=True, kw_only=True)
class Chart:
    """Columns of one measure in one drawing, the steepest first; left: columns with another measure.

    words: for the sensors. peak: the largest cost.
    """

    words: tuple[str, ...]
    measure: str
    curves: tuple[CostCurve, ...]
    x_ticks: tuple[tuple[int, float], ...]
    y_ticks: tuple[tuple[float, float], ...]
    left: tuple[Column, ...]
    peak: float


NAME_HEIGHT = 105
"""Of the name of a curve, in units of the frame."""


def chart(shown: Sequence[Column]) -> Chart | None:
    """The largest group of columns whose measures agree, as curves of cost over the multiple; None for fewer than two.

    Letters aside: l2 is the norm of a sequence, L2 that of a function, and a cost is a ratio of either.
    """
    if not shown:
        return None
    ((measure, number),) = Counter(column.measure.casefold() for column in shown).most_common(1)
    chosen = [c for c in shown if c.measure.casefold() == measure and len(c.costs) > 1]
    if number < 2 or len(chosen) < 2:
        return None
    multiples = sorted({m for column in chosen for m in column.costs})
    costs = [1.0, *(most for column in chosen for _, most in column.costs.values())]
    frame = axes([float(m) for m in multiples], costs)
    last = min(max(column.costs) for column in chosen)
    chosen.sort(key=lambda column: -column.costs[last][1] if last in column.costs else 0.0)
    whole = [column for column in chosen if max(column.costs) == multiples[-1]]
    ends = [frame.y(column.costs[multiples[-1]][1]) for column in whole]
    heights = dict(zip(map(id, whole), spread(ends, [NAME_HEIGHT] * len(whole)), strict=True))
    curves = []
    for column in chosen:
        along, bounds = zip(*sorted(column.costs.items()), strict=True)
        lower, upper = zip(*bounds, strict=True)
        dots = tuple((round(frame.x(m), 1), round(frame.y(cost), 1)) for m, cost in zip(along, upper, strict=True))
        curves.append(
            CostCurve(
                column=column,
                path=frame.path(along, upper),
                band=frame.path([*along, *reversed(along)], [*upper, *reversed(lower)]),
                dots=dots,
                height=heights.get(id(column), 0),
            )
        )
    return Chart(
        words=tuple(dict.fromkeys(re.split(r",| \(", column.name)[0] for column in chosen)),
        measure=chosen[0].measure,
        curves=tuple(curves),
        x_ticks=tuple((m, round(frame.x(m), 1)) for m in multiples),
        y_ticks=frame.y_ticks,
        left=tuple(column for column in shown if column.measure.casefold() != measure),
        peak=max(costs),
    )


def across(results: ResultsFile) -> tuple[Column, ...]:
    """The columns of all papers. A sensor without an ideal (multiple 1) is left out."""
    return tuple(column for paper in results.papers for column in _columns(paper))


def _columns(paper: PaperRecord) -> list[Column]:
    columns = []
    for sensor in dict.fromkeys(level.sensor for level in paper.common):
        levels = [level for level in paper.common if level.sensor == sensor]
        ideal = next((level for level in levels if level.multiple == 1), None)
        if ideal is not None:
            costs = {level.multiple: (level.lower / ideal.upper, level.upper / ideal.lower) for level in levels}
            costs[1] = (1.0, 1.0)
            columns.append(Column(paper=paper, sensor=sensor, measure=ideal.measure, ideal=ideal, costs=costs))
    return columns
