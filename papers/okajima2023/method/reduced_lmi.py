"""Theorem 2 in reduced form, given directly to Clarabel: only the measured columns of Y_k and the noise they bring.

The matrix inequality as printed (eq. (30)) keeps all q columns of Y_k and all of w at every phase. Columns of sensors
that are not measured have no effect, and an interior-point method stalls on directions without effect; here they are
absent. The states of each phase are scaled by the Kalman covariance, without which long periods lose three digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import clarabel
import numpy as np
import numpy.typing as npt
import scipy.sparse

from replication.estimation.conic.solvers import SolverReport, clarabel_report, clarabel_settings, raise_unless_solved
from replication.estimation.multirate.kalman import state_scales
from replication.estimation.multirate.problem import MultirateProblem, require_problem
from replication.estimation.validation import Array

ACCEPTED = ("Solved",)
"""Clarabel's statuses that count as a solution; a caller may add "AlmostSolved" and then owes the reader that word."""


@dataclass(frozen=True, eq=False)
class LmiDesign:
    """What the matrix inequality returned. level: sqrt of the minimal gamma^2 (the solver's word, not a bound);
    gains L_k = P_k^-1 Y_k (N, n, q); P (N, n, n); report: the solver's own account."""

    level: float
    gains: Array
    P: Array
    report: SolverReport


class _Terms(NamedTuple):
    """Linear terms of one upper triangle: entry (row, column) gets coefficient times variable."""

    row: npt.NDArray[np.int64]
    column: npt.NDArray[np.int64]
    variable: npt.NDArray[np.int64]
    coefficient: Array


def reduced_lmi_design(problem: MultirateProblem, *, accept: tuple[str, ...] = ACCEPTED) -> LmiDesign:
    """Minimise gamma^2 subject to the reduced inequalities of eq. (30) for all phases.

    Raises InfeasibleError or SolverError unless Clarabel's status is one of `accept`; it stays in the report.
    """
    require_problem(problem)
    layout = _Layout(problem)
    scales = _state_scales(problem)
    blocks = [_phase_constraint(problem, layout, scales, k) for k in range(layout.period)]
    A = scipy.sparse.vstack([block for block, _ in blocks], format="csc")
    b = np.concatenate([constant for _, constant in blocks])
    q = np.zeros(layout.variables)
    q[layout.level] = 1.0
    cones = [clarabel.PSDTriangleConeT(layout.block_size(k)) for k in range(layout.period)]
    empty = scipy.sparse.csc_matrix((layout.variables, layout.variables))
    solution = clarabel.DefaultSolver(empty, q, A, b, cones, clarabel_settings()).solve()
    report = clarabel_report(solution)
    raise_unless_solved(report, accept=accept)
    return layout.design(np.array(solution.x), scales, report)


class _Layout:
    """Where the variables stand: the triangles of P_k, then Y_k on measured columns, then gamma^2."""

    def __init__(self, problem: MultirateProblem) -> None:
        n = problem.plant.order
        self.n: int = n
        self.period = problem.schedule.period
        self.rows = problem.measured_rows()
        self.noise = problem.plant.D.shape[1]
        self.disturbances = problem.plant.B_d.shape[1]
        self.sensors = problem.plant.sensors
        self.triangle = n * (n + 1) // 2
        counts = np.array([n * len(rows) for rows in self.rows])
        self.first_Y = self.period * self.triangle + np.concatenate([[0], np.cumsum(counts)])
        self.level = int(self.first_Y[-1])
        self.variables = self.level + 1
        upper = np.triu_indices(n)
        self._index = np.zeros((n, n), dtype=np.int64)
        self._index[upper] = np.arange(self.triangle)
        self._index.T[upper] = np.arange(self.triangle)

    def P(self, k: int) -> npt.NDArray[np.int64]:
        """Variable numbers of the entries of P_k, shape (n, n); k = -1 is P_{N-1}."""
        return self._index + (k % self.period) * self.triangle

    def Y(self, k: int) -> npt.NDArray[np.int64]:
        """Variable numbers of the entries of the measured columns of Y_k, shape (n, rows)."""
        count = len(self.rows[k])
        return np.arange(self.n * count, dtype=np.int64).reshape(self.n, count) + int(self.first_Y[k])

    def block_size(self, k: int) -> int:
        """Rows of the matrix inequality at phase k: without measurement, without w."""
        return int(2 * self.n + self.disturbances + (self.noise if self.rows[k] else 0))

    def design(self, x: Array, scales: list[Array], report: SolverReport) -> LmiDesign:
        """Read the solution back, undo the scaling, and recover L_k = P_k^-1 Y_k (eq. (31))."""
        P = np.zeros((self.period, self.n, self.n))
        gains = np.zeros((self.period, self.n, self.sensors))
        for k, rows in enumerate(self.rows):
            T = scales[(k + 1) % self.period]
            scaled = x[self.P(k)]
            gains[k][:, rows] = T @ np.linalg.solve(scaled, x[self.Y(k)])
            half = np.linalg.solve(T.T, scaled)
            P[k] = np.linalg.solve(T.T, half.T)
        return LmiDesign(float(np.sqrt(max(x[self.level], 0.0))), gains, P, report)


