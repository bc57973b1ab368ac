"""The plant of a multi-rate observer, eqs. (2), (3), (18): z = W e, and with known inputs u

    x+ = A x + B_u u + B_d d + B_w w,  y_r = C x + D_u u + D w.

The papers have no B_w and D_u: B_w makes the noise of plant and sensors correlated, with covariance B_w D'.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from replication.errors import InvalidInputError
from replication.estimation.api.signals import index_of, is_statespace
from replication.estimation.linear.covariances import noise_factors
from replication.estimation.validation import Array, as_matrix, at_most, positive_scalar

_NOT_GIVEN = np.zeros((0, 0))


def _not_given() -> Array:
    return _NOT_GIVEN


LARGEST_OF_A = 1e30
"""Entries of A above are refused: a period is a product of many."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MultiratePlant:
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

    A: Array
    B_d: Array
    C: Array
    D: Array
    W: Array = field(default_factory=_not_given)
    B_u: Array = field(default_factory=_not_given)
    B_w: Array = field(default_factory=_not_given)
    D_u: Array = field(default_factory=_not_given)
    dt: float = 1.0
    under_way: int = 0

    if TYPE_CHECKING:
        # Type checkers see that lists do; the fields themselves are arrays.
        def __init__(
            self,
            *,
            A: npt.ArrayLike,
            B_d: npt.ArrayLike,
            C: npt.ArrayLike,
            D: npt.ArrayLike,
            W: npt.ArrayLike | None = None,
            B_u: npt.ArrayLike | None = None,
            B_w: npt.ArrayLike | None = None,
            D_u: npt.ArrayLike | None = None,
            dt: float = 1.0,
            under_way: int = 0,
        ) -> None: ...

    def __post_init__(self) -> None:
        """Check shapes and entries, fill the defaults, freeze the arrays."""
        A = as_matrix("A", self.A)
        n = A.shape[0]
        A = as_matrix("A", A, columns=n)
        if n == 0:
            raise InvalidInputError("A must have at least one state, got shape (0, 0)")
        C = as_matrix("C", self.C, columns=n)
        if not C.shape[0]:
            raise InvalidInputError("C must have at least one row: a plant without sensors cannot be observed")
        optional = (self.W, self.B_u, self.B_w, self.D_u)
        W, B_u, B_w, D_u = (None if given is _NOT_GIVEN else given for given in optional)
        D = as_matrix("D", self.D, rows=C.shape[0])
        checked: dict[str, Any] = {
            "A": A,
            "B_d": as_matrix("B_d", self.B_d, rows=n),
            "C": C,
            "D": D,
            "B_w": np.zeros((n, 0)) if B_w is None else as_matrix("B_w", B_w, rows=n),
            "W": np.eye(n) if W is None else as_matrix("W", W, columns=n),
            "B_u": np.zeros((n, 0)) if B_u is None else as_matrix("B_u", B_u, rows=n),
            "dt": positive_scalar("dt", self.dt, unit="seconds"),
        }
        if np.max(np.abs(A)) > LARGEST_OF_A:
            raise InvalidInputError(
                f"A has an entry of size {np.max(np.abs(A)):.3g}, whose powers leave the range of numbers; "
                f"choose other units of the states, in which none exceeds {LARGEST_OF_A:g}"
            )
        if self.under_way:
            at_most("under_way", self.under_way, n - 1)
        if checked["B_w"].shape[1] not in (0, D.shape[1]):
            raise InvalidInputError(
                f"B_w must have as many columns as D, {D.shape[1]}, for both belong to w; got shape "
                f"{checked['B_w'].shape}"
            )
        shape = (len(C), checked["B_u"].shape[1])
        # Zeros are those of a plant with other sensors or inputs, where `dataclasses.replace` made this one.
        given = D_u is not None and np.any(as_matrix("D_u", D_u))
        checked["D_u"] = as_matrix("D_u", D_u if given else np.zeros(shape), rows=shape[0], columns=shape[1])
        if not checked["B_d"].shape[1] or not checked["W"].shape[0]:
            raise InvalidInputError(
                "B_d needs a column and W a row; write zeros where there is no disturbance or weight"
            )
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def order(self) -> int:
        """n, the number of states."""
        return len(self.A)

    @property
    def sensors(self) -> int:
        """q, the number of sensors."""
        return len(self.C)

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
    ) -> MultiratePlant:
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
            A factor of R, in its place.
        Q : array (m_d, m_d), optional
            Covariance of d, positive semidefinite; the identity unless given.
        R : array (q, q), optional
            Covariance of the sensor noise n, positive definite.
        S : array (m_d, q), optional
            Covariance of d(k) and n(k); zero unless given.
        W : array (n_z, n), optional
            Weight of the estimation error; the identity unless given.
        B_u : array (n, m_u), optional
            Effect of the known inputs u; none unless given.
        D_u : array (q, m_u), optional
            Effect of the known inputs on the measurements; none unless given.
        dt : float
            Base period in s.

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
        A, C = as_matrix("A", A), as_matrix("C", C)
        B = np.eye(len(A)) if B_d is None else as_matrix("B_d", B_d, rows=len(A))
        if R is None:
            factor = as_matrix("D", D, rows=len(C))
            R = factor @ factor.T
        Q = np.eye(B.shape[1]) if Q is None else Q
        noise = noise_factors(Q, R, S, disturbances=B.shape[1], sensors=len(C))
        given = {"W": W, "B_u": B_u, "D_u": D_u}
        shaped: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
        return cls(A=A, C=C, B_d=B @ noise.F, B_w=B @ noise.E, D=noise.D, dt=dt, **shaped)

    @classmethod
    def from_statespace(
        cls, system: Any, D: Any, *, disturbances: Sequence[int | str] | None = None, W: Any = None
    ) -> MultiratePlant:
        """Take A, B, C and dt from a discrete-time `control.StateSpace`.

        Parameters
        ----------
        system : control.StateSpace
            Discrete-time, without feedthrough from process noise.
        D : array (q, q_w)
            Effect of the sensor noise w.
        disturbances : sequence of int or str, optional
            Inputs that are process noise, by index or label; all unless given. The others become B_u.
        W : array (n_z, n), optional
            Weight of the estimation error.

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
        if not is_statespace(system):
            raise InvalidInputError(f"system must be a control.StateSpace, got {type(system).__name__}")
        if not system.isdtime(strict=True):
            raise InvalidInputError(
                f"system must be discrete-time, its dt is {system.dt}; sample it first (control.sample_system), "
                "or give dt"
            )
        labels = list(system.input_labels)
        if isinstance(disturbances, str) or (disturbances is not None and not np.iterable(disturbances)):
            raise InvalidInputError(f"disturbances must be a sequence of inputs, got {disturbances!r}; write a list")
        chosen = (
            list(range(len(labels))) if disturbances is None else [index_of(i, labels, "input") for i in disturbances]
        )
        if len(set(chosen)) < len(chosen):
            raise InvalidInputError(f"disturbances must name each input once, got {disturbances!r}")
        others = [i for i in range(len(labels)) if i not in chosen]
        B, direct = np.asarray(system.B, dtype=float), np.asarray(system.D, dtype=float)
        if np.any(direct[:, chosen]):
            raise InvalidInputError(
                "system must have no feedthrough from its disturbances: set its D to zero there, move the input into "
                "the state, or name the inputs that are disturbances"
            )
        return cls(
            A=system.A,
            B_d=B[:, chosen],
            C=system.C,
            D=D,
            W=W,
            B_u=B[:, others],
            D_u=direct[:, others],
            dt=1.0 if system.dt is True else float(system.dt),
        )
