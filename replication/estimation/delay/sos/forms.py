"""Quadratic forms on R^m × L2^n[-1,0]^K as vectors of coefficients over monomials.

A form with Legendre coefficients of count C is a linear combination of
  u_p u_q (p <= q)             u = (x_1..x_m, μ),  μ_{c,(i,k)} = ∫p_c φ_ik        (the parts P, Q, R)
  ∫p_c φ_ik φ_jl (ik <= jl)                                                       (the part S; i ≠ j must vanish)
so that matching coefficients of monomials is matching the unique symmetric coefficients of (P, Q, S, R).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from replication.estimation.validation import Array

Index = npt.NDArray[np.int64]


def triangle(size: int) -> tuple[Index, Index]:
    """Rows and columns (p <= q) of the upper triangle, in the order of `triangle_index`."""
    rows, columns = np.triu_indices(size)
    return rows.astype(np.int64), columns.astype(np.int64)


def triangle_index(size: int, first: Index, second: Index) -> Index:
    """Position of the unordered pair {first, second} among the pairs p <= q of `size` items."""
    low, high = np.minimum(first, second), np.maximum(first, second)
    position: Index = low * size - low * (low - 1) // 2 + high - low
    return position


@dataclass(frozen=True)
class FormSpace:
    """Monomials of forms with `points` scalar variables, `delays` × `channels` functions and `count` polynomials."""

    points: int
    channels: int
    delays: int
    count: int

    @property
    def functions(self) -> int:
        """Number of scalar functions, n·K."""
        return self.channels * self.delays

    @property
    def functionals(self) -> int:
        """Number of linear functionals u: point variables and Legendre moments."""
        return self.points + self.count * self.functions

    @property
    def pair_count(self) -> int:
        """Number of monomials u_p u_q."""
        return self.functionals * (self.functionals + 1) // 2

    @property
    def multiplier_pairs(self) -> int:
        """Number of unordered pairs of functions."""
        return self.functions * (self.functions + 1) // 2

    @property
    def size(self) -> int:
        """Number of monomials."""
        return self.pair_count + self.count * self.multiplier_pairs

    def moment(self, degree: Index | int, function: Index | int) -> Index:
        """Index of the functional ∫p_degree φ_function."""
        return np.asarray(self.points + np.asarray(degree) * self.functions + np.asarray(function), dtype=np.int64)

    def pair(self, first: Index, second: Index) -> Index:
        """Index of the monomial u_first u_second."""
        return triangle_index(self.functionals, first, second)

    def multiplier(self, degree: Index, first: Index, second: Index) -> Index:
        """Index of the monomial ∫p_degree φ_first φ_second."""
        return self.pair_count + degree * self.multiplier_pairs + triangle_index(self.functions, first, second)

    def multiplier_functions(self) -> tuple[Index, Index, Index]:
        """Degree and the two functions of every multiplier monomial, in the order of their indices."""
        first, second = triangle(self.functions)
        degree = np.repeat(np.arange(self.count, dtype=np.int64), first.size)
        return degree, np.tile(first, self.count), np.tile(second, self.count)

    def split(self, coefficients: Array) -> tuple[Array, Array]:
        """Symmetric matrix W with form = uᵀWu + multiplier part, and S as an array (count, functions, functions)."""
        first, second = triangle(self.functionals)
        core = np.zeros((self.functionals, self.functionals))
        core[first, second] = coefficients[: self.pair_count] / 2.0
        core = core + core.T
        multiplier = np.zeros((self.count, self.functions, self.functions))
        first, second = triangle(self.functions)
        values = coefficients[self.pair_count :].reshape(self.count, -1) / 2.0
        multiplier[:, first, second] += values
        multiplier[:, second, first] += values
        return core, multiplier
