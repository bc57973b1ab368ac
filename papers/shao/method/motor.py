"""The motor of eq. (23), the numbers of a loop that the paper speaks of, and the algorithm simulated step by step.

The motor is permanent magnet synchronous; x = (θ, ω, dω/dt), with the input u_q. Its data are those of an example.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import scipy

from replication.estimation.dualrate.loop import DualRateLoop, monodromy, reference, require_stable, steady_state
from replication.estimation.dualrate.observers import Harmonic
from replication.estimation.dualrate.problem import DualRateDesign, Plant, make_plant
from replication.estimation.nonuniform.stamped.kalman import Transition
from replication.estimation.validation import Array, ComplexArray


@dataclass(frozen=True, kw_only=True)
class Motor:
    """resistance R in Ω, flux Ψ_f in Wb, inductance L_q in H, pole_pairs p, friction B_ω in N m s/rad, inertia J in
    kg m², torque_constant K_T in N m/A; all positive."""

    resistance: float
    flux: float
    inductance: float
    pole_pairs: int
    friction: float
    inertia: float
    torque_constant: float

    @property
    def coefficients(self) -> tuple[float, float, float]:
        """a₂ = (R B_ω + K_T p Ψ_f)/(J L_q) in 1/s², a₃ = R/L_q + B_ω/J in 1/s, b = K_T/(J L_q) in rad/s³ per V."""
        back_emf, both = self.torque_constant * self.pole_pairs * self.flux, self.inertia * self.inductance
        damping = self.resistance / self.inductance + self.friction / self.inertia
        return (self.resistance * self.friction + back_emf) / both, damping, self.torque_constant / both

    def system(self) -> Plant:
        """θ''' + a₃ θ'' + a₂ θ' = b u_q in continuous time; output θ."""
        a2, a3, b = self.coefficients
        return make_plant([[0, 1, 0], [0, 0, 1], [0, -a2, -a3]], [[0], [0], [b]], [[1, 0, 0]])


class Feedforward(StrEnum):
    """How the command that should invert the motor is formed."""

    PRINTED = "printed"
    CORRECTED = "corrected"


def feedforward(motor: Motor, s: complex, form: Feedforward) -> complex:
    """ȳ_d/y_d at exp(st). Corrected: (s³ + a₃ s² + a₂ s)/b, the inverse of the motor; printed: (s² + a₂ s + a₃)/b."""
    a2, a3, b = motor.coefficients
    return (s**3 + a3 * s**2 + a2 * s if form is Feedforward.CORRECTED else s**2 + a2 * s + a3) / b


class ReferenceTiming(StrEnum):
    """When the controller reads y_d and its derivatives: at t_k and holds, at t_{k+1} and holds, or at all times."""

    HELD = "held"
    PREVIEWED = "previewed"
    CONTINUOUS = "continuous"


def tracking_command(
    motor: Motor,
    design: DualRateDesign,
    frequency: float,
    form: Feedforward,
    timing: ReferenceTiming = ReferenceTiming.HELD,
) -> Harmonic:
    """The command r of u = K(x̂ − x_d) + ȳ_d with x_d = (y_d, y_d', y_d''), y_d = sin(frequency · t)."""
    s = 1j * frequency
    amplitude = feedforward(motor, s, form) - design.feedback @ np.array([1.0, s, s**2])
    lead = np.exp(s * design.period) if timing is ReferenceTiming.PREVIEWED else 1.0
    return Harmonic(frequency, amplitude * lead, timing is ReferenceTiming.CONTINUOUS)


def estimation_error_ratio(loop: DualRateLoop) -> float:
    """Largest |y − C x̂| / |y_d| over the fast instants in the steady state; InfeasibleError if unstable."""
    return float(np.max(np.abs(_estimation_errors(loop)[1])))


def estimation_lag(loop: DualRateLoop) -> float:
    """Mean time in s by which C x̂ lags y in the steady state, of (y − C x̂)/(s y) over the fast instants, for slow σ."""
    outputs, errors = _estimation_errors(loop)
    return float(np.real(np.mean(errors / (reference(loop).exponent * outputs))))


def bandwidth(ratio_at: Callable[[float], float], level: float, frequencies: Sequence[float]) -> float | None:
    """The first σ (rad/s) with an error ratio of `level`, searched on an increasing grid, then refined.

    None if the ratio stays below the level, or is above it from the first σ on.
    """
    from scipy.optimize import brentq  # slow to load

    crossed = next((k for k, frequency in enumerate(frequencies) if ratio_at(frequency) >= level), 0)
    ends = frequencies[crossed - 1], frequencies[crossed]
    return float(brentq(lambda frequency: ratio_at(frequency) - level, *ends, xtol=1e-10)) if crossed else None


def _estimation_errors(loop: DualRateLoop) -> tuple[ComplexArray, ComplexArray]:
    """Complex amplitudes of y and of y − C x̂ at the phases, shape (M,) each."""
    states = steady_state(loop).states[:-1]
    estimates = [step.estimate_state @ z for step, z in zip(loop.steps, states, strict=True)]
    outputs = states[:, : loop.plant.order] @ loop.plant.C[0]
    return outputs, np.asarray(outputs - estimates @ loop.design.model.C[0])


def transient_energy(loop: DualRateLoop, offset: Array) -> float:
    """∫₀^∞ y² dt of the loop left to itself from z(0) = offset, rad² s; raises InfeasibleError if it is unstable.

    Exact in time: over a fast period the integral is a form in (x, u), over all slow periods one in z, X = Φ'XΦ + Q.
    """
    require_stable(loop, "the energy of its transient is infinite")
    free, n, size = replace(loop, harmonic=None), loop.plant.order, loop.size
    plant, m = loop.plant, loop.plant.B_u.shape[1]
    flow, row = np.block([[plant.A, plant.B_u], [np.zeros((m, n + m))]]), np.hstack([plant.C[:1], np.zeros((1, m))])
    within = Transition.of(flow.T, flow[:, :0], row.T @ row).at(loop.design.period)[2]
    reached, period = np.eye(size), np.zeros((size, size))
    for step in free.steps:
        joint = np.vstack([np.eye(size)[:n], step.input_state]) @ reached
        period += joint.T @ within @ joint
        reached = step.state @ reached
    transition = monodromy(free)
    total = scipy.linalg.solve_discrete_lyapunov(transition.T, period)
    return float(offset @ total @ offset)


@dataclass(frozen=True, eq=False)
class Trace:
    """time (N,) in s and output (N,) at the sub-steps; estimate (Nf, n) and input (Nf, m) at the fast instants."""

    time: Array
    output: Array
    estimate: Array
    input: Array


def simulate(
    design: DualRateDesign,
    observer: str,
    harmonic: Harmonic,
    start: Array,
    estimate: Array,
    *,
    slow_periods: int,
    substeps: int,
    plant: Plant | None = None,
    output: int = 0,
) -> Trace:
    """Simulate a loop with one of the observers below by brute force; plant: the true one, if not the model.

    Plant and observer's equation are integrated by series over sub-steps, and the observer acts as the text says,
    instant by instant, with commands held over T: no matrix is shared with `dualrate.loop`.
    """
    A, B, C, L = design.model.A, design.model.B_u, design.model.C, design.injection
    plant = plant or design.model
    width = design.period / substeps
    free, model_drive = _hold(A, B, width)
    true_free, plant_drive = _hold(plant.A, plant.B_u, width)
    guided, observer_drive = _hold(A - L @ C, np.hstack([B, L]), width)
    x, zeta, model = start, estimate, estimate
    used, predicted, u = np.zeros(len(C)), np.zeros(len(C)), np.zeros(B.shape[1])
    outputs, estimates, inputs = [], [], []
    for k in range(slow_periods * design.ratio):
        slow_instant = k % design.ratio == 0
        if slow_instant or observer == "fast_sensor":
            used = plant.C @ x
        elif observer in ("alternating_predictive", "running_prediction"):
            used = predicted
        if slow_instant:
            model = zeta
        xhat = {"model_interpolation": model, "state_feedback": x}.get(observer, zeta)
        if slow_instant or observer != "single_rate":
            turn = np.exp(1j * harmonic.frequency * k * design.period)
            u = design.feedback @ xhat + np.imag(harmonic.amplitude * turn)
        estimates.append(xhat)
        inputs.append(u)
        before, ahead = zeta, zeta
        for _ in range(substeps):
            outputs.append(plant.C[output] @ x)
            x = true_free @ x + plant_drive @ u
            zeta = guided @ zeta + observer_drive @ np.concatenate([u, used])
            ahead = free @ ahead + model_drive @ u
            model = free @ model + model_drive @ u
        predicted = C @ ahead if observer == "alternating_predictive" else used + C @ (ahead - before)
    time = np.arange(len(outputs), dtype=float) * width
    return Trace(time, np.array(outputs), np.array(estimates), np.array(inputs))


def _hold(state: Array, inputs: Array, time: float) -> tuple[Array, Array]:
    """Zero-order hold by the integral as a series in the state matrix, doubled from a short step."""
    n = state.shape[0]  # scaled first: position, speed and acceleration of a fast mode differ by orders of magnitude
    scale = scipy.linalg.matrix_balance(state, permute=False, separate=True)[1][0]
    state, inputs = state * scale[None, :] / scale[:, None], inputs / scale[:, None]
    halvings = max(0, int(np.ceil(np.log2(np.linalg.norm(state, 2) * time + 1e-300))) + 4)
    short = time / 2**halvings
    integral, term = np.zeros((n, n)), np.eye(n) * short
    for order in range(2, 22):
        integral, term = integral + term, term @ state * (short / order)
    transition = np.eye(n) + state @ integral
    for _ in range(halvings):
        integral = integral + transition @ integral
        transition = transition @ transition
    return transition * scale[:, None] / scale[None, :], integral @ inputs * scale[:, None]
