"""Variances, biases and latencies by maximum likelihood through the exact innovations of the Kalman filter.

Fisher's scoring: steps with the expected information, damped where the likelihood does not rise (D. W. Marquardt, J.
SIAM 11 (1963)).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError, SolverError
from replication.estimation.api.shown import Shown
from replication.estimation.recorded.log import Log, by_sensor
from replication.estimation.recorded.replaying import PROBABILITY, Replay, logged, replayed
from replication.estimation.recorded.series import Form, Parameters, Series, likelihood, of_plant
from replication.estimation.validation import Array

STEPS, LONGEST, DAMPED, SETTLED = 100, 2.0, 0.1, 1e-9
"""Scoring steps at most; the longest in the logarithm of a variance; the first damping; the last decrement."""
SINGULAR = 1e-8
"""Eigenvalue of the information, its diagonal scaled to one, below which a combination is not told."""
FAINT = 1e-3
"""Information of the logarithm of a variance below which the log says nothing of it."""
GONE = 14.0
"""Fall of the logarithm of a variance, to a millionth, from which on it is near zero."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Fit(Shown):
    """What a log tells of a plant's noise.

    Attributes
    ----------
    plant : NoisyPlant or MultiratePlant
        With the fitted noise. Of a multi-rate design it has the late samples as states and needs no `latency`; of a
        dual-rate one its Q and R are the `process_noise` and `sensor_noise` of the next.
    names : tuple of str
        The p parameters: `Q[i][i]`, or `variance of NAME` for a disturbance of a multi-rate design, beside one as it
        was given; `R[sensor]`, `bias[sensor]`, `latency[sensor]` (s).
    values : array (p,)
        Their estimates.
    intervals : array (p, 2)
        95 % intervals from the Fisher information; of a variance through its logarithm.
    errors : array (p,)
        Standard errors; relative to the value for a variance.
    information : array (p, p)
        Fisher's, of the logarithms of the variances, of the biases and latencies.
    log_likelihood : float
        Its greatest value.
    replay : Replay
        The fitted filter over the log without its biases and latencies.
    """

    plant: Any
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
    """Of a log, as a function of p parameters.

    guess: logarithms of all variances of process and sensors, then biases and latencies; free: which are parameters;
    biased, late: the sensors of the latter two; start: x^(0) (n,).
    """

    form: Form
    log: Log
    guess: Array
    free: NDArray[np.bool_]
    biased: tuple[int, ...]
    late: tuple[int, ...]
    start: Any

    def noise(self, theta: Array) -> Parameters:
        """Variances and biases with their derivatives."""
        whole, K = self.whole(theta), len(self.guess)
        s, q, b = len(self.form.v), len(self.form.C), len(self.biased)
        variances, sensors, offsets = np.exp(whole[: s + q]), np.arange(q), s + q + np.arange(b)
        v, R, bias = np.zeros((K, s)), np.zeros((K, q, q)), np.zeros((K, q))
        v[:s], R[s + sensors, sensors, sensors], bias[offsets, self.biased] = np.diag(variances[:s]), variances[s:], 1.0
        late = tuple(sensor for sensor, free in zip(self.late, self.free[s + q + b :], strict=True) if free)
        return Parameters(
            np.vstack([v.sum(axis=0), v[self.free]]),
            np.concatenate([R.sum(axis=0)[None], R[self.free]]),
            np.vstack([whole @ bias, bias[self.free]]),
            late,
        )

    def whole(self, theta: Array) -> Array:
        """All parameters, those that are held fixed too."""
        whole = self.guess.copy()
        whole[self.free] = theta
        return whole

    def latency(self, theta: Array) -> Array:
        """Of each sensor, NaN where it is in time (q,)."""
        latency = np.full(len(self.form.C), np.nan)
        latency[list(self.late)] = self.whole(theta)[len(self.guess) - len(self.late) :]
        return latency

    @cached_property
    def _in_time(self) -> Series:
        return Series(self.form, self.log, self.latency(self.guess[self.free]), self.start)

    def __call__(self, theta: Array) -> tuple[float, Array, Array]:
        """-ln L, its gradient (p,), and Fisher's information (p, p)."""
        noise = self.noise(theta)
        moved = noise.late and Series(self.form, self.log, self.latency(theta), self.start)
        return likelihood((moved or self._in_time).run(noise))


