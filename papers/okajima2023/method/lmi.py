"""Theorems 1 and 2: (20) and (30) as printed, through cvxpy, and (30) reduced, given to Clarabel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from replication.errors import InfeasibleError
from replication.estimation.conic.program import (
    SOLVED,
    Inequalities,
    SolverReport,
    minimise_modelled,
    program_under,
    solve_clarabel,
    symmetric_basis,
)
from replication.estimation.linear.periodic import PeriodicSystem, Stage, block_diagonal
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

    As printed, (30) keeps all q columns of Y_k and all of w at every phase. Columns of sensors that are not measured
    have no effect, and an interior-point method stalls on directions without effect; here they are absent. The states
    of each phase are scaled by the Kalman covariance, without which long periods lose three digits.
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


# Theorems 1 and 2 as printed, through cvxpy: the matrix inequalities (20) and (30), all columns, phase by phase


ACCEPTED = ("optimal",)


def theorem1_matrix(problem: MultirateProblem, gains: Array, P: Any, k: int, gamma_squared: Any) -> list[list[Any]]:
    """Blocks of Theta_k, eq. (20), for given gains; P is a list of N matrices or cvxpy variables."""
    plant, S = problem.plant, problem.schedule.selection(k)
    A_e = plant.A - gains[k] @ S @ plant.C
    M = gains[k] @ S @ plant.D
    B, P_k, W = plant.B_d, P[k], plant.W
    level = [gamma_squared * np.eye(size) for size in (B.shape[1], M.shape[1])]
    return [
        [P[k - 1] - A_e.T @ P_k @ A_e - W.T @ W, -A_e.T @ P_k @ B, A_e.T @ P_k @ M],
        [-B.T @ P_k @ A_e, level[0] - B.T @ P_k @ B, B.T @ P_k @ M],
        [M.T @ P_k @ A_e, M.T @ P_k @ B, level[1] - M.T @ P_k @ M],
    ]


def theorem2_matrix(problem: MultirateProblem, P: Any, Y: Any, k: int, gamma_squared: Any) -> list[list[Any]]:
    """Blocks of Theta-hat_k, eq. (30); P and Y are lists of N matrices or cvxpy variables."""
    plant, S = problem.plant, problem.schedule.selection(k)
    return _matrix_30((plant.A, plant.B_d, S @ plant.C, S @ plant.D, plant.W), P[k], P[k - 1], Y[k], gamma_squared)


def _matrix_30(plant: tuple[Array, ...], P: Any, before: Any, Y: Any, gamma_squared: Any) -> list[list[Any]]:
    """The blocks for A, B_d, C, D, W, the P after the step and the one before it."""
    A, B, C, D, W = plant
    n, m, q = len(A), B.shape[1], D.shape[1]
    closed, process, sensor = P @ A - Y @ C, P @ B, -Y @ D
    return [
        [P, closed, process, sensor],
        [closed.T, before - W.T @ W, np.zeros((n, m)), np.zeros((n, q))],
        [process.T, np.zeros((m, n)), gamma_squared * np.eye(m), np.zeros((m, q))],
        [sensor.T, np.zeros((q, n)), np.zeros((q, m)), gamma_squared * np.eye(q)],
    ]


def theorem2_size(problem: MultirateProblem) -> tuple[int, int]:
    """Decision variables of Theorem 2 in all (P_k, Y_k, gamma), and rows of the inequality of each phase."""
    plant, n = problem.plant, problem.plant.order
    per_phase = n * (n + 1) // 2 + n * plant.sensors
    return problem.schedule.period * per_phase + 1, 2 * n + plant.B_d.shape[1] + plant.D.shape[1]


def cyclic_size(problem: MultirateProblem) -> tuple[int, int]:
    """The same for the single inequality of the cyclic reformulation: one P of order N n, one Y of N n by N q."""
    plant, N = problem.plant, problem.schedule.period
    n = N * plant.order
    return n * (n + 1) // 2 + n * N * plant.sensors + 1, 2 * n + N * (plant.B_d.shape[1] + plant.D.shape[1])


def lmi_analysis(
    problem: MultirateProblem, gains: Array, *, one_matrix: bool = False, accept: tuple[str, ...] = ACCEPTED
) -> LmiDesign:
    """Theorem 1: the smallest gamma that eq. (19) certifies for given gains (N, n, q).

    one_matrix: the same P at every phase, a more conservative condition, for comparison.

    Raises InvalidInputError for gains of another shape, InfeasibleError if the error system is not stable, SolverError
    unless the solver's status is one of `accept`.
    """
    import cvxpy  # here and below, because it is slow to load

    require_problem(problem)
    radius = problem.error_system(gains).spectral_radius()
    if radius >= 1:
        raise InfeasibleError(f"the gains do not stabilise the error system (multiplier of modulus {radius:.6g})")
    N, n = problem.schedule.period, problem.plant.order
    P = [cvxpy.Variable((n, n), symmetric=True) for _ in range(1 if one_matrix else N)] * (N if one_matrix else 1)
    gamma_squared = cvxpy.Variable()
    blocks = [theorem1_matrix(problem, np.asarray(gains, dtype=float), P, k, gamma_squared) for k in range(N)]
    report = _minimise(gamma_squared, [*blocks, *([[P_k]] for P_k in P)], accept)
    return LmiDesign(_root(gamma_squared), np.array(gains, dtype=float), np.array([_value(P_k) for P_k in P]), report)


def lmi_design(problem: MultirateProblem, *, one_matrix: bool = False, accept: tuple[str, ...] = ACCEPTED) -> LmiDesign:
    """Theorem 2 as printed: minimise gamma^2 subject to eq. (30), all columns of Y_k kept; gains by eq. (31).

    one_matrix: the same P at every phase, a more conservative condition, for comparison.

    Raises InfeasibleError or SolverError unless the solver's status is one of `accept`.
    """
    import cvxpy

    require_problem(problem)
    N, n, q = problem.schedule.period, problem.plant.order, problem.plant.sensors
    P = [cvxpy.Variable((n, n), symmetric=True) for _ in range(1 if one_matrix else N)] * (N if one_matrix else 1)
    Y = [cvxpy.Variable((n, q)) for _ in range(N)]
    gamma_squared = cvxpy.Variable()
    blocks = [theorem2_matrix(problem, P, Y, k, gamma_squared) for k in range(N)]
    report = _minimise(gamma_squared, blocks, accept)
    gains = np.array([np.linalg.solve(_value(P_k), _value(Y_k)) for P_k, Y_k in zip(P, Y, strict=True)])
    # Y_k on sensors that are not measured is arbitrary in the theorem and without effect in the observer.
    gains *= problem.schedule.mask[:, None, :]
    return LmiDesign(_root(gamma_squared), gains, np.array([_value(P_k) for P_k in P]), report)


def cyclic_lmi_design(problem: MultirateProblem, *, accept: tuple[str, ...] = ACCEPTED) -> LmiDesign:
    """The single inequality of the cyclic reformulation: eq. (30) at N = 1 for the cyclic plant, one P and one Y.

    P (N n, N n) and Y (N n, N q) are full. Turning the phases by the N-th roots of unity leaves the inequality as it
    is, so the mean over these turns solves it too: of P its diagonal blocks, of Y those from phase k to phase k + 1.
    Same optimum as Theorem 2, far more unknowns (`cyclic_size`). Raises as `lmi_design`.
    """
    import cvxpy

    require_problem(problem)
    plant, N, n, q = problem.plant, problem.schedule.period, problem.plant.order, problem.plant.sensors
    selected = [problem.schedule.selection(k) for k in range(N)]
    plant_stages = [Stage(plant.A, plant.B_d, S @ plant.C, np.zeros((q, plant.B_d.shape[1]))) for S in selected]
    A, B, C, _ = cyclic(PeriodicSystem(tuple(plant_stages)))
    D, W = block_diagonal([S @ plant.D for S in selected]), block_diagonal([plant.W] * N)
    P, Y = cvxpy.Variable((N * n, N * n), symmetric=True), cvxpy.Variable((N * n, N * q))
    gamma_squared = cvxpy.Variable()
    report = _minimise(gamma_squared, [_matrix_30((A, B, C, D, W), P, P, Y, gamma_squared)], accept)
    # The blocks of phase k act on the state at phase k + 1.
    ahead = [(k + 1) % N for k in range(N)]
    P_k = np.array([_value(P)[n * j : n * (j + 1), n * j : n * (j + 1)] for j in ahead])
    Y_k = np.array([_value(Y)[n * j : n * (j + 1), q * k : q * (k + 1)] for k, j in enumerate(ahead)])
    gains = np.linalg.solve(P_k, Y_k) * problem.schedule.mask[:, None, :]
    return LmiDesign(_root(gamma_squared), gains, P_k, report)


def cyclic(system: PeriodicSystem) -> Stage:
    """The cyclic reformulation: one state copy per phase, block-cyclic A and B; same induced norm as lifted."""
    total = sum(len(stage.A) for stage in system.stages)
    A = np.zeros((total, total))
    B = np.zeros((total, sum(stage.B.shape[1] for stage in system.stages)))
    column = 0
    for k, stage in enumerate(system.stages):
        following = (k + 1) % system.period
        rows = slice(following * system.order, (following + 1) * system.order)
        A[rows, k * system.order : (k + 1) * system.order] = stage.A
        B[rows, column : column + stage.B.shape[1]] = stage.B
        column += stage.B.shape[1]
    return Stage(A, B, block_diagonal([s.C for s in system.stages]), block_diagonal([s.D for s in system.stages]))


def _value(variable: Any) -> Array:
    return np.asarray(variable.value, dtype=float)


def _root(gamma_squared: Any) -> float:
    return float(np.sqrt(max(float(gamma_squared.value), 0.0)))


def _minimise(gamma_squared: Any, blocks: list[list[list[Any]]], accept: tuple[str, ...]) -> SolverReport:
    """Minimise gamma^2 with every block matrix positive semidefinite; raises unless the status is accepted."""
    import cvxpy

    matrices = (cvxpy.bmat(rows) if len(rows) > 1 or len(rows[0]) > 1 else rows[0][0] for rows in blocks)
    return minimise_modelled(gamma_squared, matrices, accept)[0]
