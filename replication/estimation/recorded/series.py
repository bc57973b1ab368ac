"""The Kalman filter along a log, of which some rows are measured at each instant, with its derivatives.

All forms, with time stamps, multi-rate, dual rate, come down to it: x+ = Phi x + drive + noise of covariance
sum_i v_i Q_i, y = C x + known + bias + noise of covariance R, where v, R, the biases and the instants may depend on
parameters. The derivatives of estimate and covariance by each parameter are further entries of the same stacks (forward
sensitivities): at the optimal gain K, that of (I - K C) P (I - K C)' + K R K' is the same expression of the derivatives
of P and R.

With innovations e and covariances V, -ln L = 1/2 sum(ln det V + e' V^-1 e) (F. C. Schweppe, IEEE T-IT 11 (1965)), and
the Fisher information is sum(1/2 tr(V^-1 V_i V^-1 V_j) + e_i' V^-1 e_j), where an index stands for a derivative (N. K.
Gupta and R. K. Mehra, IEEE TAC 19 (1974)).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replication.errors import InvalidInputError, SolverError
from replication.estimation.api.plants import Signals, numbered
from replication.estimation.dualrate.slow.problem import central, covariances
from replication.estimation.dualrate.slow.result import RunningController, SlowRateResult
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.result import KalmanResult
from replication.estimation.multirate.running import KalmanFilter, StartingFilter
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.nonuniform.stamped.kalman import Transition
from replication.estimation.recorded.log import Log
from replication.estimation.validation import Array, as_array

SETTLED = 1e-15
"""Relative change of covariances over one period below which they count as steady."""
REPEATS = 64
"""Different steps up to which the covariances of a log may become steady."""


LOST = (
    "a covariance of innovations was lost in rounding: bring Q, R and P0 nearer to each other, or scale the states; "
    "begin an extended filter nearer the truth"
)


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


class Moves(NamedTuple):
    """Different steps: Phi (U, n, n), Gamma (U, n, m), noise (U, s, n, n); and which (N,) follows each row."""

    Phi: Array
    Gamma: Array
    noise: Array
    which: Any


@dataclass(frozen=True, eq=False)
class Form:
    """A plant with its noise, or a filter of it.

    sensors, inputs: names, the latter if known; noise: names of the s variances v (s,) of the process noise; C (q, n),
    D_u (q, m); R (q, q); P0 (n, n); moves: the steps along a log; refitted: the plant with other v and R; dt: base
    period, s, or None for time stamps; gains (period, n, q): where they are fixed; due (period, q): a schedule; gate;
    under_way: states that are samples on their way; flow: A, B_u and effects of v (s, n, n) in continuous time.
    """

    sensors: tuple[str, ...]
    inputs: tuple[str, ...]
    noise: tuple[str, ...]
    v: Array
    C: Array
    D_u: Array
    R: Array
    P0: Array
    moves: Callable[[Log], Moves]
    refitted: Callable[[Array, Array], Any]
    dt: float | None = None
    gains: Array | None = None
    due: Any = None
    gate: float = 0.0
    under_way: int = 0
    flow: tuple[Array, Array, Array] | None = None

    def expected(self, rows: int) -> Any:
        """When sensors are due (rows, q)."""
        phases = np.ones((1, len(self.C)), dtype=bool) if self.due is None else self.due
        return phases[np.arange(rows) % len(phases)]


class Series:
    """A form along a log whose samples are as late as `latency` (q,) says, NaN where they are not.

    start (n - under_way,): x^(0), zero if None, as are samples under way. Raises InvalidInputError for another.
    """

    def __init__(self, form: Form, log: Log, latency: Array, start: Any) -> None:
        n = len(form.P0) - form.under_way
        self.form, self.start = form, np.zeros(len(form.P0))
        if start is not None:
            self.start[:n] = as_array("start", start, (n,))
        self.log, owner = log.taken(latency)
        self.moves = moves = form.moves(self.log)
        # A filter that follows its covariance takes a sample off its schedule.
        self.due = ~np.isnan(self.log.y) & (form.gains is None or form.expected(len(owner)))
        # What the inputs do to the measurements, and over the step that follows each row.
        self.known, self.drive = self.log.u @ form.D_u.T, np.einsum("knm,km->kn", moves.Gamma[moves.which], self.log.u)
        # By how much that step becomes longer with the latency of each sensor.
        sooner = -(owner[:, None] == np.arange(len(form.C))).astype(float)
        self.longer = np.diff(sooner, axis=0, append=sooner[-1:])

    def run(self, parameters: Parameters) -> Run:
        """Along the whole log."""
        form, log, (Phi, _, noise, which), p = self.form, self.log, self.moves, len(parameters.R) - 1
        (N, q), n = log.y.shape, len(self.start)
        used = self.due.copy()
        y = np.where(used, log.y - self.known - parameters.bias[0], 0.0)
        spread = np.einsum("ps,usij->upij", parameters.v, noise)
        X, P = np.zeros((p + 1, n)), np.zeros((p + 1, n, n))
        X[0], P[0] = self.start, form.P0
        run = Run(np.empty((N, n)), np.empty((N, n, n)), np.empty((N, p + 1, q)), np.empty((N, p + 1, q, q)), used, 0)
        sensing: dict[bytes, Sensing] = {}
        corrections: dict[tuple[bytes, int, int], Correction] = {}
        phases, repeats = 1 if form.gains is None else len(form.gains), len(Phi) <= REPEATS
        for k, (sample, came, step) in enumerate(zip(y, used, which.tolist(), strict=True)):
            if form.gate:
                variances = np.diag(form.C @ P[0] @ form.C.T + parameters.R[0])
                came &= (sample - form.C @ X[0]) ** 2 <= form.gate**2 * variances
            key = came.tobytes()
            if key not in sensing:
                sensing[key] = _sensing(form.C, parameters, came)
            sensors, place = sensing[key], (key, step, k % phases)
            now = corrections.get(place)
            if now is None or np.abs(P - now.prior).max() > SETTLED * np.abs(P).max():
                fixed = None if form.gains is None else form.gains[k % phases] * came
                now = _corrected(P, sensors, Phi[step], spread[step], fixed)
                if repeats:
                    corrections[place] = now
            e = run.e[k]
            np.subtract(sensors.shift, X @ sensors.C.T, out=e)
            e[0] += sample * came
            X = X + e @ now.K.T
            if p:
                X[1:] += now.dK @ e[0]
            run.x[k], run.P[k], run.V[k] = X[0], now.filtered[0], now.V
            X = X @ Phi[step].T
            X[0] += self.drive[k]
            P = now.following
            if parameters.late:
                P = self._moved(k, X, P, parameters)
        return run._replace(gated=int(np.sum(self.due & ~used)))

    def _moved(self, k: int, X: Array, P: Array, parameters: Parameters) -> Array:
        """The derivatives after a step that becomes longer with a latency."""
        assert self.form.flow is not None, "sensors with time stamps alone are late"
        A, B, noise = self.form.flow
        moved = np.array(P)
        flow = A @ P[0]
        flow = flow + flow.T + np.tensordot(parameters.v[0], noise, 1)
        for i, sensor in enumerate(parameters.late, start=len(P) - len(parameters.late)):
            X[i] += self.longer[k, sensor] * (A @ X[0] + B @ self.log.u[k])
            moved[i] += self.longer[k, sensor] * flow
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


SAME = 1e-9
"""Relative difference of gains that is rounding."""
UNSTEADY = 100.0
"""Covariance of the start of a log, in units of that of the steady state."""


def stamped(plant: NoisyPlant, gate: float = 0.0) -> Form:
    """Of samples with time stamps."""
    if plant.S is not None:
        raise InvalidInputError("held noise (S) needs all sensors in each row: describe the noise as white, without S")
    states = np.flatnonzero(np.diag(plant.Q))
    names, v = tuple(f"Q[{i}][{i}]" for i in states), np.diag(plant.Q)[states]
    effects = _squares(np.eye(plant.order)[states])
    if np.any(plant.Q - np.diag(np.diag(plant.Q))):
        names, v, effects = ("factor of Q",), np.ones(1), plant.Q[None]
    parts = [Transition.of(plant.A, plant.B_u, effect) for effect in effects]
    still = Transition.of(plant.A, plant.B_u, np.zeros_like(plant.Q))

    def moves(log: Log) -> Moves:
        h = np.diff(log.t, append=log.t[-1])
        # Steps that differ by less than time stamps resolve are one.
        whole = np.rint(h / (4 * np.spacing(np.abs(log.t).max())))
        _, first, which = np.unique(whole, return_index=True, return_inverse=True)
        h = h[first]
        Phi, Gamma, _ = still.over(h)
        noise = np.array([part.over(h)[2] for part in parts]).reshape(len(parts), *Phi.shape)
        return Moves(Phi, Gamma, np.moveaxis(noise, 0, 1), which)

    def refitted(v: Array, R: Array) -> NoisyPlant:
        return replace(plant, Q=np.tensordot(v, effects, 1), R=R)

    direct = np.zeros((len(plant.C), plant.B_u.shape[1]))
    return Form(
        tuple(plant.sensors), (), names, v, plant.C, direct, plant.R, plant.P0, moves, refitted, gate=gate,
        flow=(plant.A, plant.B_u, effects),
    )  # fmt: skip


def _squares(rows: Array) -> Array:
    """b b' of each row (s, n, n)."""
    return np.asarray(np.einsum("si,sj->sij", rows, rows))


