"""The observer (2) as a partial differential equation, discretised; and the error system of plant and observer.

State: e and the values of φ_i at the points other than η = 0, where φ_i(0) = e, history by history.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos.operators import GainValues, ObserverGains, evaluate
from replication.estimation.delay.spectrum import Grid, Scheme, grid
from replication.estimation.linear.periodic import Stage
from replication.estimation.validation import Array, as_array, as_matrix

if TYPE_CHECKING:
    from replication.estimation.api.running import RunningObserver


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
    size = n * (1 + k * (count - 1))
    nodes = histories(n, k, count)
    now, late = nodes[0, 0], nodes[:, -1]
    rate_now = system.a0 @ now + sum(a @ late[i] for i, a in enumerate(system.a))
    rates = np.einsum("tu,kuns->ktns", net.slope, nodes) / np.array(system.delays)[:, None, None, None]
    rate_now, rates = injected(values, net, np.einsum("qn,ktns->ktqs", system.c2, nodes), rate_now, rates)
    a = np.vstack([rate_now, rates[:, 1:].reshape(size - n, size)])
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


def injected(values: GainValues, net: Grid, error: Array, now: Array, rates: Array) -> tuple[Array, Array]:
    """`now` (n, s) and `rates` (K, M, n, s) of x^ and its histories, with what `error` (K, M, q, s) of y adds."""
    error_now, error_late, weighted = error[0, 0], error[:, -1], net.weights[None, :, None, None] * error
    now = now + values.l0 @ error_now
    now = now + np.einsum("kiq,kqs->is", values.l2, error_late)
    now = now + np.einsum("tkiq,ktqs->is", values.l3, weighted)
    rates = rates + np.einsum("tkiq,qs->ktis", values.l4, error_now)
    rates = rates + np.einsum("tkliq,lqs->ktis", values.l5, error_late)
    rates = rates + np.einsum("tkiq,ktqs->ktis", values.l6, error)
    return now, rates + np.einsum("tkuliq,luqs->ktis", values.l7, weighted, optimize=True)


def spectral_abscissa(error: Stage) -> float:
    """Largest real part of the eigenvalues, 1/s: negative if the error dies out."""
    return float(np.linalg.eigvals(error.A).real.max())


# The answer of a discretised error system to a given disturbance, and what the gains of all observers have in common


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

    @abstractmethod
    def trajectory(self, times: Any, disturbance: Any, order: int) -> Trajectory:
        """The error from rest; raises InvalidInputError as `simulate`."""


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


def equidistant(times: object, disturbance: object, inputs: int) -> tuple[Array, Array, float]:
    """The instants (M,), the disturbance (M, inputs) and the step of a simulation; raises InvalidInputError.

    It is raised for other shapes, unequal steps, what is not finite, and a disturbance that is zero.
    """
    w = as_matrix("disturbance", disturbance, columns=inputs)
    instants = as_array("times", times, (len(w),))
    steps = np.diff(instants)
    if steps.size < 1 or np.any(steps <= 0.0) or np.ptp(steps) > 1e-9 * steps.max():
        raise InvalidInputError("times must be at least two and equidistant, increasing")
    if not np.any(w):
        raise InvalidInputError("the disturbance must not vanish: the gain would be 0/0")
    return instants, w, float(steps.mean())


def over_step(a: Array, b: Array, dt: float) -> tuple[Array, Array, Array]:
    """e^{a dt}, and the effect of an input of b that is constant, and of one that grows from 0 to 1 over the step."""
    n, r = b.shape
    augmented = np.zeros((n + 2 * r, n + 2 * r))
    augmented[:n, :n], augmented[:n, n : n + r], augmented[n : n + r, n + r :] = a, b, np.eye(r) / dt
    phi = scipy.linalg.expm(augmented * dt)
    return phi[:n, :n], phi[:n, n : n + r], phi[:n, n + r :]


def simulate(error: Stage, times: Array, disturbance: Array, states: int) -> Trajectory:
    """Answer of the error system, from rest, to a disturbance that is linear between equidistant `times`; exact then.

    disturbance (M, r). Raises InvalidInputError for other shapes, unequal steps, what is not finite, or a disturbance
    that is zero.
    """
    instants, w, h = equidistant(times, disturbance, error.B.shape[1])
    step, hold, ramp = over_step(error.A, error.B, h)
    state = np.zeros((len(instants), len(step)))
    for m in range(len(instants) - 1):
        state[m + 1] = step @ state[m] + hold @ w[m] + ramp @ (w[m + 1] - w[m])
    return Trajectory(instants, w, state @ error.C.T, state[:, :states])
