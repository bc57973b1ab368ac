"""Search of all readings for the one nearest to printed columns, a block for each `Structure`.

Distance of a reading from a column: max over the frequencies of |ln(computed / printed)|.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from papers.shao.method.readings import STRUCTURES, Reading, ReadingSpace, error_ratios
from replication.estimation.validation import Array


@dataclass(frozen=True, eq=False)
class Column:
    """A printed column: observers that may stand for it, values, and half-widths to print."""

    observers: tuple[str, ...]
    values: Array
    half_widths: Array


@dataclass(frozen=True)
class Near:
    """The nearest reading found so far: its distance, its row within (observer, structure), and its values."""

    distance: float
    observer: str
    structure: int
    row: int
    values: tuple[float, ...]


@dataclass(frozen=True)
class BlockResult:
    """What one block found.

    Per column: nearest; tried, how many readings; distinct, how many of them differ to print within a structure; hits
    to print; best distance per observer. joint: the columns' readings at the nearest common reading; joint_hits: all
    columns to print.
    """

    structure: int
    nearest: Mapping[str, Near]
    tried: Mapping[str, int]
    distinct: Mapping[str, int]
    hits: Mapping[str, int]
    by_observer: Mapping[str, float]
    joint: Mapping[str, Near]
    joint_hits: int

    @property
    def joint_distance(self) -> float:
        """Distance of the nearest common reading."""
        return max(near.distance for near in self.joint.values())


@dataclass(frozen=True, eq=False)
class _Compared:
    """A column under one structure: ratios (observers, rows, frequencies), distances (observers, rows), hits (rows)."""

    column: Column
    values: Array
    distances: Array
    hits: npt.NDArray[np.bool_]

    def near(self, row: int, structure: int) -> Near:
        which = int(np.argmin(self.distances[:, row]))
        values = tuple(self.values[which, row].tolist())
        return Near(float(self.distances[which, row]), self.column.observers[which], structure, row, values)


def search_block(space: ReadingSpace, columns: Mapping[str, Column], index: int) -> BlockResult:
    """Search all readings of structure number `index`; deterministic, ties go to the first reading."""
    found = {name: _compared(space, column, index) for name, column in columns.items()}
    nearest = {name: part.distances.min(axis=0) for name, part in found.items()}
    tried = {name: np.isfinite(part.distances) for name, part in found.items()}
    row = int(np.argmin(np.max(list(nearest.values()), axis=0)))
    return BlockResult(
        structure=index,
        nearest={name: part.near(int(np.argmin(nearest[name])), index) for name, part in found.items()},
        tried={name: int(finite.sum()) for name, finite in tried.items()},
        distinct={
            name: len(np.unique(np.rint(part.values[tried[name]] / (2 * part.column.half_widths)), axis=0))
            for name, part in found.items()
        },
        hits={name: int(part.hits.sum()) for name, part in found.items()},
        by_observer={
            observer: value
            for part in found.values()
            for observer, value in zip(part.column.observers, part.distances.min(axis=1).tolist(), strict=True)
        },
        joint={name: part.near(row, index) for name, part in found.items()},
        joint_hits=int(np.sum(np.all([part.hits for part in found.values()], axis=0))),
    )


def _compared(space: ReadingSpace, column: Column, index: int) -> _Compared:
    """NaN marks a reading without a steady state: it is at an infinite distance from everything."""
    values = np.stack([error_ratios(space, observer, STRUCTURES[index]) for observer in column.observers])
    distances = np.abs(np.log(values) - np.log(column.values)).max(axis=2)
    hits = np.any(np.all(np.abs(values - column.values) <= column.half_widths, axis=2), axis=0)
    return _Compared(column, values, np.nan_to_num(distances, nan=np.inf), hits)


def merge(blocks: Sequence[BlockResult]) -> BlockResult:
    """The result of all blocks together; independent of their order."""
    blocks = sorted(blocks, key=lambda block: block.structure)
    best = min(blocks, key=lambda block: block.joint_distance)

    def added(parts: Sequence[Mapping[str, int]]) -> dict[str, int]:
        return {name: sum(part[name] for part in parts) for name in parts[0]}

    return BlockResult(
        structure=best.structure,
        nearest={name: min((b.nearest[name] for b in blocks), key=lambda near: near.distance) for name in best.nearest},
        tried=added([block.tried for block in blocks]),
        distinct=added([block.distinct for block in blocks]),
        hits=added([block.hits for block in blocks]),
        by_observer={name: min(b.by_observer[name] for b in blocks) for name in best.by_observer},
        joint=best.joint,
        joint_hits=sum(block.joint_hits for block in blocks),
    )


def reading_of(space: ReadingSpace, near: Near) -> Reading:
    """The reading behind a `Near`."""
    return space.reading(near.observer, STRUCTURES[near.structure], near.row)
