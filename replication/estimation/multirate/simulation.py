"""Time responses of periodic systems, white-noise performance, and the disturbance that hurts most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.signals import numbered
from replication.estimation.linear.periodic import PeriodicSystem
from replication.estimation.linear.riccati import RiccatiMap, settled, stacked
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.validation import Array, as_array, as_matrix, positive_integer


@dataclass(frozen=True, eq=False)
class Response:
    """inputs (T, m), outputs (T, p), and `ratio`, the l2 norm of the outputs over that of the inputs."""

    inputs: Array
    outputs: Array
    ratio: float


def simulate(system: PeriodicSystem, inputs: Array, initial_state: Array | None = None) -> Array:
    """Outputs (T, p) for inputs (T, m) from `initial_state` (n,), zero unless given; phase 0 is the first row.

    Raises InvalidInputError unless all stages have the width of the inputs.
    """
    v = as_matrix("inputs", inputs)
    if any(stage.B.shape[1] != v.shape[1] for stage in system.stages):
        widths = sorted({stage.B.shape[1] for stage in system.stages})
        raise InvalidInputError(f"inputs must have as many columns as every stage has inputs ({widths}), got {v.shape}")
    x = np.zeros(system.order)
    if initial_state is not None:
        x = as_array("initial_state", initial_state, (system.order,))
    outputs = np.zeros((len(v), system.stages[0].C.shape[0]))
    for k, v_k in enumerate(v):
        stage = system.stages[k % system.period]
        outputs[k] = stage.C @ x + stage.D @ v_k
        x = stage.A @ x + stage.B @ v_k
    return outputs


def disturbances(plant: MultiratePlant) -> tuple[str, ...]:
    """What the columns of the disturbance (d, w) are called."""
    return (*numbered("d", plant.B_d.shape[1]), *numbered("w", plant.D.shape[1]))


def white_noise_variance(system: PeriodicSystem) -> float:
    """Mean over one period of the stationary output variance, summed over channels, for white inputs of unit intensity.

    Raises InfeasibleError if the system is not stable.
    """
    stages = stacked(RiccatiMap(s.A, np.zeros_like(s.A), s.B @ s.B.T) for s in system.stages)
    covariances = settled(stages) if system.spectral_radius() < 1 else None
    if covariances is None:
        raise InfeasibleError(
            "the system is not stable, so its outputs have no stationary variance; stabilise it first"
        )
    total = 0.0
    for stage, covariance in zip(system.stages, covariances, strict=True):
        total += float(np.trace(stage.C @ covariance @ stage.C.T + stage.D @ stage.D.T))
    return total / system.period


def worst_case_response(system: PeriodicSystem, horizon: int) -> Response:
    """The input of unit norm over `horizon` instants, from rest, whose output over them is largest, and that output.

    Its ratio is a lower bound of the l2-induced norm and tends to it as the horizon grows. Leading singular vector of
    the horizon's input-output matrix, formed in full: cost grows with the cube of the horizon. Raises InvalidInputError
    for a horizon below one, or stages of unequal input width.
    """
    horizon = positive_integer("horizon", horizon)
    m = system.stages[0].B.shape[1]
    if any(stage.B.shape[1] != m for stage in system.stages):
        raise InvalidInputError("all stages must have the same number of inputs")
    repeated = PeriodicSystem(tuple(system.stages[k % system.period] for k in range(horizon)))
    operator = repeated.lift().D
    last = horizon * m - 1
    _, vectors = scipy.linalg.eigh(operator.T @ operator, subset_by_index=[last, last])
    v = vectors[:, 0] * np.sign(vectors[np.argmax(np.abs(vectors[:, 0])), 0])
    inputs = v.reshape(horizon, m)
    outputs = simulate(system, inputs)
    return Response(inputs, outputs, float(np.linalg.norm(outputs) / np.linalg.norm(inputs)))
