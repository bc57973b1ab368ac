"""The filter of least entropy at a level for a delay-free model with D_z = 0; the Kalman filter at an infinite level.

Source: Mustafa and Glover, Minimum Entropy H-infinity Control (1990): the central solution of the filter Riccati
equation. trace(C_z P C_z') bounds the mean square of the error of z for white noise, and is it for the Kalman filter.
"""

from __future__ import annotations

import numpy as np
import scipy

from replication.errors import InfeasibleError
from replication.estimation.delay.exact.filtering import noise_unit
from replication.estimation.delay.exact.ladder import FilterModel
from replication.estimation.validation import Array

NEGATIVE = 1e-9
"""Eigenvalues of P down to so much of the largest are rounding."""


def central(model: FilterModel, level: float = np.inf) -> tuple[Array, Array]:
    """L (N, q) of x^' = a x^ + L (y - cy x^), and P (N, N), for Kalman the covariance of the error.

    a P + P a' + b b' + P cz' cz P / level^2 = L R L' with R = dy dy' and L = (P cy' + b dy') R^-1.

    Raises InfeasibleError if there is no P >= 0 that stabilises, LinAlgError where rounding decides.
    """
    # In units of w in which the noise of y is about one; no gain hangs on them.
    unit = noise_unit(model)
    b, dy = model.b / unit, model.dy / unit
    R, noise = dy @ dy.T, b @ dy.T
    c, weight, cross = model.cy, R, noise
    if np.isfinite(level):
        p = len(model.cz)
        c = np.vstack([model.cz * (unit / level), c])
        weight = scipy.linalg.block_diag(-np.eye(p), R)
        cross = np.hstack([np.zeros((len(noise), p)), noise])
    P = scipy.linalg.solve_continuous_are(model.a.T, c.T, b @ b.T, weight, s=cross)
    values = np.linalg.eigvalsh(P)
    if values[0] < -NEGATIVE * max(values[-1], 0.0):
        raise InfeasibleError(f"no filter of the model keeps the level {level:.6g}")
    return np.linalg.solve(R, (P @ model.cy.T + noise).T).T, unit**2 * P
