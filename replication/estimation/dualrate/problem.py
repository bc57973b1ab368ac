"""A dual-rate output-feedback problem: plant (1), gains K of (8) and L of (3), fast period T and rate ratio M.

The input is held over the period T; the sensor delivers y = C x every M T. Time unit: seconds.

A state that no input moves and that stands still by itself, as a weight or the sag of a battery, is a load b = F x: a
model of what acts on the plant, which feedback need not stabilise. With x = J x_s + V b, x_s = E x,

    x_s' = A_s x_s + A_b b + B_s u,    and at rest  x = X (b, r), u = U (b, r)

where the tracked outputs C_t x stand at the set-points r. Feedback acts on what x and u lack of that: this is integral
action, as the observer estimates b. Source: Francis and Wonham, The internal model principle (1976), for constants.
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
    finite_vector,
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


STILL, REACHED, ROUNDS = 1e-12, 1e-9, 8
"""Relative size of what moves a load, and of what is missing at rest, that is rounding; of finding units."""


@dataclass(frozen=True, eq=False)
class Steady:
    """A plant apart from its loads, and where it rests.

    load: F (b, n). kept: E (n - b, n). back: J (n, n - b). inner: A_s, B_s, C J. states: X (n, b + t).
    inputs: U (m, b + t). tracked: rows of C. asked: whether there are set-points.
    """

    load: Array
    kept: Array
    back: Array
    inner: Plant
    states: Array
    inputs: Array
    tracked: tuple[int, ...]
    asked: bool

    @property
    def loads(self) -> int:
        """Number of loads b."""
        return len(self.load)

    @property
    def deviation(self) -> Array:
        """E - E X F (n - b, n): x_s less where the loads hold it."""
        return np.asarray(self.kept - self.kept @ self.states[:, : self.loads] @ self.load)

    @property
    def references(self) -> Array:
        """X and U for the set-points alone (n + m, t); no columns unless they are asked for."""
        both = np.vstack([self.states, self.inputs])
        return both[:, self.loads :] if self.asked else both[:, :0]

    def feedback(self, inner: Array) -> Array:
        """K (m, n) of a feedback of x_s (m, n - b): u = inner (x_s - E X b) + U b."""
        return np.asarray(inner @ self.deviation + self.inputs[:, : self.loads] @ self.load)

    def ahead(self, feedback: Array) -> Array:
        """N (m, t) of u = K x^ + N r."""
        n = len(self.states)
        return np.asarray(self.references[n:] - feedback @ self.references[:n])


def steady_of(plant: Plant, tracked: Any = None) -> Steady | None:
    """The loads of a plant and where it rests; None without loads and set-points.

    tracked: outputs that are held at set-points, all of them unless given. Raises InvalidInputError if there is no such
    output, or no input that holds them.
    """
    load, fixed = _loads(plant)
    if not len(load) and tracked is None:
        return None
    count, n, m = len(plant.C), plant.order, plant.B_u.shape[1]
    outputs = range(count) if tracked is None else [tracked] if np.ndim(tracked) == 0 else list(tracked)
    rows = tuple(row_of_output(plant, output, "tracked") for output in outputs)
    if len(set(rows)) != len(rows) or not 0 < len(rows) <= m:
        raise InvalidInputError(
            f"{m} inputs hold at most as many outputs at rest, each named once, got {list(rows)}: choose `tracked`"
        )
    moving = np.setdiff1d(np.arange(n), fixed)
    kept, back, carried = np.eye(n)[moving], np.zeros((n, n - len(load))), np.eye(n)[:, fixed]
    back[moving] = np.eye(len(moving))
    back[fixed] = -load[:, moving]
    inner = Plant(kept @ plant.A @ back, kept @ plant.B_u, plant.C @ back)
    C, at = plant.C[list(rows)], len(moving)
    equations = np.block([[inner.A, inner.B_u], [C @ back, np.zeros((len(rows), m))]])
    aims = np.zeros((len(equations), len(load) + len(rows)))
    aims[:at, : len(load)], aims[at:, : len(load)] = -kept @ plant.A @ carried, -C @ carried
    aims[at:, len(load) :] = np.eye(len(rows))
    rest = solved(equations, aims)
    if rest is None:
        raise InvalidInputError(
            f"no constant input holds the outputs {list(rows)} at rest under loads and set-points: the plant has a "
            "zero at s = 0 from the inputs to them, or a load that the inputs do not reach; track others"
        )
    states = back @ rest[:at]
    states[:, : len(load)] += carried
    return Steady(load, kept, back, inner, states, rest[at:], rows, tracked is not None)


def wanted(setpoint: Any, count: int) -> Array:
    """r (t,), zero unless given; raises InvalidInputError."""
    if setpoint is not None and not count:
        raise InvalidInputError("the design follows no set-points: name the outputs that do, tracked=[..], in `design`")
    return np.zeros(count) if setpoint is None else finite_vector("setpoint", setpoint, count)


def _loads(plant: Plant) -> tuple[Array, Array]:
    """F (b, n) with F A = 0 and F B = 0, and the states of which it is the unit matrix."""
    n = plant.order
    units = units_of(plant)
    moved = np.hstack([plant.A * units, plant.B_u]) / units[:, None]
    sizes = np.linalg.norm(moved, axis=0)  # columns have units of their own
    moved = moved[:, sizes > 0.0] / sizes[sizes > 0.0]
    moved /= max(float(np.linalg.norm(moved)), np.finfo(float).tiny)
    left, values, _ = np.linalg.svd(moved)
    kernel = left[:, np.count_nonzero(values > STILL) :].T / units
    if not len(kernel):
        return np.zeros((0, n)), np.zeros(0, dtype=int)
    fixed = np.sort(scipy.linalg.qr(kernel * units, pivoting=True)[2][: len(kernel)])
    load = np.linalg.solve(kernel[:, fixed], kernel)
    return np.where(np.abs(load) * units > STILL * np.abs(load * units).max(axis=1, keepdims=True), load, 0.0), fixed


def solved(matrix: Array, aims: Array) -> Array | None:
    """The least solution in units in which rows and columns have unit length, or None."""
    rows, columns = np.ones((len(matrix), 1)), np.ones(matrix.shape[1])
    for _ in range(ROUNDS):
        sizes = np.linalg.norm(matrix / rows / columns, axis=1, keepdims=True)
        rows *= np.where(sizes > 0.0, sizes, 1.0)
        sizes = np.linalg.norm(matrix / rows / columns, axis=0)
        columns *= np.where(sizes > 0.0, sizes, 1.0)
    solution = np.linalg.lstsq(matrix / rows / columns, aims / rows, rcond=None)[0] / columns[:, None]
    missing = np.abs(matrix @ solution - aims) / rows
    known = np.abs(matrix / rows) @ np.abs(solution) + np.abs(aims / rows)
    return np.asarray(solution) if np.all(missing <= REACHED * np.maximum(known.max(axis=0), 1e-300)) else None
