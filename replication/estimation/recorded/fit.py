"""Variances and biases by maximum likelihood through the innovations of the Kalman filter (F. C. Schweppe, IEEE T-IT 11
(1965)), with exact gradients: the sensitivities of estimate, covariance and innovation run along with the filter.

With innovations e and their covariances V, -ln L = 1/2 sum(ln det V + e' V^-1 e), and the Fisher information is
sum(1/2 tr(V^-1 V_i V^-1 V_j) + e_i' V^-1 e_j), where an index stands for a derivative (N. K. Gupta and R. K. Mehra,
IEEE TAC 19 (1974)). Scoring steps with it, halved until the likelihood rises.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import stats

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError, SolverError
from replication.estimation.api.shown import Shown
from replication.estimation.linear.riccati import symmetric
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.nonuniform.stamped.transition import Transition
from replication.estimation.recorded.replay import PROBABILITY, Log, Replay, read_log, replay
from replication.estimation.validation import Array

STEPS, LONGEST, SETTLED = 100, 2.0, 1e-9
"""Scoring steps at most; the longest in the logarithm of a variance; and the decrement at which they end."""
SINGULAR = 1e-8
"""Eigenvalue of the information, its diagonal scaled to one, below which a combination is not told."""
FAINT = 1e-3
"""Information of the logarithm of a variance below which the log says nothing of it."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Fit(Shown):
    """What a log tells of a plant's noise.

    Attributes
    ----------
    plant : NoisyPlant
        With the fitted Q and R.
    names : tuple of str
        The p parameters: `Q[i][i]`, `R[sensor]`, `bias[sensor]`.
    values : array (p,)
        Their estimates.
    intervals : array (p, 2)
        95 % intervals from the Fisher information; of a variance through its logarithm.
    errors : array (p,)
        Standard errors; relative to the value for a variance.
    information : array (p, p)
        Fisher's, of the logarithms of the variances and of the biases.
    log_likelihood : float
        Its greatest value.
    replay : Replay
        The fitted filter over the log without its biases.
    """

    plant: NoisyPlant
    names: tuple[str, ...]
    values: Array
    intervals: Array
    errors: Array
    information: Array
    log_likelihood: float
    replay: Replay

    def rows(self) -> list[tuple[str, str, str]]:
        """The lines of the table."""
        how = "maximum likelihood; 95 % interval"
        lines = [
            (name, f"{value:.4g}", f"{how} [{low:.4g}, {high:.4g}]")
            for name, value, (low, high) in zip(self.names, self.values, self.intervals, strict=True)
        ]
        return [*lines, ("log likelihood", f"{self.log_likelihood:.6g}", "exact innovations"), *self.replay.rows()]

    def panels(self) -> tuple[Panel, ...]:
        """Those of the replay."""
        return self.replay.panels()

    def to_dict(self) -> dict[str, Any]:
        """Estimates, errors and intervals as plain JSON values."""
        return {
            "names": list(self.names),
            "values": self.values.tolist(),
            "errors": self.errors.tolist(),
            "intervals": self.intervals.tolist(),
            "log_likelihood": self.log_likelihood,
        }


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Of a log, as a function of p parameters: logarithms of variances of Q and R, then biases.

    states, biased: which diagonal entries of Q, and which sensors' biases, are parameters.
    """

    plant: NoisyPlant
    log: Log
    states: tuple[int, ...]
    biased: tuple[int, ...]

    def __call__(self, theta: Array) -> tuple[float, Array, Array]:
        """-ln L, its gradient (p,), and Fisher's information (p, p)."""
        plant, log = self.plant, self.log
        n, q = plant.order, len(plant.C)
        s, p, m = len(self.states), len(theta), log.u.shape[1]
        # Derivatives of Q, of R and of the biases by each parameter.
        dQ, dR, db = np.zeros((p, n, n)), np.zeros((p, q, q)), np.zeros((p, q))
        for i, state in enumerate(self.states):
            dQ[i, state, state] = np.exp(theta[i])
        for j in range(q):
            dR[s + j, j, j] = np.exp(theta[s + j])
        for j, sensor in enumerate(self.biased):
            db[s + q + j, sensor] = 1.0
        R, bias = dR.sum(axis=0), db.T @ theta
        series = [Transition.of(plant.A, plant.B_u, part) for part in dQ[:s]]
        x, P, dx, dP = np.zeros(n), np.array(plant.P0), np.zeros((p, n)), np.zeros((p, n, n))
        cost, gradient, information = 0.0, np.zeros(p), np.zeros((p, p))
        kept: dict[float, tuple[Array, Array, Array]] = {}
        for i, y in enumerate(log.y):
            seen = ~np.isnan(y)
            if np.any(seen):
                C = plant.C[seen]
                e, de = y[seen] - C @ x - bias[seen], -dx @ C.T - db[:, seen]
                V = symmetric(C @ P @ C.T + R[np.ix_(seen, seen)])
                dV = C @ dP @ C.T + dR[:, seen][:, :, seen]
                inverse = np.linalg.inv(V)
                K, weighted, relative = P @ C.T @ inverse, inverse @ e, inverse @ dV
                cost += 0.5 * (np.linalg.slogdet(2 * np.pi * V)[1] + e @ weighted)
                trace = np.trace(relative, axis1=1, axis2=2)
                gradient += 0.5 * (trace - weighted @ dV @ weighted) + de @ weighted
                information += 0.5 * np.einsum("iab,jba->ij", relative, relative) + de @ inverse @ de.T
                dK = (dP @ C.T - K @ dV) @ inverse
                left = np.eye(n) - K @ C
                x, dx = x + K @ e, dx + dK @ e + de @ K.T
                P = symmetric(left @ P @ left.T + K @ R[np.ix_(seen, seen)] @ K.T)
                dP = left @ dP @ left.T + K @ dR[:, seen][:, :, seen] @ K.T
            if i + 1 < len(log.t):
                h = float(log.t[i + 1] - log.t[i])
                if h not in kept:
                    parts = [one.at(h) for one in series]
                    spread = np.zeros((p, n, n))
                    spread[:s] = [part[2] for part in parts]
                    kept[h] = parts[0][0], parts[0][1], spread
                Phi, Gamma, spread = kept[h]
                x, dx = Phi @ x + (Gamma @ log.u[i] if m else 0.0), dx @ Phi.T
                P, dP = Phi @ P @ Phi.T + spread.sum(axis=0), Phi @ dP @ Phi.T + spread
        return float(cost), gradient, information


