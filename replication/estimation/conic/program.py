"""Semidefinite programs: one form for all, what a point of one misses, and what its multipliers prove.

    minimise c'x  subject to  A x = b,  x = (l, vec X_1, .., vec X_k),  l >= 0,  X_j positive semidefinite,
    maximise b'y  subject to  c - A'y = (s, vec S_1, .., vec S_k),  s >= 0,  S_j positive semidefinite,

are dual to each other. A program in a few matrices under equations is written by the first, one in scalar unknowns
under matrix inequalities by the second (`program_under`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from replication.estimation.conic.solvers import SolverReport
from replication.estimation.validation import Array

Indices = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Program:
    """Data of a program: `a` (m, l + ΣN_j²), symmetric in each block; `b` (m,); `c` (l + ΣN_j²,).

    linear: the number l of scalars x; blocks: the orders N_j. Entries of `a` that stand twice count as their sum.
    """

    a: scipy.sparse.csr_array | scipy.sparse.coo_array
    b: Array
    c: Array
    linear: int
    blocks: tuple[int, ...]

    def matrices(self, vector: Array) -> list[Array]:
        """The symmetric blocks of a vector in the layout of x."""
        blocks, position = [], self.linear
        for size in self.blocks:
            block = vector[position : position + size * size].reshape(size, size)
            blocks.append((block + block.T) / 2.0)
            position += size * size
        return blocks

    def symmetric(self, vector: Array) -> Array:
        """The vector with symmetric blocks."""
        return np.concatenate([vector[: self.linear], *[block.ravel() for block in self.matrices(vector)]])

    def least(self, vector: Array) -> float:
        """The smallest scalar or eigenvalue of a vector in the layout of x."""
        eigenvalues = (float(np.linalg.eigvalsh(block)[0]) for block in self.matrices(vector))
        return min([float(vector[: self.linear].min(initial=np.inf)), *eigenvalues])

    def least_trace(self, multipliers: Array) -> float:
        """What y proves of the trace of every feasible x: bᵀy = xᵀAᵀy <= max(0, λ_max(Aᵀy)) tr x.

        Infinite by Farkas' lemma: there is no feasible x then.
        """
        reached = float(self.b @ multipliers)
        most = max(0.0, -self.least(-(self.a.T @ multipliers)))
        if reached <= 0.0:
            return 0.0
        return reached / most if most > 0.0 else np.inf


@dataclass(frozen=True)
class Inequalities:
    """K matrix inequalities constant[k] + sum_p x[variables[k, p]] coefficients[k, p] >= 0 (positive semidefinite).

    Shapes: constant (K, q, q), coefficients (K, p, q, q), all symmetric; variables (K, p), positions in x.
    """

    constant: Array
    coefficients: Array
    variables: Indices


def program_under(cost: Array, *groups: Inequalities) -> Program:
    """Minimise cost'x under all `groups`: the unknowns are the multipliers of the program, the duals its matrices."""
    data, unknowns, entries, constants, blocks, start = [], [], [], [], [], 0
    for group in groups:
        count, terms, size, _ = group.coefficients.shape
        used = np.flatnonzero(group.coefficients)
        inequality, term, entry = np.unravel_index(used, (count, terms, size * size))
        data.append(-group.coefficients.ravel()[used])
        unknowns.append(group.variables[inequality, term])
        entries.append(start + inequality * size * size + entry)
        constants.append(group.constant.ravel())
        blocks += [size] * count
        start += count * size * size
    position = np.concatenate(unknowns), np.concatenate(entries)
    a = scipy.sparse.coo_array((np.concatenate(data), position), shape=(len(cost), start))
    return Program(a, -cost, np.concatenate(constants), 0, tuple(blocks))


@dataclass(frozen=True)
class Solution:
    """A pair of points with what the solver said of it; x has symmetric blocks, multipliers is y."""

    program: Program
    x: Array
    multipliers: Array
    report: SolverReport

    @property
    def linear(self) -> Array:
        """The part l of x."""
        return self.x[: self.program.linear]

    @property
    def blocks(self) -> tuple[Array, ...]:
        """The parts X_j of x."""
        return tuple(self.program.matrices(self.x))

    @property
    def objective(self) -> float:
        """cᵀx."""
        return float(self.program.c @ self.x)

    @property
    def dual_objective(self) -> float:
        """bᵀy."""
        return float(self.program.b @ self.multipliers)

    @property
    def missed(self) -> Array:
        """|Ax-b|."""
        return np.asarray(np.abs(self.program.a @ self.x - self.program.b))

    @property
    def slip(self) -> float:
        """|y|ᵀ|Ax-b|, by which, to first order, meeting the equalities may raise the objective."""
        return float(np.abs(self.multipliers) @ self.missed)

    def residuals(self) -> dict[str, float]:
        """What the points miss, computed from the data of the program, whatever the solver reported.

        equalities: ‖Ax-b‖∞/(1+‖b‖∞). The least eigenvalues of x and of the slack s = c - Aᵀy. gap: (|cᵀx-bᵀy| +
        max(0, -λ_min(s))·tr x)/(1+|cᵀx|), so that a slightly indefinite s cannot hide one.
        """
        program, objective = self.program, self.objective
        least = program.least(program.c - program.a.T @ self.multipliers)
        trace = float(np.abs(self.linear).sum() + sum(np.trace(block) for block in self.blocks))
        return {
            "equalities": float(self.missed.max(initial=0.0) / (1.0 + np.abs(program.b).max(initial=0.0))),
            "least eigenvalue": program.least(self.x),
            "least eigenvalue of the dual": least,
            "gap": (abs(objective - self.dual_objective) + max(0.0, -least) * trace) / (1.0 + abs(objective)),
        }


def symmetric_basis(size: int) -> Array:
    """The symmetric unit matrices E_l, stacked (size (size + 1) / 2, size, size), in the order of the upper
    triangle."""
    rows, columns = np.triu_indices(size)
    basis = np.zeros((len(rows), size, size))
    basis[np.arange(len(rows)), rows, columns] = 1.0
    basis[np.arange(len(rows)), columns, rows] = 1.0
    return basis
