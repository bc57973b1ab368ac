"""A dual-rate output-feedback problem: plant (1), gains K of (8) and L of (3), fast period T and rate ratio M.

The input is held over the period T; the sensor delivers y = C x every M T. Time unit: seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.api.plants import LinearPlant, Signals, is_statespace, parts_of
from replication.estimation.linear.periodic import balanced_units
from replication.estimation.validation import (
    Array,
    ComplexArray,
    StateSpace,
    as_matrix,
    positive_integer,
    positive_scalar,
    undetectable_mode,
)

MAX_RATIO = 100_000
"""Fast instants in a slow period: the loop keeps matrices for each of them."""


@dataclass(frozen=True, eq=False)
class Plant(LinearPlant):
    """x' = A x + B_u u, y = C x.

    Attributes
    ----------
    A : array (n, n)
        In 1/s.
    B_u : array (n, m)
        Effect of the inputs.
    C : array (p, n)
        Sensors.
    """

    SHAPES: ClassVar[Mapping[str, str]] = {"A": "nn", "B_u": "nm", "C": "pn"}
    NEEDED: ClassVar[Mapping[str, str]] = {}

    A: Array
    B_u: Array
    C: Array

    def __post_init__(self) -> None:
        """Raise InvalidInputError: an entry is not finite, shapes do not fit, or there is no state, input or output."""
        sizes = self.check(A="state matrix A", B_u="input matrix B", C="output matrix C")
        if 0 in sizes.values():
            n, m, p = sizes.values()
            raise InvalidInputError(f"a plant needs a state, an input and an output, got {n}, {m} and {p} of them")


@dataclass(frozen=True, eq=False)
class DualRateDesign:
    """Plant model, feedback gain K (m, n), observer gain L (n, p), fast period T in s, slow period M T.

    Shapes and rates are checked whenever one is made, by `dataclasses.replace` too; modes by `dual_rate_design` only.
    """

    model: Plant
    feedback: Array
    injection: Array
    period: float
    ratio: int

    def __post_init__(self) -> None:
        """Raise InvalidInputError: K or L of wrong shape, T not positive, M not a positive integer or above
        MAX_RATIO."""
        model = as_plant(self.model)
        n, inputs, outputs = model.order, model.B_u.shape[1], model.C.shape[0]
        ratio = positive_integer("rate ratio M", self.ratio)
        if ratio > MAX_RATIO:
            raise InvalidInputError(
                f"rate ratio M must be at most {MAX_RATIO}, got {ratio}; choose a longer fast period T"
            )
        checked = {
            "model": model,
            "feedback": as_matrix("feedback gain K", self.feedback, rows=inputs, columns=n),
            "injection": as_matrix("observer gain L", self.injection, rows=n, columns=outputs),
            "period": positive_scalar("period T", self.period, unit="seconds"),
            "ratio": ratio,
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def slow_period(self) -> float:
        """The sampling period M T of the sensor, s."""
        return self.ratio * self.period


def make_plant(A: Any, B: Any, C: Any) -> Plant:
    """A plant of arrays: x' = A x + B u, y = C x.

    Parameters
    ----------
    A : array (n, n)
        In 1/s.
    B : array (n, m)
        Effect of the inputs, which are all known.
    C : array (p, n)
        Sensors.

    Returns
    -------
    Plant
        The matrices, checked.

    Raises
    ------
    InvalidInputError
        An entry is not finite, the shapes do not fit, or there is no state, input or output.
    """
    return Plant(A, B, C)


def as_plant(system: StateSpace | Plant) -> Plant:
    """A `Plant`, or that of a continuous-time, strictly proper `control.StateSpace`; raises InvalidInputError."""
    if isinstance(system, Plant):
        return system
    if not is_statespace(system):
        raise InvalidInputError(
            f"a plant must be a control.StateSpace or made by make_plant(A, B, C), got {type(system).__name__}"
        )
    parts = parts_of(system, continuous=True, disturbances=())
    if np.any(parts.D_u != 0):
        raise InvalidInputError(f"the plant must be strictly proper (D = 0), got D = {parts.D_u.tolist()}")
    return Plant(parts.A, parts.B_u, parts.C)


def signals_of(plant: StateSpace | Plant, period: float) -> Signals:
    """Names of the signals of a plant that is sampled every `period` seconds; what is estimated are its states."""
    if isinstance(plant, Plant):
        return Signals.numbered(plant.order, plant.B_u.shape[1], len(plant.C), dt=period)
    states = tuple(plant.state_labels)
    return Signals(states, tuple(plant.input_labels), tuple(plant.output_labels), states, period)


def row_of_output(plant: Plant, output: int, name: str = "output") -> int:
    """`output` if the plant has an output of that number, counted from 0; raises InvalidInputError that names it."""
    if not isinstance(output, (int, np.integer)) or output not in range(len(plant.C)):
        raise InvalidInputError(f"{name} must be a number from 0 to {len(plant.C) - 1}, got {output!r}")
    return output


def dual_rate_design(
    plant: StateSpace | Plant,
    *,
    feedback: Any,
    injection: Any,
    period: float,
    ratio: int,
    moved: Plant | None = None,
) -> DualRateDesign:
    """Check and assemble a dual-rate problem; u = K ζ, so that A + B K is the state-feedback loop.

    moved: the plant without constant loads, which no input has to move.
    Raises InvalidInputError: as `DualRateDesign`; a pair that is not stabilisable or not detectable; an unstable mode
    that the input loses by holding over T, or the sensor by sampling at M T.
    """
    design = DualRateDesign(as_plant(plant), feedback, injection, period, ratio)
    model = balanced(design.model)
    A, C = model.A, model.C
    driven = model if moved is None else balanced(moved)
    if (mode := undetectable_mode(driven.A.T, driven.B_u.T, discrete=False)) is not None:
        raise InvalidInputError(f"(A, B) is not stabilisable: no input moves the unstable mode {mode:.6g}")
    if (mode := undetectable_mode(A, C, discrete=False)) is not None:
        raise InvalidInputError(f"(A, C) is not detectable: the output does not see the unstable mode {mode:.6g}")
    advice = "choose another period T or ratio M"
    if (mode := folded_mode(driven.A.T, driven.B_u.T, design.period)) is not None:
        raise InvalidInputError(
            f"an input held over T = {design.period:g} s loses the unstable mode {mode:.6g} of A; {advice}"
        )
    if (mode := folded_mode(A, C, design.slow_period)) is not None:
        raise InvalidInputError(
            f"sampling every M T = {design.slow_period:g} s hides the unstable mode {mode:.6g} of A from the sensor; "
            f"{advice}"
        )
    return design


def units_of(plant: Plant) -> Array:
    """Units (n,) of the states in which A, B and C are balanced; what nothing moves, as a load, counts as disturbed."""
    A, B = plant.A, plant.B_u
    still = ~np.any(np.hstack([A - np.diag(np.diag(A)), B]), axis=1)
    return balanced_units(A, np.hstack([B, np.eye(len(A))[:, still]]), plant.C)


def balanced(plant: Plant) -> Plant:
    """The plant with x = t x~ for these units t."""
    t = units_of(plant)
    return Plant(plant.A * t / t[:, None], plant.B_u / t[:, None], plant.C * t)


def folded_mode(state: Array, output: Array, time: float, *, tolerance: float = 1e-9) -> complex | None:
    """An unstable eigenvalue λ of `state` that `output` sees in continuous time but not when sampled, or None.

    Sampling maps all eigenvalues λ + 2πjk/time, k whole, to one; `output` must tell their eigenvectors apart. This
    looks at A and not at exp(A time), whose entries lose the slow modes when others grow fast.
    Shapes: state (n, n), output (p, n).
    """
    state, (units, _) = scipy.linalg.matrix_balance(state, permute=False, separate=True)
    output = output * units
    scale = 1.0 + float(np.linalg.norm(state, 2))
    eigenvalues = np.linalg.eigvals(state)
    for eigenvalue in eigenvalues[eigenvalues.real >= -tolerance]:
        turns = (eigenvalues - eigenvalue) * time / (2j * np.pi)
        whole = np.rint(turns.real)
        # The rounding of an eigenvalue is relative to the whole spectrum.
        alike = np.abs(turns - whole) <= tolerance * (1.0 + scale * time)
        if not np.any(alike & (whole != 0)):
            continue
        folded = [eigenvalues[alike & (whole == turn)][0] for turn in np.unique(whole[alike])]
        kernel = np.hstack([_eigenvectors(state, value, tolerance * scale) for value in folded])
        spectrum = np.linalg.svd(output @ kernel, compute_uv=False)
        if kernel.shape[1] > len(output) or spectrum[-1] <= tolerance * np.linalg.norm(output, 2):
            return complex(eigenvalue)
    return None


def _eigenvectors(state: Array, eigenvalue: complex, tolerance: float) -> ComplexArray:
    """An orthonormal basis of the eigenvectors; at least one, however the eigenvalue was rounded."""
    _, sizes, rows = np.linalg.svd(state - eigenvalue * np.eye(len(state)))
    count = max(1, int(np.sum(sizes <= tolerance)))
    return np.asarray(rows[-count:].conj().T)
