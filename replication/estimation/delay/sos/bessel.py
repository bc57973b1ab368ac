"""A small cone inside that of Corollary 2, for cheap programs: positivity by Bessel's inequality.

V = uᵀXu + Σ_i(∫φ_iᵀS_iφ_i - Σ_{c<d} μ_icᵀS_iμ_ic) + Σ_i∫(1+η)φ_iᵀT_iφ_i with X, S_i, T_i ⪰ 0, where μ_ic = ∫p_cφ_i and
u = (x, μ): the second sum is the energy of φ_i beyond its first d moments. Q has degree d-1 in η, R in both arguments,
S + (1+η)T degree one. A matrix of order points + d·nK and 2K of order n take the place of two with all products of
Z_1 and Z_2, in which each such form has matrices, too.
"""

from __future__ import annotations

import math

import numpy as np
import scipy

from replication.estimation.delay.sos.forms import FormSpace, Index

RAMP = (0.5, 0.5 / math.sqrt(3.0))
"""Legendre coefficients of 1+η."""


def cone(space: FormSpace, moments: int, *, ramp: bool) -> tuple[scipy.sparse.csr_array, tuple[Index, ...]]:
    """Coefficients of the form as a linear function of (vec X, vec S_1, .., vec S_K, vec T_1, .., vec T_K).

    Returns the sparse map and, for each matrix, the variable behind each of its rows: points are numbered first, then
    functions. Without `ramp` there is no T.
    """
    functionals = np.arange(space.points + moments * space.functions, dtype=np.int64)
    functions = np.arange(space.functions, dtype=np.int64).reshape(space.delays, space.channels)
    maps = [_square(space, functionals)]
    maps += [_multiplier(space, part, (1.0,), moments) for part in functions]
    if ramp:
        maps += [_multiplier(space, part, RAMP, 0) for part in functions]
    behind = np.where(
        functionals < space.points, functionals, space.points + (functionals - space.points) % space.functions
    )
    parts = [space.points + part for part in functions]
    return scipy.sparse.hstack(maps, format="csr"), (behind, *parts, *(parts if ramp else ()))


def _square(space: FormSpace, functionals: Index) -> scipy.sparse.coo_array:
    """vec X ↦ uᵀXu."""
    first, second = (part.ravel() for part in np.meshgrid(functionals, functionals, indexing="ij"))
    where = (space.pair(first, second), np.arange(first.size))
    return scipy.sparse.coo_array((np.ones(first.size), where), shape=(space.size, first.size))


def _multiplier(space: FormSpace, functions: Index, weight: tuple[float, ...], moments: int) -> scipy.sparse.coo_array:
    """vec S ↦ ∫g φᵀSφ - Σ_{c<moments} μ_cᵀSμ_c, g with the Legendre coefficients `weight`."""
    first, second = (part.ravel() for part in np.meshgrid(functions, functions, indexing="ij"))
    rows = [space.multiplier(np.int64(c), first, second) for c in range(len(weight))]  # type: ignore[arg-type]
    rows += [space.pair(space.moment(c, first), space.moment(c, second)) for c in range(moments)]
    values = np.repeat([*weight, *[-1.0] * moments], first.size)
    where = (np.concatenate(rows), np.tile(np.arange(first.size), len(rows)))
    return scipy.sparse.coo_array((values, where), shape=(space.size, first.size))
