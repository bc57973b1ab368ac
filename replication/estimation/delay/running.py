"""The observer (2) run in real time on sampled measurements: its histories on a grid, exact between linear samples.

State xi: x^ and the values of phi^_i at the points of the grid other than 0, as in `observer`. With Y the measurements
y(t + eta tau_i) at all points, xi' = a xi - G Y, and a = F + G E, where E reads C_2 phi^_i at all points.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.api.running import RunningObserver, require_small, single
from replication.estimation.delay.collocation import Grid, grid
from replication.estimation.delay.observer import assembled
from replication.estimation.delay.operators.gains import GainValues, ObserverGains, evaluate
from replication.estimation.delay.system import DelaySystem
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
    system : DelaySystem
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

    def __init__(self, system: DelaySystem, gains: ObserverGains, *, dt: float, order: int) -> None:
        self.dt = positive_scalar("dt", dt, unit="s")
        if system.delays[-1] > LONGEST * self.dt:
            raise InvalidInputError(
                f"dt must be at least {system.delays[-1] / LONGEST:.3g} s, got {self.dt:g} s: the observer keeps the "
                "measurements of its longest delay"
            )
        self._system, self._net = system, grid(order)
        values = evaluate(gains, self._net.points)
        a, G, E = assembled(system, values, self._net).a, injection(values, self._net), reading(system, self._net)
        self._step, hold, ramp = _over_step(a, -G, self.dt)
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
    count = net.points.size
    k, _, q = values.l2.shape
    every = np.eye(k * count * q).reshape(k, count, q, -1)
    now, late, weighted = every[0, 0], every[:, -1], net.weights[None, :, None, None] * every
    first = values.l0 @ now + np.einsum("kiq,kqs->is", values.l2, late)
    first = first + np.einsum("tkiq,ktqs->is", values.l3, weighted)
    rates = np.einsum("tkiq,qs->ktis", values.l4, now) + np.einsum("tkliq,lqs->ktis", values.l5, late)
    rates = rates + np.einsum("tkiq,ktqs->ktis", values.l6, every)
    rates = rates + np.einsum("tkuliq,luqs->ktis", values.l7, weighted, optimize=True)
    return np.vstack([first, rates[:, 1:].reshape(-1, every.shape[-1])])


def reading(system: DelaySystem, net: Grid) -> Array:
    """E (K M q, size): C_2 phi_i at all points, history by history; point 0 of each is C_2 x."""
    n, k, inner = system.states, system.delay_count, net.points.size - 1
    rows = np.zeros((k, inner + 1, system.measurements, n * (1 + k * inner)))
    rows[:, 0, :, :n] = system.c2
    for i in range(k):
        for t in range(inner):
            start = n * (1 + i * inner + t)
            rows[i, t + 1, :, start : start + n] = system.c2
    return rows.reshape(-1, rows.shape[-1])


def _over_step(a: Array, b: Array, dt: float) -> tuple[Array, Array, Array]:
    """e^{a dt}, and the effect of an input b v with v constant, and with v growing from 0 to 1 over the step."""
    n = len(a)
    whole = np.zeros((3 * n, 3 * n))
    whole[:n, :n], whole[:n, n : 2 * n], whole[n : 2 * n, 2 * n :] = a, np.eye(n), np.eye(n) / dt
    power = scipy.linalg.expm(whole * dt)
    return power[:n, :n], power[:n, n : 2 * n] @ b, power[:n, 2 * n :] @ b
