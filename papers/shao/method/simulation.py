"""Brute-force simulation of the printed algorithm, as a second opinion on the lifted form.

The plant and the observer's differential equation are integrated by exponentials over sub-steps of T, the observer
acts as it is told in the text, instant by instant. Shares no matrix with `loop`, `tracking` or `response`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.dualrate.observers import Harmonic, check_fit
from replication.estimation.dualrate.problem import DualRateDesign, Plant, as_plant, row_of_output
from replication.estimation.validation import Array, finite_vector, positive_integer

if TYPE_CHECKING:
    import control

SIMULATED = (
    "single_rate",
    "held_measurement",
    "model_interpolation",
    "alternating_predictive",
    "running_prediction",
    "fast_sensor",
    "state_feedback",
)


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
    plant: control.StateSpace | Plant | None = None,
    output: int = 0,
) -> Trace:
    """Simulate one of `SIMULATED` with commands held over T; raises InvalidInputError for others.

    plant: the true plant if it differs from the model. output: which of its outputs to return, from 0.
    """
    if observer not in SIMULATED or harmonic.continuous:
        raise InvalidInputError(f"cannot simulate {observer!r} here; use one of {SIMULATED}, held r")
    positive_integer("number of slow periods", slow_periods)
    positive_integer("number of sub-steps", substeps)
    A, B, C, L = design.model.A, design.model.B_u, design.model.C, design.injection
    plant = design.model if plant is None else as_plant(plant)
    check_fit(design.model, plant, harmonic)
    if observer == "state_feedback" and plant.order != design.model.order:
        raise InvalidInputError(f"state feedback needs the {design.model.order} states of the model, got {plant.order}")
    row = plant.C[row_of_output(plant, output)]
    width = design.period / substeps
    free, model_drive = _hold(A, B, width)
    true_free, plant_drive = _hold(plant.A, plant.B_u, width)
    guided, observer_drive = _hold(A - L @ C, np.hstack([B, L]), width)
    x, zeta, model = finite_vector("x(0)", start, plant.order), *(finite_vector("ζ(0)", estimate, len(A)),) * 2
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
            u = design.feedback @ xhat + np.imag(
                harmonic.amplitude * np.exp(1j * harmonic.frequency * k * design.period)
            )
        estimates.append(xhat)
        inputs.append(u)
        before, ahead = zeta, zeta
        for _ in range(substeps):
            outputs.append(row @ x)
            x = true_free @ x + plant_drive @ u
            zeta = guided @ zeta + observer_drive @ np.concatenate([u, used])
            ahead = free @ ahead + model_drive @ u
            model = free @ model + model_drive @ u
        predicted = C @ ahead if observer == "alternating_predictive" else used + C @ (ahead - before)
    time = np.arange(len(outputs), dtype=float) * width
    return Trace(time, np.array(outputs), np.array(estimates), np.array(inputs))


def _hold(state: Array, inputs: Array, time: float) -> tuple[Array, Array]:
    """Zero-order hold by the integral as a series in the state matrix, doubled from a short step.

    The state is scaled first: position, speed and acceleration of a fast mode differ by orders of magnitude.
    """
    n = state.shape[0]
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
