"""The filter of least entropy at a level for a delay-free model with D_z = 0; the Kalman filter at an infinite level.

Source: Mustafa and Glover, Minimum Entropy H-infinity Control (1990): the central solution of the filter Riccati
equation. trace(C_z P C_z') bounds the mean square of the error of z for white noise, and is it for the Kalman filter.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy

from replication.errors import InfeasibleError
from replication.estimation.delay.exact.terms import Kernel, PlantTerms, Terms, plant_terms
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos.legendre import derivative, ends, evaluate, gauss
from replication.estimation.delay.units import Scaling, balanced_loop, natural_units, rounded
from replication.estimation.linear.periodic import Stage
from replication.estimation.linear.riccati import symmetric
from replication.estimation.validation import Array

# A plant whose past is replaced by moments: the Legendre-tau method on pieces of the past.
#
# On a piece of length tau the states are moments m_k of what passes, with orthonormal Legendre polynomials q_k of the
# lag: tau m_k' = q_k(0) v(t) - q_k(1) v(t - tau) + sum_j <q_k', q_j> m_j. The one approximation is that v(t - tau) is
# read from m_0 ... m_{N-1} and v(t): Pade's approximant [N/N]. Averages with weights of degree below N come in exactly.


RANK, APART, FEW = 1e-12, 0.02, 3
"""Of the signals; distance of a cut from the next one, in longest delays, below which it is left out;
and the number of delays up to which their differences are cuts."""


@dataclass(frozen=True, eq=False)
class FilterModel:
    """x' = a x + b w, z = cz x + dz w, y = cy x + dy w."""

    a: Array  # (N, N) Dynamics
    b: Array  # (N, r) Dynamics
    cz: Array  # (p, N) What is estimated
    dz: Array  # (p, r) What is estimated
    cy: Array  # (q, N) Measurements
    dy: Array  # (q, r) Measurements

    @property
    def terms(self) -> PlantTerms:
        """The same as a plant without delays."""
        n, p, q, r = len(self.a), len(self.cz), len(self.cy), self.b.shape[1]
        whole = np.block([[self.a, self.b], [self.cz, self.dz], [self.cy, self.dy]])
        return PlantTerms((n, p, q, r), Terms(whole), Terms(np.zeros((n + p + q, 0))))

    def error(self, L: Array, Lz: Array | None = None) -> Stage:
        """From w to the error of x^' = a x^ + L (y - cy x^), z^ = cz x^ + Lz (y - cy x^); Lz is zero unless given."""
        z = (self.cz, self.dz) if Lz is None else (self.cz - Lz @ self.cy, self.dz - Lz @ self.dy)
        return Stage(self.a - L @ self.cy, self.b - L @ self.dy, *z)


def ladder_model(plant: PlantTerms, order: int) -> FilterModel:
    """The model with `order` moments, on each piece of the past, of each signal that is needed from there.

    The pieces end at the delays and, for a few delays, at their differences: there the memory of an optimal filter has
    corners, and polynomials across a corner converge slowly.
    """
    n, p, _, r = plant.sizes
    pieces = _pieces(plant.terms)
    size = n + order * sum(len(piece.channels) for piece in pieces)
    # All signals as rows over the columns (x, moments, w).
    now = np.delete(np.eye(size + r), np.s_[n:size], axis=0)
    whole, rates = plant.terms.constant @ now, np.zeros((size - n, size + r))
    drift, source, reading, direct = shift(order)
    signal, channels, start = now, np.eye(n + r), n
    for piece in pieces:
        count = len(piece.channels)
        part = slice(start, start + order * count)
        signal = piece.channels @ channels.T @ signal
        rates[start - n : part.stop - n] = np.kron(signal, source[:, None]) / piece.length
        rates[start - n : part.stop - n, part] += np.kron(np.eye(count), drift) / piece.length
        for delay, _, kernel in plant.terms.spread:
            if kernel is not None and delay >= piece.stop:
                moments = _moments(kernel, order, (piece.stop - piece.length) / delay, piece.stop / delay)
                whole[:, part] += np.einsum("kab,cb->ack", moments, piece.channels).reshape(len(whole), -1)
        signal = direct * signal
        signal[:, part] += np.kron(np.eye(count), reading)
        channels, start = piece.channels, part.stop
        for delay, matrix, _ in plant.terms.spread:
            if delay == piece.stop:
                whole += matrix @ channels.T @ signal
    a = np.vstack([whole[:n], rates])
    z, y = whole[n : n + p], whole[n + p :]
    return FilterModel(a[:, :size], a[:, size:], z[:, :size], z[:, size:], y[:, :size], y[:, size:])


