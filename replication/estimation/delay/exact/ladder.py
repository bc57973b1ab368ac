"""A plant with each delay replaced by a delay-free model of N states a channel: the Legendre-tau method.

The states are moments m_k of what is under way, with orthonormal Legendre polynomials q_k of the lag. The shift obeys
tau m_k' = q_k(0) v(t) - q_k(1) v(t - tau) + sum_j <q_k', q_j> m_j; the one approximation is that v(t - tau) is read
from m_0 ... m_{N-1} and v(t). It is Pade's approximant [N/N]; distributed delays of degree below N come in exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from replication.estimation.delay.exact.kernel import Kernel
from replication.estimation.delay.exact.terms import PlantTerms
from replication.estimation.validation import Array

RANK = 1e-12


@dataclass(frozen=True, eq=False)
class FilterModel:
    """x' = a x + b w, z = cz x + dz w, y = cy x + dy w.

    Attributes
    ----------
    a, b : array (N, N), (N, r)
        Dynamics.
    cz, dz : array (p, N), (p, r)
        What is estimated.
    cy, dy : array (q, N), (q, r)
        Measurements.
    """

    a: Array
    b: Array
    cz: Array
    dz: Array
    cy: Array
    dy: Array


def ladder_model(plant: PlantTerms, order: int) -> FilterModel:
    """The model with `order` moments for each channel of each line; a channel is a row that the line delays."""
    n, p, q, r = plant.sizes
    terms = plant.terms
    lines = [_line(matrix, kernel, order) for _, matrix, kernel in terms.spread]
    size = n + order * sum(len(channels) for channels, _ in lines)
    # Rows (x', z, y), columns (x, moments, w).
    whole = np.zeros((n + p + q, size + r))
    whole[:, :n], whole[:, size:] = terms.constant[:, :n], terms.constant[:, n:]
    a, b = np.zeros((size, size)), np.zeros((size, r))
    drift, source, reading, direct = shift(order)
    start = n
    for (channels, effect), delay in zip(lines, terms.delays, strict=True):
        count = len(channels)
        stop = start + order * count
        eye = np.eye(count)
        a[start:stop, start:stop] = np.kron(eye, drift) / delay
        entry = np.kron(channels, source[:, None]) / delay
        a[start:stop, :n], b[start:stop] = entry[:, :n], entry[:, n:]
        late, weights = effect
        # v(t - tau) = reading m + direct v(t).
        whole[:, :n] += direct * late @ channels[:, :n]
        whole[:, size:] += direct * late @ channels[:, n:]
        whole[:, start:stop] = np.kron(late, reading[None, :]) + weights
        start = stop
    a[:n], b[:n] = whole[:n, :size], whole[:n, size:]
    return FilterModel(
        a, b, whole[n : n + p, :size], whole[n : n + p, size:], whole[n + p :, :size], whole[n + p :, size:]
    )


def shift(order: int) -> tuple[Array, Array, Array, float]:
    """(F, g, c, d): tau m' = F m + g v(t) and v(t - tau) = c m + d v(t)."""
    index = np.arange(order)
    now = np.sqrt(2.0 * index + 1.0)
    then = (-1.0) ** index * now
    direct = (-1.0) ** order
    reading = then - direct * now
    # <q_k', q_j> = -2 q_k(0) q_j(0) for j < k with k - j odd.
    slope = -2.0 * np.outer(now, now) * np.tril((index[:, None] - index[None, :]) % 2)
    return slope - np.outer(then, reading), now - direct * then, reading, direct


def _line(matrix: Array, kernel: Kernel | None, order: int) -> tuple[Array, tuple[Array, Array]]:
    """Channels (k, n+r), orthonormal; the effect (rows, k) of their late values and (rows, k N) of their moments."""
    moments = np.zeros((order, *matrix.shape)) if kernel is None else _moments(kernel, order)
    stacked = np.vstack([matrix, moments.reshape(-1, matrix.shape[1])])
    values, right = np.linalg.svd(stacked, full_matrices=False)[1:]
    channels = right[: int(np.sum(values > RANK * max(values[0], np.finfo(float).tiny)))]
    weights = np.einsum("kab,cb->ack", moments, channels).reshape(len(matrix), -1)
    return channels, (matrix @ channels.T, weights)


def _moments(kernel: Kernel, order: int) -> Array:
    """(N, rows, columns): coefficients of the kernel with regard to q_0 ... q_{N-1}."""
    nodes, weights = legendre.leggauss(order + kernel.series.shape[1])
    half, middle = np.diff(kernel.edges) / 2.0, (kernel.edges[1:] + kernel.edges[:-1]) / 2.0
    lags = (middle[:, None] + half[:, None] * nodes).ravel()
    basis = legendre.legvander(1.0 - 2.0 * lags, order - 1) * np.sqrt(2.0 * np.arange(order) + 1.0)
    share = (half[:, None] * weights).ravel()
    return np.asarray(np.einsum("t,tk,tab->kab", share, basis, kernel(lags)))
