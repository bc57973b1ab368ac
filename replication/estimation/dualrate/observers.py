"""Observers of a dual-rate loop behind one interface, and the exact discretisation that they rest on.

Each is a linear M-periodic recursion over the fast instants, o(k+1) = transition o(k) + input u(k) + injection m(k),
with the estimate x̂(k) = readout o(k) + feedthrough m(k), where m is the measured output of the plant. A slow sensor is
one whose injection and feedthrough vanish except at phase 0. The first n entries of o are the observer's own state ζ.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.dualrate.problem import DualRateDesign, Plant
from replication.estimation.validation import Array, ComplexArray, as_matrix


@dataclass(frozen=True, eq=False)
class Harmonic:
    """Reference y_d(t) = Im exp(jσt) and the command r(t) = Im(amplitude exp(jσt)) that is added to K ζ.

    frequency: σ in rad/s. amplitude: one complex number per input. continuous: r(t) acts between the fast instants
    too; otherwise it is held over T, like the rest of the input. Raises InvalidInputError unless all are finite.
    """

    frequency: float
    amplitude: ComplexArray
    continuous: bool = False

    def __post_init__(self) -> None:
        frequency = float(as_matrix("frequency σ of the reference (rad/s)", [[self.frequency]])[0, 0])
        amplitude = np.array(self.amplitude)
        if amplitude.ndim != 1 or amplitude.dtype.kind not in "iufc" or not np.all(np.isfinite(amplitude)):
            raise InvalidInputError(
                f"the amplitude of the command must be a list of finite numbers, one per input, got {self.amplitude!r}"
            )
        amplitude = amplitude.astype(complex)
        amplitude.flags.writeable = False
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "amplitude", amplitude)

    @property
    def exponent(self) -> complex:
        """s = jσ."""
        return 1j * self.frequency


@dataclass(frozen=True, eq=False)
class Held:
    """x(τ) = state x(0) + input u for an input held over τ, plus forcing · w(0) if w' = s w acts continuously."""

    state: Array
    input: Array
    forcing: ComplexArray


def held(state: Array, inputs: Array, time: float, forced: ComplexArray | None = None, s: complex = 0) -> Held:
    """e^{Aτ}, ∫₀^τ e^{Aν}dν B and ∫₀^τ e^{A(τ−ν)} e^{sν} dν · forced, as blocks of one matrix exponential.

    The state is balanced first, which keeps the accuracy when a mode is fast in the units of the plant.
    Shapes: state (n, n), inputs (n, m), forced (n,). Raises InvalidInputError if the exponential overflows.
    """
    n, m = inputs.shape
    scale = scipy.linalg.matrix_balance(state, permute=False, separate=True)[1][0]
    state, inputs = state * scale / scale[:, None], inputs / scale[:, None]
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = state, inputs
    power = _exponential(block * time)
    forcing = np.zeros(n, dtype=complex)
    if forced is not None:
        wide = np.zeros((n + 1, n + 1), dtype=complex)
        wide[:n, :n], wide[:n, n], wide[n, n] = state, forced / scale, s
        forcing = _exponential(wide * time)[:n, n]
    return Held(power[:n, :n] * scale[:, None] / scale, power[:n, n:] * scale[:, None], forcing * scale)


def over_time(plant: Plant, time: float, harmonic: Harmonic | None) -> Held:
    """`held` of a plant, with the forcing of the harmonic's command on its first inputs if that acts continuously."""
    if harmonic is None or not harmonic.continuous:
        return held(plant.A, plant.B_u, time)
    return held(plant.A, plant.B_u, time, forced(plant, harmonic), harmonic.exponent)


def forced(plant: Plant, harmonic: Harmonic | None) -> ComplexArray:
    """What the command, with w = 1, adds to x' (n,); zero unless it acts continuously."""
    if harmonic is None or not harmonic.continuous:
        return np.zeros(plant.order, dtype=complex)
    return np.asarray(plant.B_u[:, : len(harmonic.amplitude)] @ harmonic.amplitude)


@dataclass(frozen=True, eq=False)
class SampledModel:
    """What an observer may use over one fast period.

    predictor: Ā, B̄ of (5). F (n, n), G (n, m), H (n, p) of (7), forcing (n,) beside them. output: C. ratio: M.
    """

    predictor: Held
    F: Array
    G: Array
    H: Array
    forcing: ComplexArray
    output: Array
    ratio: int


