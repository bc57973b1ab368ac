"""The Kalman filter along a log, of which some rows are measured at each instant, with its derivatives.

All forms come down to it: x+ = Phi x + drive + noise of covariance sum_i v_i Q_i, y = C x + known + bias + noise of
covariance R, where v, R, the biases and the instants may depend on parameters. The derivatives of estimate and
covariance by each parameter are further entries of the same stacks (forward sensitivities): at the optimal gain K, that
of (I - K C) P (I - K C)' + K R K' is the same expression of the derivatives of P and R.

With innovations e and covariances V, -ln L = 1/2 sum(ln det V + e' V^-1 e) (F. C. Schweppe, IEEE T-IT 11 (1965)), and
the Fisher information is sum(1/2 tr(V^-1 V_i V^-1 V_j) + e_i' V^-1 e_j), where an index stands for a derivative (N. K.
Gupta and R. K. Mehra, IEEE TAC 19 (1974)).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replication.errors import SolverError
from replication.estimation.recorded.log import Log
from replication.estimation.validation import Array

SETTLED = 1e-15
"""Relative change of covariances over one period below which they count as steady."""
REPEATS = 64
"""Different steps up to which the covariances of a log may become steady."""


LOST = (
    "a covariance of innovations was lost in rounding: bring Q, R and P0 nearer to each other, or scale the states; "
    "begin an extended filter nearer the truth"
)


class Drift(NamedTuple):
    """What moves with an instant: A (n, n) and noise (s, n, n) in continuous time, the known drive (N, n), and by how
    much each step becomes longer with the latency of each sensor (N, q)."""

    A: Array
    noise: Array
    drive: Array
    longer: Array


class Parameters(NamedTuple):
    """Values, and then their derivatives by each of p parameters, of the variances v (p + 1, s), of R (p + 1, q, q) and
    of the biases (p + 1, q); late: the sensors whose latencies are the last parameters."""

    v: Array
    R: Array
    bias: Array
    late: tuple[int, ...] = ()


class Run(NamedTuple):
    """Filtered x (N, n) and P (N, n, n); innovations e (N, p + 1, q) and covariances V (N, p + 1, q, q) with their
    derivatives, zero and one for sensors without a number that was used (N, q)."""

    x: Array
    P: Array
    e: Array
    V: Array
    used: NDArray[np.bool_]
    gated: int


@dataclass(frozen=True, eq=False)
class Series:
    """A log with the model of its steps.

    log; due (N, q): numbers that may be used; C (q, n); known (N, q): effect of the inputs on the measurements; Phi
    (U, n, n) and noise (U, s, n, n): different steps, of which `which` (N,) follows each row; drive (N, n): effect of
    the inputs over it; x0 (n,) and P0 (n, n) of the start; gains (period, n, q): where they are fixed; gate: in
    standard deviations, 0 for none; drift: where instants move.
    """

    log: Log
    due: NDArray[np.bool_]
    C: Array
    known: Array
    Phi: Array
    noise: Array
    which: NDArray[np.intp]
    drive: Array
    x0: Array
    P0: Array
    gains: Array | None = None
    gate: float = 0.0
    drift: Drift | None = None

    def run(self, parameters: Parameters) -> Run:
        """Along the whole log."""
        log, (N, q), n, p = self.log, self.log.y.shape, len(self.P0), len(parameters.R) - 1
        due = self.due & ~np.isnan(log.y)
        used = due.copy()
        y = np.where(due, log.y - self.known - parameters.bias[0], 0.0)
        spread = np.einsum("ps,usij->upij", parameters.v, self.noise)
        X, P = np.zeros((p + 1, n)), np.zeros((p + 1, n, n))
        X[0], P[0] = self.x0, self.P0
        run = Run(np.empty((N, n)), np.empty((N, n, n)), np.empty((N, p + 1, q)), np.empty((N, p + 1, q, q)), used, 0)
        sensing: dict[bytes, Sensing] = {}
        corrections: dict[tuple[bytes, int, int], Correction] = {}
        phases, repeats = 1 if self.gains is None else len(self.gains), len(self.Phi) <= REPEATS
        for k, (sample, came, step) in enumerate(zip(y, used, self.which.tolist(), strict=True)):
            if self.gate:
                variances = np.diag(self.C @ P[0] @ self.C.T + parameters.R[0])
                came &= (sample - self.C @ X[0]) ** 2 <= self.gate**2 * variances
            key = came.tobytes()
            if key not in sensing:
                sensing[key] = _sensing(self.C, parameters, came)
            sensors, place = sensing[key], (key, step, k % phases)
            now = corrections.get(place)
            if now is None or np.abs(P - now.prior).max() > SETTLED * np.abs(P).max():
                fixed = None if self.gains is None else self.gains[k % phases] * came
                now = _corrected(P, sensors, self.Phi[step], spread[step], fixed)
                if repeats:
                    corrections[place] = now
            e = run.e[k]
            np.subtract(sensors.shift, X @ sensors.C.T, out=e)
            e[0] += sample * came
            X = X + e @ now.K.T
            if p:
                X[1:] += now.dK @ e[0]
            run.x[k], run.P[k], run.V[k] = X[0], now.filtered[0], now.V
            X = X @ self.Phi[step].T
            X[0] += self.drive[k]
            P = now.following
            if self.drift is not None and parameters.late:
                P = self._moved(k, X, P, parameters)
        return run._replace(gated=int(np.sum(due & ~used)))

    def _moved(self, k: int, X: Array, P: Array, parameters: Parameters) -> Array:
        """The derivatives after a step that becomes longer with a latency."""
        assert self.drift is not None
        A, noise, drive, longer = self.drift
        moved = np.array(P)
        flow = A @ P[0]
        flow = flow + flow.T + np.tensordot(parameters.v[0], noise, 1)
        for i, sensor in enumerate(parameters.late, start=len(P) - len(parameters.late)):
            X[i] += longer[k, sensor] * (A @ X[0] + drive[k])
            moved[i] += longer[k, sensor] * flow
        return moved


class Sensing(NamedTuple):
    """C and R (p + 1, q, q) with rows of zero and noise of one for sensors that are not used, and the derivatives of
    what is subtracted from the innovations (p + 1, q)."""

    C: Array
    R: Array
    shift: Array


def _sensing(C: Array, parameters: Parameters, came: NDArray[np.bool_]) -> Sensing:
    R = parameters.R * came[:, None] * came
    R[0] += np.diag(~came)
    shift = -parameters.bias * came
    shift[0] = 0.0
    return Sensing(C * came[:, None], R, shift)


class Correction(NamedTuple):
    """Covariances before the sample (p + 1, n, n); V (p + 1, q, q); the gain K (n, q) and its derivatives dK (p, n, q);
    covariances after the sample and after the step."""

    prior: Array
    V: Array
    K: Array
    dK: Array
    filtered: Array
    following: Array


def _corrected(P: Array, sensors: Sensing, Phi: Array, noise: Array, fixed: Array | None) -> Correction:
    """One sample and one step of the covariances; fixed: the gain, if it is not the optimal one."""
    C, R, _ = sensors
    crossed = P @ C.T
    V = C @ crossed + R
    try:
        inverse = np.linalg.inv(V[0])
    except np.linalg.LinAlgError:
        raise SolverError(LOST) from None
    K = crossed[0] @ inverse if fixed is None else fixed
    left = np.eye(len(Phi)) - K @ C
    filtered = left @ P @ left.T + K @ R @ K.T
    return Correction(P, V, K, (crossed[1:] - K @ V[1:]) @ inverse, filtered, Phi @ filtered @ Phi.T + noise)


def likelihood(run: Run) -> tuple[float, Array, Array]:
    """-ln L, its gradient (p,), and Fisher's information (p, p); raises SolverError if rounding spoils a covariance."""
    e, V, de, dV = run.e[:, 0], run.V[:, 0], run.e[:, 1:], run.V[:, 1:]
    inverse = np.linalg.inv(V)
    weighted = np.einsum("kab,kb->ka", inverse, e)
    sign, size = np.linalg.slogdet(V)
    if not np.all(sign > 0):
        raise SolverError(LOST)
    cost = 0.5 * (size.sum() + np.sum(e * weighted) + np.log(2 * np.pi) * run.used.sum())
    relative = inverse[:, None] @ dV
    gradient = 0.5 * np.einsum("kiaa->i", relative) + np.einsum("kia,ka->i", de, weighted)
    gradient -= 0.5 * np.einsum("ka,kiab,kb->i", weighted, dV, weighted, optimize=True)
    size = len(gradient)
    flat, turned = relative.reshape(len(e), size, -1), relative.mT.reshape(len(e), size, -1)
    information = 0.5 * np.tensordot(flat, turned, ([0, 2], [0, 2]))
    information += np.tensordot(de @ inverse, de, ([0, 2], [0, 2]))
    return float(cost), gradient, information


def whitened(run: Run) -> Array:
    """Innovations as independent numbers of variance one if the model is right (N, q); NaN where none was used.

    Raises SolverError if rounding spoils their covariance.
    """
    try:
        roots = np.linalg.cholesky(run.V[:, 0])
    except np.linalg.LinAlgError:
        raise SolverError(LOST) from None
    return np.where(run.used, np.linalg.solve(roots, run.e[:, 0, :, None])[..., 0], np.nan)
