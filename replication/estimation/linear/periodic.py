"""Discrete-time linear periodic systems: x(k+1) = A_k x(k) + B_k v(k), z(k) = C_k x(k) + D_k v(k), k modulo N.

The lifted transfer matrix of a long period is an operator: applied by the recursion, from the state that repeats after
the period up to e^{jt}, it costs O(N) and is never formed. Its largest singular value is found by Lanczos' method with
full reorthogonalisation (Golub and Van Loan, Matrix Computations, 4th ed., 2013, ch. 10).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from replication.errors import InvalidInputError, SolverError
from replication.estimation.validation import Array, ComplexArray, as_array, as_matrix


class Stage(NamedTuple):
    """The matrices at one instant: A (n, n), B (n, m), C (p, n), D (p, m); m and p may change from stage to stage."""

    A: Array
    B: Array
    C: Array
    D: Array


@dataclass(frozen=True)
class PeriodicSystem:
    """An N-periodic system given by its N stages; an N = 1 system is time-invariant.

    Raises InvalidInputError if there is no stage, an entry is not finite, or the shapes do not fit.
    """

    stages: tuple[Stage, ...]

    def __post_init__(self) -> None:
        if not self.stages:
            raise InvalidInputError("a periodic system needs at least one stage (A, B, C, D)")
        if any(not isinstance(stage, Sequence) or len(stage) != 4 for stage in self.stages):
            raise InvalidInputError("each stage must be four matrices (A, B, C, D)")
        n = as_matrix("A_0", self.stages[0][0]).shape[0]
        if n == 0:
            raise InvalidInputError("A_0 must have at least one state, got shape (0, 0)")
        checked = []
        for k, (A, B, C, D) in enumerate(self.stages):
            A = as_matrix(f"A_{k}", A, rows=n, columns=n)
            B = as_matrix(f"B_{k}", B, rows=n)
            C = as_matrix(f"C_{k}", C, columns=n)
            checked.append(Stage(A, B, C, as_matrix(f"D_{k}", D, rows=C.shape[0], columns=B.shape[1])))
        object.__setattr__(self, "stages", tuple(checked))

    @property
    def period(self) -> int:
        """N, the number of stages."""
        return len(self.stages)

    @property
    def order(self) -> int:
        """n, the number of states."""
        return len(self.stages[0].A)

    def monodromy(self) -> Array:
        """The state transition over one period from phase 0, A_{N-1} ... A_1 A_0, of shape (n, n)."""
        return monodromy(np.stack([stage.A for stage in self.stages]))

    def spectral_radius(self) -> float:
        """Largest modulus of the characteristic multipliers; the system is stable iff it is below one."""
        return float(np.max(np.abs(np.linalg.eigvals(self.monodromy()))))

    def lift(self) -> Stage:
        """The time-invariant system from phase 0 over one period: inputs and outputs stacked, same induced norm."""
        return lifted(self.stages)


def lifted(stages: Sequence[Stage]) -> Stage:
    """`PeriodicSystem.lift` of stages that need no check."""
    n = len(stages[0].A)
    columns = n + np.cumsum([0, *(stage.B.shape[1] for stage in stages)])
    # [transition, drive]: the effect of the first state and of all inputs so far on the state.
    effect, rows = np.eye(n, columns[-1]), []
    for stage, start, stop in zip(stages, columns[:-1], columns[1:], strict=True):
        row = np.dot(stage.C, effect)
        row[:, start:stop] = stage.D
        rows.append(row)
        effect = np.dot(stage.A, effect)
        effect[:, start:stop] = stage.B
    outputs = np.concatenate(rows)
    return Stage(effect[:, :n], effect[:, n:], outputs[:, :n], outputs[:, n:])


def balanced_units(A: Array, drive: Array, sight: Array) -> Array:
    """Units (n,), powers of two, of the states in which A, what drives them (n, m) and what looks at them are balanced.

    What drives and what looks keep units of their own, so that each state is measured against both.
    """
    n, m = drive.shape
    whole = np.zeros((n + m + len(sight),) * 2)
    whole[:n, :n], whole[:n, n : n + m], whole[n + m :, :n] = A, drive, sight
    # The scaling may be beyond the integers to which scipy casts a permutation that is not asked for.
    with np.errstate(invalid="ignore"):
        return np.asarray(scipy.linalg.matrix_balance(whole, permute=False, separate=True)[1][0][:n])


def monodromy(steps: Array) -> Array:
    """A_{N-1} ... A_1 A_0 of the transitions (N, n, n) of a period, neighbours at a time."""
    while (count := len(steps)) > 1:
        even = count - count % 2
        pairs = steps[1:even:2] @ steps[0:even:2]
        steps = pairs if even == count else np.concatenate([pairs, steps[even:]])
    return np.asarray(steps[0])


def frequency_response(system: Stage, angle: float | Array) -> ComplexArray:
    """C (e^{j angle} I - A)^-1 B + D of a time-invariant system; angle in radians per sample, or many in a stack."""
    z = np.exp(1j * np.asarray(angle))[..., None, None]
    return np.asarray(system.C @ np.linalg.solve(z * np.eye(len(system.A)) - system.A, system.B) + system.D)


def simulate(system: PeriodicSystem, inputs: Array, initial_state: Array | None = None) -> Array:
    """Outputs (T, p) for inputs (T, m) from `initial_state` (n,), zero unless given; phase 0 is the first row.

    Raises InvalidInputError unless all stages have the width of the inputs.
    """
    v = as_matrix("inputs", inputs)
    if any(stage.B.shape[1] != v.shape[1] for stage in system.stages):
        widths = sorted({stage.B.shape[1] for stage in system.stages})
        raise InvalidInputError(f"inputs must have as many columns as every stage has inputs ({widths}), got {v.shape}")
    x = np.zeros(system.order)
    if initial_state is not None:
        x = as_array("initial_state", initial_state, (system.order,))
    outputs = np.zeros((len(v), system.stages[0].C.shape[0]))
    for k, v_k in enumerate(v):
        stage = system.stages[k % system.period]
        outputs[k] = stage.C @ x + stage.D @ v_k
        x = stage.A @ x + stage.B @ v_k
    return outputs


CHUNK = 64
"""Inputs per chunk of stages: fewer and larger products than stage by stage."""
RESIDUAL = 1e-10
"""Residual of the leading Ritz pair, relative; the singular value itself is as accurate as its square over the gap."""
CHECK_EVERY = 5
MAX_STEPS = 2000

Operator = Callable[[ComplexArray], ComplexArray]


class LiftedResponse:
    """The lifted transfer matrices of a periodic system, `at` any angle; outputs are turned, which keeps their norm."""

    def __init__(self, system: PeriodicSystem) -> None:
        chunks = [compressed(PeriodicSystem(group).lift()) for group in _groups(system.stages)]
        self._monodromy = system.monodromy()
        self._chunks = [Stage(*(np.asarray(M, dtype=complex) for M in chunk)) for chunk in chunks]
        self._transposed = [Stage(A.T, C.T, B.T, D.T) for A, B, C, D in self._chunks[::-1]]
        self._inputs = np.cumsum([chunk.B.shape[1] for chunk in chunks])
        self._outputs = np.cumsum([len(chunk.C) for chunk in chunks])

    @property
    def inputs(self) -> int:
        """Columns of the lifted transfer matrix."""
        return int(self._inputs[-1])

    def at(self, angle: float) -> tuple[Operator, Operator]:
        """(G, G*) at e^{j angle}: functions from vectors (inputs,) to (outputs,), and back."""
        closing = scipy.linalg.lu_factor(np.exp(1j * angle) * np.eye(len(self._monodromy)) - self._monodromy)

        def through(chunks: list[Stage], parts: list[ComplexArray], trans: int) -> list[ComplexArray]:
            """The outputs of all chunks, from the state that repeats after the period up to e^{j angle}."""
            driven = [chunk.B @ part for chunk, part in zip(chunks, parts, strict=True)]
            x = np.zeros(len(self._monodromy), dtype=complex)
            for chunk, drive in zip(chunks, driven, strict=True):
                x = chunk.A @ x + drive
            x = scipy.linalg.lu_solve(closing, x, trans=trans)
            outputs = []
            for chunk, drive, part in zip(chunks, driven, parts, strict=True):
                outputs.append(chunk.C @ x + chunk.D @ part)
                x = chunk.A @ x + drive
            return outputs

        def forward(v: ComplexArray) -> ComplexArray:
            return np.concatenate(through(self._chunks, np.split(v, self._inputs[:-1]), 0))

        def adjoint(y: ComplexArray) -> ComplexArray:
            parts = np.split(y, self._outputs[:-1])[::-1]
            return np.concatenate(through(self._transposed, parts, 2)[::-1])

        return forward, adjoint


def compressed(system: Stage) -> Stage:
    """The same system with its outputs turned and cut to no more than states and inputs: same gain at all angles."""
    n, m = system.B.shape
    if len(system.C) <= n + m:
        return system
    both = np.asarray(np.linalg.qr(np.hstack([system.C, system.D]), mode="r"))
    return Stage(system.A, system.B, both[:, :n], both[:, n:])


def _groups(stages: tuple[Stage, ...]) -> Iterator[tuple[Stage, ...]]:
    """Consecutive stages with about CHUNK inputs together."""
    group: list[Stage] = []
    for stage in stages:
        group.append(stage)
        if sum(member.B.shape[1] for member in group) >= CHUNK:
            yield tuple(group)
            group = []
    if group:
        yield tuple(group)


def largest_singular_value(gram: Operator, size: int, *, floor: float = 0.0) -> float:
    """sqrt of the largest eigenvalue of the positive semidefinite `gram`, a function on vectors of length `size`.

    floor: a value below it is rounding, and zero is returned at once. The start is a fixed vector without symmetries.
    Raises SolverError if Lanczos' method does not settle.
    """
    if size == 0:
        return 0.0
    start = np.exp(1j * np.arange(size, dtype=float) ** 2)
    basis = (start / np.linalg.norm(start))[None, :]
    diagonal: list[float] = []
    beside: list[float] = []
    for step in range(1, min(size, MAX_STEPS) + 1):
        w = gram(basis[-1])
        diagonal.append(float(np.vdot(basis[-1], w).real))
        for _ in range(2):
            w = w - basis.T @ (basis.conj() @ w)
        rest = float(np.linalg.norm(w))
        if step % CHECK_EVERY == 0 or step == size or rest <= RESIDUAL * max(0.0, *diagonal):
            value, vector = scipy.linalg.eigh_tridiagonal(
                diagonal, beside, select="i", select_range=(step - 1, step - 1)
            )
            if value[0] + rest <= floor**2:
                return 0.0
            if step == size or rest * abs(vector[-1, 0]) <= RESIDUAL * value[0]:
                return float(np.sqrt(max(value[0], 0.0)))
        beside.append(rest)
        basis = np.vstack([basis, w / rest])
    raise SolverError(f"Lanczos' method found no largest singular value in {MAX_STEPS} steps; rescale the system")