def of_plant(plant: Any) -> Form:
    """Of a plant with a first guess of its noise, or of a design for it; raises InvalidInputError for another thing."""
    if isinstance(plant, NoisyPlant):
        return stamped(plant)
    if isinstance(plant, KalmanResult):
        form = _multirate(plant.filter())
    elif isinstance(plant, SlowRateResult):
        form = _dual_rate(plant.running())
    else:
        raise InvalidInputError(
            "plant must be a NoisyPlant, or the result of a multi-rate design or of a dual-rate one at the slow rate, "
            f"both with goal='h2', got {type(plant).__name__}"
        )
    # Its own covariances follow from the noise, and where a log begins the filter is not yet steady.
    return replace(form, P0=UNSTEADY * form.P0, gains=None)


def of_observer(observer: Any) -> Form:
    """Of a running Kalman filter, with its gate; raises InvalidInputError for another observer."""
    if isinstance(observer, StampedKalman):
        return stamped(observer.plant, observer.gate)
    if isinstance(observer, RunningController):
        return _dual_rate(observer)
    if isinstance(observer, KalmanFilter | StartingFilter):
        return _multirate(observer)
    raise InvalidInputError(
        "observer must be a Kalman filter (StampedKalman, ExtendedKalman, ExtendedFilter, the filter() of a multi-rate "
        f"or the running() of a dual-rate design for goal='h2'), got {type(observer).__name__}"
    )