@dataclass(frozen=True, eq=False)
class _Piece:
    """The past from stop - length to stop (s), and orthonormal rows of (x, w) that are needed from there or beyond."""

    stop: float
    length: float
    channels: Array


def _pieces(terms: Terms) -> list[_Piece]:
    """The pieces that something is needed from."""
    cuts = sorted(set(terms.delays))
    gaps = [late - early for late in cuts for early in cuts if late > early] if len(cuts) <= FEW else []
    for gap in gaps:
        if min(abs(gap - cut) for cut in [0.0, *cuts]) > APART * cuts[-1]:
            cuts.append(gap)
    pieces, start = [], 0.0
    for stop in sorted(cuts):
        needed = [
            np.vstack([matrix, *([] if kernel is None else kernel.series.reshape(-1, matrix.shape[1]))])
            for delay, matrix, kernel in terms.spread
            if delay >= stop
        ]
        values, right = np.linalg.svd(np.vstack(needed), full_matrices=False)[1:]
        channels = right[: int(np.sum(values > RANK * max(values[0], np.finfo(float).tiny)))]
        pieces.append(_Piece(stop, stop - start, channels))
        start = stop
    return pieces


def shift(order: int) -> tuple[Array, Array, Array, float]:
    """(F, g, c, d): tau m' = F m + g v(t) and v(t - tau) = c m + d v(t)."""
    now, then = ends(order)
    direct = (-1.0) ** order
    reading = then - direct * now
    return -derivative(order).T - np.outer(then, reading), now - direct * then, reading, direct


def _moments(kernel: Kernel, order: int, start: float, stop: float) -> Array:
    """(N, rows, columns): coefficients of the kernel between two lags with regard to q_0 ... q_{N-1} over them."""
    nodes, weights = gauss(order + len(kernel.series))
    values = kernel(start - (stop - start) * nodes)
    return np.asarray(np.einsum("t,tk,tab->kab", (stop - start) * weights, evaluate(order, nodes), values))


NEGATIVE = 1e-9
"""Eigenvalues of P down to so much of the largest are rounding."""
SMALLEST, STEPS = 1e-4, 3
"""Variance up to which one pass changes a unit; steps of Newton's method on the Riccati equation."""


def whitened(model: FilterModel) -> FilterModel:
    """The same model with measurements whose noise is of unit size and independent; `dy` has full row rank."""
    if not len(model.cy):
        return model
    sizes = np.linalg.norm(model.dy, axis=1)  # a unit of y decides nothing
    left, values, _ = np.linalg.svd(model.dy / sizes[:, None], full_matrices=False)
    unit = left.T / values[:, None] / sizes
    return replace(model, cy=unit @ model.cy, dy=unit @ model.dy)


def normal_states(model: FilterModel) -> tuple[FilterModel, Array]:
    """A whitened model in states x' = scale x whose Kalman filter has errors of unit variance, and scale (N,)."""
    drive, sight = np.abs(model.b).max(axis=1, initial=0.0), np.abs(model.cy).max(axis=0, initial=0.0)
    scale = 1.0 / balanced_loop(np.abs(model.a), drive, sight)
    for _ in range(2):
        try:
            sizes = np.diag(_riccati(_scaled(model, scale), np.inf))
        except np.linalg.LinAlgError:
            break
        if not np.all(np.isfinite(sizes)):
            break
        # High moments of slow signals have hardly an error: they keep about the unit of the low ones.
        scale = scale * 2.0 ** -np.round(np.log2(np.sqrt(np.maximum(sizes, SMALLEST))))
    return _scaled(model, scale), scale


def _scaled(model: FilterModel, scale: Array) -> FilterModel:
    a = scale[:, None] * model.a / scale
    return replace(model, a=a, b=scale[:, None] * model.b, cz=model.cz / scale, cy=model.cy / scale)


def hamiltonian(model: FilterModel, level: float) -> Array | None:
    """The Hamiltonian matrix of the filter Riccati equation at a level; None where R has another inertia."""
    p, q = len(model.cz), len(model.cy)
    c, d = np.vstack([model.cz / level, model.cy]), np.vstack([model.dz / level, model.dy])
    weight = d @ d.T - np.diag([1.0] * p + [0.0] * q)
    values, vectors = np.linalg.eigh(weight)
    if np.sum(values < 0.0) != p or np.abs(values).min() < 1e-14:
        return None
    inverse = vectors / values @ vectors.T
    drift = model.a - model.b @ d.T @ inverse @ c
    process = model.b @ (np.eye(d.shape[1]) - d.T @ inverse @ d) @ model.b.T
    return np.block([[drift.T, -c.T @ inverse @ c], [-process, -drift]])


