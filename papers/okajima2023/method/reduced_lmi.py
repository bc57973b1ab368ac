"""Theorem 2 in reduced form, given directly to Clarabel: only the measured columns of Y_k and the noise they bring.

The matrix inequality as printed (eq. (30)) keeps all q columns of Y_k and all of w at every phase. Columns of sensors
that are not measured have no effect, and an interior-point method stalls on directions without effect; here they are
absent. The states of each phase are scaled by the Kalman covariance, without which long periods lose three digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from replication.estimation.conic.program import (
    SOLVED,
    Inequalities,
    SolverReport,
    program_under,
    solve_clarabel,
    symmetric_basis,
)
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


def reduced_lmi_design(problem: MultirateProblem, *, accept: tuple[str, ...] = SOLVED) -> LmiDesign:
    """Minimise gamma^2 subject to the reduced inequalities of eq. (30) for all phases.

    Raises InfeasibleError or SolverError unless Clarabel's status is one of `accept`; it stays in the report.
    """
    require_problem(problem)
    layout = Layout(problem)
    cost = np.zeros(layout.variables)
    cost[layout.level] = 1.0
    solution = solve_clarabel(program_under(cost, *inequalities(layout)), accept=accept)
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


def inequalities(layout: Layout) -> list[Inequalities]:
    """The matrix of eq. (30) at each phase, reduced and in scaled states, with the few variables that stand in it."""
    return [_phase(layout, k) for k in range(layout.period)]


def _phase(layout: Layout, k: int) -> Inequalities:
    plant, n, rows, size = layout.plant, layout.n, layout.rows[k], layout.block_size(k)
    T, T_next = layout.scales[k], layout.scales[(k + 1) % layout.period]
    basis, triangle = symmetric_basis(n), np.triu_indices(n)
    ahead, now = np.zeros((2, len(basis), size, size))
    ahead[:, :n, :n] = basis
    _beside(ahead, n, basis @ np.linalg.solve(T_next, plant.A @ T))
    _beside(ahead, 2 * n, basis @ np.linalg.solve(T_next, plant.B_d))
    now[:, n : 2 * n, n : 2 * n] = basis
    level = np.diag(np.arange(size) >= 2 * n).astype(float)
    parts = [(ahead, layout.P(k)[triangle]), (now, layout.P(k - 1)[triangle]), (level[None], np.array([layout.level]))]
    if layout.period == 1:
        parts[:2] = [(ahead + now, layout.P(k)[triangle])]
    if rows:
        units = np.eye(n * len(rows)).reshape(-1, n, len(rows))
        columns = np.zeros((len(units), size, size))
        _beside(columns, n, units @ (-plant.C[rows] @ T))
        _beside(columns, 2 * n + layout.disturbances, units @ -plant.D[rows])
        parts.append((columns, layout.Y(k).ravel()))
    constant = np.zeros((1, size, size))
    constant[0, n : 2 * n, n : 2 * n] = -T.T @ plant.W.T @ plant.W @ T
    coefficients, variables = (np.concatenate(part)[None] for part in zip(*parts, strict=True))
    return Inequalities(constant, coefficients, variables)


def _beside(matrices: Array, start: int, blocks: Array) -> None:
    """Write blocks into the first rows from the column `start` on, and their transposes below."""
    rows, stop = blocks.shape[1], start + blocks.shape[2]
    matrices[:, :rows, start:stop] = blocks
    matrices[:, start:stop, :rows] = np.swapaxes(blocks, 1, 2)
