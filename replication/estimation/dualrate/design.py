"""A dual-rate output-feedback problem: plant (1), gains K of (8) and L of (3), fast period T and rate ratio M.

The input is held over the period T; the sensor delivers y = C x every M T. Time unit: seconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import control
import numpy as np
import scipy.linalg

from replication.errors import InvalidInputError
from replication.estimation.validation import (
    Array,
    as_matrix,
    positive_integer,
    positive_scalar,
    undetectable_mode,
)


@dataclass(frozen=True, eq=False)
class Plant:
    """x' = state x + input u, y = output x. Shapes: (n, n), (n, m), (p, n)."""

    state: Array
    input: Array
    output: Array

    @property
    def size(self) -> int:
        """Number of states n."""
        return len(self.state)


@dataclass(frozen=True, eq=False)
class DualRateDesign:
    """Plant model, feedback gain K (m, n), observer gain L (n, p), fast period T in s, slow period M T."""

    model: Plant
    feedback: Array
    injection: Array
    period: float
    ratio: int

    @property
    def slow_period(self) -> float:
        """The sampling period M T of the sensor, s."""
        return self.ratio * self.period


def make_plant(state: Any, input: Any, output: Any) -> Plant:
    """Check shapes and finiteness; raises InvalidInputError."""
    a = as_matrix("state matrix A", state)
    a = as_matrix("state matrix A", a, columns=a.shape[0])
    return Plant(
        a,
        as_matrix("input matrix B", input, rows=a.shape[0]),
        as_matrix("output matrix C", output, columns=a.shape[0]),
    )


def plant_of(system: control.StateSpace) -> Plant:
    """The plant of a continuous-time, strictly proper `control.StateSpace`; raises InvalidInputError."""
    if system.dt != 0:
        raise InvalidInputError(f"the plant must be continuous in time (dt = 0), got dt = {system.dt!r}")
    if np.any(system.D != 0):
        raise InvalidInputError(f"the plant must be strictly proper (D = 0), got D = {system.D.tolist()}")
    return make_plant(system.A, system.B, system.C)


def dual_rate_design(
    plant: control.StateSpace | Plant, *, feedback: Any, injection: Any, period: float, ratio: int
) -> DualRateDesign:
    """Check and assemble a dual-rate problem; u = K ζ, so that A + B K is the state-feedback loop.

    Raises InvalidInputError: K or L of wrong shape, period not positive, ratio not a positive integer, a pair that
    is not stabilisable or not detectable, or a mode that the sensor loses by sampling at M T.
    """
    model = plant if isinstance(plant, Plant) else plant_of(plant)
    inputs, outputs = model.input.shape[1], model.output.shape[0]
    design = DualRateDesign(
        model,
        as_matrix("feedback gain K", feedback, rows=inputs, columns=model.size),
        as_matrix("observer gain L", injection, rows=model.size, columns=outputs),
        positive_scalar("period T", period, unit="seconds"),
        positive_integer("rate ratio M", ratio),
    )
    _check_modes(design)
    return design


def _check_modes(design: DualRateDesign) -> None:
    model = design.model
    if (mode := undetectable_mode(model.state.T, model.input.T, discrete=False)) is not None:
        raise InvalidInputError(f"(A, B) is not stabilisable: no input moves the unstable mode {mode:.6g}")
    if (mode := undetectable_mode(model.state, model.output, discrete=False)) is not None:
        raise InvalidInputError(f"(A, C) is not detectable: the output does not see the unstable mode {mode:.6g}")
    sampled = scipy.linalg.expm(model.state * design.slow_period)
    if np.all(np.isfinite(sampled)) and (mode := undetectable_mode(sampled, model.output, discrete=True)) is not None:
        raise InvalidInputError(
            f"sampling every M T = {design.slow_period:g} s hides the unstable mode {mode:.6g} of exp(A M T) from "
            "the sensor; choose another period T or ratio M"
        )
