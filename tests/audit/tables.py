"""Tables of cases; and what was written, read back: the data of a figure, and numbers as they are typeset."""

import csv
import re
import tomllib
from pathlib import Path
from typing import Any

_POWERS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")


_CASES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def rows(name: str) -> list[Any]:
    """The cases of this name in tables.toml, lists as tuples, and None for an empty table."""
    return list(tupled(_CASES[name]))


def tupled(value: Any) -> Any:
    """The same with tuples for lists, at any depth."""
    if isinstance(value, list):
        return tuple(map(tupled, value))
    return None if value == {} else value


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
