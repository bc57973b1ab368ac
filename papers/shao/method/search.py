"""Search of all readings for the one nearest to printed columns, with a null test against decoy columns.

Distance of a reading from a column: max over the frequencies of |ln(computed / printed)|. The search goes block by
block, one block per `Structure`; a block is a pure function of its inputs, so a caller may run blocks in parallel,
keep their results, and go on later. Decoys are smooth random columns of the same kind: if the readings come as near
to them as to the printed column, nearness says nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from papers.shao.method.readings import STRUCTURES, Reading, ReadingSpace, Structure, error_ratios
from replication.errors import InvalidInputError
from replication.estimation.validation import Array

Whole = npt.NDArray[np.int64]
LARGEST = 2**62
"""Numbers up to this are counted exactly."""


@dataclass(frozen=True, eq=False)
class Column:
    """A printed column: observers that may stand for it, values, half-widths to print, and decoys (count, values)."""

    observers: tuple[str, ...]
    values: Array
    half_widths: Array
    decoys: Array


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
    to print; nearest of each decoy; best distance per observer. joint: the columns' readings at the nearest common
    reading; joint_distance: its distance, joint_decoys: that of each decoy pair; joint_hits: all columns to print.
    """

    structure: int
    nearest: Mapping[str, Near]
    tried: Mapping[str, int]
    distinct: Mapping[str, int]
    hits: Mapping[str, int]
    decoys: Mapping[str, tuple[float, ...]]
    by_observer: Mapping[str, float]
    joint: Mapping[str, Near]
    joint_distance: float
    joint_decoys: tuple[float, ...]
    joint_hits: int


def decoy_columns(values: Array, count: int, rng: np.random.Generator) -> Array:
    """Smooth increasing columns whose ends lie within a factor of two of those of `values`; shape (count, values).

    ln d = a + (b − a)(t + c t (1 − t)) over t ∈ [0, 1] with |c| < 1, so that d increases with its index.
    """
    if np.any(values <= 0) or values[-1] <= values[0]:
        raise InvalidInputError(f"decoys are made for positive columns that increase, got {values.tolist()}")
    t = np.linspace(0.0, 1.0, len(values))
    ends = np.log(values[[0, -1]]) + rng.uniform(-np.log(2), np.log(2), size=(count, 2))
    ends.sort(axis=1)
    bend = rng.uniform(-1, 1, size=(count, 1))
    return np.asarray(np.exp(ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * (t + bend * t * (1 - t))))


def search_block(space: ReadingSpace, columns: Mapping[str, Column], index: int) -> BlockResult:
    """Search all readings of structure number `index`; deterministic, ties go to the first reading."""
    found = {name: _search_column(space, column, index) for name, column in columns.items()}
    parts = list(found.values())
    joint = np.max([part.distances for part in parts], axis=0)
    row = int(np.argmin(joint[0]))
    return BlockResult(
        structure=index,
        nearest={name: part.near(int(np.argmin(part.distances[0])), index) for name, part in found.items()},
        tried={name: part.tried for name, part in found.items()},
        distinct={name: part.distinct for name, part in found.items()},
        hits={name: int(part.hits.sum()) for name, part in found.items()},
        decoys={name: tuple(part.distances[1:].min(axis=1).tolist()) for name, part in found.items()},
        by_observer={observer: value for part in parts for observer, value in part.by_observer.items()},
        joint={name: part.near(row, index) for name, part in found.items()},
        joint_distance=float(joint[0, row]),
        joint_decoys=tuple(joint[1:].min(axis=1).tolist()),
        joint_hits=int(np.sum(np.all([part.hits for part in parts], axis=0))),
    )


