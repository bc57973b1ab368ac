"""A continuous-time plant as a Kalman filter with time stamps sees it: dynamics, sensors by name, and their noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from replication.errors import InvalidInputError
from replication.estimation.api.plants import NOT_GIVEN, LinearPlant, parts_of
from replication.estimation.api.signals import numbered
from replication.estimation.linear.covariances import covariance, noise_factors
from replication.estimation.validation import Array, as_matrix, undetectable_mode

if TYPE_CHECKING:
    import control


@dataclass(frozen=True, eq=False)
class NoisyPlant(LinearPlant):
    """x' = Ax + B_u u + w between the samples y = Cx + v, whose instants are known; u is held from sample to sample.

    Without S the noise w is white with intensity Q. With S it is held: w keeps one value, of covariance Q, from each
    sample to the next, and S is its covariance with the noise v of the sample at which it starts. The plant may be
    unstable or integrate.

    Parameters
    ----------
    A : array (n, n)
        Dynamics, in 1/s.
    C : array (q, n)
        One row for each sensor.
    Q : array (n, n)
        Intensity of the white process noise, in squared units of the states per second; covariance if it is held.
    R : array (q, q) or (q,)
        Covariance of the sensors' noise, positive definite; a vector holds the variances of independent sensors.
    B_u : array (n, m), optional
        Effect of known inputs.
    S : array (n, q), optional
        Covariance of the held process noise with the sensors' noise.
    P0 : array (n, n), optional
        Covariance of x^(0) - x(0); the identity unless given.
    sensors : sequence of str, optional
        Names of the q sensors; y[0], y[1] and so on unless given.

    Raises
    ------
    InvalidInputError
        A shape does not fit, Q, R or P0 is no covariance, S does not fit to Q and R, a name stands twice, or an
        unstable mode is not seen by any sensor.

    Examples
    --------
    >>> cart = NoisyPlant([[0, 1], [0, 0]], [[1, 0]], Q=[[0, 0], [0, 0.1]], R=[0.01], sensors=["camera"])
    >>> cart.sensors
    ('camera',)
    """

    SHAPES: ClassVar[Mapping[str, str]] = {"A": "nn", "C": "qn", "B_u": "nu"}

    A: Array
    C: Array
    Q: Array
    R: Array
    B_u: Array = NOT_GIVEN
    S: Array | None = None
    P0: Array = NOT_GIVEN
    sensors: Sequence[str] = NOT_GIVEN

    if TYPE_CHECKING:
        # Type checkers see that lists do; the fields themselves are arrays.
        def __init__(
            self,
            A: npt.ArrayLike,
            C: npt.ArrayLike,
            Q: npt.ArrayLike,
            R: npt.ArrayLike,
            B_u: npt.ArrayLike | None = None,
            S: npt.ArrayLike | None = None,
            P0: npt.ArrayLike | None = None,
            sensors: Sequence[str] | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        """Check and freeze."""
        sizes = self.check()
        n, q = sizes["n"], sizes["q"]
        noise_factors(self.Q, self.R, self.S, disturbances=n, sensors=q)  # refuses what is no covariance
        P0 = np.eye(n) if self.P0 is None else self.P0
        for name, value, size in (("Q", self.Q, n), ("R", self.R, q), ("P0", P0, n)):
            object.__setattr__(self, name, covariance(name, value, size))
        if self.S is not None:
            object.__setattr__(self, "S", as_matrix("S", self.S))
        object.__setattr__(self, "sensors", _names(self.sensors, q))
        if (mode := undetectable_mode(self.A, self.C, discrete=False)) is not None:
            raise InvalidInputError(
                f"no sensor sees the mode {mode:.6g}, which does not decay: its error would grow for ever; measure it, "
                "or leave it out of the plant"
            )

    @staticmethod
    def from_statespace(
        system: control.StateSpace, Q: Any, R: Any, *, S: Any | None = None, P0: Any | None = None
    ) -> NoisyPlant:
        """From a continuous-time `control.StateSpace` with known inputs u and outputs y, whose labels name the sensors.

        Parameters
        ----------
        system : control.StateSpace
            Continuous-time, without feedthrough.
        Q, R, S, P0 : see there
            As in `NoisyPlant`.

        Returns
        -------
        NoisyPlant
            The same matrices.

        Raises
        ------
        InvalidInputError
            The system is not continuous-time or has feedthrough; or as `NoisyPlant`.
        """
        parts = parts_of(system, continuous=True, disturbances=())
        if np.any(parts.D_u):
            raise InvalidInputError("the plant must have no feedthrough from u to y: set D to zero, and take y - D u")
        return NoisyPlant(parts.A, parts.C, Q, R, parts.B_u, S, P0, parts.signals.measurements)


def _names(given: Sequence[str] | None, count: int) -> tuple[str, ...]:
    if given is None:
        return numbered("y", count)
    names = () if isinstance(given, str) else tuple(given)
    if len(names) != count or len(set(names)) < count or not all(isinstance(name, str) for name in names):
        raise InvalidInputError(f"sensors must be {count} different names, one for each row of C, got {given!r}")
    return names
