"""Characteristic roots, exact frequency response and H∞ gain of a system with delays.

M(s) = sI - A_0 - ΣA_i e^{-sτ_i}; the roots are those of det M, the response is C(s)M(s)⁻¹B with
C(s) = C_10 + ΣC_1i e^{-sτ_i}. Nothing is approximated except the start of Newton's iteration for the roots.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from replication.errors import InvalidInputError, SolverError
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.units import natural_units, reach
from replication.estimation.validation import Array, positive_integer

# Discretisation of a history on [-1, 0]: Chebyshev collocation, or the forward difference with lumped states.
#
# Collocation converges geometrically; the forward difference of N lumped states is first order in 1/N.


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


def generator(system: DelayPlant, order: int) -> tuple[Array, Array]:
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


Complex = npt.NDArray[np.complexfloating[Any, Any]]
NEWTON_STEPS = 60
ROOT_TOLERANCE = 1e-9
UNSEEN = 1e-7
"""In `natural_units`, of the real part of a root, and of the rank, where a mode counts as not seen."""
ORDER, FEW = 40, 16
"""Order of the collocation that starts Newton's iteration, and the least one where roots are known to be small."""


def characteristic(system: DelayPlant, s: complex | Complex) -> Complex:
    """M(s), shape (..., n, n) for s of shape (...)."""
    points = np.asarray(s, dtype=complex)[..., None, None]
    matrix = points * np.eye(system.states) - system.a0
    for delay, a in zip(system.delays, system.a, strict=True):
        matrix = matrix - np.exp(-points * delay) * a
    return np.asarray(matrix, dtype=complex)


def rightmost_roots(system: DelayPlant, count: int = 5) -> Complex:
    """The `count` characteristic roots of largest real part (1/s), refined until σ_min(M)/‖M‖ is below ROOT_TOLERANCE.

    Eigenvalues of the generator on ORDER + 1 Chebyshev points start Newton's method. Raises SolverError where a start
    does not converge.
    """
    positive_integer("count", count)
    units = natural_units(system)
    starts = np.linalg.eigvals(generator(units.system, ORDER)[0])
    starts = starts[np.argsort(-starts.real)][:count]
    roots = [_refined(units.system, complex(start)) / units.time for start in starts]
    return np.array(roots, dtype=complex)


def _refined(system: DelayPlant, start: complex) -> complex:
    """Newton on M(s)v = 0, cᴴv = 1, from the singular vector of the start."""
    s = start
    vector = np.linalg.svd(characteristic(system, s))[2][-1].conj()
    normal = vector.conj()
    n = system.states
    for _ in range(NEWTON_STEPS):
        matrix = characteristic(system, s)
        values = np.linalg.svd(matrix, compute_uv=False)
        if values[-1] <= 1e-14 * (1.0 + values[0]):
            break
        terms = (delay * np.exp(-s * delay) * a for delay, a in zip(system.delays, system.a, strict=True))
        slope = np.eye(n) + sum(terms)  # dM/ds
        jacobian = np.block([[matrix, (slope @ vector)[:, None]], [normal[None, :], np.zeros((1, 1))]])
        residual = np.concatenate([matrix @ vector, [normal @ vector - 1.0]])
        # A multiple root makes the Jacobian singular; the least-squares step still converges, linearly.
        step = np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        vector, s = vector - step[:n], s - complex(step[n])
    values = np.linalg.svd(characteristic(system, s), compute_uv=False)
    if values[-1] > ROOT_TOLERANCE * (1.0 + values[0]) or abs(s - start) > 0.1 * (1.0 + abs(start)):
        raise SolverError(f"no characteristic root found near {start:.6g}; raise the order of the collocation")
    return s


def undetectable_root(system: DelayPlant) -> complex | None:
    """A root with non-negative real part that y does not see (Hautus: rank [M(s); C_2] < n), or None."""
    units = natural_units(system)
    plant = units.system
    # e^{sη} is resolved for all |s| up to the bound of the unstable roots, as far as ORDER goes.
    order = min(ORDER, FEW + int(np.ceil(min(ORDER, reach(plant) * plant.delays[-1]))))
    starts = np.linalg.eigvals(generator(plant, order)[0])
    for start in starts[starts.real >= -1e-3]:
        root = _refined(plant, complex(start))
        if root.real >= -UNSEEN:
            sensor = plant.c2 / np.linalg.norm(plant.c2, axis=1, keepdims=True)
            pencil = np.vstack([characteristic(plant, root), sensor])
            if np.linalg.svd(pencil, compute_uv=False)[-1] <= UNSEEN:
                return root / units.time
    return None


def require_detectable(system: DelayPlant) -> None:
    """Raise InvalidInputError if an unstable mode does not reach y: then no observer has an error that dies out."""
    root = undetectable_root(system)
    if root is not None:
        raise InvalidInputError(
            f"the system is not detectable: y does not see the root {root:.6g}; measure another state"
        )
