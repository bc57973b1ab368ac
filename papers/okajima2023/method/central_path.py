"""Analytic centres of the matrix inequality of Theorem 2, eq. (30), reduced to the sensors that are measured.

The centre at t minimises t gamma^2 - sum_k log det F_k over (P, Y, gamma^2), where F_k is the matrix of eq. (30) at
phase k. Interior-point solvers follow these points, so the gains that a solver returned, which are not unique, lie near
one of them. Source: Nesterov and Nemirovskii, Interior-Point Polynomial Algorithms in Convex Programming (SIAM, 1994).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from papers.okajima2023.method.lmi import Layout, inequalities
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.conic.program import Inequalities, SolverReport
from replication.estimation.multirate.problem import MultirateProblem, require_problem
from replication.estimation.validation import Array, positive_scalar

DECREMENT = 1e-6
"""Newton decrement at which a point counts as the centre: half its square is the distance from the minimum."""
FULL_STEP = 0.25
"""Below this decrement full Newton steps converge quadratically; above it damped ones keep every F_k positive."""
MAX_STEPS = 300
INSIDE = 0.5
"""Length of the longest step along the path in the norm of the barrier; below one, every F_k stays positive."""


@dataclass(frozen=True, eq=False)
class CentralPoint:
    """One centre. level: its gamma; gap: level^2 - gap <= optimum^2 <= level^2; gains L_k = P_k^-1 Y_k (N, n, q).

    The gain of the error system with these gains is below `level`. report: steps and decrement of Newton's method.
    """

    level: float
    gap: float
    gains: Array
    report: SolverReport


def central_path(
    problem: MultirateProblem, start_gains: npt.ArrayLike, *, gap: float, factor: float = 1.5
) -> Iterator[CentralPoint]:
    """Follow the centres from a wide gap, divided by `factor` from point to point, down to exactly `gap`, in gamma^2.

    start_gains (N, n, q) must stabilise the error system; the points do not depend on them, except for the first gap.
    Dense Newton steps: O(N n^6) to assemble and O(N^3 n^6) to solve each, so meant for small plants and short periods.
    Raises, before the first point, InvalidInputError for gains of another shape, a gap that is not positive or a factor
    that is not above 1, and InfeasibleError if the gains do not stabilise; SolverError, on the way, if Newton's method
    does not reach a centre.
    """
    require_problem(problem)
    gap, factor = positive_scalar("gap", gap), positive_scalar("factor", factor)
    if factor <= 1:
        raise InvalidInputError(f"factor must be above 1, got {factor!r}: the gap is divided by it from point to point")
    layout = Layout(problem)
    blocks = inequalities(layout)
    x = _interior_point(problem, np.asarray(start_gains, dtype=float), layout, blocks)
    return _follow(layout, blocks, x, gap, factor)


def _follow(layout: Layout, blocks: list[Inequalities], x: Array, gap: float, factor: float) -> Iterator[CentralPoint]:
    """The points of `central_path` from the interior point x; at a centre, the gap is (sum of the sizes of F_k) / t."""
    order = sum(block.constant.shape[-1] for block in blocks)
    current = max(float(x[layout.level]), gap)
    while True:
        x, tangent, report = _centre(x, layout.level, order / current, blocks)
        design = layout.design(x, report)
        yield CentralPoint(design.level, current, design.gains, report)
        if current <= gap:
            return
        following = max(current / factor, gap)
        step = order / following - order / current
        # Along the tangent as far as all F_k are positive for certain, in the norm of the barrier.
        x = x + min(step, INSIDE / float(np.sqrt(-tangent[layout.level]))) * tangent
        current = following


def _interior_point(problem: MultirateProblem, gains: Array, layout: Layout, blocks: list[Inequalities]) -> Array:
    """Variables with all F_k > 0: P_{k-1} = A_ek' P_k A_ek + W'W + Q with Q > 0, Y_k = P_k L_k, and a large gamma^2."""
    system = problem.error_system(gains)
    radius = system.spectral_radius()
    if radius >= 1:
        raise InfeasibleError(
            f"start_gains do not stabilise the error system (multiplier of modulus {radius:.6g}); "
            "start from those of `kalman_design` or `optimal_design`"
        )
    scales = layout.scales
    ahead = [scales[(k + 1) % layout.period] for k in range(layout.period)]
    steps = [np.linalg.solve(T1, s.A @ T) for T1, s, T in zip(ahead, system.stages, scales, strict=True)]
    weights = [T.T @ problem.plant.W.T @ problem.plant.W @ T for T in scales]
    weights = [Q + max(float(np.linalg.norm(Q)), 1e-6) * np.eye(layout.n) for Q in weights]

    def backward(P: Array) -> list[Array]:
        """P_{N-1} given, all P_k of the recursion, and at the end P_{-1}."""
        found = [P]
        for step, Q in zip(steps[::-1], weights[::-1], strict=True):
            found.append(step.T @ found[-1] @ step + Q)
        return found

    monodromy = np.linalg.multi_dot([np.eye(layout.n), *steps[::-1], np.eye(layout.n)])
    last = scipy.linalg.solve_discrete_lyapunov(monodromy.T, backward(np.zeros((layout.n, layout.n)))[-1])
    x = np.zeros(layout.variables)
    for k, P in zip(reversed(range(layout.period)), backward(last)[:-1], strict=True):
        x[layout.P(k)] = (P + P.T) / 2
        x[layout.Y(k)] = P @ np.linalg.solve(ahead[k], gains[k][:, layout.rows[k]])
    x[layout.level] = max(float(np.linalg.norm(Q)) for Q in weights)
    while not all(_positive_definite(_value(block, x)) for block in blocks):
        x[layout.level] *= 2
        if not np.isfinite(x[layout.level]):
            raise SolverError("no interior point was found from start_gains: they hardly stabilise; take other gains")
    return x


def _value(block: Inequalities, x: Array) -> Array:
    """F_k(x), shape (s, s)."""
    return np.asarray(block.constant[0] + np.tensordot(x[block.variables[0]], block.coefficients[0], 1))


def _positive_definite(matrix: Array) -> bool:
    return bool(np.linalg.eigvalsh(matrix)[0] > 0)


def _centre(x: Array, level: int, t: float, blocks: list[Inequalities]) -> tuple[Array, Array, SolverReport]:
    """Damped Newton method for the minimum of t x[level] - sum_k log det F_k(x) from an interior point.

    The minimum, and how it moves with t.
    """
    for count in range(1, MAX_STEPS + 1):
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
            pull = scale * np.eye(len(x))[level]
            return x, -scale * scipy.linalg.cho_solve(cholesky, pull), _report("Centred", count, decrement)
    raise SolverError(f"no centre at t = {t:.3g}: Newton decrement {decrement:.3g} after {MAX_STEPS} steps; {_ADVICE}")


_ADVICE = "ask for a wider gap or a smaller factor, and see that (d, w) disturb every state (else there is no centre)"


def _derivatives(x: Array, blocks: list[Inequalities]) -> tuple[Array, Array]:
    """Gradient (v,) and Hessian (v, v) of -sum_k log det F_k at x."""
    gradient, hessian = np.zeros(len(x)), np.zeros((len(x), len(x)))
    for block in blocks:
        inverse = np.linalg.inv(np.linalg.cholesky(_value(block, x)))
        (variables,) = block.variables
        whitened = (inverse @ block.coefficients[0] @ inverse.T).reshape(len(variables), -1)
        gradient[variables] -= whitened[:, :: len(inverse) + 1].sum(axis=1)
        hessian[np.ix_(variables, variables)] += whitened @ whitened.T
    return gradient, hessian


def _report(status: str, steps: int, decrement: float) -> SolverReport:
    return SolverReport(
        name="damped Newton (numpy)",
        version=np.__version__,
        status=status,
        options={"decrement": DECREMENT, "max_steps": MAX_STEPS},
        residuals={"decrement": decrement},
        iterations=steps,
    )