def merge(blocks: Sequence[BlockResult]) -> BlockResult:
    """The result of all blocks together; independent of their order."""
    blocks = sorted(blocks, key=lambda block: block.structure)
    names = list(blocks[0].nearest)
    best = min(blocks, key=lambda block: block.joint_distance)
    return BlockResult(
        structure=best.structure,
        nearest={name: min((b.nearest[name] for b in blocks), key=lambda near: near.distance) for name in names},
        tried={name: sum(b.tried[name] for b in blocks) for name in names},
        distinct={name: sum(b.distinct[name] for b in blocks) for name in names},
        hits={name: sum(b.hits[name] for b in blocks) for name in names},
        decoys={name: tuple(np.min([b.decoys[name] for b in blocks], axis=0).tolist()) for name in names},
        by_observer={name: min(b.by_observer[name] for b in blocks) for name in blocks[0].by_observer},
        joint=best.joint,
        joint_distance=best.joint_distance,
        joint_decoys=tuple(np.min([b.joint_decoys for b in blocks], axis=0).tolist()),
        joint_hits=sum(b.joint_hits for b in blocks),
    )


def reading_of(space: ReadingSpace, near: Near) -> Reading:
    """The reading behind a `Near`."""
    return space.reading(near.observer, STRUCTURES[near.structure], near.row)


def chance(distance: float, decoys: Sequence[float]) -> float:
    """Share of columns at least as near as `distance` among the decoys and the printed one: (1 + hits)/(1 + count)."""
    return (1 + sum(decoy <= distance for decoy in decoys)) / (1 + len(decoys))


@dataclass(frozen=True, eq=False)
class _ColumnSearch:
    """Per row the distance of the best observer (targets, rows), which one it is, its values, and whether any hits."""

    observers: tuple[str, ...]
    distances: Array
    which: Array
    values: Array
    hits: Array
    tried: int
    distinct: int
    by_observer: Mapping[str, float]

    def near(self, row: int, structure: int) -> Near:
        which = int(self.which[row])
        values = tuple(self.values[which, row].tolist())
        return Near(float(self.distances[0, row]), self.observers[which], structure, row, values)


def _search_column(space: ReadingSpace, column: Column, index: int) -> _ColumnSearch:
    structure: Structure = STRUCTURES[index]
    values = np.stack([error_ratios(space, observer, structure) for observer in column.observers])
    targets = np.log(np.vstack([column.values, column.decoys]))
    logs = np.log(values)
    distances = _distances(logs, targets)
    own = distances[0]
    tried = np.isfinite(own)
    return _ColumnSearch(
        observers=column.observers,
        distances=distances.min(axis=1),
        which=np.argmin(own, axis=0),
        values=values,
        hits=np.any(np.all(np.abs(values - column.values) <= column.half_widths, axis=2), axis=0),
        tried=int(tried.sum()),
        distinct=_distinct(np.rint(values[tried] / (2 * column.half_widths))),
        by_observer=dict(zip(column.observers, own.min(axis=1).tolist(), strict=True)),
    )


def _distinct(rows: Array) -> int:
    """Number of different rows of whole numbers: digits of one number, counted anew where it would get too large."""
    labels: Whole = np.zeros(len(rows), dtype=np.int64)
    count = 1
    for column in rows.T if len(rows) else ():
        digits, base = _counted(column)
        if count * base > LARGEST:
            labels, count = _counted(labels, LARGEST // base)
        labels, count = labels * base + digits, count * base
    return len(np.unique(labels))


def _counted(numbers: Array | Whole, most: int = 2**31) -> tuple[Whole, int]:
    """Whole numbers from 0 on that differ where these do, and how many they are at most: by their distance from the
    least, by their rank if there would be more than `most`."""
    base = int(np.ptp(numbers)) + 1
    if base <= most:
        return (numbers - numbers.min()).astype(np.int64), base
    distinct, ranks = np.unique(numbers, return_inverse=True)
    return ranks.astype(np.int64), len(distinct)


def _distances(logs: Array, targets: Array) -> Array:
    """max over frequencies of |logs − targets|: (targets, observers, rows).

    NaN marks a reading without a steady state: it is at an infinite distance from everything.
    """
    columns = np.ascontiguousarray(np.moveaxis(logs, 2, 0))
    worst, apart = np.zeros((len(targets), *logs.shape[:2])), np.empty(logs.shape[:2])
    # One target at a time stays in the cache of the processor.
    for nearest, target in zip(worst, targets, strict=True):
        for column, log in zip(columns, target, strict=True):
            np.maximum(nearest, np.abs(np.subtract(column, log, out=apart), out=apart), out=nearest)
        np.nan_to_num(nearest, copy=False, nan=np.inf)
    return worst
