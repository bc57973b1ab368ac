"""Readers of what a driver hands over with each sample: values, time stamp, known input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.validation import Array, finite_vector


def as_time(name: str, value: Any) -> float:
    """A finite time, s; raises InvalidInputError."""
    return _finite(name, value, "time (s)")


def _finite(name: str, value: Any, kind: str) -> float:
    """A finite number; a driver hands over many, so that the check is a short one."""
    plain = value.item() if isinstance(value, (np.ndarray, np.generic)) and value.ndim == 0 else value
    if not isinstance(plain, (float, int)) or isinstance(plain, bool) or not isfinite(plain):
        raise InvalidInputError(f"{name} must be a finite {kind}, got {value!r}")
    return float(plain)


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
    sample = np.full(len(sensors), np.nan)
    for i, entry in enumerate(entries):
        if entry is not None:
            sample[i] = _finite(f"the sample of {sensors[i]}", entry, "number (None where the sensor did not measure)")
        elif complete:
            raise InvalidInputError(
                f"the sample of {sensors[i]} is missing: this estimator needs all sensors at once; where they measure "
                "apart, take a `StampedKalman`"
            )
    return sample
