"""Covariance matrices Q, R and S as a user gives them: checked, and turned into factors of white noise."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.validation import Array, as_matrix

ROUNDING = 1e-9
"""Asymmetry, and size of a negative eigenvalue, that count as rounding, with every variance scaled to one."""


class NoiseFactors(NamedTuple):
    """Q, R, S = F F' + E E', D D', E D' with white noise: d = F v + E w drives the plant, D w disturbs the sensors."""

    F: Array
    E: Array
    D: Array


def noise_factors(Q: Any, R: Any, S: Any, *, disturbances: int, sensors: int) -> NoiseFactors:
    """Factors of the joint covariance [[Q, S], [S', R]] of disturbances and sensor noise.

    Parameters
    ----------
    Q : array (m, m)
        Covariance of the disturbances, positive semidefinite.
    R : array (q, q) or (q,)
        Covariance of the sensor noise, positive definite; a vector holds variances.
    S : array (m, q), optional
        Covariance of both; None stands for zero.
    disturbances, sensors : int
        m and q.

    Raises
    ------
    InvalidInputError
        A matrix has another shape, is not symmetric or indefinite, or S does not fit the other two.
    """
    Q, R = covariance("Q", Q, disturbances), covariance("R", R, sensors)
    units = np.sqrt(np.diag(R))
    silent = np.flatnonzero(units == 0)
    if len(silent):
        raise InvalidInputError(f"R must be positive definite, R[{silent[0]}][{silent[0]}] is 0: give it some noise")
    try:
        D = units[:, None] * np.linalg.cholesky(R / np.outer(units, units))
    except np.linalg.LinAlgError:
        raise InvalidInputError(
            "R must be positive definite, but noises of several sensors determine each other; give each some of its own"
        ) from None
    E, rest = np.zeros((disturbances, sensors)), Q
    if S is not None:
        E = np.linalg.solve(D, as_matrix("S", S, rows=disturbances, columns=sensors).T).T
        rest = Q - E @ E.T
        if (least := _least_eigenvalue(rest, np.diag(Q))) < -ROUNDING:
            raise InvalidInputError(
                f"S does not fit Q and R: Q - S R^-1 S' has the eigenvalue {least:.3g} (every variance of Q scaled to "
                "one), and must be positive semidefinite; make S smaller"
            )
    return NoiseFactors(_root(rest), E, D)


def covariance(name: str, value: Any, size: int) -> Array:
    """`value`, a matrix or a vector of variances, as a covariance matrix (size, size), read-only.

    Raises InvalidInputError unless it is symmetric and semidefinite.
    """
    matrix = np.diag(value) if np.ndim(value) == 1 else value
    given = as_matrix(name, matrix, rows=size, columns=size)
    scale = np.sqrt(np.abs(np.outer(np.diag(given), np.diag(given))))
    if np.any(np.diag(given) < 0):
        where = int(np.argmin(np.diag(given)))
        raise InvalidInputError(
            f"{name}[{where}][{where}] is a variance and must not be negative, got {given[where][where]:.6g}"
        )
    if np.any(np.abs(given - given.T) > ROUNDING * np.maximum(scale, np.abs(given))):
        raise InvalidInputError(f"{name} must be symmetric, as every covariance is; got {given.tolist()}")
    if np.any(np.abs(given) > scale * (1 + ROUNDING)) or _least_eigenvalue(given, np.diag(given)) < -ROUNDING:
        raise InvalidInputError(
            f"{name} must be positive semidefinite, as every covariance is; its covariances are too large for its "
            "variances"
        )
    return as_matrix(name, (given + given.T) / 2)


def _least_eigenvalue(matrix: Array, variances: Array) -> float:
    """With variances scaled to one, so that units do not matter; those of zero keep their unit."""
    units = np.sqrt(np.where(variances > 0, variances, 1.0))
    return float(np.linalg.eigvalsh(matrix / np.outer(units, units))[0])


def _root(matrix: Array) -> Array:
    """F with F F' = matrix, which is semidefinite up to rounding."""
    variances = np.diag(matrix)
    units = np.sqrt(np.where(variances > 0, variances, 1.0))
    values, vectors = np.linalg.eigh(matrix / np.outer(units, units))
    return np.asarray(units[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
