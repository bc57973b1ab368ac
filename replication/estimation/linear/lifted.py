"""The lifted response of a long period as an operator, and its largest singular value by Lanczos' method.

The lifted transfer matrix at e^{jt} has N m columns; applied by the recursion over the period, from the state that
repeats after it up to e^{jt}, it costs O(N) and is never formed. Full reorthogonalisation keeps Lanczos' basis honest.
Source: Golub and Van Loan, Matrix Computations (4th ed., 2013), ch. 10.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import scipy

from replication.errors import SolverError
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.validation import ComplexArray

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
        self._inputs = np.cumsum([chunk.B.shape[1] for chunk in chunks])
        self._outputs = np.cumsum([len(chunk.C) for chunk in chunks])

    @property
    def inputs(self) -> int:
        """Columns of the lifted transfer matrix."""
        return int(self._inputs[-1])

    def at(self, angle: float) -> tuple[Operator, Operator]:
        """(G, G*) at e^{j angle}: functions from vectors (inputs,) to (outputs,), and back."""
        closing = scipy.linalg.lu_factor(np.exp(1j * angle) * np.eye(len(self._monodromy)) - self._monodromy)

        def forward(v: ComplexArray) -> ComplexArray:
            parts = np.split(v, self._inputs[:-1])
            driven = [chunk.B @ part for chunk, part in zip(self._chunks, parts, strict=True)]
            x = np.zeros(len(self._monodromy), dtype=complex)
            for chunk, drive in zip(self._chunks, driven, strict=True):
                x = chunk.A @ x + drive
            x = scipy.linalg.lu_solve(closing, x)
            outputs = []
            for chunk, drive, part in zip(self._chunks, driven, parts, strict=True):
                outputs.append(chunk.C @ x + chunk.D @ part)
                x = chunk.A @ x + drive
            return np.concatenate(outputs)

        def adjoint(y: ComplexArray) -> ComplexArray:
            parts = np.split(y, self._outputs[:-1])[::-1]
            seen = [chunk.C.T @ part for chunk, part in zip(self._chunks[::-1], parts, strict=True)]
            x = np.zeros(len(self._monodromy), dtype=complex)
            for chunk, sight in zip(self._chunks[::-1], seen, strict=True):
                x = chunk.A.T @ x + sight
            x = scipy.linalg.lu_solve(closing, x, trans=2)
            inputs = []
            for chunk, sight, part in zip(self._chunks[::-1], seen, parts, strict=True):
                inputs.append(chunk.B.T @ x + chunk.D.T @ part)
                x = chunk.A.T @ x + sight
            return np.concatenate(inputs[::-1])

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