def _multirate(observer: KalmanFilter | StartingFilter) -> Form:
    plant, signals = observer.problem.plant, observer.signals or Signals((), (), (), (), None)
    if plant.correlated:
        raise InvalidInputError("B_w makes noise of plant and sensors correlated: describe both as independent")
    columns = [int(i) for i in np.flatnonzero(np.any(plant.B_d, axis=0))]
    effects = _squares(plant.B_d.T[columns])
    d = signals.disturbances if len(signals.disturbances) == plant.B_d.shape[1] else numbered("d", plant.B_d.shape[1])

    def moves(log: Log) -> Moves:
        return Moves(plant.A[None], plant.B_u[None], effects[None], np.zeros(len(log.t), dtype=int))

    def refitted(v: Array, R: Array) -> MultiratePlant:
        scale = np.ones(plant.B_d.shape[1])
        scale[columns] = np.sqrt(v)
        return replace(plant, B_d=plant.B_d * scale, D=np.sqrt(R))

    if isinstance(observer, KalmanFilter):
        P0, gains = observer.gains.predicted[0], observer.gains.K[:, 0]
    else:
        P0, gains = observer.start, None
    return Form(
        sensors=signals.measurements or numbered("y", plant.sensors),
        inputs=signals.inputs,
        noise=tuple(f"variance of {d[i]}" for i in columns),
        v=np.ones(len(columns)),
        C=plant.C,
        D_u=plant.D_u,
        R=plant.D @ plant.D.T,
        P0=P0,
        moves=moves,
        dt=plant.dt,
        gains=gains,
        due=observer.problem.schedule.mask,
        gate=observer.gate,
        under_way=plant.under_way,
        refitted=refitted,
    )


def _dual_rate(observer: RunningController) -> Form:
    """The Kalman filter in a controller, by its gains; its covariance before the first reading is that of the steady
    state."""
    problem, gains = observer.problem, observer.controller.L
    best = central(problem, np.inf).L
    if not np.allclose(gains, best, rtol=SAME, atol=SAME * np.abs(best).max()):
        raise InvalidInputError(
            "only innovations of a Kalman filter tell whether a model is right: replay the design for goal='h2'"
        )
    model = problem.plant
    names: Any = observer.signals.measurements if observer.signals else None
    P0 = covariances(problem)[0]
    plant = NoisyPlant(model.A, model.C, problem.process_noise, problem.sensor_noise, model.B_u, None, P0, names)
    K = np.asarray(np.linalg.solve(problem.sampled.state, gains))
    return replace(stamped(plant), dt=problem.period, gains=K, due=problem.mask)