def sampled_model(
    design: DualRateDesign, harmonic: Harmonic | None = None, *, discrete_gain: bool = False
) -> SampledModel:
    """Sample the model of `design`. With `discrete_gain`, L corrects by steps: F = Ā − L C, G = B̄, H = L."""
    model, gain = design.model, design.injection
    predictor = over_time(model, design.period, harmonic)
    if discrete_gain:
        F, G, H, forcing = predictor.state - gain @ model.C, predictor.input, gain, predictor.forcing
    else:
        guided = Plant(model.A - gain @ model.C, np.hstack([model.B_u, gain]), model.C)
        inputs = model.B_u.shape[1]
        observer = over_time(guided, design.period, harmonic)
        F, G, H, forcing = observer.state, observer.input[:, :inputs], observer.input[:, inputs:], observer.forcing
    return SampledModel(predictor, F, G, H, forcing, model.C, design.ratio)


def _exponential(matrix: Any) -> Any:
    with np.errstate(over="ignore", invalid="ignore"):
        power = scipy.linalg.expm(matrix)
    if not np.all(np.isfinite(power)):
        raise InvalidInputError("exp(A T) overflows: the plant grows too fast for this period; choose a shorter period")
    return power


@dataclass(frozen=True, eq=False)
class ObserverStep:
    """The recursion at one phase; `forcing` is the effect of a command that acts continuously (see `Harmonic`)."""

    transition: Array
    input: Array
    injection: Array
    forcing: ComplexArray
    readout: Array
    feedthrough: Array


@dataclass(frozen=True, eq=False)
class Observer:
    """`steps` has one entry per phase 0 … M−1. `slow_command`: the controller, too, acts at phase 0 only.

    full_state: the measurement is the state of the plant, not its output.
    """

    steps: tuple[ObserverStep, ...]
    slow_command: bool = False
    full_state: bool = False


def _step(
    model: SampledModel, transition: Array, drive: Array, injection: Array, forcing: ComplexArray, reads: int = 0
) -> ObserverStep:
    """reads: first entry of the state that is the estimate."""
    n, p = model.H.shape
    return ObserverStep(transition, drive, injection, forcing, np.eye(n, len(transition), reads), np.zeros((n, p)))


def _corrected(model: SampledModel, phase: int) -> ObserverStep:
    """(7) with the measurement of this phase, which only phase 0 has."""
    return _step(model, model.F, model.G, model.H * (phase == 0), model.forcing)


def _always(model: SampledModel, _: int) -> ObserverStep:
    """(7) with a true measurement at every fast instant."""
    return _corrected(model, 0)


def _single(model: SampledModel, phase: int) -> ObserverStep:
    """(7) at phase 0, then the model alone."""
    free = model.predictor
    return _step(model, free.state, free.input, model.H * 0, free.forcing) if phase else _corrected(model, 0)


def _predicting(model: SampledModel, phase: int) -> ObserverStep:
    """State (ζ, ζ_p): ζ follows (7) with y at phase 0 and C ζ_p elsewhere."""
    draft, chain = _corrected(model, phase), model.predictor.state
    rows = np.hstack([draft.transition, model.H @ model.output * (phase > 0)])
    return _step(
        model,
        np.vstack([rows, np.hstack([chain * (phase == 0), chain * (phase > 0)])]),
        np.vstack([draft.input, model.predictor.input]),
        np.vstack([draft.injection, np.zeros((len(chain), model.H.shape[1]))]),
        np.concatenate([draft.forcing, model.predictor.forcing]),
    )


def _virtual(model: SampledModel, phase: int, *, carries: bool, predicts: bool = True) -> ObserverStep:
    """State (ζ, y_p): ζ follows (7) with y at phase 0 and y_p elsewhere.

    y_p is (6), or continues from ȳ if it `carries`; one that does not predict is the last measurement, held.
    """
    n, p = model.H.shape
    fresh, C, carried = phase == 0, model.output * predicts, np.eye(p) * carries
    step = model.predictor.state - np.eye(n) * carries
    return _step(
        model,
        np.block([[model.F, model.H * (not fresh)], [C @ step, carried * (not fresh)]]),
        np.vstack([model.G, C @ model.predictor.input]),
        np.vstack([model.H, carried]) * fresh,
        np.concatenate([model.forcing, C @ model.predictor.forcing]),
    )


