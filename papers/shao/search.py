"""Experiments on the readings of Table I: one block of the search for each structure, so that a run can be resumed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from papers.shao import data
from papers.shao.method.readings import STRUCTURES
from papers.shao.method.search import BlockResult, Column, Near, decoy_columns, merge, search_block
from papers.shao.problem import APO_READINGS, PMI_READINGS, READINGS
from replication.estimation.validation import Array

BLOCKS = range(len(STRUCTURES))


def block(structure: int, decoys: int, seed: int) -> dict[str, Any]:
    """Search all readings of one structure for Table I and for `decoys` random columns like each of its columns."""
    return asdict(search_block(READINGS, table_columns(decoys, seed), structure))


def table_columns(decoys: int, seed: int) -> dict[str, Column]:
    """The printed columns as ratios, with half a unit of the last printed place, and their decoys."""
    rng = np.random.default_rng(seed)
    return {
        "pmi": _column(PMI_READINGS, data.TABLE_PMI, decoys, rng),
        "apo": _column(APO_READINGS, data.TABLE_APO, decoys, rng),
    }


def merged(blocks: Sequence[dict[str, Any]]) -> BlockResult:
    """The whole search from the stored results of its blocks."""
    return merge([_restore(stored) for stored in blocks])


def _column(observers: tuple[str, ...], printed: tuple[str, ...], decoys: int, rng: np.random.Generator) -> Column:
    values: Array = np.array([float(text) for text in printed]) / 100
    half_widths: Array = np.array([0.5 * 10.0 ** -len(text.split(".")[1]) for text in printed]) / 100
    return Column(observers, values, half_widths, decoy_columns(values, decoys, rng))


def _restore(stored: dict[str, Any]) -> BlockResult:
    near = {
        kind: {name: Near(**{**entry, "values": tuple(entry["values"])}) for name, entry in stored[kind].items()}
        for kind in ("nearest", "joint")
    }
    return BlockResult(**{**stored, **near, "joint_decoys": tuple(stored["joint_decoys"])})
