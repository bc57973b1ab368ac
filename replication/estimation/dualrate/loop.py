"""The closed dual-rate loop as a linear M-periodic system over the fast instants, and its exact responses.

State z = (x, o, v): plant, observer, last computed command. With y_d = 0 it is (1), (8) and the observer; a command
r(k) adds to K x̂(k), and each sensor reading may carry noise.

Between slow instants everything is linear and M T-periodic, so with y_d = Im exp(st), s = jσ, the steady state at the
slow instants is X = (e^{sMT} I − Φ)⁻¹ Γ e^{s t}: no time stepping. The largest modulus of the error's complex amplitude
over one slow period is the supremum of the error over all time if σ M T/(2π) is irrational, and an upper bound if not.

The slow instants obey z(n+1) = Φ z(n) + Im(Γ e^{sMTn}); everything inside a slow period is a fixed linear map of its
start, so all periods are filled in at once. Works for unstable loops.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.dualrate.observers import (
    Builder,
    Harmonic,
    Held,
    ObserverStep,
    forced,
    over_time,
    sampled_model,
)
from replication.estimation.dualrate.problem import DualRateDesign, Plant, as_plant, row_of_output
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.linear.riccati import gramians
from replication.estimation.validation import Array, ComplexArray, StateSpace, finite_vector, one_of, positive_integer

MARGINAL = 1e-12
"""A monodromy radius this near to one is one, up to rounding."""


@dataclass(frozen=True, eq=False)
class LoopStep:
    """One phase: z' = state z + command r + noise n + forcing w; applied input u and estimate x̂ of the same form."""

    state: Array
    command: Array
    noise: Array
    forcing: ComplexArray
    input_state: Array
    input_command: Array
    estimate_state: Array


@dataclass(frozen=True, eq=False)
class DualRateLoop:
    """A design, the plant that it really drives, and the M steps of the closed loop."""

    design: DualRateDesign
    plant: Plant
    harmonic: Harmonic | None
    steps: tuple[LoopStep, ...]

    @property
    def size(self) -> int:
        """Number of states of (x, o, v)."""
        return len(self.steps[0].state)


class Driven(NamedTuple):
    """One instant of a loop that follows set-points r: z+ = state z + drive r, u = input z + ahead r, x^ = estimate z.

    The first states are those of the plant, then come those of the observer, x^ in front.
    """

    state: Array
    drive: Array
    input: Array
    ahead: Array
    estimate: Array


def close_loop(
    design: DualRateDesign,
    builder: Builder,
    *,
    plant: StateSpace | Plant | None = None,
    harmonic: Harmonic | None = None,
    discrete_gain: bool = False,
) -> DualRateLoop:
    """Close the loop of `design` with one of `OBSERVERS`.

    plant: the true plant if it differs from the model; it may have another order, unless the full state is measured.
    harmonic: the reference, if there is one. discrete_gain: L corrects by steps (see `sampled_model`).
    Raises InvalidInputError: not an observer, a plant or a command that does not fit the model.
    """
    if not callable(builder):
        raise InvalidInputError(f"the observer must be one of OBSERVERS, such as OBSERVERS[{builder!r}]")
    true_plant = design.model if plant is None else as_plant(plant)
    m, outputs = design.model.B_u.shape[1], len(design.model.C)
    if true_plant.B_u.shape[1] != m or len(true_plant.C) != outputs:
        raise InvalidInputError(
            f"the true plant must have the {m} inputs and {outputs} outputs of the model, got "
            f"{true_plant.B_u.shape[1]} and {len(true_plant.C)}"
        )
    if harmonic is not None and len(harmonic.amplitude) != m:
        raise InvalidInputError(
            f"the harmonic needs one amplitude for each of the {m} inputs, got {len(harmonic.amplitude)}"
        )
    model = sampled_model(design, harmonic, discrete_gain=discrete_gain)
    observer = builder(model)
    if observer.full_state and true_plant.order != design.model.order:
        raise InvalidInputError(
            f"state feedback needs a true plant with the {design.model.order} states of the model, got "
            f"{true_plant.order}"
        )
    sampled = model.predictor if plant is None else over_time(true_plant, design.period, harmonic)
    sensed = np.eye(true_plant.order) if observer.full_state else true_plant.C
    law = np.hstack([design.feedback, np.zeros((m, m))])
    # The phases after the first are alike.
    closed = cache(partial(loop_step, law, plant=sampled, sensed=sensed))
    pairs = [(step, phase == 0 or not observer.slow_command) for phase, step in enumerate(observer.steps)]
    return DualRateLoop(design, true_plant, harmonic, tuple(closed(step, computes=now) for step, now in pairs))


