"""Certificates as they come from a file: JSON without floats, every number exact, every field known."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

Matrix = list[list[Any]]
"""Rows of entries that add and multiply: rationals, intervals, complex numbers of these."""

LARGEST_FILE = 2_000_000
LONGEST = 1_000
"""Digits of a numerator or denominator, and of the least common denominator of a matrix."""
MOST = 40_000
"""Entries of a matrix or a list."""
PLAIN = re.compile(r"-?(?:0|[1-9]\d*)(?:/[1-9]\d*)?", re.ASCII)
WORD = re.compile(r"[\w.-]{1,80}", re.ASCII)


class Unproved(Exception):
    """Nothing is proved; the message says why."""


class NoCheck(Unproved):
    """The certificate is not checked here: there is no check of its statement, or it asks for too much work."""


def need(condition: bool, why: str) -> None:
    """Raise Unproved with the reason unless the condition holds."""
    if not condition:
        raise Unproved(why)


def small(condition: bool, why: str) -> None:
    """Raise NoCheck unless the condition holds."""
    if not condition:
        raise NoCheck(why)


@dataclass(frozen=True)
class Proof:
    """What was proved, in exact numbers: closed bounds, the answer to a question, bounds of each of a list."""

    lower: Fraction | None = None
    upper: Fraction | None = None
    holds: bool | None = None
    items: tuple[tuple[Fraction, Fraction], ...] = ()


@dataclass(frozen=True)
class Certificate:
    """One certificate: its fields as they stand, and what it bounds."""

    paper: str | None
    name: str
    statement: str
    plant: Mapping[str, Any]
    parameters: Mapping[str, Any]
    bound: Mapping[str, Fraction]
    witness: Mapping[str, Any]

    def stated(self, *sides: str) -> tuple[Fraction, ...]:
        """The bounds of exactly these sides."""
        need(set(self.bound) == set(sides), f"the bound must have {sides or 'nothing'}, not {sorted(self.bound)}")
        return tuple(self.bound[side] for side in sides)


def load(path: Path) -> Any:
    """The JSON value of a file."""
    need(path.is_file(), "it is no regular file")
    need(path.stat().st_size <= LARGEST_FILE, f"it has more than {LARGEST_FILE} bytes")
    return decoded(path.read_bytes())


def decoded(content: bytes) -> Any:
    """A JSON value without floats, long integers, and keys that stand twice."""

    def no_float(text: str) -> Any:
        raise Unproved(f"{text:.30} is a number that is not exact")

    def small(text: str) -> int:
        need(len(text) <= 9, f"the integer {text:.20} is too long")
        return int(text)

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        need(len({key for key, _ in pairs}) == len(pairs), "a key stands twice in one object")
        return dict(pairs)

    try:
        return json.loads(
            content.decode(), object_pairs_hook=unique, parse_int=small, parse_float=no_float, parse_constant=no_float
        )
    except (ValueError, RecursionError) as error:
        raise Unproved(f"it is no JSON: {error}") from None


def take(value: Any, where: str, *names: str) -> tuple[Any, ...]:
    """The values of an object that has these fields and no others."""
    need(isinstance(value, dict), f"{where} is no object")
    need(set(value) == set(names), f"{where} has the fields {sorted(value)}, not {sorted(names)}")
    return tuple(value[name] for name in names)


def several(value: Any, where: str, reader: Callable[[Any, str], Any], number: int | None = None) -> list[Any]:
    """A list, read entry by entry."""
    need(isinstance(value, list) and len(value) <= MOST, f"{where} is no list, or too long")
    need(number is None or len(value) == number, f"{where} has {len(value)} entries, not {number}")
    return [reader(entry, f"{where}[{i}]") for i, entry in enumerate(value)]


def word(value: Any, where: str) -> str:
    """A string."""
    need(isinstance(value, str), f"{where} is no string")
    return str(value)


def one_of(value: Any, where: str, *choices: str) -> str:
    """One of these strings."""
    need(isinstance(value, str) and value in choices, f"{where} is none of {', '.join(choices)}")
    return str(value)


def count(value: Any, where: str, least: int = 0) -> int:
    """A small integer."""
    need(type(value) is int and value >= least, f"{where} is no integer of at least {least}")
    return int(value)


def number(value: Any, where: str) -> Fraction:
    """A rational, written as a string in plain form."""
    need(isinstance(value, str) and PLAIN.fullmatch(value) is not None, f"{where} is no rational: {value!r:.40}")
    need(all(len(part.lstrip("-")) <= LONGEST for part in value.split("/")), f"{where} has too many digits")
    return Fraction(value)


def positive(value: Any, where: str) -> Fraction:
    """A rational above zero."""
    found = number(value, where)
    need(found > 0, f"{where} is not positive")
    return found


def matrix(value: Any, where: str, rows: int | None = None, columns: int | None = None) -> Matrix:
    """A matrix of rationals, of this shape if one is given."""
    found = several(value, where, lambda row, at: several(row, at, number), rows)
    width = len(found[0]) if found else 0
    need(width > 0 and all(len(row) == width for row in found), f"{where} is empty or has rows of different lengths")
    need(columns is None or width == columns, f"{where} has {width} columns, not {columns}")
    need(len(found) * width <= MOST, f"{where} has too many entries")
    return found


def square(value: Any, where: str, size: int | None = None) -> Matrix:
    """A square matrix."""
    found = matrix(value, where, size)
    need(len(found) == len(found[0]), f"{where} is not square")
    return found


def symmetric(value: Any, where: str, size: int | None = None) -> Matrix:
    """A symmetric matrix."""
    found = square(value, where, size)
    need(found == [list(column) for column in zip(*found, strict=True)], f"{where} is not symmetric")
    return found