def fit(
    plant: NoisyPlant, log: Any, *, biases: tuple[str, ...] = (), time: str = "t", inputs: tuple[str, ...] = ()
) -> Fit:
    """Estimate the variances of a plant's noise, and biases of its sensors, from a log.

    Parameters
    ----------
    plant : NoisyPlant
        Q and R diagonal, as first guess; zeros of Q stay zero. P0 is the covariance of the start.
    log, time, inputs : see there
        As in `read_log`.
    biases : tuple of str
        Sensors whose constant bias is estimated.

    Returns
    -------
    Fit
        Estimates with intervals, the plant, and its replay.

    Raises
    ------
    InvalidInputError
        The plant is of another kind, a sensor unknown, the log refused, or the log does not tell the parameters.
    SolverError
        The likelihood did not settle.
    """
    if not isinstance(plant, NoisyPlant):
        raise InvalidInputError(f"plant must be a NoisyPlant, got {type(plant).__name__}")
    if plant.S is not None or any(np.any(np.diag(np.diag(M)) != M) for M in (plant.Q, plant.R)):
        raise InvalidInputError(
            "fit takes a diagonal Q and R and no S: choose states or sensors whose noise is independent"
        )
    states = tuple(int(i) for i in np.flatnonzero(np.diag(plant.Q)))
    if not states:
        raise InvalidInputError("Q is zero: give a first guess of the variances that are to be fitted")
    sensors = list(plant.sensors)
    if any(name not in sensors for name in biases) or len(set(biases)) < len(biases):
        raise InvalidInputError(f"biases must be different names out of {sensors}, got {biases!r}")
    data = read_log(log, plant, time=time, inputs=inputs)
    first = replay(StampedKalman(plant), log, time=time, inputs=inputs)
    if first.suspicions:
        raise InvalidInputError(f"{first.suspicions[0]}, or start from another Q and R")
    biased = tuple(sensors.index(name) for name in biases)
    names = (
        *(f"Q[{i}][{i}]" for i in states),
        *(f"R[{name}]" for name in sensors),
        *(f"bias[{name}]" for name in biases),
    )
    logs = len(states) + len(sensors)
    start = np.concatenate([np.log(np.diag(plant.Q)[list(states)]), np.log(np.diag(plant.R)), np.zeros(len(biased))])
    theta, cost, information = _optimum(Likelihood(plant, data, states, biased), start, logs, names)
    deviations = np.sqrt(np.diag(np.linalg.inv(information)))
    width = stats.norm.ppf((1 + PROBABILITY) / 2) * deviations
    ends = np.column_stack([theta - width, theta + width])
    values = np.array(theta)
    values[:logs], ends[:logs] = np.exp(values[:logs]), np.exp(ends[:logs])
    Q = np.zeros_like(plant.Q)
    Q[states, states] = values[: len(states)]
    fitted = replace(plant, Q=Q, R=np.diag(values[len(states) : logs]))
    shifted = np.array(data.y)
    shifted[:, biased] -= values[logs:]
    table = {time: data.t, **dict(zip(sensors, shifted.T, strict=True)), **dict(zip(inputs, data.u.T, strict=True))}
    return Fit(
        plant=fitted,
        names=names,
        values=values,
        intervals=ends,
        errors=deviations,
        information=information,
        log_likelihood=-cost,
        replay=replay(StampedKalman(fitted), table, time=time, inputs=inputs),
    )


