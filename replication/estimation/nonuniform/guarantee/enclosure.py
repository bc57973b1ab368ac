"""Finite sets of matrices whose convex hull holds [Phi(h), Gamma(h)] for a whole interval of h, up to a bounded
remainder.

On a piece [a, a + d] the exponential is a Taylor polynomial in h, which lies in the hull of its Bernstein coefficients,
plus a remainder of norm at most ||N||^{p+1} d^{p+1} e^{||N|| d} / (p + 1)! ||e^{Na}||.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, factorial

import numpy as np

from replication.estimation.nonuniform.plant import SampledPlant
from replication.estimation.validation import Array

DEGREE = 5


@dataclass(frozen=True)
class Enclosure:
    """K hulls. vertices (K, DEGREE + 1, n + m, n + m): transition matrices; periods (K, DEGREE + 1): the h of each
    vertex; bases (K, n + m, n + m): the transition matrices at the starts; width (K,), in seconds; generator: N."""

    vertices: Array
    periods: Array
    bases: Array
    width: Array
    generator: Array

    def remainder(self, frame: Array | None = None) -> Array:
        """Bound (K,) of the 2-norm of what each hull misses, infinite if it overflows.

        frame S (n + m, n + m): the bound is that of S R S^-1 for what is missed, R; it is small in coordinates in which
        S N S^-1 is.
        """
        N, bases = self.generator, self.bases
        if frame is not None:
            inverse = np.linalg.inv(frame)
            N, bases = frame @ N @ inverse, frame @ bases @ inverse
        size = np.linalg.norm(N, 2) * np.abs(self.width)
        with np.errstate(over="ignore"):
            tail = size ** (DEGREE + 1) / factorial(DEGREE + 1) * np.exp(size)
        return np.asarray(tail * np.linalg.norm(bases, 2, axis=(1, 2)))


def enclose(plant: SampledPlant, start: Array, stop: Array) -> Enclosure:
    """Hulls of exp(h [[A, B], [0, 0]]) over start[i] <= h <= stop[i] (seconds), i = 1 ... K, of degree DEGREE."""
    N = plant.generator()
    width = stop - start
    powers = [np.linalg.matrix_power(N, k) / factorial(k) for k in range(DEGREE + 1)]
    # Bernstein coefficient i of sum_k c_k t^k on [0, 1] is sum_{k <= i} C(i, k) / C(p, k) c_k.
    shares = np.array([[comb(i, k) / comb(DEGREE, k) for k in range(DEGREE + 1)] for i in range(DEGREE + 1)])
    scaled = width[:, None] ** np.arange(DEGREE + 1)
    bases = plant.transitions(start)
    vertices = np.einsum("ik,ck,kab,cbd->ciad", shares, scaled, np.array(powers), bases, optimize=True)
    periods = start[:, None] + width[:, None] * np.arange(DEGREE + 1) / DEGREE
    return Enclosure(vertices, periods, bases, width, N)
