"""Theorems 1 and 2: (20) and (30) as printed, through cvxpy; (30) reduced, given to Clarabel; and its central path.

The reduced inequality has the sensors that are measured alone. Its centre at t minimises t gamma^2 - sum_k log det F_k
over (P, Y, gamma^2), where F_k is the matrix of eq. (30) at phase k. Interior-point solvers follow these points, so the
gains that a solver returned, which are not unique, lie near one of them.
Source: Nesterov and Nemirovskii, Interior-Point Polynomial Algorithms in Convex Programming (SIAM, 1994).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import (
    SOLVED,
    Inequalities,
    SolverReport,
    minimise_modelled,
    program_under,
    solve_clarabel,
)
from replication.estimation.linear.riccati import RiccatiMap, settled
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
    cost = np.eye(layout.level + 1)[layout.level]
    phases = (inequality(layout, k) for k in range(len(layout.rows)))
    solution = solve_clarabel(program_under(cost, *phases), accept=accept)
    return LmiDesign(*layout.design(solution.multipliers), solution.report)


class Layout:
    """Where the variables stand: the triangles of P_k, then Y_k on measured columns, then gamma^2.

    P, Y: the positions of their entries, by phase; level: that of gamma^2, the last. scales: triangular T_k with
    e(k) = T_k e_scaled(k), Cholesky factors of the Kalman error covariances, one per phase.
    """

    def __init__(self, problem: MultirateProblem) -> None:
        self.plant, self.rows, self.scales = problem.plant, problem.measured_rows(), state_scales(problem)
        n, N = self.plant.order, len(self.rows)
        upper, index = np.triu_indices(n), np.zeros((n, n), dtype=np.int64)
        index[upper] = index.T[upper] = np.arange(len(upper[0]))
        self.P = index + len(upper[0]) * np.arange(N)[:, None, None]
        counts = [n * len(rows) for rows in self.rows]
        columns = np.split(N * len(upper[0]) + np.arange(sum(counts)), np.cumsum(counts)[:-1])
        self.Y = [entries.reshape(n, len(rows)) for entries, rows in zip(columns, self.rows, strict=True)]
        self.level = N * len(upper[0]) + sum(counts)

    def design(self, x: Array) -> tuple[float, Array, Array]:
        """The level, the gains L_k = P_k^-1 Y_k of eq. (31), and P, of a solution, in the states of the plant."""
        P, gains = np.zeros(self.P.shape), np.zeros((len(self.rows), self.plant.order, self.plant.sensors))
        for k, rows in enumerate(self.rows):
            T, scaled = self.scales[(k + 1) % len(self.rows)], x[self.P[k]]
            gains[k][:, rows] = T @ np.linalg.solve(scaled, x[self.Y[k]])
            P[k] = np.linalg.solve(T.T, np.linalg.solve(T.T, scaled).T)
        return float(np.sqrt(max(x[self.level], 0.0))), gains, P


def inequality(layout: Layout, k: int) -> Inequalities:
    """The matrix of eq. (30) at phase k, reduced and in scaled states, with the few variables that stand in it.

    It is affine: what each variable alone adds to it is its coefficient.
    """
    plant, rows, P, before, Y = layout.plant, layout.rows[k], layout.P[k], layout.P[k - 1], layout.Y[k]
    T, T_next = layout.scales[k], layout.scales[(k + 1) % len(layout.rows)]
    A, B = np.linalg.solve(T_next, plant.A @ T), np.linalg.solve(T_next, plant.B_d)
    # Without measurement, without w.
    C, D = plant.C[rows] @ T, plant.D[rows] if rows else np.zeros((0, 0))

    def matrix(x: Array, W: Array) -> Array:
        rows_of_blocks = matrix_30((A, B, C, D, W), x[P], x[before], x[Y], x[layout.level])
        return np.concatenate([np.concatenate(row, axis=1) for row in rows_of_blocks])

    variables = np.unique([*P.ravel(), *before.ravel(), *Y.ravel(), layout.level])
    weight, x = plant.W @ T, np.eye(layout.level + 1)
    coefficients = np.array([matrix(x[variable], 0 * weight) for variable in variables])
    return Inequalities(matrix(0 * x[0], weight)[None], coefficients[None], variables[None])


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
    return matrix_30((plant.A, plant.B_d, S @ plant.C, S @ plant.D, plant.W), P[k], P[k - 1], Y[k], gamma_squared)


def matrix_30(plant: tuple[Array, ...], P: Any, before: Any, Y: Any, gamma_squared: Any) -> list[list[Any]]:
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


def theorem2_size(problem: MultirateProblem, cyclic: bool = False) -> tuple[int, int]:
    """Decision variables of Theorem 2 in all (P_k, Y_k, gamma), and rows of the inequality of each phase.

    cyclic: of the single inequality of the cyclic reformulation, one phase with a copy of all signals for each.
    """
    plant, N = problem.plant, problem.schedule.period
    phases, copies = (1, N) if cyclic else (N, 1)
    n, q, m, w = (copies * size for size in (plant.order, plant.sensors, plant.B_d.shape[1], plant.D.shape[1]))
    return phases * (n * (n + 1) // 2 + n * q) + 1, 2 * n + m + w


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
    level, report = minimise(gamma_squared, [*blocks, *([[P_k]] for P_k in P)], accept)
    return LmiDesign(level, np.array(gains, dtype=float), np.array([_value(P_k) for P_k in P]), report)


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
    level, report = minimise(gamma_squared, blocks, accept)
    gains = np.array([np.linalg.solve(_value(P_k), _value(Y_k)) for P_k, Y_k in zip(P, Y, strict=True)])
    # Y_k on sensors that are not measured is arbitrary in the theorem and without effect in the observer.
    gains *= problem.schedule.mask[:, None, :]
    return LmiDesign(level, gains, np.array([_value(P_k) for P_k in P]), report)


def _value(variable: Any) -> Array:
    return np.asarray(variable.value, dtype=float)


def minimise(gamma_squared: Any, blocks: list[list[list[Any]]], accept: tuple[str, ...]) -> tuple[float, SolverReport]:
    """The least level at which every block matrix is positive semidefinite; raises unless the status is accepted."""
    import cvxpy

    report = minimise_modelled(gamma_squared, map(cvxpy.bmat, blocks), accept)
    return float(np.sqrt(max(float(gamma_squared.value), 0.0))), report


DECREMENT = 1e-6
"""Newton decrement at which a point counts as the centre: half its square is the distance from the minimum."""
FULL_STEP = 0.25
"""Below this decrement full Newton steps converge quadratically; above it damped ones keep every F_k positive."""
MAX_STEPS = 300
INSIDE = 0.5
"""Length of the longest step along the path in the norm of the barrier; below one, every F_k stays positive."""


class CentralPoint(NamedTuple):
    """One centre. level: its gamma; gap: level^2 - gap <= optimum^2 <= level^2; gains L_k = P_k^-1 Y_k (N, n, q).

    The gain of the error system with these gains is below `level`.
    """

    level: float
    gap: float
    gains: Array


def central_path(
    problem: MultirateProblem, start_gains: Array, *, gap: float, factor: float = 1.5
) -> Iterator[CentralPoint]:
    """Follow the centres from a wide gap, divided by `factor` from point to point, down to exactly `gap`, in gamma^2.

    start_gains (N, n, q) must stabilise the error system; the points do not depend on them, except for the first gap.
    Dense Newton steps: O(N n^6) to assemble and O(N^3 n^6) to solve each, so meant for small plants and short periods.
    Raises InfeasibleError if the gains do not stabilise, SolverError if Newton's method does not reach a centre.
    """
    layout = Layout(problem)
    blocks = [inequality(layout, k) for k in range(len(layout.rows))]
    x = _interior_point(problem, start_gains, layout, blocks)
    # At a centre, the gap is (sum of the sizes of F_k) / t.
    order = sum(block.constant.shape[-1] for block in blocks)
    current = max(float(x[layout.level]), gap)
    while True:
        x, tangent = _centre(x, layout.level, order / current, blocks)
        level, gains, _ = layout.design(x)
        yield CentralPoint(level, current, gains)
        if current <= gap:
            return
        following = max(current / factor, gap)
        step = order / following - order / current
        # Along the tangent as far as all F_k are positive for certain, in the norm of the barrier.
        x = x + min(step, INSIDE / float(np.sqrt(-tangent[layout.level]))) * tangent
        current = following


def _interior_point(problem: MultirateProblem, gains: Array, layout: Layout, blocks: list[Inequalities]) -> Array:
    """Variables with all F_k > 0: P_{k-1} = A_ek' P_k A_ek + W'W + Q with Q > 0, Y_k = P_k L_k, and a large gamma^2."""
    now, ahead = layout.scales, np.roll(layout.scales, -1, axis=0)
    closed = np.array([stage.A for stage in problem.error_system(gains).stages])
    steps = np.asarray(np.linalg.solve(ahead, closed @ now), dtype=float)
    weights = np.array([T.T @ layout.plant.W.T @ layout.plant.W @ T for T in now])
    weights += np.maximum(np.linalg.norm(weights, axis=(1, 2)), 1e-6)[:, None, None] * np.eye(layout.plant.order)
    backward = settled(RiccatiMap(steps[::-1].mT, np.zeros_like(steps), weights[::-1]))
    if backward is None:
        raise InfeasibleError("start_gains do not stabilise the error system; take those of `kalman_design`")
    x = np.zeros(layout.level + 1)
    for k, P in enumerate(backward[::-1]):
        x[layout.P[k]] = P
        x[layout.Y[k]] = P @ np.linalg.solve(ahead[k], gains[k][:, layout.rows[k]])
    x[layout.level] = np.linalg.norm(weights, axis=(1, 2)).max()
    while np.isfinite(x[layout.level]):
        if all(np.linalg.eigvalsh(_block_at(block, x))[0] > 0 for block in blocks):
            return x
        x[layout.level] *= 2
    raise SolverError("no interior point was found from start_gains: they hardly stabilise; take other gains")


def _block_at(block: Inequalities, x: Array) -> Array:
    """F_k(x), shape (s, s)."""
    return np.asarray(block.constant[0] + np.tensordot(x[block.variables[0]], block.coefficients[0], 1))


def _centre(x: Array, level: int, t: float, blocks: list[Inequalities]) -> tuple[Array, Array]:
    """Damped Newton method for the minimum of t x[level] - sum_k log det F_k(x) from an interior point.

    The minimum, and how it moves with t.
    """
    for _ in range(MAX_STEPS):
        try:
            gradient, hessian = _derivatives(x, blocks)
            gradient[level] += t
            # A diagonal scaling evens out variables of different units before the symmetric solve.
            scale = 1 / np.sqrt(np.diag(hessian))
            cholesky = scipy.linalg.cho_factor(hessian * np.outer(scale, scale))
            step = -scale * scipy.linalg.cho_solve(cholesky, scale * gradient)
        except np.linalg.LinAlgError:
            raise SolverError(f"Newton's method met a matrix that is not positive at t = {t:.3g}; {_ADVICE}") from None
        decrement = float(np.sqrt(max(0.0, -gradient @ step)))
        x = x + step / (1 + decrement if decrement > FULL_STEP else 1.0)
        if decrement <= DECREMENT:
            return x, -scale * scipy.linalg.cho_solve(cholesky, scale * np.eye(len(x))[level])
    raise SolverError(f"no centre at t = {t:.3g}: Newton decrement {decrement:.3g} after {MAX_STEPS} steps; {_ADVICE}")


_ADVICE = "ask for a wider gap or a smaller factor, and see that (d, w) disturb every state (else there is no centre)"


def _derivatives(x: Array, blocks: list[Inequalities]) -> tuple[Array, Array]:
    """Gradient (v,) and Hessian (v, v) of -sum_k log det F_k at x."""
    gradient, hessian = np.zeros(len(x)), np.zeros((len(x), len(x)))
    for block in blocks:
        inverse = np.linalg.inv(np.linalg.cholesky(_block_at(block, x)))
        (variables,) = block.variables
        whitened = (inverse @ block.coefficients[0] @ inverse.T).reshape(len(variables), -1)
        gradient[variables] -= whitened[:, :: len(inverse) + 1].sum(axis=1)
        hessian[np.ix_(variables, variables)] += whitened @ whitened.T
    return gradient, hessian
