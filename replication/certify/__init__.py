"""Makers of certificates: floating-point solutions, rounded to short rationals with room to spare; never trusted.

A maker is called with a theorem, all fields of a certificate but two, and returns these two, `bound` and `witness`;
makers of dual-rate loops are called with the closed loop, which a reading of the paper decides. `own` makes the whole
certificate of a design for a plant of one's own.

Here is what all of them share: from floating-point numbers to short rationals, and back to floating point.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from math import ceil, floor
from typing import Any

import numpy as np
import numpy.typing as npt
from flint import fmpq, fmpq_mat

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import Options, solve_modelled
from replication.estimation.validation import Array
from replication.verify.reading import written

ACCURATE: Options = {"tol_gap_abs": 1e-9, "tol_gap_rel": 1e-9, "tol_feas": 1e-9}
"""Tolerances of Clarabel for a point that is rounded afterwards."""


def rounded(number: float | str | fmpq, bits: int, to: Callable[[Fraction], int] = round) -> str:
    """The nearest multiple of 2^-bits, or that which `to` gives."""
    return str(Fraction(to(Fraction(str(number) if isinstance(number, fmpq) else number) * 2**bits), 2**bits))


rounded_up, rounded_down = partial(rounded, to=ceil), partial(rounded, to=floor)
"""The least multiple that is not below a number, and the largest that is not above it."""


def rounded_array(values: npt.ArrayLike, bits: int) -> Any:
    """The nearest multiples of 2^-bits, as nested lists of strings in the shape of `values`; symmetry is kept."""
    array = np.asarray(values, dtype=float)
    return [rounded_array(part, bits) for part in array] if array.ndim else rounded(float(array), bits)


def bracket(lower: float, upper: float, margin: float, bits: int) -> dict[str, str]:
    """Both bounds, a relative `margin` further apart: room for what rounding costs."""
    return {"lower": rounded_down(lower * (1 - margin), bits), "upper": rounded_up(upper * (1 + margin), bits)}


def stepwise(
    least: float, steps: Sequence[float], bits: int, witness: Callable[[str], dict[str, Any]]
) -> dict[str, Any]:
    """Bound and witness of the level nearest above `least` for which `witness` finds one; steps: relative distances.

    Raises InfeasibleError if there is no room for rounding up to the last step.
    """
    for step in steps:
        level = rounded_up(least * (1.0 + step), bits)
        try:
            return {"bound": {"upper": level}, "witness": witness(level)}
        except (InfeasibleError, SolverError):
            continue
    raise InfeasibleError(f"no room for rounding up to {steps[-1]:g} above {least!r}; add a larger step")


def modelled(problem: Any) -> str:
    """Solve a problem of cvxpy. How accurate Clarabel says it is does not matter: the margin is measured afterwards."""
    return solve_modelled(problem, ACCURATE)


def rational(number: str | float) -> fmpq:
    """A number of a certificate, or a floating-point number, as it stands."""
    return fmpq(*Fraction(number).as_integer_ratio())


def exact(values: Any) -> fmpq_mat:
    """A matrix of a certificate in exact numbers."""
    return fmpq_mat([[rational(entry) for entry in row] for row in values])


def floats(matrix: fmpq_mat) -> Array:
    """An exact matrix in floating point, each number rounded once."""
    return as_floats(written(matrix))


def as_floats(values: Any) -> Array:
    """Nested lists of rationals, as certificates hold them, in floating point."""
    if isinstance(values, str):
        return np.asarray(float(Fraction(values)))
    return np.array([as_floats(value) for value in values])


def rationals(values: Any) -> Any:
    """Floats as the rationals that they are, in nested lists."""
    return [rationals(value) for value in values] if np.ndim(values) else str(Fraction(float(values)))


def decimals(values: Any) -> Any:
    """Numbers that are short decimals, as the rationals they are written as, in nested lists."""
    return str(Fraction(str(values))) if isinstance(values, (int, float)) else [decimals(value) for value in values]
