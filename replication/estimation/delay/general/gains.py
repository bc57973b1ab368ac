"""From a storage function to the gains of the observer: Z and L_z between the two inequalities, then their inverse."""

from __future__ import annotations

import numpy as np
import scipy

from replication.estimation.delay.general.cone import Storage, dissipation, scalars_of
from replication.estimation.delay.general.lines import LineForm
from replication.estimation.delay.general.rates import Rates
from replication.estimation.delay.sos import legendre
from replication.estimation.validation import Array

NODES = 160
"""Gauss points on a line: the kernels are polynomials over S + (1 + s) T."""
NEGLIGIBLE = 1e-11
"""Legendre coefficients of a kernel below this share of its largest are left out."""


def multiplier(rates: Rates, storage: Storage) -> tuple[Array, Array]:
    """Z (k, q) and L_z (p, q), which make N positive where both inequalities hold.

    They leave (u, v) and eps independent given the rest: the completion of largest determinant.
    """
    k, q, p = len(rates.u), len(rates.unit), len(rates.z)
    whole = dissipation(rates, rates.change, outputs=p).at(storage.plus, scalars_of(storage))
    free = np.r_[0:k, len(whole) - p : len(whole)]
    eps, rest = np.arange(k, k + q), np.arange(k + q, len(whole) - p)
    wanted = whole[np.ix_(free, rest)] @ np.linalg.solve(whole[np.ix_(rest, rest)], whole[np.ix_(rest, eps)])
    found = np.linalg.solve(rates.unit, (wanted - whole[np.ix_(free, eps)]).T).T
    return found[:k], found[k:]


def injection(form: LineForm, rates: Rates, storage: Storage) -> tuple[Array, Array, tuple[Array, ...]]:
    """L_0, L_z and, for each line, the Legendre coefficients of L_i.

    The derivative of V along an injection L eps is 2 u'Z eps if, with m = (L_0, moments of L_i),
    (S_i + (1 + s) T_i) L_i = sum_c p_c (Z - W m)_ic; then (W_+ + diag(0, K_i^-1 - S_i)) m = Z, K_i the moments of
    (S_i + (1 + s) T_i)^-1.
    """
    (z, lz), n = multiplier(rates, storage), form.states
    degree = len(rates.lines[0].moments) if rates.lines else 1
    points, weights = legendre.gauss(NODES)
    basis = legendre.evaluate(degree, points)
    whole, inverses, start = storage.plus.copy(), [], n
    for s, t in zip(storage.s, storage.t, strict=True):
        values = np.linalg.inv(s + (1.0 + points)[:, None, None] * t)
        size = degree * len(s)
        moments = np.einsum("x,xc,xij,xd->cidj", weights, basis, values, basis, optimize=True).reshape(size, size)
        part = slice(start, start + size)
        whole[part, part] += np.linalg.inv(moments) - np.kron(np.eye(degree), s)
        inverses.append((part, values, moments))
        start += size
    m = scipy.linalg.solve((whole + whole.T) / 2.0, z, assume_a="pos")
    kernels = []
    for part, values, moments in inverses:
        inner = np.linalg.solve(moments, m[part]).reshape(degree, -1, z.shape[1])
        kernel = np.einsum("xij,xc,cjq->xiq", values, basis, inner, optimize=True)
        kernels.append(_polynomial(kernel, points, weights))
    return m[:n], lz, tuple(kernels)


def _polynomial(values: Array, points: Array, weights: Array) -> Array:
    """Legendre coefficients (c, m, q) of a function given at the Gauss points."""
    tests = legendre.evaluate(len(points) // 2, points)
    coefficients = np.einsum("x,xc,xiq->ciq", weights, tests, values)
    sizes = np.abs(coefficients).max(axis=(1, 2))
    kept = np.flatnonzero(sizes > NEGLIGIBLE * sizes.max(initial=0.0))
    return np.asarray(coefficients[: kept[-1] + 1 if kept.size else 1])
