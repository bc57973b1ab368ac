"""The observer (2) as a partial differential equation, discretised: its error system, and as it runs on samples.

State: e and the values of φ_i at the points other than η = 0, where φ_i(0) = e, history by history. With F the plant
alone, E what reads C_2φ_i at all points and G what the gains add, ė = (F + GE)e - Bw; on measurements Y of all points
the observer itself follows ξ' = (F + GE)ξ - GY, exact between linear samples.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.api.running import RunningObserver, require_small, single
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos.operators import GainValues, ObserverGains, evaluate
from replication.estimation.delay.spectrum import Grid, Scheme, grid
from replication.estimation.linear.periodic import Stage
from replication.estimation.validation import Array, StateSpace, as_array, as_matrix, positive_scalar


def error_system(system: DelayPlant, gains: ObserverGains, order: int = 40, scheme: Scheme = Scheme.CHEBYSHEV) -> Stage:
    """The error of the observer (2) with `gains`, histories at order + 1 points; its first n states are the error of x.

    Gains of an observer close to the optimum vary quickly in η: compare two orders before trusting the result. Raises
    InvalidInputError if the gains are not finite at a point.
    """
    net = grid(order, scheme)
    return assembled(system, evaluate(gains, net.points), net)


def assembled(system: DelayPlant, values: GainValues, net: Grid) -> Stage:
    """ė = A e + B w, z_e = C e for gains given at the points of `net`."""
    n, k, count = system.states, system.delay_count, net.points.size
    nodes = histories(n, k, count)
    now, late, size = nodes[0, 0], nodes[:, -1], nodes.shape[-1]
    rate_now = system.a0 @ now + sum(a @ late[i] for i, a in enumerate(system.a))
    rates = np.einsum("tu,kuns->ktns", net.slope, nodes) / np.array(system.delays)[:, None, None, None]
    a = np.vstack([rate_now, rates[:, 1:].reshape(size - n, size)]) + injection(values, net) @ reading(system, net)
    b = np.zeros((size, system.inputs))
    b[:n] = -system.b
    c = system.c10 @ now + sum(c @ late[i] for i, c in enumerate(system.c1))
    if not np.all(np.isfinite(a)):
        raise InvalidInputError("the gains are not finite at the grid points; check the certificate")
    return Stage(a, b, c, np.zeros((len(c), b.shape[1])))


def histories(n: int, delays: int, count: int) -> Array:
    """Rows (K, M, n, size) that pick φ_i at each point out of the state; point 0 is e itself."""
    rows = np.eye(n * (1 + delays * (count - 1)))
    late = rows[n:].reshape(delays, count - 1, n, -1)
    return np.concatenate([np.broadcast_to(rows[None, None, :n], (delays, 1, *rows[:n].shape)), late], axis=1)


def reading(system: DelayPlant, net: Grid) -> Array:
    """E (K M q, size): C_2 φ_i at all points, history by history; point 0 of each is C_2 e."""
    rows = system.c2 @ histories(system.states, system.delay_count, net.points.size)
    return np.asarray(rows.reshape(-1, rows.shape[-1]))


def injection(values: GainValues, net: Grid) -> Array:
    """G (size, K M q): what the measured histories add to the derivative of the state."""
    k, n, q = values.l2.shape
    each, points = np.eye(k), np.eye(net.points.size)
    first, last = points[0], points[-1]
    now = np.einsum("iq,l,u->iluq", values.l0, each[0], first) + np.einsum("liq,u->iluq", values.l2, last)
    now += np.einsum("uliq,u->iluq", values.l3, net.weights)
    rates = np.einsum("tkiq,l,u->ktiluq", values.l4, each[0], first)
    rates += np.einsum("tkliq,u->ktiluq", values.l5, last)
    rates += np.einsum("tkiq,kl,tu->ktiluq", values.l6, each, points)
    rates += np.einsum("tkuliq,u->ktiluq", values.l7, net.weights)
    return np.vstack([now.reshape(n, -1), rates[:, 1:].reshape(-1, k * len(points) * q)])


def spectral_abscissa(error: Stage) -> float:
    """Largest real part of the eigenvalues, 1/s: negative if the error dies out."""
    return float(np.linalg.eigvals(error.A).real.max())


@dataclass(frozen=True)
class Trajectory:
    """Answer of the error system to a disturbance."""

    times: Array  # (M,) Equidistant, s
    disturbance: Array  # (M, r) w
    output: Array  # (M, p) z_e, the error of the estimate of z
    state: Array  # (M, n) The error e of the estimate of x

    @property
    def gain(self) -> float:
        """‖z_e‖/‖w‖ over the simulated interval, integrals by the trapezoidal rule."""
        energy = [float(np.trapezoid(np.sum(part**2, axis=1), self.times)) for part in (self.output, self.disturbance)]
        return float(np.sqrt(energy[0] / energy[1]))


class DelayGains(ABC):
    """The gains of an observer of a delay plant, and what follows from them; `order` resolves each delay."""

    plant: DelayPlant

    @abstractmethod
    def arrays(self, order: int) -> tuple[dict[str, Array], dict[str, str]]:
        """The gains by name, and what their axes are."""

    @abstractmethod
    def error_model(self, order: int) -> Stage:
        """The error of the estimate, from w to that of z, without delays; its first n states are that of x."""

    @abstractmethod
    def gain_at(self, omega: Array, order: int) -> Array:
        """The largest gain from w to the error of z at frequencies (M,), rad/s."""

    @abstractmethod
    def running(self, dt: float, order: int) -> RunningObserver:
        """The observer on samples, every `dt` (s); raises InvalidInputError for a step that does not do."""


def over_step(a: Array, b: Array, dt: float) -> tuple[Array, Array, Array]:
    """e^{a dt}, and the effect of an input of b that is constant, and of one that grows from 0 to 1 over the step."""
    n, r = b.shape
    augmented = np.zeros((n + 2 * r, n + 2 * r))
    augmented[:n, :n], augmented[:n, n : n + r], augmented[n : n + r, n + r :] = a, b, np.eye(r) / dt
    phi = scipy.linalg.expm(augmented * dt)
    return phi[:n, :n], phi[:n, n : n + r], phi[:n, n + r :]


def simulate(error: Stage, times: object, disturbance: object, states: int) -> Trajectory:
    """Answer of the error system, from rest, to a disturbance (M, r) that is linear between `times` (M,); exact.

    Raises InvalidInputError for another shape, unequal steps or a disturbance that is zero.
    """
    w = as_matrix("disturbance", disturbance, columns=error.B.shape[1])
    instants = as_array("times", times, (len(w),))
    steps = np.diff(instants)
    if steps.size < 1 or np.any(steps <= 0.0) or np.ptp(steps) > 1e-9 * steps.max():
        raise InvalidInputError("times must be at least two and equidistant, increasing")
    if not np.any(w):
        raise InvalidInputError("the disturbance must not vanish: the gain would be 0/0")
    step, hold, ramp = over_step(error.A, error.B, float(steps.mean()))
    state = np.zeros((len(instants), len(step)))
    for m in range(len(instants) - 1):
        state[m + 1] = step @ state[m] + hold @ w[m] + ramp @ (w[m + 1] - w[m])
    return Trajectory(instants, w, state @ error.C.T + w @ error.D.T, state[:, :states])


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

    def to_statespace(self) -> StateSpace:
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
