"""Plants in continuous time, x' = A x + B_u u + B_d d, whose inputs and disturbances are held over the base period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from replication.errors import InvalidInputError
from replication.estimation.api.signals import is_statespace
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
    W : array (n_z, n), optional
        Weight of the estimation error; the identity unless given.
    B_u : array (n, m_u), optional
        Effect of the known inputs u; none unless given.
    D_u : array (q, m_u), optional
        Effect of the known inputs on the measurements; none unless given.

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
        """Check everything at once."""
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
        if (self.D is None) == (self.R is None):
            raise InvalidInputError("give the sensor noise once: R, its covariance, or D, a factor of it")
        named = {"D": self.D, "Q": self.Q, "R": self.R, "W": self.W, "D_u": self.D_u}
        given: dict[str, Any] = {name: value for name, value in named.items() if value is not None}
        make = MultiratePlant.from_covariances if {"Q", "R"} & given.keys() else MultiratePlant
        return make(A=over, B_d=B_d, B_u=B_u, C=self.C, dt=self.dt, **given)


def held_over(A: Array, B: Array, time: float) -> tuple[Array, Array]:
    """exp(A time), and its integral from 0 to `time` times B: the effect of inputs that are held."""
    n, m = B.shape
    whole = scipy.linalg.expm(np.block([[A, B], [np.zeros((m, n + m))]]) * time)
    return whole[:n, :n], whole[:n, n:]


def sampled_statespace(system: Any, time: float, dt: float) -> Any:
    """A continuous-time `control.StateSpace` over a time, with its names and the base period dt (s)."""
    import control

    A, B = held_over(np.asarray(system.A, dtype=float), np.asarray(system.B, dtype=float), time)
    names = {
        "states": list(system.state_labels),
        "inputs": list(system.input_labels),
        "outputs": list(system.output_labels),
    }
    return control.StateSpace(A, B, system.C, system.D, dt, **names)


def is_continuous(system: Any) -> bool:
    """Whether it is a `control.StateSpace` in continuous time."""
    return is_statespace(system) and not system.isdtime(strict=True)
