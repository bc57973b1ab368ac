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

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.units import natural_units, reach
from replication.estimation.validation import Array, as_matrix, positive_integer, positive_scalar

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
ORDER, FEW = 40, 16
"""Order of the collocation that starts Newton's iteration, and the least one where roots are known to be small."""


def characteristic(system: DelayPlant, s: complex | Complex) -> Complex:
    """M(s), shape (..., n, n) for s of shape (...)."""
    points = np.asarray(s, dtype=complex)[..., None, None]
    matrix = points * np.eye(system.states) - system.a0
    for delay, a in zip(system.delays, system.a, strict=True):
        matrix = matrix - np.exp(-points * delay) * a
    return np.asarray(matrix, dtype=complex)


def rightmost_roots(system: DelayPlant, count: int = 5, order: int = ORDER) -> Complex:
    """The `count` characteristic roots of largest real part (1/s), refined until σ_min(M)/‖M‖ is below ROOT_TOLERANCE.

    Eigenvalues of the generator on `order` + 1 Chebyshev points start Newton's method. Raises SolverError where a start
    does not converge.
    """
    positive_integer("count", count)
    units = natural_units(system)
    starts = np.linalg.eigvals(generator(units.system, order)[0])
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


def undetectable_root(system: DelayPlant, tolerance: float = 1e-7) -> complex | None:
    """A root with non-negative real part that y does not see (Hautus: rank [M(s); C_2] < n), or None.

    tolerance: in `natural_units`, for the real part of the root and for the rank.
    """
    units = natural_units(system)
    plant = units.system
    # e^{sη} is resolved for all |s| up to the bound of the unstable roots, as far as ORDER goes.
    order = min(ORDER, FEW + int(np.ceil(min(ORDER, reach(plant) * plant.delays[-1]))))
    starts = np.linalg.eigvals(generator(plant, order)[0])
    for start in starts[starts.real >= -1e-3]:
        root = _refined(plant, complex(start))
        if root.real >= -tolerance:
            sensor = plant.c2 / np.linalg.norm(plant.c2, axis=1, keepdims=True)
            pencil = np.vstack([characteristic(plant, root), sensor])
            if np.linalg.svd(pencil, compute_uv=False)[-1] <= tolerance:
                return root / units.time
    return None


def require_detectable(system: DelayPlant) -> None:
    """Raise InvalidInputError if an unstable mode does not reach y: then no observer has an error that dies out."""
    root = undetectable_root(system)
    if root is not None:
        raise InvalidInputError(
            f"the system is not detectable: y does not see the root {root:.6g}; measure another state"
        )


def frequency_response(system: DelayPlant, omega: Array | float) -> Complex:
    """The exact response from w to z, complex (M, p, r), at finite frequencies (M,) in rad/s."""
    s = 1j * as_matrix("omega", np.atleast_2d(omega), rows=1)[0]
    inner = np.linalg.solve(characteristic(system, s), np.broadcast_to(system.b, (s.size, *system.b.shape)))
    return np.asarray(_output(system, s) @ inner, dtype=complex)


def _output(system: DelayPlant, s: Complex, power: int = 0) -> Complex:
    """d^power C/ds^power at s, shape (len(s), p, n)."""
    value = np.zeros((s.size, *system.c10.shape), dtype=complex)
    if power == 0:
        value = value + system.c10
    for delay, c in zip(system.delays, system.c1, strict=True):
        value = value + (-delay) ** power * np.exp(-s * delay)[:, None, None] * c
    return value


@dataclass(frozen=True)
class GainBracket:
    """lower <= sup_ω ‖G(jω)‖ <= upper, with the frequency [rad/s] of the lower bound; bounds in floating point."""

    lower: float
    upper: float
    frequency: float


