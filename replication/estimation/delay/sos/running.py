"""The observer (2) run in real time on sampled measurements: its histories on a grid, exact between linear samples.

State xi: x^ and the values of phi^_i at the points of the grid other than 0, as in `observer`. With Y the measurements
y(t + eta tau_i) at all points, xi' = a xi - G Y, and a = F + G E, where E reads C_2 phi^_i at all points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.api.running import RunningObserver, require_small, single
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos.observer import (
    DelayGains,
    Trajectory,
    assembled,
    error_system,
    histories,
    injected,
    over_step,
    simulate,
)
from replication.estimation.delay.sos.operators import GainValues, ObserverGains, evaluate
from replication.estimation.delay.spectrum import Grid, grid
from replication.estimation.linear.periodic import Stage
from replication.estimation.validation import Array, positive_scalar

if TYPE_CHECKING:
    import control

LONGEST = 1_000_000
"""Measurements that are kept, at the most."""


class RunningDelayObserver(RunningObserver):
    """`step(None, y)` takes y(t_k) every dt seconds and returns x^(t_k), the estimate at the same instant.

    Between two samples y is taken as linear; before the first one as what x^(0) makes it, for all time. A missing
    entry is replaced by what the model without correction expects at t_k.

    Parameters
    ----------
    system : DelayPlant
        The plant.
    gains : ObserverGains
        What `observer_gains` gave.
    dt : float
        Sampling period, s.
    order : int
        Points of each history less one.

    Raises
    ------
    InvalidInputError
        dt is not positive, or so short that more than LONGEST measurements would be kept.
    """

    def __init__(self, system: DelayPlant, gains: ObserverGains, *, dt: float, order: int) -> None:
        self.dt = positive_scalar("dt", dt, unit="s")
        if system.delays[-1] > LONGEST * self.dt:
            raise InvalidInputError(
                f"dt must be at least {system.delays[-1] / LONGEST:.3g} s, got {self.dt:g} s: the observer keeps the "
                "measurements of its longest delay"
            )
        self._system, self._net = system, grid(order)
        values = evaluate(gains, self._net.points)
        a, G, E = assembled(system, values, self._net).A, injection(values, self._net), reading(system, self._net)
        self._step, hold, ramp = over_step(a, -G, self.dt)
        # Y at the end of the step weighs by the ramp, Y at its start by the rest.
        self._old, self._new = hold - ramp, ramp
        self._free = scipy.linalg.expm((a - G @ E) * self.dt)
        super().__init__(system.states, 0, system.measurements)

    @property
    def estimate(self) -> Array:
        """x^(t_k), (n,)."""
        return np.array(self._state[: self.states])

    def to_statespace(self) -> control.StateSpace:
        """From y to x^ at the same instant, from rest and from a first sample of zero.

        Returns
        -------
        control.StateSpace
            Discrete-time; its states are the histories at the points of the grid, and the past measurements.

        Raises
        ------
        InvalidInputError
            dt is so short that there are more than 2000 states.
        """
        count, q, size = len(self._past), self.measurements, len(self._state)
        require_small(size + count * q)
        whole = np.eye(size + count * q + q)
        state, past, now = np.split(whole, [size, size + count * q])
        samples = np.kron(np.stack([self._between(row) for row in np.eye(count)], axis=-1), np.eye(q))
        later = np.vstack([now, past])[: count * q]
        state = self._step @ state + self._old @ samples @ past + self._new @ samples @ later
        return single(np.vstack([state, later]), state[: self.states], self.dt, self.signals)

    def _begin(self, start: Array) -> None:
        self._state = np.tile(start, 1 + self._system.delay_count * (self._net.points.size - 1))
        length = int(np.ceil(self._system.delays[-1] / self.dt)) + 1
        self._past = np.tile(self._system.c2 @ start, (length, 1))  # newest first

    def _advance(self, u: Array, y: Array) -> None:
        moved = self.instant > 0
        free = (self._free @ self._state if moved else self._state)[: self.states]
        y = self._completed(y, self._system.c2 @ free, np.ones(self.measurements, dtype=bool))
        before = self._histories()
        self._past = np.vstack([y, self._past[:-1]])
        if moved:
            self._state = self._step @ self._state + self._old @ before + self._new @ self._histories()

    def _histories(self) -> Array:
        """Y: y(t + eta tau_i) at all points of all histories, interpolated, in the order of `reading`."""
        return np.stack([self._between(column) for column in self._past.T], axis=-1).ravel()

    def _between(self, column: Array) -> Array:
        """One measurement at all points of all histories, from its samples, newest first."""
        ages = -self._net.points[None, :] * np.array(self._system.delays)[:, None] / self.dt
        return np.asarray(np.interp(ages.ravel(), np.arange(len(column)), column))


def injection(values: GainValues, net: Grid) -> Array:
    """G (size, K M q): what the differences of all measured histories add to the derivative of xi."""
    k, _, q = values.l2.shape
    every = np.eye(k * net.points.size * q).reshape(k, net.points.size, q, -1)
    first, rates = injected(values, net, every, np.zeros(1), np.zeros(1))
    return np.vstack([first, rates[:, 1:].reshape(-1, every.shape[-1])])


def reading(system: DelayPlant, net: Grid) -> Array:
    """E (K M q, size): C_2 phi_i at all points, history by history; point 0 of each is C_2 x."""
    rows = system.c2 @ histories(system.states, system.delay_count, net.points.size)
    return np.asarray(rows.reshape(-1, rows.shape[-1]))


AXES = {
    "points": "(point)",
    "L0": "(state, measurement)",
    "L2": "(delay, state, measurement)",
    "L3": "(point, delay, state, measurement)",
    "L4": "(point, delay, state, measurement)",
    "L5": "(point, delay, delay of y, state, measurement)",
    "L6": "(point, delay, state, measurement)",
    "L7": "(point, delay, point of y, delay of y, state, measurement)",
}


@dataclass(frozen=True, eq=False)
class HistoryObserver(DelayGains):
    """The observer (2) of a plant whose y is free of noise: it keeps the histories of y.

    Attributes
    ----------
    plant : DelayPlant
        The plant.
    operators : ObserverGains
        The operators of which the gains are values.
    """

    plant: DelayPlant
    operators: ObserverGains

    def arrays(self, order: int) -> tuple[dict[str, Array], dict[str, str]]:
        """At `order` + 1 points of the scaled histories [-1, 0]."""
        points = grid(order).points
        values = evaluate(self.operators, points)
        return {"points": points} | {f"L{i}": getattr(values, f"l{i}") for i in (0, 2, 3, 4, 5, 6, 7)}, AXES.copy()

    def error_model(self, order: int) -> Stage:
        """Histories at `order` + 1 points; z - z^, where the paper has z^ - z."""
        A, B, C, D = error_system(self.plant, self.operators, order)
        return Stage(A, -B, C, -D)

    def gain_at(self, omega: Array, order: int) -> Array:
        """Of that model."""
        A, B, C, _ = self.error_model(order)
        return np.array([np.linalg.norm(C @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B), 2) for w in omega])

    def running(self, dt: float, order: int) -> RunningDelayObserver:
        """With y linear between samples."""
        return RunningDelayObserver(self.plant, self.operators, dt=dt, order=order)

    def trajectory(self, times: Any, disturbance: Any, order: int) -> Trajectory:
        """Of that model, and exact for it."""
        return simulate(self.error_model(order), times, disturbance, self.plant.states)
