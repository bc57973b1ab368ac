"""Analytic centres of the matrix inequality of Theorem 2, eq. (30), reduced to the sensors that are measured.

The centre at t minimises t gamma^2 - sum_k log det F_k over (P, Y, gamma^2), where F_k is the matrix of eq. (30) at
phase k. Interior-point solvers follow these points, so the gains that a solver returned, which are not unique, lie near
one of them. Source: Nesterov and Nemirovskii, Interior-Point Polynomial Algorithms in Convex Programming (SIAM, 1994).
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy

from papers.okajima2023.method.lmi import Layout, inequalities
from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import Inequalities
from replication.estimation.linear.riccati import RiccatiMap, reversed_in_time, settled
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array

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
    blocks = inequalities(layout)
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
    backward = settled(reversed_in_time(RiccatiMap(steps.mT, np.zeros_like(steps), weights)))
    if backward is None:
        raise InfeasibleError("start_gains do not stabilise the error system; take those of `kalman_design`")
    x = np.zeros(layout.level + 1)
    for k, P in enumerate(backward[::-1]):
        x[layout.P[k]] = P
        x[layout.Y[k]] = P @ np.linalg.solve(ahead[k], gains[k][:, layout.rows[k]])
    x[layout.level] = np.linalg.norm(weights, axis=(1, 2)).max()
    while np.isfinite(x[layout.level]):
        if all(np.linalg.eigvalsh(_value(block, x))[0] > 0 for block in blocks):
            return x
        x[layout.level] *= 2
    raise SolverError("no interior point was found from start_gains: they hardly stabilise; take other gains")


def _value(block: Inequalities, x: Array) -> Array:
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
        inverse = np.linalg.inv(np.linalg.cholesky(_value(block, x)))
        (variables,) = block.variables
        whitened = (inverse @ block.coefficients[0] @ inverse.T).reshape(len(variables), -1)
        gradient[variables] -= whitened[:, :: len(inverse) + 1].sum(axis=1)
        hessian[np.ix_(variables, variables)] += whitened @ whitened.T
    return gradient, hessian
