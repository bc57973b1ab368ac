"""The observer (2) as a partial differential equation, discretised; and the error system of plant and observer.

State: e and the values of φ_i at the points other than η = 0, where φ_i(0) = e, history by history.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.delay.collocation import Grid, Scheme, grid
from replication.estimation.delay.operators.gains import GainValues, ObserverGains, evaluate
from replication.estimation.delay.system import DelaySystem
from replication.estimation.validation import Array


@dataclass(frozen=True)
class ErrorSystem:
    """ė = a e + b w, z_e = c e for the discretised error; N states in all.

    Attributes
    ----------
    a : array (N, N)
        1/s.
    b : array (N, r)
        Effect of the disturbance.
    c : array (p, N)
        Error of the estimate of z.
    """

    a: Array
    b: Array
    c: Array


def error_system(
    system: DelaySystem,
    gains: ObserverGains,
    order: int = 40,
    scheme: Scheme = Scheme.CHEBYSHEV,
) -> ErrorSystem:
    """The error of the observer (2) with `gains`, its histories discretised.

    Gains of an observer close to the optimum vary quickly in η: compare two orders before trusting the result.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    gains : ObserverGains
        What `observer_gains` gave.
    order : int
        Each history has order + 1 points.
    scheme : Scheme
        How histories are discretised.

    Returns
    -------
    ErrorSystem
        Its first n states are the error of x.

    Raises
    ------
    InvalidInputError
        `order` is below one, or the gains are not finite at a point.
    """
    net = grid(order, scheme)
    return assembled(system, evaluate(gains, net.points), net)


def assembled(system: DelaySystem, values: GainValues, net: Grid) -> ErrorSystem:
    """The matrices of the error system for gains given at the points of `net`."""
    n, k, count = system.states, system.delay_count, net.points.size
    size = n * (1 + k * (count - 1))
    # Rows of `nodes[i, t]` pick φ_i at point t out of the state; point 0 is e itself.
    nodes = np.zeros((k, count, n, size))
    nodes[:, 0, :, :n] = np.eye(n)
    for i in range(k):
        for t in range(1, count):
            start = n * (1 + i * (count - 1) + t - 1)
            nodes[i, t, :, start : start + n] = np.eye(n)
    now, late = nodes[0, 0], nodes[:, -1]
    error = np.einsum("qn,ktns->ktqs", system.c2, nodes)
    error_now, error_late = error[0, 0], error[:, -1]
    weighted = np.einsum("t,ktqs->ktqs", net.weights, error)
    rate_now = system.a0 @ now + sum(a @ late[i] for i, a in enumerate(system.a)) + values.l0 @ error_now
    rate_now = rate_now + np.einsum("kiq,kqs->is", values.l2, error_late)
    rate_now = rate_now + np.einsum("tkiq,ktqs->is", values.l3, weighted)
    rates = np.einsum("tu,kuns->ktns", net.slope, nodes) / np.array(system.delays)[:, None, None, None]
    rates = rates + np.einsum("tkiq,qs->ktis", values.l4, error_now)
    rates = rates + np.einsum("tkliq,lqs->ktis", values.l5, error_late)
    rates = rates + np.einsum("tkiq,ktqs->ktis", values.l6, error)
    rates = rates + np.einsum("tkuliq,luqs->ktis", values.l7, weighted, optimize=True)
    a = np.vstack([rate_now, rates[:, 1:].reshape(size - n, size)])
    b = np.zeros((size, system.inputs))
    b[:n] = -system.b
    c = system.c10 @ now + sum(c @ late[i] for i, c in enumerate(system.c1))
    if not np.all(np.isfinite(a)):
        raise InvalidInputError("the gains are not finite at the grid points; check the certificate")
    return ErrorSystem(a, b, c)