def loop_step(law: Array, o: ObserverStep, plant: Held, sensed: Array, *, computes: bool = True) -> LoopStep:
    """One phase over z = (x, o, v): read m = sensed x, estimate, compute v+ = law (x̂, v) + r or keep the last v."""
    n, m, size = plant.state.shape[0], plant.input.shape[1], o.transition.shape[0]
    p = sensed.shape[0]
    estimate = np.hstack([o.feedthrough @ sensed, o.readout, np.zeros((len(o.readout), m))])
    last = np.hstack([np.zeros((m, n + size)), np.eye(m)])
    by_state, by_command, by_noise = last, np.zeros((m, m)), np.zeros((m, p))
    if computes:
        by_state, by_command, by_noise = law @ np.vstack([estimate, last]), np.eye(m), law[:, :-m] @ o.feedthrough
    drive = np.vstack([plant.input, o.input, np.eye(m)])
    free = np.zeros((n + size + m, n + size + m))
    free[:n, :n] = plant.state
    free[n : n + size, : n + size] = np.hstack([o.injection @ sensed, o.transition])
    read = np.vstack([np.zeros((n, p)), o.injection, np.zeros((m, p))])
    return LoopStep(
        state=free + drive @ by_state,
        command=drive @ by_command,
        noise=read + drive @ by_noise,
        forcing=np.concatenate([plant.forcing, o.forcing, np.zeros(m)]),
        input_state=by_state,
        input_command=by_command,
        estimate_state=estimate,
    )


def driven(steps: Sequence[LoopStep], ahead: Sequence[Array]) -> list[Driven]:
    """The loop with the command ahead r, instant by instant; ahead (m, t) for each."""
    return [
        Driven(step.state, step.command @ N, step.input_state, step.input_command @ N, step.estimate_state)
        for step, N in zip(steps, ahead, strict=True)
    ]


def monodromy(loop: DualRateLoop) -> Array:
    """Φ = S_{M−1} … S_0, shape (nz, nz): the state transition over one slow period; InvalidInputError on overflow."""
    total = np.eye(loop.size)
    with np.errstate(over="ignore", invalid="ignore"):
        for step in loop.steps:
            total = step.state @ total
    if not np.all(np.isfinite(total)):
        raise InvalidInputError(
            f"the loop overflows over M T = {loop.design.slow_period:g} s: the plant grows too fast for this slow "
            "period; choose a shorter one"
        )
    return total


def stability_radius(loop: DualRateLoop) -> float:
    """Largest modulus of the eigenvalues of the monodromy matrix; the loop is stable iff it is below one."""
    return float(np.max(np.abs(np.linalg.eigvals(monodromy(loop)))))


def require_stable(loop: DualRateLoop, consequence: str) -> None:
    """Raise InfeasibleError, ending in `consequence`, unless the radius is below one by more than rounding."""
    radius = stability_radius(loop)
    if radius >= 1.0 - MARGINAL:
        word = "unstable" if radius > 1.0 + MARGINAL else "marginal"
        raise InfeasibleError(f"the loop is {word} (monodromy radius {radius:.6g}, must be below 1): {consequence}")


def noise_system(loop: DualRateLoop, weight: float = 1.0) -> PeriodicSystem:
    """The loop from the sensor noise to the plant outputs times `weight` at all M phases."""
    rows = len(loop.plant.C)
    output = weight * np.hstack([loop.plant.C, np.zeros((rows, loop.size - loop.plant.order))])
    return PeriodicSystem(
        tuple(Stage(step.state, step.noise, output, np.zeros((rows, step.noise.shape[1]))) for step in loop.steps)
    )


