"""The plant of a multi-rate observer, eqs. (2), (3), (18): z = W e, and with known inputs u

    x+ = A x + B_u u + B_d d + B_w w,  y_r = C x + D_u u + D w.

The papers have no B_w and D_u: B_w makes the noise of plant and sensors correlated, with covariance B_w D'.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from replication.errors import InvalidInputError
from replication.estimation.api.plants import NOT_GIVEN, LinearPlant, Signals, parts_of
from replication.estimation.validation import Array, as_matrix, at_most, noise_factors, positive_scalar

LARGEST_OF_A = 1e30
"""Entries of A above are refused: a period is a product of many."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MultiratePlant(LinearPlant):
    """A discrete-time plant with process noise d and sensor noise w: eqs. (2), (3) and (18).

    The noise is scaled so that d and w are the signals whose l2 norm counts.

    Parameters
    ----------
    A : array (n, n)
        State transition over one base period.
    B_d : array (n, m_d)
        Effect of the process noise d.
    C : array (q, n)
        Sensors.
    D : array (q, q_w)
        Effect of the sensor noise w.
    W : array (n_z, n), optional
        Weight of the estimation error, z = W e; the identity unless given.
    B_u : array (n, m_u), optional
        Effect of the known inputs u; none unless given.
    B_w : array (n, q_w), optional
        Effect of the sensor noise w on the state, which correlates the two; none unless given.
    D_u : array (q, m_u), optional
        Effect of the known inputs on the measurements; none unless given.
    dt : float
        Base period in s; 1 if it does not matter.
    under_way : int
        How many of the last states are samples on their way (`latency.delivered` adds them); not estimated for use.

    Raises
    ------
    InvalidInputError
        An entry is not finite, the shapes do not fit, or there is no state, sensor, disturbance or weight.
    """

    SHAPES: ClassVar[Mapping[str, str]] = {
        "A": "nn", "C": "qn", "D": "qw", "B_d": "nm", "B_w": "nw", "W": "zn", "B_u": "nu", "D_u": "qu",
    }  # fmt: skip
    NEEDED: ClassVar[Mapping[str, str]] = {
        **LinearPlant.NEEDED,
        **dict.fromkeys("mz", "B_d needs a column and W a row; write zeros where there is no disturbance or weight"),
    }

    A: Array
    B_d: Array
    C: Array
    D: Array
    W: Array = NOT_GIVEN
    B_u: Array = NOT_GIVEN
    B_w: Array = NOT_GIVEN
    D_u: Array = NOT_GIVEN
    dt: float = 1.0
    under_way: int = 0

    def __post_init__(self) -> None:
        sizes = self.check()
        if (largest := np.max(np.abs(self.A))) > LARGEST_OF_A:
            raise InvalidInputError(
                f"A has an entry of size {largest:.3g}, whose powers leave the range of numbers; choose other units of "
                f"the states, in which none exceeds {LARGEST_OF_A:g}"
            )
        if self.under_way:
            at_most("under_way", self.under_way, sizes["n"] - 1)
        object.__setattr__(self, "dt", positive_scalar("dt", self.dt, unit="seconds"))

    @property
    def sensors(self) -> int:
        """q, the number of sensors."""
        return len(self.C)

    @property
    def signals(self) -> Signals:
        """x[0], u[0], y[0] and so on; what is estimated are the states, unless they are weighted."""
        present = self.order - self.under_way
        outputs = None if np.array_equal(self.W, np.eye(present, self.order)) else len(self.W)
        plain = Signals.numbered(self.order, self.B_u.shape[1], self.sensors, outputs, self.dt)
        return plain if outputs else replace(plain, outputs=plain.states[:present])

    @property
    def drive(self) -> Array:
        """The effect of all noise on the state: [B_d, B_w], or B_d alone if there is no B_w."""
        return np.hstack([self.B_d, self.B_w]) if self.correlated else self.B_d

    @property
    def correlated(self) -> bool:
        """Whether the noise of the sensors also drives the state."""
        return bool(np.any(self.B_w))

    @classmethod
    def from_covariances(
        cls,
        *,
        A: npt.ArrayLike,
        C: npt.ArrayLike,
        B_d: npt.ArrayLike | None = None,
        D: npt.ArrayLike | None = None,
        Q: npt.ArrayLike | None = None,
        R: npt.ArrayLike | None = None,
        S: npt.ArrayLike | None = None,
        W: npt.ArrayLike | None = None,
        B_u: npt.ArrayLike | None = None,
        D_u: npt.ArrayLike | None = None,
        dt: float = 1.0,
    ) -> Self:
        """The plant whose noise has given covariances: x+ = A x + B_u u + B_d d, y = C x + n.

        Parameters
        ----------
        A : array (n, n)
            State transition over one base period.
        C : array (q, n)
            Sensors.
        B_d : array (n, m_d), optional
            Effect of the process noise d; the identity unless given: each state has its own.
        D : array (q, q_w), optional
            A factor of R, in its place; taken as it is where there is no Q.
        Q : array (m_d, m_d), optional
            Covariance of d, positive semidefinite; the identity unless given.
        R : array (q, q), optional
            Covariance of the sensor noise n, positive definite.
        S : array (m_d, q), optional
            Covariance of d(k) and n(k); zero unless given.
        W, B_u, D_u, dt : see there
            As in `MultiratePlant`.

        Returns
        -------
        MultiratePlant
            With noise of unit intensity.

        Raises
        ------
        InvalidInputError
            A covariance is not symmetric or indefinite, S does not fit, both or neither of D and R are given, or
            neither B_d nor Q.

        Examples
        --------
        >>> cart = MultiratePlant.from_covariances(A=[[1, 0.1], [0, 0.98]], C=[[1, 0]], Q=[[0, 0], [0, 0.01]], R=[[4]])
        >>> cart.D.tolist()
        [[2.0]]
        """
        if (D is None) == (R is None):
            raise InvalidInputError("give the sensor noise once: R, its covariance, or D, a factor of it")
        if B_d is None and Q is None:
            raise InvalidInputError("give the process noise: Q, its covariance, or B_d, or both")
        shaped: dict[str, Any] = {"W": W, "B_u": B_u, "D_u": D_u, "dt": dt}
        if Q is None and R is None and S is None:
            return cls(A=A, C=C, B_d=B_d, D=D, **shaped)  # type: ignore[arg-type]
        A, C = as_matrix("A", A), as_matrix("C", C)
        B = np.eye(len(A)) if B_d is None else as_matrix("B_d", B_d, rows=len(A))
        if R is None:
            factor = as_matrix("D", D, rows=len(C))
            R = factor @ factor.T
        Q = np.eye(B.shape[1]) if Q is None else Q
        noise = noise_factors(Q, R, S, disturbances=B.shape[1], sensors=len(C))
        return cls(A=A, C=C, B_d=B @ noise.F, B_w=B @ noise.E, D=noise.D, **shaped)

    @classmethod
    def from_statespace(
        cls,
        system: Any,
        D: Any = None,
        *,
        disturbances: Sequence[int | str] | None = None,
        W: Any = None,
        Q: Any = None,
        R: Any = None,
        S: Any = None,
    ) -> Self:
        """Take A, B, C and dt from a discrete-time `control.StateSpace`.

        Parameters
        ----------
        system : control.StateSpace
            Discrete-time, without feedthrough from process noise.
        D : array (q, q_w), optional
            Effect of the sensor noise w; or `R`.
        disturbances : sequence of int or str, optional
            Inputs that are process noise, by index or label; all unless given. The others become B_u.
        W : array (n_z, n), optional
            Weight of the estimation error.
        Q, R, S : array, optional
            Covariances of the noise, as in `from_covariances`.

        Returns
        -------
        MultiratePlant
            With the sampling period of the system; 1 s if it has none.

        Raises
        ------
        InvalidInputError
            A continuous-time system, a feedthrough from process noise to a sensor (it is sensor noise, too), or an
            unknown input.
        """
        parts = parts_of(system, continuous=False, disturbances=disturbances)
        if np.any(parts.D_d):
            raise InvalidInputError(
                "system must have no feedthrough from its disturbances: set its D to zero there, move the input into "
                "the state, or name the inputs that are disturbances"
            )
        known: dict[str, Any] = {"B_u": parts.B_u, "D_u": parts.D_u, "dt": parts.signals.dt or 1.0}
        return cls.from_covariances(A=parts.A, B_d=parts.B_d, C=parts.C, D=D, Q=Q, R=R, S=S, W=W, **known)
