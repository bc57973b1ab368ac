"""From floating-point numbers to short rationals, and from the rationals of a certificate to floating point."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, floor
from typing import Any

import numpy as np
import numpy.typing as npt

from replication.estimation.validation import Array


def rounded(number: float, bits: int) -> str:
    """The nearest multiple of 2^-bits."""
    return str(Fraction(round(Fraction(number) * 2**bits), 2**bits))


def rounded_up(number: float, bits: int) -> str:
    """The least multiple of 2^-bits that is not below `number`."""
    return str(Fraction(ceil(Fraction(number) * 2**bits), 2**bits))


def rounded_down(number: float, bits: int) -> str:
    """The largest multiple of 2^-bits that is not above `number`."""
    return str(Fraction(floor(Fraction(number) * 2**bits), 2**bits))


def rounded_array(values: npt.ArrayLike, bits: int) -> Any:
    """The nearest multiples of 2^-bits, as nested lists of strings in the shape of `values`; symmetry is kept."""
    array = np.asarray(values, dtype=float)
    return [rounded_array(part, bits) for part in array] if array.ndim else rounded(float(array), bits)


def as_floats(values: Any) -> Array:
    """Nested lists of rationals, as certificates hold them, in floating point."""
    if isinstance(values, str):
        return np.asarray(float(Fraction(values)))
    return np.array([as_floats(value) for value in values])


def decimals(values: Any) -> Any:
    """Numbers that are short decimals, as the rationals they are written as, in nested lists."""
    return str(Fraction(str(values))) if isinstance(values, (int, float)) else [decimals(value) for value in values]
