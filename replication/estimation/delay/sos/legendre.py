"""Orthonormal Legendre polynomials p_0, p_1, ... on [-1, 0], the interval to which every delay is scaled.

p_a(η) = √(2a+1) P_a(2η+1), so ∫p_a p_b = δ_ab over [-1, 0]. A function is the vector of its coefficients; all integrals
of polynomials below are exact Gauss quadratures.
"""

from functools import cache

import numpy as np
from numpy.polynomial import legendre as classical

from replication.estimation.validation import Array


@cache
def gauss(count: int) -> tuple[Array, Array]:
    """Gauss nodes and weights of [-1, 0]: exact up to degree 2·count-1. Shapes (count,), (count,); read-only."""
    nodes, weights = classical.leggauss(count)
    points, scaled = (nodes - 1.0) / 2.0, weights / 2.0
    points.flags.writeable = False
    scaled.flags.writeable = False
    return points, scaled


def evaluate(count: int, points: Array | float) -> Array:
    """Values of p_0..p_{count-1}: shape (len(points), count)."""
    grid = np.atleast_1d(np.asarray(points, dtype=float))
    norms: Array = np.sqrt(2.0 * np.arange(count) + 1.0)
    return classical.legvander(2.0 * grid + 1.0, count - 1) * norms


def ends(count: int) -> tuple[Array, Array]:
    """p_0..p_{count-1} at 0 and at -1, each of shape (count,)."""
    norms: Array = np.sqrt(2.0 * np.arange(count) + 1.0)
    return norms, (-1.0) ** np.arange(count) * norms


@cache
def derivative(count: int) -> Array:
    """Matrix D with p_a' = Σ_c D[c, a] p_c; shape (count, count)."""
    norms = np.sqrt(2.0 * np.arange(count) + 1.0)
    matrix = np.zeros((count, count))
    for a in range(1, count):
        coefficients = classical.legder(np.eye(count)[a])
        matrix[: coefficients.size, a] = 2.0 * coefficients * norms[a] / norms[: coefficients.size]
    matrix.flags.writeable = False
    return matrix


@cache
def products(out: int, first: int, second: int, weighted: bool) -> Array:
    """T[c, a, b] = ∫g p_c p_a p_b over [-1, 0], shape (out, first, second); g = -η(η+1) if `weighted`, else 1.

    With out > degree of g p_a p_b these are the Legendre coefficients of g p_a p_b.
    """
    points, weights = gauss((out + first + second) // 2 + 2)
    if weighted:
        weights = weights * (-points * (points + 1.0))
    tensor: Array = np.einsum(
        "k,kc,ka,kb->cab",
        weights,
        evaluate(out, points),
        evaluate(first, points),
        evaluate(second, points),
        optimize=True,
    )
    # Products of orthogonal polynomials vanish exactly in many entries; quadrature leaves rounding there.
    tensor[np.abs(tensor) < 1e-13] = 0.0
    tensor.flags.writeable = False
    return tensor
