"""Experiments on the readings of Table I: one block of the search for each structure, so that a run can be resumed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import msgspec
import numpy as np

from papers.shao.method.readings import STRUCTURES, windowed_errors
from papers.shao.method.search import BlockResult, Column, decoy_columns, merge, search_block
from papers.shao.printed import table_1
from papers.shao.problem import APO_READINGS, COLUMNS, FREQUENCIES, PMI_READINGS, READINGS
from papers.shao.readings import INTERPOLATIONS, LITERAL, MEASURES
from replication.estimation.dualrate.response import Points

SEARCH = tuple(f"readings-{index:02d}" for index in range(len(STRUCTURES)))
"""Names of the blocks of the search."""


def block(structure: int, decoys: int, seed: int) -> dict[str, Any]:
    """Search all readings of one structure for Table I and for `decoys` random columns like each of its columns."""
    return asdict(search_block(READINGS, table_columns(decoys, seed), structure))


def windows() -> dict[str, Any]:
    """For each cell of Table I what comes out over a window of time, under each reading of the cell and from each ζ(0).

    long: windows of at least half a period of the reference, in which every steady state has its maximum. nearest: of
    these the error nearest to the print, percent. hits: how many of these, and of the shorter ones, give the print.
    """
    columns = table_columns(0, 0)
    return {name: [_over_windows(name, columns[name], row) for row in range(len(FREQUENCIES))] for name in COLUMNS}


def _over_windows(name: str, column: Column, row: int) -> dict[str, Any]:
    frequency, printed, half = FREQUENCIES[row], column.values[row], column.half_widths[row]
    tried = [(COLUMNS[name], *measure) for measure in MEASURES.values()]
    if name == "pmi":
        tried += [(other, *MEASURES[LITERAL]) for other in INTERPOLATIONS.values() if other != COLUMNS[name]]
    found = np.array(
        [
            windowed_errors(READINGS, READINGS.loop(observer, structure, frequency))[:, list(Points).index(points)]
            for observer, structure, points in tried
        ]
    )
    lasting = READINGS.design.slow_period * np.array([end - start for start, end in READINGS.windows])
    long = lasting >= np.pi / frequency
    hit = np.abs(found - printed) <= half
    whole = found[..., long].ravel()
    return {
        "nearest": float(100 * whole[np.argmin(np.abs(np.log(whole / printed)))]),
        "long": whole.size,
        "hits": {"long": int(hit[..., long].sum()), "short": int(hit[..., ~long].sum())},
    }


def table_columns(decoys: int, seed: int) -> dict[str, Column]:
    """The printed columns as ratios, with half a unit of the last printed place, and their decoys."""
    rng = np.random.default_rng(seed)
    columns = {}
    for name, observers in (("pmi", PMI_READINGS), ("apo", APO_READINGS)):
        printed = table_1(f"DRC-{name.upper()}")
        values = np.array([float(text) for text in printed]) / 100
        half_widths = np.array([0.5 * 10.0 ** -len(text.split(".")[1]) for text in printed]) / 100
        columns[name] = Column(observers, values, half_widths, decoy_columns(values, decoys, rng))
    return columns


def merged(blocks: Iterable[dict[str, Any]]) -> BlockResult:
    """The whole search from the stored results of its blocks."""
    return merge([msgspec.convert(stored, BlockResult) for stored in blocks])
