"""Plants in continuous time, and late samples: those under way are further states of the plant.

The schedule says when a sample is used, the latency how old it then is:

    y_i(k) = C_i x(k - l_i) + D_u,i u(k - l_i) + D_i w(k).

A sample of age a - f, with a whole and 0 <= f < 1, was taken f after instant k - a. It enters a line of a states as
what the plant says of that time, inputs and disturbances being held over the base period, and leaves it a later.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from replication.errors import InvalidInputError
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.validation import Array, as_matrix, positive_scalar


@dataclass(frozen=True, kw_only=True, eq=False)
class ContinuousPlant:
    """A plant in continuous time that is sampled at a base period; it knows what happens between the instants.

    Parameters
    ----------
    A : array (n, n)
        x' = A x + B_u u + B_d d; rates in 1/s.
    C : array (q, n)
        Sensors.
    dt : float
        Base period in s, over which u and d are held.
    B_d : array (n, m_d), optional
        Effect of the process noise d; the identity unless given, where Q is.
    D : array (q, q_w), optional
        Effect of the sensor noise w; or give R.
    Q : array (m_d, m_d), optional
        Covariance of the held d; the identity unless given.
    R : array (q, q) or (q,), optional
        Covariance of the sensor noise, or variances, in place of D.
    W, B_u, D_u : see there
        As in `MultiratePlant`.

    Raises
    ------
    InvalidInputError
        As for `MultiratePlant`, or D and R do not leave one.

    Examples
    --------
    >>> plant = ContinuousPlant(A=[[0, 1], [0, -0.2]], B_d=[[0], [1]], C=[[1, 0]], D=[[0.1]], dt=0.1)
    >>> plant.after(0.1).order
    2
    """

    A: npt.ArrayLike
    C: npt.ArrayLike
    dt: float
    B_d: npt.ArrayLike | None = None
    D: npt.ArrayLike | None = None
    Q: npt.ArrayLike | None = None
    R: npt.ArrayLike | None = None
    W: npt.ArrayLike | None = None
    B_u: npt.ArrayLike | None = None
    D_u: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        self.after(positive_scalar("dt", self.dt, unit="seconds"))

    def after(self, time: float) -> MultiratePlant:
        """The plant over a time.

        Parameters
        ----------
        time : float
            In s, from one base instant on.

        Returns
        -------
        MultiratePlant
            Of the whole base period if `time` is `dt`.

        Raises
        ------
        InvalidInputError
            A matrix does not fit.
        """
        A = as_matrix("A", self.A)
        n = len(A)
        A = as_matrix("A", A, columns=n)
        B_d = np.eye(n) if self.B_d is None else as_matrix("B_d", self.B_d, rows=n)
        B_u = np.zeros((n, 0)) if self.B_u is None else as_matrix("B_u", self.B_u, rows=n)
        over, held = held_over(A, np.hstack([B_d, B_u]), time)
        B_d, B_u = held[:, : B_d.shape[1]], held[:, B_d.shape[1] :]
        noise: dict[str, Any] = {"D": self.D, "Q": self.Q, "R": self.R}
        return MultiratePlant.from_covariances(
            A=over, B_d=B_d, B_u=B_u, C=self.C, W=self.W, D_u=self.D_u, dt=self.dt, **noise
        )


def held_over(A: Array, B: Array, time: float) -> tuple[Array, Array]:
    """exp(A time), and its integral from 0 to `time` times B: the effect of inputs that are held."""
    n, m = B.shape
    whole = scipy.linalg.expm(np.block([[A, B], [np.zeros((m, n + m))]]) * time)
    return whole[:n, :n], whole[:n, n:]


def sampled_statespace(system: Any, time: float, dt: float) -> Any:
    """A continuous-time `control.StateSpace` over a time, with its names and the base period dt (s)."""
    sampled = system.sample(time)
    sampled.dt = dt
    return sampled


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
    entries = tuple(latency) if np.ndim(latency) == 1 and not isinstance(latency, str) else (latency,)
    if len(entries) != sensors:
        raise InvalidInputError(f"latency must have one entry for each of {sensors} sensors, got {latency!r}")
    ages = []
    for i, age in enumerate(entries):
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