def lifted_system(loop: DualRateLoop) -> StateSpace:
    """`noise_system` over one slow period, dt = M T: inputs the sensor noises, outputs those of all M phases."""
    import control

    return control.StateSpace(*noise_system(loop).lift(), loop.design.slow_period)


def noise_gain(loop: DualRateLoop) -> float:
    """Standard deviation of the output per unit standard deviation of white noise on each sensor reading.

    The largest over the fast instants, from the periodic Lyapunov equation, by doubling: units of the states do not
    matter. Raises InfeasibleError if the loop is unstable.
    """
    require_stable(loop, "its noise grows without bound")
    stages = noise_system(loop).stages
    covariances = gramians((s.A, s.B) for s in stages)
    if covariances is None:
        raise SolverError("the covariance of the output was lost in rounding; choose other units of the states")
    return float(np.sqrt(max(np.max(np.diag(s.C @ P @ s.C.T)) for s, P in zip(stages, covariances, strict=True))))


LEAST_SUBSTEPS, POINTS_PER_TURN = 100, 20
"""Grid before the refinement: points per fast period at least, and points per turn of the fastest oscillation."""
NEARLY_HIGHEST, REFINED = 0.98, 5
"""Local maxima of the grid that are refined: those near its highest, since 20 points a turn miss up to 1.3 % of one,
and no more than five."""
MOST_STEPS, CLOSE = 8, 1e-6
"""Of Newton's method; of a step of the grid, a step that ends it: as many digits again are right after it."""


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
    if loop.plant.C.shape[0] != 1:
        raise InvalidInputError(f"tracking is defined for one output, the plant has {loop.plant.C.shape[0]}")
    if loop.harmonic is None:
        raise InvalidInputError("the loop has no reference; close it with a `harmonic`")
    return loop.harmonic


def command(loop: DualRateLoop) -> Harmonic:
    """What drives the loop: its reference, or the command zero if it has none."""
    return loop.harmonic or Harmonic(0.0, np.zeros(loop.plant.B_u.shape[1], complex))


def output_rows(loop: DualRateLoop, substeps: int, output: int = 0) -> OutputRows:
    """The map to one output at τ = 0, T/q, …, (q−1)T/q for q = substeps, from one exponential of the sub-step."""
    positive_integer("number of sub-steps", substeps)
    width, plant = loop.design.period / substeps, loop.plant
    s, step = command(loop).exponent, over_time(plant, width, loop.harmonic)
    n, m = plant.B_u.shape
    joint = np.eye(n + m + 1, dtype=complex)  # x, the held input and w = exp(st) over one sub-step
    joint[:n] = np.hstack([step.state, step.input, step.forcing[:, None]])
    joint[-1, -1] = np.exp(s * width)
    powers = np.eye(n + m + 1, dtype=complex)[None]
    while len(powers) < substeps:
        powers = np.concatenate([powers, powers @ np.linalg.matrix_power(joint, len(powers))])
    rows = np.tensordot(powers[:substeps, :n], plant.C[output], axes=(1, 0))
    offsets = np.arange(substeps, dtype=float) * width
    return OutputRows(offsets, rows[:, :n].real, rows[:, n : n + m].real, rows[:, -1])


def period_response(loop: DualRateLoop, start: ComplexArray, turn: complex | ComplexArray = 1.0) -> SteadyState:
    """States at phases 0 … M (M + 1 rows) and inputs at phases 0 … M−1, for z = start at t = 0 and w = turn · exp(st).

    Several starts (N, nz) have turns (N, 1).
    """
    harmonic = command(loop)
    states, inputs = [start], []
    for phase, step in enumerate(loop.steps):
        w = turn * np.exp(harmonic.exponent * phase * loop.design.period)
        r = np.zeros_like(harmonic.amplitude) if harmonic.continuous else harmonic.amplitude * w
        inputs.append(states[-1] @ step.input_state.T + r @ step.input_command.T)
        states.append(states[-1] @ step.state.T + r @ step.command.T + step.forcing * w)
    return SteadyState(np.array(states), np.array(inputs))