def _state_scales(problem: MultirateProblem) -> list[Array]:
    """Triangular T_k with e(k) = T_k e_scaled(k): Cholesky factors of the Kalman error covariances, one per phase."""
    return list(state_scales(problem))


def _phase_constraint(
    problem: MultirateProblem, layout: _Layout, scales: list[Array], k: int
) -> tuple[scipy.sparse.csc_matrix, Array]:
    """Rows (A, b) with b - A x = svec of the matrix of eq. (30) at phase k, reduced and in scaled states."""
    plant, n, rows = problem.plant, layout.n, layout.rows[k]
    T, T_next = scales[k], scales[(k + 1) % layout.period]
    size, noise_start = layout.block_size(k), 2 * n + layout.disturbances
    terms = [
        _product(layout.P(k), np.eye(n), (0, 0)),
        _product(layout.P(k), np.linalg.solve(T_next, plant.A @ T), (0, n)),
        _product(layout.P(k), np.linalg.solve(T_next, plant.B_d), (0, 2 * n)),
        _product(layout.P(k - 1), np.eye(n), (n, n)),
        _diagonal(layout.level, 2 * n, size),
    ]
    if rows:
        terms.append(_product(layout.Y(k), -plant.C[rows] @ T, (0, n)))
        terms.append(_product(layout.Y(k), -plant.D[rows], (0, noise_start)))
    constant = np.zeros((size, size))
    constant[n : 2 * n, n : 2 * n] = -T.T @ plant.W.T @ plant.W @ T
    row, column, variable, coefficient = (np.concatenate(parts) for parts in zip(*terms, strict=True))
    upper = row <= column
    row, column, variable, coefficient = row[upper], column[upper], variable[upper], coefficient[upper]
    # Clarabel stacks the upper triangle by columns and scales the off-diagonal by sqrt(2).
    scaled = coefficient * np.where(row == column, 1.0, np.sqrt(2.0))
    A = scipy.sparse.csc_matrix(
        (-scaled, (column * (column + 1) // 2 + row, variable)), shape=(size * (size + 1) // 2, layout.variables)
    )
    i, j = np.triu_indices(size)
    b = np.zeros(size * (size + 1) // 2)
    b[j * (j + 1) // 2 + i] = constant[i, j] * np.where(i == j, 1.0, np.sqrt(2.0))
    return A, b


def _product(variables: npt.NDArray[np.int64], right: npt.NDArray[Any], corner: tuple[int, int]) -> _Terms:
    """Terms of the block (matrix of variables) times `right`, whose upper left entry stands at `corner`."""
    i, m, j = np.meshgrid(*(np.arange(s) for s in (*variables.shape, right.shape[1])), indexing="ij")
    i, m, j = i.ravel(), m.ravel(), j.ravel()
    coefficient = right[m, j]
    used = coefficient != 0
    i, m, j, coefficient = i[used], m[used], j[used], coefficient[used]
    return _Terms(i + corner[0], j + corner[1], variables[i, m], coefficient)


def _diagonal(variable: int, start: int, stop: int) -> _Terms:
    """Terms that put one variable on the diagonal from `start` to `stop`."""
    at = np.arange(start, stop, dtype=np.int64)
    return _Terms(at, at, np.full(len(at), variable, dtype=np.int64), np.ones(len(at)))
