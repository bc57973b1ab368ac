"""The data of a figure as they are written: the digits that are certain, and the same bytes on any processor.

Another processor rounds otherwise, so the last digits of a number move. No rounding of ours alone can hide that: some
number always lies at an edge. So data that lie there already are kept while the new ones agree with them.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from replication.audit.parts import FigureData

DIGITS = 10
"""Significant digits of a new number."""
RELATIVE, OF_LARGEST = 1e-6, 1e-7
"""How near to a number, and to the largest of its column: processors differ by 3.3e-7 and 5.6e-8 at most."""


def settled(fresh: FigureData, path: Path) -> FigureData:
    """The data of the CSV file at `path` if all of `fresh` agrees with them, else `fresh` in `DIGITS` digits."""
    kept = _read(path)
    if list(kept) == list(fresh.columns) and all(_agree(kept[name], fresh.columns[name]) for name in kept):
        return FigureData(columns=kept)
    return FigureData(columns={name: tuple(map(_rounded, column)) for name, column in fresh.columns.items()})


def _agree(kept: Sequence[float], fresh: Sequence[float]) -> bool:
    largest = max(map(abs, fresh), default=0.0)
    return len(kept) == len(fresh) and all(
        abs(old - new) <= RELATIVE * abs(new) + OF_LARGEST * largest for old, new in zip(kept, fresh, strict=True)
    )


def _rounded(number: float) -> float:
    return float(f"{float(number):.{DIGITS}g}") if math.isfinite(number) else number


def _read(path: Path) -> Mapping[str, tuple[float, ...]]:
    """The columns of a CSV file as `to_csv` writes it; none if it is not there or not such a file."""
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            names, *rows = csv.reader(stream)
        columns = zip(*rows, strict=True)
        return {
            name: tuple(float(cell) for cell in column if cell) for name, column in zip(names, columns, strict=True)
        }
    except (OSError, ValueError):
        return {}