def _optimum(cost_of: Likelihood, theta: Array, logs: int, names: tuple[str, ...]) -> tuple[Array, float, Array]:
    cost, gradient, information = cost_of(theta)
    for _ in range(STEPS):
        _require_told(information, logs, names)
        step = -np.linalg.solve(information, gradient)
        if -gradient @ step < SETTLED:
            return theta, cost, information
        longest = np.abs(step[:logs]).max()
        share = min(1.0, LONGEST / longest) if longest else 1.0
        while True:
            trial = theta + share * step
            if (after := cost_of(trial))[0] < cost:
                break
            share /= 2
            if share < SETTLED:
                raise SolverError("the likelihood does not rise along its gradient: scale the units, or guess anew")
        theta, (cost, gradient, information) = trial, after
    raise SolverError(f"the likelihood has not settled after {STEPS} steps: start from another Q and R")


def _require_told(information: Array, logs: int, names: tuple[str, ...]) -> None:
    """Refuse what the log does not tell, by name."""
    diagonal = np.diag(information)
    for name, amount, variance in zip(names, diagonal, np.arange(len(names)) < logs, strict=True):
        if amount <= (FAINT if variance else 0.0):
            raise InvalidInputError(
                f"the log does not tell {name}: hold it fixed (a zero in Q), or record it otherwise"
            )
    units = np.sqrt(diagonal)
    values, vectors = np.linalg.eigh(information / np.outer(units, units))
    if values[0] < SINGULAR:
        mixed = [name for name, part in zip(names, vectors[:, 0], strict=True) if abs(part) > 0.1]
        raise InvalidInputError(f"the log does not tell {' and '.join(mixed)} apart: fix one of them")
