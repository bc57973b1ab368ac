"""What each form of filter is along a log: with time stamps, multi-rate, dual rate; all give one `Series`."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.plants import Signals, numbered
from replication.estimation.dualrate.slow.controller import central, covariances
from replication.estimation.dualrate.slow.result import RunningController, SlowRateResult
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.result import KalmanResult
from replication.estimation.multirate.running import KalmanFilter, StartingFilter
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.nonuniform.stamped.kalman import Transition
from replication.estimation.recorded.log import Log
from replication.estimation.recorded.series import Drift, Series
from replication.estimation.validation import Array

SAME = 1e-9
"""Relative difference of gains that is rounding."""
UNSTEADY = 100.0
"""Covariance of the start of a log, in units of that of the steady state."""


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

    def along(self, log: Log, latency: Array, start: Array) -> Series:
        """The filter over a log whose samples are as late as `latency` (q,) says, NaN where they are not."""
        taken, owner = log.taken(latency)
        moves, N = self.moves(taken), len(taken.t)
        due = np.ones(taken.y.shape, dtype=bool)
        if self.gains is not None:  # a filter that follows its covariance takes a sample off its schedule
            due &= self.expected(N)
        drift = None
        if self.flow is not None and np.any(owner >= 0):
            A, B, effects = self.flow
            sooner = -(owner[:, None] == np.arange(len(self.C))).astype(float)
            drift = Drift(A, effects, taken.u @ B.T, np.diff(sooner, axis=0, append=sooner[-1:]))
        drive = np.einsum("knm,km->kn", moves.Gamma[moves.which], taken.u)
        return Series(
            taken, due, self.C, taken.u @ self.D_u.T, moves.Phi, moves.noise, moves.which, drive, start, self.P0,
            self.gains, self.gate, drift,
        )  # fmt: skip


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
