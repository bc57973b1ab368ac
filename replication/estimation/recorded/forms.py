"""What each form of filter is along a log: with time stamps, multi-rate, dual rate; all give one `Series`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from replication.errors import InvalidInputError
from replication.estimation.api.plants import numbered
from replication.estimation.dualrate.slow.controller import central, covariances
from replication.estimation.dualrate.slow.result import RunningController, SlowRateResult
from replication.estimation.multirate.latency import ContinuousPlant, checked_latency, delivered
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.running import KalmanFilter, StartingFilter
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.nonuniform.stamped.transition import Transition
from replication.estimation.recorded.log import Log
from replication.estimation.recorded.series import Drift, Series
from replication.estimation.validation import Array, covariance

SAME = 1e-9
"""Relative difference of gains that is rounding."""


class Moves(NamedTuple):
    """Different steps: Phi (U, n, n), Gamma (U, n, m), noise (U, s, n, n); and which (N,) follows each row."""

    Phi: Array
    Gamma: Array
    noise: Array
    which: Any


def _unknown(v: Array, R: Array) -> None:
    """A filter has no plant to give back."""


@dataclass(frozen=True, eq=False)
class Form:
    """A plant with its noise, or a filter of it.

    sensors, inputs: names, the latter if known; noise: names of the s variances v (s,) of the process noise; C (q, n),
    D_u (q, m); R (q, q); P0 (n, n); moves: the steps along a log; dt: base period, s, or None for time stamps; gains
    (period, n, q): where they are fixed; due (period, q): a schedule; gate; early (q,): rows from the start on that are
    left out; under_way: states that are samples on their way; flow: A, B_u and effects of the variances (s, n, n) in
    continuous time; refitted: the plant with other v and R.
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
    dt: float | None = None
    gains: Array | None = None
    due: Any = None
    gate: float = 0.0
    early: tuple[int, ...] = ()
    under_way: int = 0
    flow: tuple[Array, Array, Array] | None = None
    refitted: Callable[[Array, Array], Any] = _unknown

    def expected(self, rows: int) -> Any:
        """When sensors are due (rows, q)."""
        phases = np.ones((1, len(self.C)), dtype=bool) if self.due is None else self.due
        return phases[np.arange(rows) % len(phases)]

    def along(self, log: Log, latency: Array, start: Array) -> Series:
        """The filter over a log whose samples are as late as `latency` (q,) says, NaN where they are not."""
        taken, owner = log.taken(latency)
        moves, N = self.moves(taken), len(taken.t)
        due = np.ones(taken.y.shape, dtype=bool)
        for sensor, count in enumerate(self.early):
            due[:count, sensor] = False
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


def _pieces(Q: Array) -> tuple[tuple[str, ...], Array, Array]:
    """Names, values and effects of the variances in Q: its diagonal, or else one factor of it all."""
    if np.any(Q - np.diag(np.diag(Q))):
        return ("factor of Q",), np.ones(1), Q[None]
    states = [int(i) for i in np.flatnonzero(np.diag(Q))]
    names = tuple(f"Q[{i}][{i}]" for i in states)
    return (
        names,
        np.diag(Q)[states],
        np.array([np.outer(row, row) for row in np.eye(len(Q))[states]]).reshape(-1, *Q.shape),
    )


def stamped(plant: NoisyPlant, gate: float = 0.0) -> Form:
    """Of samples with time stamps."""
    if plant.S is not None:
        raise InvalidInputError("held noise (S) needs all sensors in each row: describe the noise as white, without S")
    names, v, effects = _pieces(plant.Q)
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
        tuple(plant.sensors), (), names, v, plant.C, direct, plant.R, plant.P0, moves, gate=gate,
        flow=(plant.A, plant.B_u, effects),        refitted=refitted,
    )  # fmt: skip


def periodic(plant: MultiratePlant, P0: Array, sensors: Sequence[str]) -> Form:
    """Of samples at the instants of a base period."""
    if plant.correlated:
        raise InvalidInputError("B_w makes noise of plant and sensors correlated: describe both as independent")
    columns = [int(i) for i in np.flatnonzero(np.any(plant.B_d, axis=0))]
    effects = np.array([np.outer(b, b) for b in plant.B_d.T[columns]]).reshape(-1, *plant.A.shape)

    def moves(log: Log) -> Moves:
        return Moves(plant.A[None], plant.B_u[None], effects[None], np.zeros(len(log.t), dtype=int))

    names, R = tuple(f"variance of d[{i}]" for i in columns), plant.D @ plant.D.T
    return Form(
        tuple(sensors), (), names, np.ones(len(columns)), plant.C, plant.D_u, R, P0, moves, plant.dt,
        under_way=plant.under_way,
    )  # fmt: skip


