"""The plant of a multi-rate observer, eqs. (2), (3), (18): x+ = A x + B_u u + B_d d, y_r = C x + D w, z = W e."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from replication.errors import InvalidInputError
from replication.estimation.api.signals import is_statespace
from replication.estimation.validation import Array, as_matrix, positive_scalar

_NOT_GIVEN = np.zeros((0, 0))


def _not_given() -> Array:
    return _NOT_GIVEN


@dataclass(frozen=True, kw_only=True, eq=False)
class MultiratePlant:
    """A discrete-time plant with process noise d and sensor noise w.

    Shapes: A (n, n), B_d (n, m_d), C (q, n), D (q, q_w), W (n_z, n), B_u (n, m_u). W is the identity and B_u empty
    unless given (or if None). `dt` is the base period in seconds (1.0 if it does not matter). The noise is scaled so
    that d and w are the signals whose l2 norm counts. Raises InvalidInputError if an entry is not finite or the shapes
    do not fit.
    """

    A: Array
    B_d: Array
    C: Array
    D: Array
    W: Array = field(default_factory=_not_given)
    B_u: Array = field(default_factory=_not_given)
    dt: float = 1.0

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
            dt: float = 1.0,
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
        W, B_u = (None if given is _NOT_GIVEN else given for given in (self.W, self.B_u))
        checked: dict[str, Any] = {
            "A": A,
            "B_d": as_matrix("B_d", self.B_d, rows=n),
            "C": C,
            "D": as_matrix("D", self.D, rows=C.shape[0]),
            "W": np.eye(n) if W is None else as_matrix("W", W, columns=n),
            "B_u": np.zeros((n, 0)) if B_u is None else as_matrix("B_u", B_u, rows=n),
            "dt": positive_scalar("dt", self.dt, unit="seconds"),
        }
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

    @classmethod
    def from_statespace(
        cls, system: Any, D: Any, *, disturbances: Sequence[int | str] | None = None, W: Any = None
    ) -> MultiratePlant:
        """Take A, B, C and dt from a discrete-time `control.StateSpace`.

        disturbances: indices or labels of the inputs that are process noise (all if None); the others become B_u. D is
        the sensor noise matrix (q, q_w). Raises InvalidInputError for a continuous-time system, a feedthrough from an
        input to a sensor (the observer has no place for one), or an unknown input.
        """
        if not is_statespace(system):
            raise InvalidInputError(f"system must be a control.StateSpace, got {type(system).__name__}")
        if not system.isdtime(strict=True):
            raise InvalidInputError(
                f"system must be discrete-time, its dt is {system.dt}; sample it first (control.sample_system)"
            )
        if np.any(system.D):
            raise InvalidInputError(
                "system must have no feedthrough: set its D to zero, or move the input into the state"
            )
        labels = list(system.input_labels)
        if isinstance(disturbances, str) or (disturbances is not None and not np.iterable(disturbances)):
            raise InvalidInputError(f"disturbances must be a sequence of inputs, got {disturbances!r}; write a list")
        chosen = list(range(len(labels))) if disturbances is None else [_input_index(i, labels) for i in disturbances]
        if len(set(chosen)) < len(chosen):
            raise InvalidInputError(f"disturbances must name each input once, got {disturbances!r}")
        others = [i for i in range(len(labels)) if i not in chosen]
        B = np.asarray(system.B, dtype=float)
        return cls(
            A=system.A,
            B_d=B[:, chosen],
            C=system.C,
            D=D,
            W=W,
            B_u=B[:, others],
            dt=1.0 if system.dt is True else float(system.dt),
        )


def _input_index(name: int | str, labels: list[str]) -> int:
    if isinstance(name, str) and name in labels:
        return labels.index(name)
    if isinstance(name, (int, np.integer)) and not isinstance(name, bool) and 0 <= name < len(labels):
        return int(name)
    raise InvalidInputError(f"no input {name!r}; the inputs are {', '.join(labels)} (or their indices from 0)")
