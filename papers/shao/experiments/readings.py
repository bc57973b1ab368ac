"""Experiments on the readings of Table I: one block of the search for each structure, so that a run can be resumed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import msgspec
import numpy as np

from papers.shao.method.readings import STRUCTURES
from papers.shao.method.search import BlockResult, Column, decoy_columns, merge, search_block
from papers.shao.printed import table_1
from papers.shao.problem import APO_READINGS, PMI_READINGS, READINGS

SEARCH = tuple(f"readings-{index:02d}" for index in range(len(STRUCTURES)))
"""Names of the blocks of the search."""


def block(structure: int, decoys: int, seed: int) -> dict[str, Any]:
    """Search all readings of one structure for Table I and for `decoys` random columns like each of its columns."""
    return asdict(search_block(READINGS, table_columns(decoys, seed), structure))


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