def fit(
    plant: Any,
    log: Any,
    *,
    biases: Sequence[str] = (),
    latencies: Mapping[str, float] | None = None,
    fixed: Sequence[str] = (),
    time: str = "t",
    inputs: tuple[str, ...] = (),
    start: Any = None,
) -> Fit:
    """Estimate the variances of a plant's noise, biases and latencies of its sensors, from a log.

    Parameters
    ----------
    plant : NoisyPlant, KalmanResult or SlowRateResult
        A plant with time stamps, or a design of a multi-rate or dual-rate filter (goal="h2"). Its noise is the first
        guess; zeros stay zero. R is diagonal. Of a Q that is not, one factor is fitted.
    log : str, path, or mapping of str to array (N,)
        As in `read_log`; with a base period the first row is instant 0.
    biases : sequence of str
        Sensors whose constant bias is estimated.
    latencies : mapping of str to float, optional
        First guess of the latencies of sensors, s, of plants with time stamps.
    fixed : sequence of str
        Parameters by their names that are held at the first guess.
    time, inputs, start : see there
        As in `replay`.

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
    form = of_plant(plant)
    if np.any(form.R - np.diag(np.diag(form.R))):
        raise InvalidInputError("fit takes a diagonal R: choose sensors whose noise is independent")
    if not len(form.v):
        raise InvalidInputError("the process noise is zero: give a first guess of the variances to be fitted")
    late = by_sensor("latencies", latencies or {}, form.sensors)
    if any(name not in form.sensors for name in biases) or len(set(biases)) < len(biases):
        raise InvalidInputError(f"biases must be different names out of {list(form.sensors)}, got {biases!r}")
    tardy = tuple(int(j) for j in np.flatnonzero(~np.isnan(late)))
    names = (
        *form.noise,
        *(f"R[{name}]" for name in form.sensors),
        *(f"bias[{name}]" for name in biases),
        *(f"latency[{form.sensors[j]}]" for j in tardy),
    )
    if unknown := [name for name in fixed if name not in names]:
        raise InvalidInputError(f"fixed names no parameter {unknown[0]!r}; they are {', '.join(names)}")
    data = logged(form, log, time=time, inputs=inputs)
    first = replayed(form, data, Parameters(form.v[None], form.R[None], np.zeros((1, len(form.R)))), late, start)
    if first.suspicions:
        raise InvalidInputError(f"{first.suspicions[0]}, or start from another Q and R")
    logs = len(form.v) + len(form.R)
    guess = np.concatenate([np.log(form.v), np.log(np.diag(form.R)), np.zeros(len(biases)), late[list(tardy)]])
    free = np.array([name not in fixed for name in names])
    biased = tuple(form.sensors.index(name) for name in biases)
    cost_of = Likelihood(form, data, guess, free, biased, tardy, start)
    variance = (np.arange(len(names)) < logs)[free]
    parameters = tuple(name for name, flag in zip(names, free, strict=True) if flag)
    theta, cost, information = _optimum(cost_of, guess[free], variance, parameters)
    deviations = np.sqrt(np.diag(np.linalg.inv(information)))
    width = stats.norm.ppf((1 + PROBABILITY) / 2) * deviations
    ends = np.column_stack([theta - width, theta + width])
    v, R, bias, _ = cost_of.noise(theta)
    noise = Parameters(v[:1], R[:1], bias[:1])
    return Fit(
        plant=form.refitted(noise.v[0], noise.R[0]),
        names=parameters,
        values=np.where(variance, np.exp(theta), theta),
        intervals=np.where(variance[:, None], np.exp(ends), ends),
        errors=deviations,
        information=information,
        log_likelihood=-cost,
        replay=replayed(form, data, noise, cost_of.latency(theta), start),
    )


def _optimum(
    cost_of: Likelihood, guess: Array, variance: NDArray[np.bool_], names: tuple[str, ...]
) -> tuple[Array, float, Array]:
    theta, damping = guess, DAMPED
    cost, gradient, information = cost_of(theta)
    for _ in range(STEPS):
        if gradient @ _inverse(information) @ gradient < SETTLED:
            _require_told(information, variance, names)
            return theta, cost, information
        size = np.diag(information)
        step = -_inverse(information + damping * np.diag(np.where(variance, np.maximum(size, 1.0), size))) @ gradient
        trial = theta + np.where(variance, np.clip(step, -LONGEST, LONGEST), step)
        try:
            after = cost_of(trial)
        except SolverError:  # rounding spoils it
            after = np.inf, gradient, information
        if not after[0] < cost:
            damping *= 10
            continue
        damping /= 10
        theta, (cost, gradient, information) = trial, after
        if np.any(gone := variance & (theta < guess - GONE)):
            name = names[int(np.argmax(gone))]
            raise InvalidInputError(f"the log is likeliest with {name} near zero: leave it out, or hold it fixed")
    _require_told(information, variance, names)
    raise SolverError(f"the likelihood has not settled after {STEPS} steps: start from another Q and R")


def _scaled(information: Array) -> tuple[Array, Array, Array]:
    """Units in which its diagonal is one, and eigenvalues and -vectors in them."""
    units = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    return units, *np.linalg.eigh(information / np.outer(units, units))


def _inverse(information: Array) -> Array:
    """With what the log does not tell held to its place."""
    units, values, vectors = _scaled(information)
    inverse: Array = (vectors / np.maximum(values, SINGULAR) @ vectors.T) / np.outer(units, units)
    return inverse


def _require_told(information: Array, variance: NDArray[np.bool_], names: tuple[str, ...]) -> None:
    """Refuse what the log does not tell, by name."""
    for name, amount, logarithm in zip(names, np.diag(information), variance, strict=True):
        if amount <= (FAINT if logarithm else 0.0):
            raise InvalidInputError(
                f"the log does not tell {name}: hold it fixed (fixed=[{name!r}]), or record it otherwise"
            )
    _, values, vectors = _scaled(information)
    if values[0] < SINGULAR:
        mixed = [name for name, part in zip(names, vectors[:, 0], strict=True) if abs(part) > 0.1]
        raise InvalidInputError(
            f"the log does not tell {' and '.join(mixed)} apart: fix one of them (fixed=[{mixed[0]!r}])"
        )
