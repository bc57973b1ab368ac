"""Steady-state response of a stable dual-rate loop to a sinusoidal reference, and its largest tracking error.

Between slow instants everything is linear and M T-periodic, so with y_d = Im exp(st), s = jσ, the steady state at the
slow instants is X = (e^{sMT} I − Φ)⁻¹ Γ e^{s t}: no time stepping. The largest modulus of the error's complex amplitude
over one slow period is the supremum of the error over all time if σ M T/(2π) is irrational, and an upper bound if not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.dualrate.loop import DualRateLoop, monodromy
from replication.estimation.dualrate.sampled import Harmonic, over_time
from replication.estimation.validation import Array, ComplexArray, positive_integer

SUBSTEPS = 100
"""Grid points per fast period before the refinement; the grid must be finer than the plant's fastest oscillation."""


class Points(StrEnum):
    """Where the tracking error is looked at: for all times, at fast instants, or at slow instants."""

    BETWEEN = "between"
    FAST = "fast"
    SLOW = "slow"


@dataclass(frozen=True, eq=False)
class OutputRows:
    """y(t_k + τ) = state x(t_k) + input u(t_k) + forcing w(t_k) at τ = offsets; shapes (q, n), (q, m), (q,)."""

    offsets: Array
    state: Array
    input: Array
    forcing: ComplexArray


@dataclass(frozen=True, eq=False)
class SteadyState:
    """Complex amplitudes at the M phases: loop states (M, nz), applied held inputs (M, m)."""

    states: ComplexArray
    inputs: ComplexArray


def reference(loop: DualRateLoop) -> Harmonic:
    """The reference of the loop; raises InvalidInputError if it has none or the plant has several outputs."""
    if loop.plant.output.shape[0] != 1:
        raise InvalidInputError(f"tracking is defined for one output, the plant has {loop.plant.output.shape[0]}")
    if loop.harmonic is None:
        raise InvalidInputError("the loop has no reference; close it with a `harmonic`")
    return loop.harmonic


def output_rows(loop: DualRateLoop, substeps: int) -> OutputRows:
    """The output map at τ = 0, T/q, …, (q−1)T/q for q = substeps, from one exponential of the sub-step."""
    positive_integer("number of sub-steps", substeps)
    width, plant = loop.design.period / substeps, loop.plant
    s, step = reference(loop).exponent, over_time(plant, width, loop.harmonic)
    n, m = plant.input.shape
    joint = np.eye(n + m + 1, dtype=complex)  # x, the held input and w = exp(st) over one sub-step
    joint[:n] = np.hstack([step.state, step.input, step.forcing[:, None]])
    joint[-1, -1] = np.exp(s * width)
    powers = np.eye(n + m + 1, dtype=complex)[None]
    while len(powers) < substeps:
        powers = np.concatenate([powers, powers @ np.linalg.matrix_power(joint, len(powers))])
    rows = np.tensordot(powers[:substeps, :n], plant.output[0], axes=(1, 0))
    offsets = np.arange(substeps, dtype=float) * width
    return OutputRows(offsets, rows[:, :n].real, rows[:, n : n + m].real, rows[:, -1])


def period_response(loop: DualRateLoop, start: ComplexArray) -> SteadyState:
    """States at phases 0 … M (M + 1 rows) and inputs at phases 0 … M−1, for z = start at t = 0 and w = exp(st)."""
    harmonic = reference(loop)
    states, inputs = [start], []
    for phase, step in enumerate(loop.steps):
        w = np.exp(harmonic.exponent * phase * loop.design.period)
        r = np.zeros_like(harmonic.amplitude) if harmonic.continuous else harmonic.amplitude * w
        inputs.append(step.input_state @ states[-1] + step.input_command @ r)
        states.append(step.state @ states[-1] + step.command @ r + step.forcing * w)
    return SteadyState(np.array(states), np.array(inputs))


def steady_state(loop: DualRateLoop) -> SteadyState:
    """The periodic steady state. Raises InfeasibleError if the loop is unstable: it has none."""
    harmonic = reference(loop)
    transition = monodromy(loop)
    radius = float(np.max(np.abs(np.linalg.eigvals(transition))))
    if radius >= 1.0:
        raise InfeasibleError(
            f"the loop is unstable (monodromy radius {radius:.6g} ≥ 1) and has no steady state; "
            "ask for its time response instead"
        )
    gain = period_response(loop, np.zeros(loop.size, complex)).states[-1]
    turn = np.exp(harmonic.exponent * loop.design.slow_period)
    start = np.linalg.solve(turn * np.eye(loop.size) - transition, gain)
    return period_response(loop, start)


