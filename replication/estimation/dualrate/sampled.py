"""Exact discretisation between fast instants: Ā, B̄ of eq. (5) and F, G, H of eq. (7), each from one exponential."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
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
        """Check and freeze."""
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
    scale = _balance(state.tobytes(), n)
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


def check_fit(model: Plant, plant: Plant, harmonic: Harmonic | None) -> None:
    """Raise InvalidInputError unless the true plant and the command have the inputs and outputs of the model."""
    inputs, outputs = model.B_u.shape[1], len(model.C)
    if plant.B_u.shape[1] != inputs or len(plant.C) != outputs:
        raise InvalidInputError(
            f"the true plant must have the {inputs} inputs and {outputs} outputs of the model, got "
            f"{plant.B_u.shape[1]} and {len(plant.C)}"
        )
    if harmonic is not None and len(harmonic.amplitude) != inputs:
        raise InvalidInputError(
            f"the harmonic needs one amplitude for each of the {inputs} inputs, got {len(harmonic.amplitude)}"
        )


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


@lru_cache(maxsize=256)
def _balance(state: bytes, n: int) -> Any:
    """The units in which the entries of a state matrix (n, n) are alike: the same for every time."""
    return scipy.linalg.matrix_balance(np.frombuffer(state).reshape(n, n), permute=False, separate=True)[1][0]


def _exponential(matrix: Any) -> Any:
    with np.errstate(over="ignore", invalid="ignore"):
        power = scipy.linalg.expm(matrix)
    if not np.all(np.isfinite(power)):
        raise InvalidInputError("exp(A T) overflows: the plant grows too fast for this period; choose a shorter period")
    return power
