"""A plant whose past is replaced by moments: the Legendre-tau method on pieces of the past.

On a piece of length tau the states are moments m_k of what passes, with orthonormal Legendre polynomials q_k of the
lag: tau m_k' = q_k(0) v(t) - q_k(1) v(t - tau) + sum_j <q_k', q_j> m_j. The one approximation is that v(t - tau) is
read from m_0 ... m_{N-1} and v(t): Pade's approximant [N/N]. Averages with weights of degree below N come in exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from replication.estimation.delay.exact.kernel import Kernel
from replication.estimation.delay.exact.terms import PlantTerms, Terms
from replication.estimation.validation import Array

RANK, APART, FEW = 1e-12, 0.02, 3
"""Of the signals; distance of a cut from the next one, in longest delays, below which it is left out;
and the number of delays up to which their differences are cuts."""


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
    index = np.arange(order)
    now = np.sqrt(2.0 * index + 1.0)
    then = (-1.0) ** index * now
    direct = (-1.0) ** order
    reading = then - direct * now
    # <q_k', q_j> = -2 q_k(0) q_j(0) for j < k with k - j odd.
    slope = -2.0 * np.outer(now, now) * np.tril((index[:, None] - index[None, :]) % 2)
    return slope - np.outer(then, reading), now - direct * then, reading, direct


def _moments(kernel: Kernel, order: int, start: float, stop: float) -> Array:
    """(N, rows, columns): coefficients of the kernel between two lags with regard to q_0 ... q_{N-1} over them."""
    nodes, weights = legendre.leggauss(order + kernel.series.shape[1])
    edges = np.unique(np.clip(kernel.edges, start, stop))
    half, middle = np.diff(edges) / 2.0, (edges[1:] + edges[:-1]) / 2.0
    lags = (middle[:, None] + half[:, None] * nodes).ravel()
    basis = legendre.legvander(1.0 - 2.0 * (lags - start) / (stop - start), order - 1)
    share = (half[:, None] * weights).ravel()
    return np.asarray(np.einsum("t,tk,tab->kab", share, basis * np.sqrt(2.0 * np.arange(order) + 1.0), kernel(lags)))
