"""The data of a figure, read back from the CSV file that was written of it."""

from __future__ import annotations

import csv
from pathlib import Path


def read_csv(path: Path) -> dict[str, tuple[float, ...]]:
    rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    return {name: tuple(float(cell) for cell in column if cell) for name, *column in zip(*rows, strict=True)}
