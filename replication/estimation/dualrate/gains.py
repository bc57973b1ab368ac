"""Weights of a dual-rate design, checked, and the gains K and L that they have in continuous time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.dualrate.problem import Plant
from replication.estimation.validation import Array, as_matrix

SEMIDEFINITE = 1e-12
"""Negative eigenvalues of a weight up to so much of the largest are rounding."""


class Weights(NamedTuple):
    """Q (n, n) and R (m, m) of x'Qx + u'Ru; W (n, n) and V (p, p) of the process and the sensor noise."""

    state: Array
    input: Array
    process: Array
    sensor: Array


def checked_weights(plant: Plant, *, state: Any, input: Any, process: Any, sensor: Any) -> Weights:
    """The given weights, or C'C, the identity, BB' and the identity; raises InvalidInputError."""
    B, C = plant.B_u, plant.C
    return Weights(
        _weight("state_weight", state, C.T @ C),
        _weight("input_weight", input, np.eye(B.shape[1]), definite=True),
        _weight("process_noise", process, B @ B.T),
        _weight("sensor_noise", sensor, np.eye(len(C)), definite=True),
    )


def continuous_gains(plant: Plant, weights: Weights) -> tuple[Array, Array]:
    """The linear-quadratic K (m, n) and the stationary Kalman gain L (n, p); raises InfeasibleError."""
    A, B, C = plant.A, plant.B_u, plant.C
    Q, R, W, V = weights
    K = -np.linalg.solve(R, B.T @ _riccati(A, B, Q, R, "state_weight, input_weight"))
    L = np.linalg.solve(V, C @ _riccati(A.T, C.T, W, V, "process_noise, sensor_noise")).T
    return K, L


def _weight(name: str, value: Any, default: Array, *, definite: bool = False) -> Array:
    """The symmetric weight or `default`; InvalidInputError unless it is positive semidefinite, or definite if asked."""
    if value is None:
        return default
    size = len(default)
    matrix = as_matrix(name, value, rows=size, columns=size)
    least, largest = np.linalg.eigvalsh(matrix)[[0, -1]]
    good = least > 0 if definite else least >= -SEMIDEFINITE * max(largest, 0.0)
    if not np.array_equal(matrix, matrix.T) or not good:
        word = "definite" if definite else "semidefinite"
        raise InvalidInputError(f"{name} must be symmetric and positive {word}, got {matrix.tolist()}")
    return matrix


def _riccati(A: Any, B: Any, Q: Any, R: Any, weights: str) -> Any:
    try:
        return scipy.linalg.solve_continuous_are(A, B, Q, R)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InfeasibleError(
            f"the Riccati equation for {weights} has no stabilising solution ({error}): every unstable mode must be "
            "moved by the input and seen by the sensor, and no mode on the imaginary axis may be left out of the weight"
        ) from None
