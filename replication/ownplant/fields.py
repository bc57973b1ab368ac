"""What a plant file may hold for each method: names, kinds and shapes, as data.

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


def _matrix(name: str, rows: str, columns: str, meaning: str, *, required: bool = True) -> Field:
    return Field(name, Kind.MATRIX, (rows, columns), required, meaning)


FIELDS: dict[str, tuple[Field, ...]] = {
    "multirate": (
        _matrix("A", "n", "n", "x+ = A x + B_u u + B_d d"),
        _matrix("B_d", "n", "m", "process noise"),
        _matrix("C", "q", "n", "sensors, y = C x + D w"),
        _matrix("D", "q", "w", "sensor noise"),
        _matrix("W", "z", "n", "weight of the error (identity)", required=False),
        _matrix("B_u", "n", "u", "known inputs (none)", required=False),
        Field("dt", Kind.TIME, (), required=False, meaning="base period in s (1)"),
    ),
    "nonuniform": (
        _matrix("A", "n", "n", "x' = A x + B w"),
        _matrix("B", "n", "m", "disturbance, held between samples"),
        _matrix("C", "q", "n", "sensors, y = C x + D w"),
        _matrix("D", "q", "m", "sensor noise"),
        _matrix("L", "z", "n", "what is estimated, z = L x"),
    ),
    "dualrate": (
        _matrix("A", "n", "n", "x' = A x + B u"),
        _matrix("B", "n", "u", "input, held over the fast period"),
        _matrix("C", "q", "n", "sensor, y = C x"),
        _matrix("K", "u", "n", "feedback u = K x^ (linear-quadratic)", required=False),
        _matrix("L", "n", "q", "observer gain (Kalman)", required=False),
    ),
    "delay": (
        _matrix("A0", "n", "n", "x' = A0 x + sum of A[i] x(t - delays[i]) + B w"),
        Field("A", Kind.MATRICES, ("k", "n", "n"), meaning="one matrix for each delay"),
        Field("delays", Kind.TIMES, ("k",), meaning="increasing, in s"),
        _matrix("B", "n", "m", "disturbance"),
        _matrix("C10", "z", "n", "what is estimated, z = C10 x + sum of C1[i] x(t - delays[i])"),
        Field("C1", Kind.MATRICES, ("k", "z", "n"), required=False, meaning="one matrix for each delay (zero)"),
        _matrix("C2", "q", "n", "sensors, y = C2 x"),
    ),
}

NAMES = {"states": "n", "inputs": "u", "measurements": "q", "outputs": "z"}
"""Lists of the table [names], and the letter that says how many there are."""


def described(method: str) -> str:
    """The keys of a method's plant file, one line each, for the help of the command line."""
    width = max(len(field.name) for field in FIELDS[method])
    lines = []
    for field in FIELDS[method]:
        shape = f" ({', '.join(field.shape)})" if field.shape else ""
        lines.append(f"  {field.name:<{width}}{shape}  {field.meaning}{'' if field.required else ', optional'}")
    return "\n".join(lines)
