"""Late samples: a plant with the samples that are under way as further states.

The schedule says when a sample is used, the latency how old it then is:

    y_i(k) = C_i x(k - l_i) + D_u,i u(k - l_i) + D_i w(k).

A sample of age a - f, with a whole and 0 <= f < 1, was taken f after instant k - a. It enters a line of a states as
what the plant says of that time, inputs and disturbances being held over the base period, and leaves it a later.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil
from typing import Any

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.validation import Array

HORIZON = 200
"""Base periods; a sample that is older is refused: each base period of each sensor is a state."""
WHOLE = 1e-9
"""Latencies nearer than this to a whole number of base periods are meant as that number."""


def delivered(
    plant: MultiratePlant, latency: Sequence[float], between: Callable[[float], MultiratePlant] | None = None
) -> MultiratePlant:
    """The plant whose sensor i gives samples that are latency[i] base periods old, W = [W, 0].

    between: the same plant over a part of the base period (seconds); latencies that are not whole need it. Raises
    InvalidInputError for a latency that is negative, beyond HORIZON, or not whole without `between`, and for noise of
    plant and sensors that is correlated.
    """
    ages = checked_latency(latency, plant.sensors)
    lengths = [ceil(age) for age in ages]
    total = sum(lengths)
    if not total:
        return plant
    if plant.correlated:
        raise InvalidInputError(
            "S and latency do not go together: whose disturbance is the noise of an old sample correlated with? Model "
            "the common noise as a state"
        )
    n = plant.order
    A, C = np.zeros((n + total, n + total)), np.zeros((plant.sensors, n + total))
    B_d, B_u = np.zeros((n + total, plant.B_d.shape[1])), np.zeros((n + total, plant.B_u.shape[1]))
    A[:n, :n], B_d[:n], B_u[:n] = plant.A, plant.B_d, plant.B_u
    D_u = np.array(plant.D_u)
    first = n
    for i, (age, length) in enumerate(zip(ages, lengths, strict=True)):
        if not length:
            C[i, :n] = plant.C[i]
            continue
        line = slice(first, first + length)
        A[line, line] = np.eye(length, k=-1)
        A[first, :n], B_d[first], B_u[first] = _taken(plant, i, length - age, between)
        C[i, first + length - 1] = 1.0
        D_u[i] = 0.0
        first += length
    W = np.hstack([plant.W, np.zeros((len(plant.W), total))])
    return MultiratePlant(A=A, B_d=B_d, C=C, D=plant.D, W=W, B_u=B_u, D_u=D_u, dt=plant.dt, under_way=total)


def _taken(
    plant: MultiratePlant, i: int, part: float, between: Callable[[float], MultiratePlant] | None
) -> tuple[Array, Array, Array]:
    """What state, disturbance and input at an instant say of a sample of sensor i, `part` of a period later."""
    if not part:
        return plant.C[i], np.zeros(plant.B_d.shape[1]), plant.D_u[i]
    if between is None:
        raise InvalidInputError(
            f"latency[{i}] is no whole number of base periods, and what happens between two instants is not known of a "
            "discrete-time plant; give the plant in continuous time (a ContinuousPlant, or a control.StateSpace with "
            "dt=..)"
        )
    then = between(part * plant.dt)
    return plant.C[i] @ then.A, plant.C[i] @ then.B_d, plant.C[i] @ then.B_u + plant.D_u[i]


def checked_latency(latency: Any, sensors: int) -> tuple[float, ...]:
    """One age for each sensor, in base periods, whole where it is meant to be; raises InvalidInputError."""
    given = tuple(latency) if np.ndim(latency) == 1 and not isinstance(latency, str) else (latency,)
    if len(given) != sensors:
        raise InvalidInputError(f"latency must have one entry for each of {sensors} sensors, got {latency!r}")
    ages = []
    for i, age in enumerate(given):
        if isinstance(age, (bool, np.bool_)) or not isinstance(age, (int, float, np.integer, np.floating)):
            raise InvalidInputError(f"latency[{i}] must be a number of base periods, got {age!r}")
        if not 0 <= age < np.inf:
            raise InvalidInputError(
                f"latency[{i}] must be at least 0 base periods, got {age!r}; a sample is not of the future"
            )
        if age > HORIZON:
            raise InvalidInputError(
                f"latency beyond the horizon: latency[{i}] is {age:g} base periods, more than {HORIZON}; choose a "
                "longer base period"
            )
        ages.append(float(round(age)) if abs(age - round(age)) <= WHOLE else float(age))
    return tuple(ages)