def steady_state(loop: DualRateLoop) -> SteadyState:
    """The periodic steady state. Raises InfeasibleError if the loop is unstable: it has none."""
    harmonic = reference(loop)
    require_stable(loop, "it has no steady state; ask for its time response instead")
    transition = monodromy(loop)
    gain = period_response(loop, np.zeros(loop.size, complex)).states[-1]
    turn = np.exp(harmonic.exponent * loop.design.slow_period)
    start = np.linalg.solve(turn * np.eye(loop.size) - transition, gain)
    return period_response(loop, start)


def tracking_error_ratio(loop: DualRateLoop, points: Points = Points.BETWEEN) -> float:
    """sup |y − y_d| / |y_d| in the steady state, a pure number; raises InfeasibleError if the loop is unstable."""
    points = one_of(Points, points)
    if points is Points.BETWEEN:
        return tracking_error_peak(loop)[0]
    return float(np.max(fast_errors(loop)[: 1 if points is Points.SLOW else None]))


def fast_errors(loop: DualRateLoop) -> Array:
    """|y − y_d| / |y_d| at the fast instants of a slow period in the steady state, shape (M,)."""
    return np.abs(_errors(loop, steady_state(loop), output_rows(loop, 1)))[:, 0]


def tracking_error_peak(loop: DualRateLoop) -> tuple[float, float]:
    """The ratio of `tracking_error_ratio` over all times, and the time in [0, M T) where it is met, s."""
    # Enough points for the fastest oscillation in the error: of the plant, or of the reference.
    fastest = max(float(np.max(np.abs(np.linalg.eigvals(loop.plant.A).imag))), abs(reference(loop).frequency))
    substeps = max(LEAST_SUBSTEPS, int(np.ceil(POINTS_PER_TURN * loop.design.period * fastest / (2 * np.pi))))
    steady = steady_state(loop)
    sizes = np.abs(_errors(loop, steady, output_rows(loop, substeps))).ravel()
    width = loop.design.period / substeps
    peaks = np.flatnonzero((sizes >= np.roll(sizes, 1)) & (sizes >= np.roll(sizes, -1)))
    peaks = peaks[np.argsort(-sizes[peaks], kind="stable")][:REFINED]
    near = [int(peak) for peak in peaks if sizes[peak] >= NEARLY_HIGHEST * sizes.max()]
    highest = float(sizes.max()), int(sizes.argmax()) * width
    return max(highest, *(_refined(loop, steady, peak * width, width, _offset(sizes, peak)) for peak in near))


def _offset(sizes: Array, peak: int) -> float:
    """Where the parabola through a local maximum of a periodic grid and its neighbours is highest, in its steps."""
    before, at, after = sizes[peak - 1], sizes[peak], sizes[(peak + 1) % len(sizes)]
    bend = before - 2 * at + after
    return float((before - after) / bend / 2) if bend < 0 else 0.0


def _refined(loop: DualRateLoop, steady: SteadyState, start: float, width: float, offset: float) -> tuple[float, float]:
    """The highest amplitude of the error within `width` of `start`, and where it is met, modulo the slow period.

    offset: in widths, where to begin. Newton's method for the slope of the squared amplitude; where that jumps, at a
    fast instant, a point of the grid is the peak.
    """
    best, time = (0.0, start), start + offset * width
    for _ in range(MOST_STEPS):
        error, slope, bend = _error_at(loop, steady, time)
        best = max(best, (abs(error), time))
        rise, curve = (error.conjugate() * slope).real, abs(slope) ** 2 + (error.conjugate() * bend).real
        step = -rise / curve if curve < 0.0 else float(np.copysign(width / 2.0, rise))
        following = min(max(time + step, start - width), start + width)
        if abs(following - time) <= CLOSE * width:
            break
        time = following
    return best[0], best[1] % loop.design.slow_period


def _errors(loop: DualRateLoop, steady: SteadyState, rows: OutputRows) -> ComplexArray:
    """Complex amplitudes of y − y_d, shape (M, q), turned back to the phase of t = 0."""
    s, n = reference(loop).exponent, loop.plant.order
    starts = np.exp(s * loop.design.period * np.arange(loop.design.ratio))
    output = steady.states[:-1, :n] @ rows.state.T + steady.inputs @ rows.input.T + np.outer(starts, rows.forcing)
    return np.asarray(output - np.outer(starts, np.exp(s * rows.offsets)))