def stable_space(model: FilterModel, level: float) -> tuple[Array, Array]:
    """U and V (N, N) with orthonormal [U; V], V U^-1 the solution that stabilises; raises LinAlgError if none does."""
    matrix, n = hamiltonian(model, level), len(model.a)
    if matrix is None:
        raise np.linalg.LinAlgError("the weight of the Riccati equation has another inertia")
    _, vectors, stable = scipy.linalg.schur(matrix, sort="lhp")
    if stable != n:
        raise np.linalg.LinAlgError("the Hamiltonian matrix has eigenvalues on the imaginary axis, to rounding")
    return vectors[:n, :n], vectors[n:, :n]


def _riccati(model: FilterModel, level: float) -> Array:
    """P of `central`."""
    u, v = stable_space(model, level)
    return symmetric(np.asarray(np.linalg.solve(u.T, v.T), dtype=float))


def _refined(model: FilterModel, P: Array) -> Array:
    """Newton's method (Kleinman) for the Kalman filter; raises LinAlgError if P does not stabilise."""
    R, noise = model.dy @ model.dy.T, model.b @ model.dy.T
    for _ in range(STEPS):
        gains = np.asarray(np.linalg.solve(R, (P @ model.cy.T + noise).T).T, dtype=float)
        drift, drive, *_ = model.error(gains)
        if np.linalg.eigvals(drift).real.max() >= 0.0:
            raise np.linalg.LinAlgError("rounding decides whether the filter of the model is stable")
        before, P = P, symmetric(scipy.linalg.solve_continuous_lyapunov(drift, -drive @ drive.T))
        if np.abs(P - before).max() <= 1e-14 * np.abs(P).max():
            break
    return P


def central(model: FilterModel, level: float = np.inf) -> tuple[Array, Array]:
    """L (N, q) of x^' = a x^ + L (y - cy x^), and P (N, N), for Kalman the covariance of the error.

    a P + P a' + b b' + P cz' cz P / level^2 = L R L' with R = dy dy' and L = (P cy' + b dy') R^-1.

    Raises InfeasibleError if there is no P >= 0 that stabilises, LinAlgError where rounding decides.
    """
    sizes = np.linalg.norm(model.dy, axis=1)
    if np.any(sizes == 0.0) or np.linalg.matrix_rank(model.dy / sizes[:, None]) < len(sizes):
        raise np.linalg.LinAlgError("a measurement has no noise of its own")
    # In units in which errors and noise are about one; the gains go back to those of the model.
    unit_model = replace(model, cy=model.cy / sizes[:, None], dy=model.dy / sizes[:, None])
    scale = normal_states(whitened(unit_model))[1]
    scaled = _scaled(unit_model, scale)
    unit = float(np.linalg.norm(scaled.cz)) or 1.0
    P = _riccati(replace(scaled, cz=scaled.cz / unit), level / unit)
    if np.isfinite(level):
        values = np.linalg.eigvalsh(P)
        if values[0] < -NEGATIVE * max(values[-1], 0.0):
            raise InfeasibleError(f"no filter of the model keeps the level {level:.6g}")
    else:
        P = _refined(scaled, P)
    R = unit_model.dy @ unit_model.dy.T
    gains = np.linalg.solve(R, (P @ scaled.cy.T + scaled.b @ unit_model.dy.T).T).T
    return gains / scale[:, None] / sizes, P / np.outer(scale, scale)


# Units in which the matrices of a plant with noise are of moderate size.


MOMENTS = 3
"""On each piece of the past, in the model of the Kalman filter."""


def scaling_of(plant: DelayPlant) -> Scaling:
    """Time in natural units, at most the longest delay; errors of the Kalman filter of unit size; w and z as they are.

    So a slow mode is as large as its error, and not as what it becomes in its own time. Where there is no Kalman filter
    the states are balanced.
    """
    units = natural_units(plant)
    noise = np.linalg.norm(np.hstack([plant.d21, *plant.d21_delayed]), axis=1)
    sensors = np.array([1.0 / rounded(size, 2.0) if size > 0.0 else 1.0 for size in noise])
    natural = replace(units, sensors=sensors, time=min(units.time, rounded(plant.delays[-1], 2.0)))
    model = ladder_model(plant_terms(natural.plant(plant)), MOMENTS)
    if np.linalg.matrix_rank(model.dy) < len(model.dy):
        return natural
    return replace(natural, states=natural.states * normal_states(whitened(model))[1][: plant.states])
