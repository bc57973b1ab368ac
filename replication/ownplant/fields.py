"""Keys of a plant file and options of the command line, as data: names, kinds and shapes, and how words are read.

The letters of a shape stand for numbers that must agree within a file: n states, u known inputs, q sensors, and so on.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self, TypeVar

T = TypeVar("T")
LARGEST = 1e60
"""Of an entry; the methods take powers of entries, which must stay in the range of floating point."""


class Kind(StrEnum):
    """How a value is written in the file; the text is the advice."""

    TIME = "a positive number, such as 0.1"
    TIMES = "a list of positive numbers, such as [0.1, 0.2]"
    AGES = "a list of numbers from 0 on, such as [0, 0.15]"
    MATRIX = "a list of rows, such as [[1, 0], [0, 1]]"
    WORD = 'a word in quotes, such as "h2"'
    COVARIANCE = "a list of rows, such as [[1, 0], [0, 1]], or of variances, such as [1, 1]"
    MATRICES = "a list of matrices, such as [[[1, 0], [0, 1]]]"


@dataclass(frozen=True)
class Field:
    """One key of a plant file; shape: its letters, (rows, columns) for a matrix, with the count first for several.

    instead: a key that may stand in the place of a required one.
    """

    name: str
    kind: Kind
    shape: tuple[str, ...] = ()
    required: bool = True
    meaning: str = ""
    instead: str = ""

    @classmethod
    def of(cls, name: str, *, shape: str = "", kind: str = "", optional: bool = False, **attributes: str) -> Self:
        """From a row of `methods.toml`; a matrix, or several if there are three letters, unless it says otherwise."""
        letters = tuple(shape.split())
        kind = kind or ("matrices" if len(letters) == 3 else "matrix")
        return cls(name, Kind[kind.upper()], letters, not optional, **attributes)

    def described(self) -> str:
        """Shape and meaning, for the help of the command line."""
        shape = f" ({', '.join(self.shape)})" if self.shape else ""
        return f"{shape}  {self.meaning}{'' if self.required else ', optional'}"


NAMES = {"states": "n", "inputs": "u", "measurements": "q", "outputs": "z"}
"""Lists of the table [names], and the letter that says how many there are."""


@dataclass(frozen=True)
class Option:
    """`--name METAVAR`, passed on to the design under its name; read: its value from the word that was given."""

    name: str
    read: Callable[[str], Any]
    help: str
    metavar: str | None = None
    required: bool = False
    choices: tuple[str, ...] | None = None

    @classmethod
    def of(
        cls, name: str, *, read: str = "word", most: int = 0, several: bool = False, two: bool = False, **settings: Any
    ) -> Self:
        """From a row of `methods.toml`."""
        reader = up_to(most) if most else READERS[read]
        choices = tuple(settings.pop("choices", ())) or None
        return cls(name, pair(reader) if two else listed(reader) if several else reader, choices=choices, **settings)

    def add(self, parser: argparse.ArgumentParser) -> None:
        """Add the option to a parser."""
        settings = {key: value for key, value in vars(self).items() if key not in ("name", "read")}
        parser.add_argument(f"--{self.name}", type=self.read, **settings)


def listed(reader: Callable[[str], T]) -> Callable[[str], list[T]]:
    """Reads values that commas separate."""
    return lambda text: [reader(part.strip()) for part in text.split(",")]


def pair(reader: Callable[[str], T]) -> Callable[[str], list[T]]:
    """Reads exactly two values."""

    def ends(text: str) -> list[T]:
        values = listed(reader)(text)
        if len(values) != 2:
            raise argparse.ArgumentTypeError(f"{text!r} must be two numbers, such as 0.1,0.3")
        return values

    return ends


def offsets(text: str) -> list[int] | str:
    """A list of whole numbers from zero on, or the word `best`."""
    return text if text == "best" else listed(natural)(text)


def age(text: str) -> float:
    """A number from zero on."""
    return 0.0 if text.strip("0.") == "" and "0" in text else positive(text)


def probability(text: str) -> float:
    """A number from zero to one."""
    if age(text) > 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a probability from 0 to 1")
    return age(text)


def natural(text: str) -> int:
    """A whole number from zero on."""
    if not text.isascii() or not text.isdecimal() or len(text) > 9:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 on")
    return int(text)


def whole(text: str) -> int:
    """A whole number from one on."""
    if natural(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 1")
    return int(text)


def up_to(most: int) -> Callable[[str], int]:
    """Whole numbers from one to `most`, beyond which a design takes hours."""

    def read(text: str) -> int:
        if whole(text) > most:
            raise argparse.ArgumentTypeError(f"{text!r} is more than {most}; the library takes what the memory allows")
        return int(text)

    return read


def positive(text: str) -> float:
    """A positive number whose powers stay in the range of floating point."""
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    if not 1 / LARGEST <= number <= LARGEST:
        raise argparse.ArgumentTypeError(f"{text!r} is not from {1 / LARGEST:g} to {LARGEST:g}; choose other units")
    return number


READERS: dict[str, Callable[[str], Any]] = {
    "word": str, "offsets": offsets, "age": age, "probability": probability, "natural": natural, "whole": whole,
    "positive": positive,
}  # fmt: skip
"""Of one value, by the name that `methods.toml` has for them."""
