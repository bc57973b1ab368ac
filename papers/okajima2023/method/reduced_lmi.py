"""Theorem 2 in reduced form, given directly to Clarabel: only the measured columns of Y_k and the noise they bring.

The matrix inequality as printed (eq. (30)) keeps all q columns of Y_k and all of w at every phase. Columns of sensors
that are not measured have no effect, and an interior-point method stalls on directions without effect; here they are
absent. The states of each phase are scaled by the Kalman covariance, without which long periods lose three digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

from replication.estimation.conic.clarabel import SOLVED, solve_clarabel
from replication.estimation.conic.program import Program
from replication.estimation.conic.solvers import SolverReport
from replication.estimation.multirate.kalman import state_scales
from replication.estimation.multirate.problem import MultirateProblem, require_problem
from replication.estimation.validation import Array


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


def reduced_lmi_design(problem: MultirateProblem, *, accept: tuple[str, ...] = SOLVED) -> LmiDesign:
    """Minimise gamma^2 subject to the reduced inequalities of eq. (30) for all phases.

    Raises InfeasibleError or SolverError unless Clarabel's status is one of `accept`; it stays in the report.
    """
    require_problem(problem)
    layout = Layout(problem)
    solution = solve_clarabel(reduced_program(layout), accept=accept)
    return layout.design(solution.multipliers, solution.report)


class Layout:
    """Where the variables stand: the triangles of P_k, then Y_k on measured columns, then gamma^2.

    scales: triangular T_k with e(k) = T_k e_scaled(k), Cholesky factors of the Kalman error covariances, one per phase.
    """

    def __init__(self, problem: MultirateProblem) -> None:
        n = problem.plant.order
        self.plant, self.scales = problem.plant, list(state_scales(problem))
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

    def design(self, x: Array, report: SolverReport) -> LmiDesign:
        """Read the solution back, undo the scaling, and recover L_k = P_k^-1 Y_k (eq. (31))."""
        P = np.zeros((self.period, self.n, self.n))
        gains = np.zeros((self.period, self.n, self.sensors))
        for k, rows in enumerate(self.rows):
            T = self.scales[(k + 1) % self.period]
            scaled = x[self.P(k)]
            gains[k][:, rows] = T @ np.linalg.solve(scaled, x[self.Y(k)])
            half = np.linalg.solve(T.T, scaled)
            P[k] = np.linalg.solve(T.T, half.T)
        return LmiDesign(float(np.sqrt(max(x[self.level], 0.0))), gains, P, report)


def reduced_program(layout: Layout) -> Program:
    """Minimise gamma^2 with the matrices of eq. (30), reduced and in scaled states, positive semidefinite."""
    sizes = tuple(layout.block_size(k) for k in range(layout.period))
    starts = np.concatenate([[0], np.cumsum(np.square(sizes))])
    data, variables, entries = [], [], []
    for k, (size, start) in enumerate(zip(sizes, starts, strict=False)):
        row, column, variable, coefficient = (np.concatenate(parts) for parts in zip(*_phase(layout, k), strict=True))
        upper = row <= column
        row, column, variable, coefficient = row[upper], column[upper], variable[upper], coefficient[upper]
        below = row < column
        data += [-coefficient, -coefficient[below]]
        variables += [variable, variable[below]]
        entries += [start + row * size + column, start + column[below] * size + row[below]]
    position = np.concatenate(variables), np.concatenate(entries)
    cost = np.zeros(layout.variables)
    cost[layout.level] = 1.0
    constants = np.concatenate([_constant(layout, k).ravel() for k in range(layout.period)])
    a = sparse.csr_array((np.concatenate(data), position), shape=(layout.variables, int(starts[-1])))
    return Program(a, -cost, constants, 0, sizes)


def _phase(layout: Layout, k: int) -> list[_Terms]:
    """The linear terms of the matrix of eq. (30) at phase k."""
    plant, n, rows = layout.plant, layout.n, layout.rows[k]
    T, T_next = layout.scales[k], layout.scales[(k + 1) % layout.period]
    terms = [
        _product(layout.P(k), np.eye(n), (0, 0)),
        _product(layout.P(k), np.linalg.solve(T_next, plant.A @ T), (0, n)),
        _product(layout.P(k), np.linalg.solve(T_next, plant.B_d), (0, 2 * n)),
        _product(layout.P(k - 1), np.eye(n), (n, n)),
        _diagonal(layout.level, 2 * n, layout.block_size(k)),
    ]
    if rows:
        terms.append(_product(layout.Y(k), -plant.C[rows] @ T, (0, n)))
        terms.append(_product(layout.Y(k), -plant.D[rows], (0, 2 * n + layout.disturbances)))
    return terms


def _constant(layout: Layout, k: int) -> Array:
    """Its constant part."""
    n, size, T = layout.n, layout.block_size(k), layout.scales[k]
    constant = np.zeros((size, size))
    constant[n : 2 * n, n : 2 * n] = -T.T @ layout.plant.W.T @ layout.plant.W @ T
    return constant


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
