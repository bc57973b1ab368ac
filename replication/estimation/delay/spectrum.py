"""Grids of a history, and the characteristic roots of a system with delays: all of the rightmost, seen by y or not.

Of M(s) = sI - A_0 - ΣA_i e^{-sτ_i}, averages with it, nothing is approximated but the start of Newton's iteration.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import scipy

from replication.errors import InvalidInputError, SolverError
from replication.estimation.delay.exact.terms import Complex, PlantTerms, plant_terms
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.units import natural_units, reach
from replication.estimation.validation import Array, positive_integer


class Scheme(StrEnum):
    """How histories on [-1, 0] are discretised: Chebyshev collocation, which converges geometrically, or the forward
    difference with lumped states, of first order in their number.
    """

    CHEBYSHEV = "chebyshev"
    LUMPED = "lumped"


@dataclass(frozen=True)
class Grid:
    """Points of [-1, 0] from 0 down to -1 (N+1,), differentiation matrix (N+1, N+1), quadrature weights (N+1,)."""

    points: Array
    slope: Array
    weights: Array


@np.errstate(invalid="ignore")  # the slope of a line, whose second point is where it is asked for
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
    points = (np.cos(np.pi * np.arange(order + 1) / order) - 1.0) / 2.0
    nodes, weights = legendre.gauss(order // 2 + 1)
    return Grid(points, _interpolant(points).derivative(points), weights @ interpolation(points, nodes))


def _interpolant(points: Array) -> Any:
    """The polynomial through values at Chebyshev points, as the rows that evaluate it (barycentric formula)."""
    weights = (-1.0) ** np.arange(points.size)
    weights[[0, -1]] /= 2.0
    return scipy.interpolate.BarycentricInterpolator(points, np.eye(points.size), wi=weights)


@np.errstate(invalid="ignore")  # at a point of the grid itself, which the interpolant then treats apart
def interpolation(points: Array, at: Array | float) -> Array:
    """Rows (.., N+1) that evaluate the interpolant of values at Chebyshev `points`, `at` points of [-1, 0]."""
    return np.asarray(_interpolant(points)(at))


def generator(system: DelayPlant, order: int) -> tuple[Array, Array]:
    """The plant on one history of length τ_K with order+1 Chebyshev points, state (x; values from η < 0 down to -1).

    Returns A (n(order+1))² with ẋ = A x for w = 0, and C with z = C x.
    """
    net, plant = grid(order), plant_terms(system)
    n, longest = system.states, system.delays[-1]
    rows: Array = np.kron(interpolation(net.points, 0.0), plant.terms.constant[:, :n]).astype(float)
    for delay, matrix, kernel in plant.terms.spread:
        rows += np.kron(interpolation(net.points, -delay / longest), matrix[:, :n])
        if kernel is not None:
            nodes, weights = legendre.gauss(order + len(kernel.series))
            at = interpolation(net.points, nodes * delay / longest)
            rows += np.einsum("t,tu,tab->aub", weights, at, kernel(-nodes)[..., :n]).reshape(rows.shape)
    a: Array = np.kron(net.slope / longest, np.eye(n)).astype(float)
    a[:n] = rows[:n]
    return a, rows[n : n + system.outputs]


NEWTON_STEPS = 60
ROOT_TOLERANCE = 1e-9
UNSEEN = 1e-7
"""In `natural_units`, of the real part of a root, and of the rank, where a mode counts as not seen."""
ORDER, FEW = 40, 16
"""Order of the collocation that starts Newton's iteration, and the least one where roots are known to be small."""


def characteristic(plant: PlantTerms, s: Complex) -> Complex:
    """M(s) at each s (M,), shape (M, n, n)."""
    n = plant.sizes[0]
    return np.asarray(s[:, None, None] * np.eye(n) - plant.terms.at(s)[:, :n, :n])


def rightmost_roots(system: DelayPlant, count: int = 5) -> Complex:
    """The `count` characteristic roots of largest real part (1/s), to σ_min(M)/‖M‖ below ROOT_TOLERANCE."""
    positive_integer("count", count)
    units = natural_units(system)
    scaled = units.plant(system)
    starts = np.linalg.eigvals(generator(scaled, ORDER)[0])
    starts = starts[np.argsort(-starts.real)][:count]
    plant = plant_terms(scaled)
    return np.array([_refined(plant, complex(start)) / units.time for start in starts], dtype=complex)


def _refined(plant: PlantTerms, start: complex) -> complex:
    """Newton on M(s)v = 0, cᴴv = 1, from the singular vector of the start."""
    s, n, aged = start, plant.sizes[0], plant.terms.aged()

    def matrix_at(s: complex) -> Complex:
        return np.asarray(characteristic(plant, np.array([s]))[0])

    vector = np.linalg.svd(matrix_at(s))[2][-1].conj()
    normal = vector.conj()
    for _ in range(NEWTON_STEPS):
        matrix = matrix_at(s)
        values = np.linalg.svd(matrix, compute_uv=False)
        if values[-1] <= 1e-14 * (1.0 + values[0]):
            break
        late = zip(aged.delays, aged.lines_at(np.array([s])), strict=True)
        slope = np.eye(n) + sum(delay * line[0, :n, :n] for delay, line in late)  # dM/ds
        jacobian = np.block([[matrix, (slope @ vector)[:, None]], [normal[None, :], np.zeros((1, 1))]])
        residual = np.concatenate([matrix @ vector, [normal @ vector - 1.0]])
        # A multiple root makes the Jacobian singular; the least-squares step still converges, linearly.
        step = np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        vector, s = vector - step[:n], s - complex(step[n])
    values = np.linalg.svd(matrix_at(s), compute_uv=False)
    if values[-1] > ROOT_TOLERANCE * (1.0 + values[0]) or abs(s - start) > 0.1 * (1.0 + abs(start)):
        raise SolverError(f"no characteristic root found near {start:.6g}; raise the order of the collocation")
    return s


def require_seen(system: DelayPlant, time: float) -> None:
    """Refuse a plant, in units of moderate size, of `time` s, whose y does not see a root with Re s >= 0 (Hautus)."""
    plant, n = plant_terms(system), system.states
    # e^{sη} is resolved for all |s| up to the bound of the unstable roots, as far as ORDER goes.
    order = min(ORDER, FEW + int(np.ceil(min(ORDER, reach(system) * system.delays[-1]))))
    starts = np.linalg.eigvals(generator(system, order)[0])
    for start in starts[starts.real >= -1e-3]:
        root = _refined(plant, complex(start))
        if root.real >= -UNSEEN:
            sensor = plant.terms.at(np.array([root]))[0][plant.rows[2], :n]
            sensor = sensor / np.maximum(np.linalg.norm(sensor, axis=1, keepdims=True), np.finfo(float).tiny)
            pencil = np.vstack([characteristic(plant, np.array([root]))[0], sensor])
            if np.linalg.svd(pencil, compute_uv=False)[-1] <= UNSEEN:
                value = root.real if abs(root.imag) <= ROOT_TOLERANCE * (1.0 + abs(root)) else root
                raise InvalidInputError(
                    f"the plant is not detectable: y does not see the root {value / time:.6g}; measure another state"
                )