def hinf_gain(system: DelayPlant, relative: float = 1e-9, most: int = 200_000) -> GainBracket:
    """Supremum of ‖G(jω)‖ over ω by subdivision with an upper bound on every interval, `most` at most.

    On |ω-c| <= r, with x = ω-c: ‖G‖ <= max‖G_c ± rG_c'‖ + r²/2 sup‖G''‖, the last from ‖M⁻¹‖ <= μ/(1-rℓμ). Intervals
    that cannot hold the maximum are dropped. Raises InfeasibleError for an unstable plant, SolverError if `most` do not
    suffice.
    """
    positive_scalar("relative", relative)
    rightmost = rightmost_roots(system, 1)[0]
    if rightmost.real >= 0.0:
        raise InfeasibleError(f"the gain is infinite: the plant has the root {rightmost:.6g}; it must be stable")
    bound = _IntervalBound(system)
    radius = bound.far(float(np.linalg.norm(frequency_response(system, 0.0)[0], 2)))
    edges = np.linspace(0.0, radius, 201)
    centers, halves = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges) / 2.0
    lower, where, settled, used = 0.0, 0.0, 0.0, 0
    while centers.size:
        used += centers.size
        if used > most:
            raise SolverError(f"more than {most} intervals are needed for a gain within {relative:g}; ask for less")
        middle, upper = bound(centers, halves)
        best = int(np.argmax(middle))
        if middle[best] > lower:
            lower, where = float(middle[best]), float(centers[best])
        done = upper <= lower * (1.0 + relative)
        settled = max(settled, float(upper[done].max(initial=0.0)))
        centers, halves = centers[~done], halves[~done] / 2.0
        centers, halves = np.concatenate([centers - halves, centers + halves]), np.concatenate([halves, halves])
    origin = float(np.linalg.norm(frequency_response(system, 0.0)[0], 2))
    if origin > lower:
        lower, where = origin, 0.0
    return GainBracket(lower, max(lower, settled), where)


class _IntervalBound:
    """Bounds of ‖G‖ at the centre and over the whole of intervals of ω."""

    def __init__(self, system: DelayPlant) -> None:
        """Norms that do not depend on the interval."""
        self.system = system
        norms = [float(np.linalg.norm(a, 2)) for a in system.a]
        late = [float(np.linalg.norm(c, 2)) for c in system.c1]
        delays = system.delays
        self.size = float(np.linalg.norm(system.a0, 2)) + sum(norms)
        self.slope = 1.0 + sum(d * a for d, a in zip(delays, norms, strict=True))
        self.curve = sum(d * d * a for d, a in zip(delays, norms, strict=True))
        self.outputs = (
            float(np.linalg.norm(system.c10, 2)) + sum(late),
            sum(d * c for d, c in zip(delays, late, strict=True)),
            sum(d * d * c for d, c in zip(delays, late, strict=True)),
        )
        self.input = float(np.linalg.norm(system.b, 2))

    def far(self, level: float) -> float:
        """A frequency beyond which ‖G‖ is below `level`: ‖M⁻¹‖ <= 1/(ω - Σ‖A‖)."""
        reach = self.outputs[0] * self.input
        return self.size + reach / level if level > 0.0 else 1e3 * (1.0 + self.size)

    def __call__(self, centers: Array, halves: Array) -> tuple[Array, Array]:
        """Lower bounds (the value at the centre) and upper bounds over the intervals."""
        system = self.system
        s = 1j * centers
        inverse = np.linalg.inv(characteristic(system, s))
        output = _output(system, s)
        state = inverse @ system.b
        slope = np.zeros_like(inverse) + np.eye(system.states)
        for delay, a in zip(system.delays, system.a, strict=True):
            slope = slope + delay * np.exp(-s * delay)[:, None, None] * a
        value = output @ state
        rate = 1j * (_output(system, s, 1) @ state - output @ inverse @ slope @ state)
        middle = np.linalg.norm(value, 2, axis=(1, 2))
        step = halves[:, None, None] * rate
        ends = np.maximum(np.linalg.norm(value + step, 2, axis=(1, 2)), np.linalg.norm(value - step, 2, axis=(1, 2)))
        mu = np.linalg.norm(inverse, 2, axis=(1, 2))
        room = 1.0 - halves * self.slope * mu
        wide = np.where(room > 0.0, mu / np.where(room > 0.0, room, 1.0), np.inf)
        c0, c1, c2 = self.outputs
        second = c2 * wide + 2.0 * c1 * self.slope * wide**2
        second = second + c0 * (2.0 * self.slope**2 * wide**3 + self.curve * wide**2)
        return middle, ends + halves**2 / 2.0 * second * self.input