def tracking_error_ratio(loop: DualRateLoop, points: Points = Points.BETWEEN) -> float:
    """sup |y − y_d| / |y_d| in the steady state, a pure number; raises InfeasibleError if the loop is unstable."""
    steady = steady_state(loop)
    if points is not Points.BETWEEN:
        rows = output_rows(loop, 1)
        return float(np.max(np.abs(_errors(loop, steady, rows)[: 1 if points is Points.SLOW else None])))
    rows = output_rows(loop, SUBSTEPS)
    sizes = np.abs(_errors(loop, steady, rows)).ravel()
    width = loop.design.period / SUBSTEPS
    best = int(np.argmax(sizes)) * width
    refined = minimize_scalar(
        lambda t: -_error_size(loop, steady, t),
        bounds=(best - width, best + width),
        method="bounded",
        options={"xatol": 1e-9 * width},
    )
    return float(max(sizes.max(), -refined.fun))


def estimation_error_ratio(loop: DualRateLoop) -> float:
    """Largest |y − C x̂| / |y_d| over the fast instants in the steady state; InfeasibleError if unstable."""
    return float(np.max(np.abs(_estimation_errors(loop))))


def estimation_lag(loop: DualRateLoop) -> float:
    """Mean time in s by which C x̂ lags y in the steady state: mean of (y − C x̂)/(s y) over the fast instants.

    Meaningful for σ well below the loop's rates, where y is close to a ramp within a slow period.
    """
    steady, n = steady_state(loop), loop.plant.size
    outputs = steady.states[:-1, :n] @ loop.plant.output[0]
    return float(np.real(np.mean(_estimation_errors(loop) / (reference(loop).exponent * outputs))))


def bandwidth(
    loop_at: Callable[[float], DualRateLoop], level: float, frequencies: Sequence[float], *, tolerance: float = 1e-10
) -> float:
    """The first σ (rad/s) with a tracking error ratio of `level`, searched on an increasing grid, then refined.

    Raises InfeasibleError if the ratio stays below the level on the grid or already exceeds it at its first point,
    or if the loop is unstable.
    """

    def excess(frequency: float) -> float:
        return tracking_error_ratio(loop_at(frequency)) - level

    previous = frequencies[0]
    if excess(previous) >= 0:
        raise InfeasibleError(f"the error ratio exceeds {level:g} from σ = {previous:g} rad/s on; start lower")
    for frequency in frequencies[1:]:
        if excess(frequency) >= 0:
            return float(brentq(excess, previous, frequency, xtol=tolerance))
        previous = frequency
    raise InfeasibleError(f"the error ratio stays below {level:g} up to σ = {previous:g} rad/s; search higher")


def _estimation_errors(loop: DualRateLoop) -> ComplexArray:
    """Complex amplitudes of y − C x̂ at the phases, shape (M,)."""
    steady, n = steady_state(loop), loop.plant.size
    estimates = [step.estimate_state @ z for step, z in zip(loop.steps, steady.states[:-1], strict=True)]
    return np.asarray((steady.states[:-1, :n] - np.array(estimates)) @ loop.plant.output[0])


def _errors(loop: DualRateLoop, steady: SteadyState, rows: OutputRows) -> ComplexArray:
    """Complex amplitudes of y − y_d, shape (M, q), turned back to the phase of t = 0."""
    s, n = reference(loop).exponent, loop.plant.size
    starts = np.exp(s * loop.design.period * np.arange(loop.design.ratio))
    output = steady.states[:-1, :n] @ rows.state.T + steady.inputs @ rows.input.T + np.outer(starts, rows.forcing)
    return np.asarray(output - np.outer(starts, np.exp(s * rows.offsets)))


def _error_size(loop: DualRateLoop, steady: SteadyState, time: float) -> float:
    """|y − y_d| amplitude at any time of the steady state, modulo the slow period."""
    time = time % loop.design.slow_period
    phase = min(int(time // loop.design.period), loop.design.ratio - 1)
    s, part = reference(loop).exponent, over_time(loop.plant, time - phase * loop.design.period, loop.harmonic)
    w = np.exp(s * phase * loop.design.period)
    x = part.state @ steady.states[phase, : loop.plant.size] + part.input @ steady.inputs[phase] + part.forcing * w
    return float(np.abs(loop.plant.output[0] @ x - np.exp(s * time)))
