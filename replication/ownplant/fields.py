"""The keys of a plant file: names, kinds and shapes, as data.

The letters of a shape stand for numbers that must agree within a file: n states, u known inputs, q sensors, and so on.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """How a value is written in the file; the text is the advice."""

    TIME = "a positive number, such as 0.1"
    TIMES = "a list of positive numbers, such as [0.1, 0.2]"
    MATRIX = "a list of rows, such as [[1, 0], [0, 1]]"
    MATRICES = "a list of matrices, such as [[[1, 0], [0, 1]]]"


@dataclass(frozen=True)
class Field:
    """One key of a plant file; shape: its letters, (rows, columns) for a matrix, with the count first for several."""

    name: str
    kind: Kind
    shape: tuple[str, ...] = ()
    required: bool = True
    meaning: str = ""

    def described(self) -> str:
        """Shape and meaning, for the help of the command line."""
        shape = f" ({', '.join(self.shape)})" if self.shape else ""
        return f"{shape}  {self.meaning}{'' if self.required else ', optional'}"


def matrix(name: str, rows: str, columns: str, meaning: str, *, required: bool = True) -> Field:
    """The key of one matrix."""
    return Field(name, Kind.MATRIX, (rows, columns), required, meaning)


NAMES = {"states": "n", "inputs": "u", "measurements": "q", "outputs": "z"}
"""Lists of the table [names], and the letter that says how many there are."""