def _error_at(loop: DualRateLoop, steady: SteadyState, time: float) -> tuple[complex, complex, complex]:
    """Amplitude of y − y_d at any time of the steady state, and its first two derivatives by time."""
    time, plant = time % loop.design.slow_period, loop.plant
    phase = min(int(time // loop.design.period), loop.design.ratio - 1)
    s, after = reference(loop).exponent, time - phase * loop.design.period
    part, u, w = over_time(plant, after, loop.harmonic), steady.inputs[phase], np.exp(s * phase * loop.design.period)
    drive = forced(plant, loop.harmonic) * w * np.exp(s * after)
    x = part.state @ steady.states[phase, : plant.order] + part.input @ u + part.forcing * w
    rate = plant.A @ x + plant.B_u @ u + drive
    bend = plant.A @ rate + s * drive
    row, aim = plant.C[0], np.exp(s * time)
    return tuple(complex(row @ part - s**k * aim) for k, part in enumerate((x, rate, bend)))  # type: ignore[return-value]


@dataclass(frozen=True, eq=False)
class Response:
    """time (N,) in s, output and reference (N,) on the fine grid; instants (Nf,) in s, state and estimate (Nf, n),
    input (Nf, m) at the fast instants, where the estimate and the input are formed."""

    time: Array
    output: Array
    reference: Array
    instants: Array
    state: Array
    estimate: Array
    input: Array

    @property
    def error(self) -> Array:
        """y − y_d on the fine grid."""
        return self.output - self.reference


def time_response(
    loop: DualRateLoop, start: Any, estimate: Any, *, slow_periods: int, substeps: int, output: int = 0
) -> Response:
    """Response from x(0) = start, ζ(0) = estimate to the reference of the loop, `substeps` points per fast period.

    A loop without a reference is left to itself, and the reference of its response is zero. output: which output of
    the plant, from 0. Raises InvalidInputError if there is no such output, a start has the wrong length or is not
    finite, or a count is not a positive integer.
    """
    harmonic, design, n = command(loop), loop.design, loop.plant.order
    positive_integer("number of slow periods", slow_periods)
    rows = output_rows(loop, substeps, row_of_output(loop.plant, output))
    fast = design.period * np.arange(slow_periods * design.ratio, dtype=float).reshape(slow_periods, design.ratio)
    phasor, transition = np.exp(harmonic.exponent * fast), monodromy(loop)
    gain = period_response(loop, np.zeros(loop.size, complex)).states[-1]
    starts = [start_state(loop, start, estimate)]
    for turn in phasor[:-1, 0]:
        starts.append(transition @ starts[-1] + np.imag(gain * turn))
    # All is the imaginary part of a complex response, a real start z that of j z.
    within = period_response(loop, np.array(starts, complex) * 1j, phasor[:, :1])
    states, u = within.states[:-1].imag, np.swapaxes(within.inputs.imag, 0, 1)
    x = np.swapaxes(states[..., :n], 0, 1)
    xhat = np.stack([z @ step.estimate_state.T for z, step in zip(states, loop.steps, strict=True)], axis=1)
    outputs = x @ rows.state.T + u @ rows.input.T + np.imag(phasor[..., None] * rows.forcing)
    time = fast[..., None] + rows.offsets
    return Response(
        time=time.ravel(),
        output=outputs.ravel(),
        reference=np.sin(harmonic.frequency * time).ravel(),
        instants=fast.ravel(),
        state=x.reshape(-1, n),
        estimate=xhat.reshape(fast.size, -1),
        input=u.reshape(fast.size, -1),
    )


def start_state(loop: DualRateLoop, start: Any, estimate: Any) -> Array:
    """z(0) of the loop from x(0) and ζ(0), of the orders of the plant and of the model; raises InvalidInputError."""
    n, order = loop.plant.order, loop.design.model.order
    z = np.zeros(loop.size)
    has_observer = loop.size > n + loop.plant.B_u.shape[1]
    z[:n] = finite_vector("x(0)", start, n)
    zeta = finite_vector("ζ(0)", estimate, order)
    if has_observer:
        z[n : n + order] = zeta
    return z
