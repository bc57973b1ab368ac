"""Figures: Fig. 1 and the gains of an observer, how near the methods come to the optimum, what they cost."""

from __future__ import annotations

from collections.abc import Iterable

from replication.audit.parts import FigureData


def columns(**columns: Iterable[float]) -> FigureData:
    """The data of a figure by the names of its columns."""
    return FigureData(columns={name: tuple(map(float, values)) for name, values in columns.items()})
