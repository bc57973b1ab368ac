"""The observer (2) as a partial differential equation, discretised; and the error system of plant and observer.

Chebyshev collocation at N+1 points of each history by default; the forward difference with N lumped states as an
option. State: e and the values of φ_i at the points other than η = 0, where φ_i(0) = e.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.delay import gains as lemma5
from replication.estimation.delay.gains import GainValues, ObserverGains
from replication.estimation.delay.system import DelaySystem
from replication.estimation.validation import Array, positive_integer


class Scheme(StrEnum):
    """How histories are discretised."""

    CHEBYSHEV = "chebyshev"
    LUMPED = "lumped"


@dataclass(frozen=True)
class Grid:
    """Points of [-1, 0] from 0 down to -1 (N+1,), differentiation matrix (N+1, N+1), quadrature weights (N+1,)."""

    points: Array
    slope: Array
    weights: Array


@dataclass(frozen=True)
class ErrorSystem:
    """ė = A e + B w, z_e = C e for the discretised error; also what turns the state into histories."""

    a: Array
    b: Array
    c: Array


def grid(order: int, scheme: Scheme = Scheme.CHEBYSHEV) -> Grid:
    """The discretisation of [-1, 0] with order+1 points. Raises InvalidInputError for order < 1."""
    order = positive_integer("order", order)
    if scheme is Scheme.LUMPED:
        points = -np.arange(order + 1) / order
        slope = np.zeros((order + 1, order + 1))
        index = np.arange(1, order + 1)
        slope[index, index - 1], slope[index, index] = order, -order  # (φ(η+h) - φ(η))/h
        weights = np.full(order + 1, 1.0 / order)
        weights[0] = 0.0
        return Grid(points, slope, weights)
    angle = np.pi * np.arange(order + 1) / order
    points = (np.cos(angle) - 1.0) / 2.0
    scale = np.ones(order + 1)
    scale[[0, -1]] = 2.0
    scale *= (-1.0) ** np.arange(order + 1)
    difference = points[:, None] - points[None, :] + np.eye(order + 1)
    slope = np.outer(scale, 1.0 / scale) / difference
    slope -= np.diag(slope.sum(axis=1))
    # Clenshaw-Curtis weights: exact integrals of the Chebyshev interpolant.
    modes = np.arange(0, order + 1, 2)
    moments = 1.0 / (1.0 - modes.astype(float) ** 2)
    halves = np.where((modes == 0) | (modes == order), 0.5, 1.0)
    ends = np.ones(order + 1)
    ends[[0, -1]] = 0.5
    weights = 2.0 / order * ends * (np.cos(np.outer(angle, modes)) @ (moments * halves))
    return Grid(points, slope, weights)


def error_system(
    system: DelaySystem,
    gains: ObserverGains | None = None,
    order: int = 20,
    scheme: Scheme = Scheme.CHEBYSHEV,
) -> ErrorSystem:
    """The error of the observer with `gains` (None: no observer, the plant itself with disturbance -w)."""
    net = grid(order, scheme)
    values = lemma5.no_gains(system, net.points) if gains is None else lemma5.evaluate(gains, net.points)
    return assembled(system, values, net)


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
