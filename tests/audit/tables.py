"""What was written, read back: the data of a figure from its CSV file, and numbers as they are typeset."""

from __future__ import annotations

import csv
import re
from pathlib import Path

_POWERS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")


def read_csv(path: Path) -> dict[str, tuple[float, ...]]:
    rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    return {name: tuple(float(cell) for cell in column if cell) for name, *column in zip(*rows, strict=True)}


def decimal(text: str) -> str:
    """A number as it is typeset, written as Python reads it."""
    powers = re.sub("(×?)10(?=[⁻⁰¹²³⁴⁵⁶⁷⁸⁹])", lambda found: "e" if found[1] else "1e", text)
    return powers.translate(_POWERS)


def number(text: str) -> float:
    """The number that a typeset text stands for."""
    return float(decimal(text))
