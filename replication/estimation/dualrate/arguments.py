"""Checks of arguments that only this room has: named choices and grids; each failure is an `InvalidInputError`."""

from __future__ import annotations

from enum import StrEnum
from typing import Any, TypeVar

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.validation import Array, as_matrix

Choice = TypeVar("Choice", bound=StrEnum)


def one_of(kind: type[Choice], value: Any) -> Choice:
    """The member of `kind` that `value` is or names; raises InvalidInputError that lists them."""
    try:
        return kind(value)
    except ValueError:
        known = ", ".join(repr(str(member)) for member in kind)
        raise InvalidInputError(f"{kind.__name__.lower()} must be one of {known}, got {value!r}") from None


def increasing_grid(name: str, values: Any) -> Array:
    """`values` as at least two positive, increasing numbers; raises InvalidInputError."""
    grid: Array = as_matrix(name, [values])[0]
    if grid.size < 2 or grid[0] <= 0 or np.any(np.diff(grid) <= 0):
        raise InvalidInputError(f"the {name} must be an increasing sequence of positive numbers, at least two")
    return grid


def finite_vector(name: str, value: Any, size: int) -> Array:
    """`value` as `size` finite real numbers; raises InvalidInputError."""
    try:
        return np.array(as_matrix(name, [value], columns=size)[0])
    except InvalidInputError as error:
        raise InvalidInputError(f"{name} must be {size} finite real numbers, got {value!r}") from error