def of_plant(plant: Any, *, latency: Sequence[float], P0: Any, sensors: Sequence[str]) -> Form:
    """Of a plant with a first guess of its noise: a NoisyPlant, MultiratePlant, ContinuousPlant or SlowRateResult.

    latency: known ages of the samples in base periods, of multi-rate plants; what was measured before the start says
    nothing of it and is left out. Raises InvalidInputError for another plant, or what does not belong to it.
    """
    if isinstance(plant, MultiratePlant | ContinuousPlant):
        return _multirate(plant, latency, P0, sensors)
    if isinstance(plant, SlowRateResult):
        given, names = plant.problem, plant.signals.measurements
        model = given.plant
        plant = NoisyPlant(model.A, model.C, given.process_noise, given.sensor_noise, model.B_u, sensors=names)
    if not isinstance(plant, NoisyPlant):
        raise InvalidInputError(
            "plant must be a NoisyPlant, MultiratePlant, ContinuousPlant or the result of a dual-rate design at the "
            f"slow rate, got {type(plant).__name__}"
        )
    if np.size(latency) or len(sensors):
        raise InvalidInputError(
            "latency and sensors belong to multi-rate plants: a NoisyPlant has names, see latencies"
        )
    return stamped(plant if P0 is None else replace(plant, P0=P0))


def _multirate(plant: MultiratePlant | ContinuousPlant, latency: Sequence[float], P0: Any, sensors: Any) -> Form:
    between = None
    if isinstance(plant, ContinuousPlant):
        plant = _in_columns(plant)
        between, whole = plant.after, plant.after(plant.dt)
    else:
        whole = plant
    names = tuple(sensors) if len(sensors) else numbered("y", whole.sensors)
    if len(names) != whole.sensors:
        raise InvalidInputError(f"sensors must name the {whole.sensors} rows of C, got {sensors!r}")
    ages = checked_latency(latency if np.size(latency) else [0.0] * whole.sensors, whole.sensors)
    start = np.eye(whole.order) if P0 is None else covariance("P0", P0, whole.order)
    along = delivered(whole, ages, between)
    form = periodic(along, block_diag(start, np.zeros((along.under_way, along.under_way))), names)

    def refitted(v: Array, R: Array) -> MultiratePlant | ContinuousPlant:
        scale = np.ones(whole.B_d.shape[1])
        scale[np.any(along.B_d, axis=0)] = np.sqrt(v)
        if isinstance(plant, MultiratePlant):
            return replace(plant, B_d=plant.B_d * scale, D=np.sqrt(R))
        return replace(plant, B_d=np.asarray(plant.B_d) * scale, R=R, D=None)

    return replace(form, early=tuple(ceil(age) for age in ages), refitted=refitted)


def _in_columns(plant: ContinuousPlant) -> ContinuousPlant:
    """The same with Q in the columns of B_d."""
    B = np.eye(len(np.asarray(plant.A))) if plant.B_d is None else np.asarray(plant.B_d, dtype=float)
    Q = np.eye(B.shape[1]) if plant.Q is None else covariance("Q", plant.Q, B.shape[1])
    if np.any(Q - np.diag(np.diag(Q))):
        raise InvalidInputError("fit takes a diagonal Q of a ContinuousPlant: put what is common into B_d")
    return replace(plant, B_d=B * np.sqrt(np.diag(Q)), Q=None)


def of_observer(observer: Any) -> Form:
    """Of a running Kalman filter, with its gate; raises InvalidInputError for another observer."""
    if isinstance(observer, StampedKalman):
        return stamped(observer.plant, observer.gate)
    if isinstance(observer, RunningController):
        return _dual_rate(observer)
    if not isinstance(observer, KalmanFilter | StartingFilter):
        raise InvalidInputError(
            "observer must be a Kalman filter (StampedKalman, ExtendedKalman, the filter() of a multi-rate or the "
            f"running() of a dual-rate design for goal='h2'), got {type(observer).__name__}"
        )
    problem, signals = observer.problem, observer.signals
    names = signals.measurements if signals else numbered("y", problem.plant.sensors)
    if isinstance(observer, KalmanFilter):
        P0, gains = observer.gains.predicted[0], observer.gains.K[:, 0]
    else:
        P0, gains = observer.start, None
    form = periodic(problem.plant, P0, names)
    inputs = signals.inputs if signals else ()
    return replace(form, inputs=inputs, gains=gains, due=problem.schedule.mask, gate=observer.gate)


def _dual_rate(observer: RunningController) -> Form:
    """The Kalman filter in a controller, by its gains; its covariance before the first reading is that of the steady
    state."""
    problem, gains = observer.problem, observer.controller.L
    best = central(problem, np.inf).L
    if not np.allclose(gains, best, rtol=SAME, atol=SAME * np.abs(best).max()):
        raise InvalidInputError(
            "only innovations of a Kalman filter tell whether a model is right: replay the design for goal='h2'"
        )
    model, names = problem.plant, observer.signals.measurements if observer.signals else None
    P0 = covariances(problem)[0]
    plant = NoisyPlant(model.A, model.C, problem.process_noise, problem.sensor_noise, model.B_u, None, P0, names)
    K = np.asarray(np.linalg.solve(problem.sampled.state, gains))
    due = np.tile(problem.sensors.mask, (len(gains) // problem.sensors.period, 1))
    return replace(stamped(plant), dt=problem.period, gains=K, due=due)
