"""Numbers of a loop that the paper speaks of: error and lag of the estimate, bandwidth, energy of a transient."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy

from replication.errors import InfeasibleError
from replication.estimation.dualrate.loop import DualRateLoop, monodromy, require_stable
from replication.estimation.dualrate.problem import Plant
from replication.estimation.dualrate.response import reference, steady_state, tracking_error_ratio
from replication.estimation.validation import Array, ComplexArray, increasing_grid, positive_scalar


def estimation_error_ratio(loop: DualRateLoop) -> float:
    """Largest |y − C x̂| / |y_d| over the fast instants in the steady state; InfeasibleError if unstable."""
    return float(np.max(np.abs(_estimation_errors(loop))))


def estimation_lag(loop: DualRateLoop) -> float:
    """Mean time in s by which C x̂ lags y in the steady state: mean of (y − C x̂)/(s y) over the fast instants.

    Meaningful for σ well below the loop's rates, where y is close to a ramp within a slow period.
    """
    steady, n = steady_state(loop), loop.plant.order
    outputs = steady.states[:-1, :n] @ loop.plant.C[0]
    return float(np.real(np.mean(_estimation_errors(loop) / (reference(loop).exponent * outputs))))


def bandwidth(
    loop_at: Callable[[float], DualRateLoop], level: float, frequencies: Sequence[float], *, tolerance: float = 1e-10
) -> float:
    """The first σ (rad/s) with a tracking error ratio of `level`, searched on an increasing grid, then refined.

    Raises InfeasibleError if the ratio stays below the level on the grid or already exceeds it at its first point,
    or if the loop is unstable; InvalidInputError unless the level is positive and the grid increases from above zero.
    """
    from scipy.optimize import brentq  # slow to load

    level = positive_scalar("error level", level)
    grid = increasing_grid("frequencies", frequencies)

    def excess(frequency: float) -> float:
        return tracking_error_ratio(loop_at(frequency)) - level

    previous = float(grid[0])
    if excess(previous) >= 0:
        raise InfeasibleError(f"the error ratio exceeds {level:g} from σ = {previous:g} rad/s on; start lower")
    for frequency in grid[1:]:
        if excess(frequency) >= 0:
            return float(brentq(excess, previous, frequency, xtol=tolerance))
        previous = float(frequency)
    raise InfeasibleError(f"the error ratio stays below {level:g} up to σ = {previous:g} rad/s; search higher")


def _estimation_errors(loop: DualRateLoop) -> ComplexArray:
    """Complex amplitudes of y − C x̂ at the phases, shape (M,)."""
    steady, n = steady_state(loop), loop.plant.order
    estimates = [step.estimate_state @ z for step, z in zip(loop.steps, steady.states[:-1], strict=True)]
    return np.asarray(steady.states[:-1, :n] @ loop.plant.C[0] - estimates @ loop.design.model.C[0])


def transient_energy(loop: DualRateLoop, offset: Array) -> tuple[float, float]:
    """∫₀^∞ y² dt of the loop left to itself from z(0) = offset, and a bound of the error of solving for it; rad² s.

    Exact in time: over a fast period the integral is a form in (x, u) from one exponential, over all slow periods one
    in z, X = Φ'XΦ + Q. The second number is what X leaves of that equation, summed over all periods.
    Raises InfeasibleError if the loop is unstable.
    """
    require_stable(loop, "the energy of its transient is infinite")
    free, n, size = replace(loop, harmonic=None), loop.plant.order, loop.size
    within, reached, period = _held_energy(loop.plant, loop.design.period), np.eye(size), np.zeros((size, size))
    for step in free.steps:
        joint = np.vstack([np.eye(size)[:n], step.input_state]) @ reached
        period += joint.T @ within @ joint
        reached = step.state @ reached
    transition = monodromy(free)
    total = scipy.linalg.solve_discrete_lyapunov(transition.T, period)
    left = transition.T @ total @ transition + period - total
    summed = scipy.linalg.solve_discrete_lyapunov(transition, np.outer(offset, offset))
    missed = np.linalg.norm(left, 2) * np.trace(summed)
    return float(offset @ total @ offset), float(missed)


def _held_energy(plant: Plant, time: float) -> Array:
    """∫₀^T y² dt as a form in (x, u) with u held, by the exponential of a block matrix (Van Loan 1978)."""
    n, m = plant.B_u.shape
    flow, row = np.zeros((n + m, n + m)), np.hstack([plant.C[0], np.zeros(m)])
    flow[:n] = np.hstack([plant.A, plant.B_u])
    blocks = np.block([[-flow.T, np.outer(row, row)], [np.zeros_like(flow), flow]])
    power = scipy.linalg.expm(blocks * time)
    return np.asarray(power[n + m :, n + m :].T @ power[: n + m, n + m :])
