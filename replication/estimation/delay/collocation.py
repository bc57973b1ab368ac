"""Discretisation of a history on [-1, 0]: Chebyshev collocation, or the forward difference with lumped states.

Collocation converges geometrically; the forward difference of N lumped states is first order in 1/N.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from replication.estimation.delay.system import DelaySystem
from replication.estimation.validation import Array, positive_integer


class Scheme(StrEnum):
    """How histories are discretised: Chebyshev collocation, or the forward difference with lumped states."""

    CHEBYSHEV = "chebyshev"
    LUMPED = "lumped"


@dataclass(frozen=True)
class Grid:
    """Points of [-1, 0] from 0 down to -1 (N+1,), differentiation matrix (N+1, N+1), quadrature weights (N+1,)."""

    points: Array
    slope: Array
    weights: Array


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


def interpolation(net: Grid, point: float) -> Array:
    """Row (N+1,) that evaluates the interpolant of a Chebyshev grid at `point` of [-1, 0] (barycentric formula)."""
    distance = point - net.points
    nearest = int(np.argmin(np.abs(distance)))
    if abs(distance[nearest]) < 1e-14:
        row: Array = np.eye(net.points.size)[nearest]
        return row
    weights = (-1.0) ** np.arange(net.points.size)
    weights[[0, -1]] /= 2.0
    terms = weights / distance
    row = terms / terms.sum()
    return row


def generator(system: DelaySystem, order: int) -> tuple[Array, Array]:
    """The plant on one history of length τ_K with order+1 Chebyshev points, state (x; values from η < 0 down to -1).

    Returns A (n(order+1))² with ẋ = A x for w = 0, and C with z = C x.
    """
    net = grid(order)
    n, size = system.states, system.states * (order + 1)
    longest = system.delays[-1]
    a: Array = np.kron(net.slope / longest, np.eye(n)).astype(float)
    a[:n] = 0.0
    a[:n, :n] = system.a0
    c = np.zeros((system.outputs, size))
    c[:, :n] = system.c10
    for delay, matrix, output in zip(system.delays, system.a, system.c1, strict=True):
        row = interpolation(net, -delay / longest)
        a[:n] += np.kron(row, matrix)
        c += np.kron(row, output)
    return a, c
