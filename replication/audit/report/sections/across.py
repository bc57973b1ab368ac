"""The papers side by side: one plant, a sensor that is slower, less regular or later, and what that costs."""

from __future__ import annotations

from dataclasses import dataclass

from replication.audit.parts import CommonLevel
from replication.audit.store.records import PaperRecord, ResultsFile


@dataclass(frozen=True, kw_only=True)
class Cost:
    """One level, and how many times that of the ideal sensor it is, as a bracket."""

    level: CommonLevel
    least: float
    most: float


@dataclass(frozen=True, kw_only=True)
class Column:
    """One kind of sensor, by the estimator of a paper; costs by multiple, the ideal sensor included."""

    paper: PaperRecord
    sensor: str
    measure: str
    ideal: CommonLevel
    costs: dict[int, Cost]


@dataclass(frozen=True, kw_only=True)
class Across:
    """All columns and the multiples that any of them has."""

    columns: tuple[Column, ...]
    multiples: tuple[int, ...]


def across(results: ResultsFile) -> Across | None:
    """The columns of all papers; None if there are none. A sensor without an ideal (multiple 1) is left out."""
    columns = tuple(column for paper in results.papers for column in _columns(paper))
    if not columns:
        return None
    return Across(columns=columns, multiples=tuple(sorted({m for column in columns for m in column.costs})))


def _columns(paper: PaperRecord) -> list[Column]:
    made = []
    for sensor in dict.fromkeys(level.sensor for level in paper.common):
        levels = [level for level in paper.common if level.sensor == sensor]
        ideal = next((level for level in levels if level.multiple == 1), None)
        if ideal is not None:
            costs = {level.multiple: _cost(level, ideal) for level in levels}
            made.append(Column(paper=paper, sensor=sensor, measure=ideal.measure, ideal=ideal, costs=costs))
    return made


def _cost(level: CommonLevel, ideal: CommonLevel) -> Cost:
    if level is ideal:
        return Cost(level=level, least=1.0, most=1.0)
    return Cost(level=level, least=level.lower / ideal.upper, most=level.upper / ideal.lower)
