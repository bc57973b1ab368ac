"""Readers of what a driver hands over with each sample: values, time stamp, known input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.validation import Array, finite_vector


def as_time(name: str, value: Any) -> float:
    """A finite time, s; raises InvalidInputError."""
    if isinstance(value, (bool, np.bool_)):
        raise InvalidInputError(f"{name} must be a finite time (s), got {value!r}")
    try:
        return float(finite_vector(name, [value], 1)[0])
    except InvalidInputError:
        raise InvalidInputError(f"{name} must be a finite time (s), got {value!r}") from None


def as_input(value: Any, size: int) -> Array:
    """A known input (size,); a single number stands for a vector of one. Raises InvalidInputError."""
    return finite_vector("u", [value] if np.ndim(value) == 0 else value, size)


def as_sample(value: Any, sensors: Sequence[str], *, complete: bool) -> Array:
    """A sample (q,) with NaN where a sensor did not measure.

    complete: all sensors must have. Raises InvalidInputError for a sensor that is not known, or a number that is none.
    """
    if isinstance(value, Mapping):
        unknown = [name for name in value if name not in sensors]
        if unknown:
            raise InvalidInputError(f"no sensor {unknown[0]!r}; the sensors are {', '.join(sensors)}")
        entries = [value.get(name) for name in sensors]
    else:
        entries = list(np.atleast_1d(np.asarray(value, dtype=object)).ravel())
    if len(entries) != len(sensors):
        raise InvalidInputError(
            f"y must have {len(sensors)} entries (None where a sensor did not measure), or name its sensors, got "
            f"{value!r}"
        )
    for name, entry in zip(sensors, entries, strict=True):
        if entry is not None:
            finite_vector(f"the sample of {name}", [entry], 1)
        elif complete:
            raise InvalidInputError(f"the sample of {name} is missing: held noise needs all sensors at once")
    return np.array([np.nan if entry is None else float(entry) for entry in entries])