_holding = partial(_virtual, carries=True, predicts=False)
"""State (ζ, y held): ζ follows (7) with the measurement of phase 0."""


def _interpolating(model: SampledModel, phase: int, *, slow_input: bool = False) -> ObserverStep:
    """State (ζ, y held, x̂, u₀): x̂ follows the model from ζ at phase 0; u₀ is used only with `slow_input`."""
    holding = _holding(model, phase)
    (n, m), h = model.G.shape, holding.transition.shape[0]
    fresh = phase == 0
    transition = np.zeros((h + n + m, h + n + m))
    transition[:h, :h] = holding.transition
    transition[h : h + n, (slice(0, n) if fresh else slice(h, h + n))] = model.predictor.state
    transition[h + n :, h + n :] = np.eye(m) * (not fresh)
    known = np.vstack([holding.input, model.predictor.input, np.eye(m) * fresh])
    if slow_input and not fresh:
        transition[:n, h + n :] = model.G
        known[:n] = 0.0
    return _step(
        model,
        transition,
        known,
        np.vstack([holding.injection, np.zeros((n + m, model.H.shape[1]))]),
        np.concatenate([holding.forcing, model.predictor.forcing, np.zeros(m)]),
        reads=0 if fresh else h,
    )


def _reading(model: SampledModel, _: int) -> ObserverStep:
    """The full state, which is measured at every fast instant."""
    n, m = model.G.shape
    none = np.zeros((0, 0)), np.zeros((0, m)), np.zeros((0, n)), np.zeros(0, complex)
    return ObserverStep(*none, np.zeros((n, 0)), np.eye(n))


Builder = Callable[[SampledModel], Observer]


def _observer(
    model: SampledModel,
    *,
    step: Callable[..., ObserverStep],
    slow_command: bool = False,
    full_state: bool = False,
    **choice: bool,
) -> Observer:
    """The steps of all phases, of which those after the first are one."""
    first, later = (step(model, phase, **choice) for phase in (0, 1))
    return Observer((first, *[later] * (model.ratio - 1)), slow_command, full_state)


OBSERVERS: Mapping[str, Builder] = {
    # Observer (2) and controller both updated every M T: F, G, H at M T, written over the fast instants.
    "single_rate": partial(_observer, step=_holding, slow_command=True),
    # `single_correction` whose controller, too, acts at phase 0 only.
    "single_rate_correction": partial(_observer, step=_single, slow_command=True),
    # (2) with u changing every T and the last measurement held over M T. State (ζ, y held).
    "held_measurement": partial(_observer, step=_holding),
    # `held_measurement` read at phase 0 only, the model carrying the estimate between. State (ζ, y held, x̂).
    "model_interpolation": partial(_observer, step=_interpolating),
    # (7) at phase 0, then the model alone until the next measurement.
    "single_correction": partial(_observer, step=_single),
    # `model_interpolation` that takes the input of phase 0 for the whole M T. State (ζ, y held, x̂, u₀).
    "slow_input_interpolation": partial(_observer, step=_interpolating, slow_input=True),
    # The alternating predictive observer as printed: (7) with the virtual measurement (6). State (ζ, y_p).
    "alternating_predictive": partial(_observer, step=_virtual, carries=False),
    # (7) with y_p = C ζ_p, where ζ_p starts at ζ at phase 0 and follows the model alone. State (ζ, ζ_p).
    "open_loop_prediction": partial(_observer, step=_predicting),
    # The restarted predictor: y_p(k) = ȳ(k−1) + C[(Ā − I) ζ(k−1) + B̄ u(k−1)], restarted at each measurement.
    "running_prediction": partial(_observer, step=_virtual, carries=True),
    # A measurement at every fast instant: what a virtual measurement tries to replace.
    "fast_sensor": partial(_observer, step=_always),
    # No observer: the controller reads the full state at every fast instant.
    "state_feedback": partial(_observer, step=_reading, full_state=True),
}
