"""Search of all readings for the one nearest to printed columns, a block for each `Structure`.

Distance of a reading from a column: max over the frequencies of |ln(computed / printed)|.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

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


def search_block(space: ReadingSpace, columns: Mapping[str, Column], index: int) -> BlockResult:
    """Search all readings of structure number `index`; deterministic, ties go to the first reading.

    Per column, in arrays over (observers, readings): NaN marks one without a steady state, infinitely far from all.
    """
    values, distances, hits = {}, {}, {}
    for name, column in columns.items():
        errors = np.stack([error_ratios(space, observer, STRUCTURES[index]) for observer in column.observers])
        away = np.abs(np.log(errors) - np.log(column.values)).max(axis=2)
        values[name], distances[name] = errors, np.nan_to_num(away, nan=np.inf)
        hits[name] = np.any(np.all(np.abs(errors - column.values) <= column.half_widths, axis=2), axis=0)

    def near(name: str, row: int) -> Near:
        which = int(np.argmin(distances[name][:, row]))
        ratios = tuple(values[name][which, row].tolist())
        return Near(float(distances[name][which, row]), columns[name].observers[which], index, row, ratios)

    nearest = {name: away.min(axis=0) for name, away in distances.items()}
    tried = {name: np.isfinite(away) for name, away in distances.items()}
    row = int(np.argmin(np.max(list(nearest.values()), axis=0)))
    return BlockResult(
        structure=index,
        nearest={name: near(name, int(np.argmin(away))) for name, away in nearest.items()},
        tried={name: int(finite.sum()) for name, finite in tried.items()},
        distinct={
            name: len(np.unique(np.rint(values[name][tried[name]] / (2 * column.half_widths)), axis=0))
            for name, column in columns.items()
        },
        hits={name: int(hit.sum()) for name, hit in hits.items()},
        by_observer={
            observer: float(away.min())
            for name, column in columns.items()
            for observer, away in zip(column.observers, distances[name], strict=True)
        },
        joint={name: near(name, row) for name in columns},
        joint_hits=int(np.sum(np.all(list(hits.values()), axis=0))),
    )


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
