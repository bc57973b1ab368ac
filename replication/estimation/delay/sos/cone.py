"""The positive cone of forms V = Σ_g ∫g(η) ζ(η)ᵀM_gζ(η)dη, g ∈ {1, -η(η+1)}, M_g ⪰ 0 (Corollary 2), as a sparse map.

ζ(η) = [x; (Z_1(η)⊗I)φ(η); ∫(Z_2(η,θ)⊗I)φ(θ)dθ]. Every such form is non-negative by construction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt
import scipy

from replication.estimation.delay.sos import legendre

# Quadratic forms on R^m × L2^n[-1,0]^K as vectors of coefficients over monomials.
#
# A form with Legendre coefficients of count C is a linear combination of
#   u_p u_q (p <= q)             u = (x_1..x_m, μ),  μ_{c,(i,k)} = ∫p_c φ_ik        (the parts P, Q, R)
#   ∫p_c φ_ik φ_jl (ik <= jl)                                                       (the part S; i ≠ j must vanish)
# so that matching coefficients of monomials is matching the unique symmetric coefficients of (P, Q, S, R).


Index = npt.NDArray[np.int64]


def triangle_index(size: int, first: Index, second: Index) -> Index:
    """Position of the unordered pair {first, second} of `size` items, in the order of `numpy.triu_indices`."""
    low, high = np.minimum(first, second), np.maximum(first, second)
    return np.asarray(low * size - low * (low - 1) // 2 + high - low)


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
        first, second = np.triu_indices(self.functions)
        degree = np.repeat(np.arange(self.count, dtype=np.int64), first.size)
        return degree, np.tile(first, self.count), np.tile(second, self.count)

    def variables(self) -> tuple[Index, Index]:
        """The two variables of every monomial: points are numbered first, then functions."""
        behind = np.concatenate([np.arange(self.points), self.points + np.tile(np.arange(self.functions), self.count)])
        pairs, multipliers = np.triu_indices(self.functionals), self.multiplier_functions()[1:]
        first, second = (np.append(behind[p], self.points + m) for p, m in zip(pairs, multipliers, strict=True))
        return first, second


class DegreeRule(StrEnum):
    """Which monomials η^a θ^b the basis Z_2 of degree d holds, and the degree of the weighted term (Corollary 2).

    tensor: a, b <= d; total: a + b <= d; inner: a <= d, b = 0; outer: a = 0, b <= d; all with a weighted term of
    degree d-1, so that both terms reach the same degrees; for outer it keeps b <= d. wide: a <= d, b <= 2d, both terms
    of degree d; no strictly feasible point exists, and solvers stop early. bessel: the smaller cone by Bessel with d
    moments of each history; it lies in that of the tensor rule of degree max(1, d-1), and in that of the total rule of
    degree 1 if d = 1.
    """

    TENSOR = "tensor"
    TOTAL = "total"
    OUTER = "outer"
    INNER = "inner"
    WIDE = "wide"
    BESSEL = "bessel"


@dataclass(frozen=True)
class ConeBlock:
    """One matrix M_g: the degree of Z_1; Z_2 holds η^a θ^b, a <= inner, b <= outer and, if `total`, a + b <= degree."""

    degree: int
    inner: int
    outer: int
    total: bool
    weighted: bool  # Whether g = -η(η+1)

    def kernel_basis(self) -> tuple[Index, Index]:
        """Degrees (in η, in θ) of the members of Z_2."""
        first, second = np.divmod(np.arange((self.inner + 1) * (self.outer + 1), dtype=np.int64), self.outer + 1)
        keep = first + second <= (self.degree if self.total else self.inner + self.outer)
        return first[keep], second[keep]

    @property
    def members(self) -> int:
        """Of Z_1 and Z_2, for each function."""
        return self.degree + 1 + self.kernel_basis()[0].size

    def size(self, space: FormSpace) -> int:
        """Order of the matrix M_g."""
        return space.points + space.functions * self.members

    def labels(self, space: FormSpace) -> Index:
        """The variable behind each row of M_g: points are numbered first, then functions."""
        functions = space.points + np.arange(space.functions, dtype=np.int64)
        return np.concatenate([np.arange(space.points, dtype=np.int64), np.tile(functions, self.members)])


Blocks = tuple[ConeBlock, ConeBlock]
"""Without and with the weight -η(η+1)."""


def cone_blocks(degree: int, rule: DegreeRule) -> Blocks:
    """The two matrices of the cone of degree d >= 1, for every rule but bessel."""

    def block(order: int, weighted: bool) -> ConeBlock:
        inner = 0 if rule is DegreeRule.OUTER else order
        outer = {DegreeRule.OUTER: degree, DegreeRule.INNER: 0, DegreeRule.WIDE: 2 * order}.get(rule, order)
        return ConeBlock(order, inner, outer, rule is DegreeRule.TOTAL, weighted)

    return block(degree, False), block(degree if rule is DegreeRule.WIDE else degree - 1, True)


def required_count(degree: int, rule: DegreeRule) -> int:
    """Legendre coefficients that hold every product in the cone of degree d: the highest is that of g Z_1 Z_1."""
    if rule is DegreeRule.BESSEL:
        return max(degree, 2)  # the multiplier S + (1+η)T has degree one
    return 2 * degree + (3 if rule is DegreeRule.WIDE else 1)


def cone_of(blocks: Blocks, space: FormSpace) -> tuple[scipy.sparse.csr_array, tuple[Index, ...]]:
    """Map from both matrices to the coefficients of their forms, and what stands behind their rows."""
    stacked = scipy.sparse.hstack([cone_map(block, space) for block in blocks], format="csr")
    return stacked, tuple(block.labels(space) for block in blocks)


def cone_map(block: ConeBlock, space: FormSpace) -> scipy.sparse.csr_array:
    """Coefficients of ∫gζᵀMζ as a linear function of vec(M): sparse, shape (space.size, N²), rows symmetric in M.

    M is ordered as ζ: x; then Z_1 by (degree, function); then Z_2 by (member, function).
    """
    size, points, count = block.size(space), space.points, block.degree + 1
    moments = legendre.products(1, count, count, block.weighted)[0]  # ∫g p_a p_b
    triple = legendre.products(space.count, count, count, block.weighted)  # coefficients of g p_a p_b
    function = np.arange(space.functions, dtype=np.int64)
    # Rows p_a(η)u of x and Z_2, u a functional; rows p_a(η)φ of Z_1.
    inner, outer = block.kernel_basis()
    z1 = points + np.arange(count * space.functions)
    rows = np.delete(np.arange(size), z1)
    degree = np.concatenate([np.zeros(points, dtype=np.int64), np.repeat(inner, space.functions)])
    u = np.concatenate([np.arange(points), space.moment(outer[:, None], function).ravel()])
    a, phi = np.repeat(np.arange(count), space.functions), np.tile(function, count)
    both = moments[degree[:, None], degree]
    mixed, local = 2.0 * triple[:, a[:, None], degree], triple[:, a[:, None], a]
    i, j = np.nonzero(both)
    c, m, k = np.nonzero(mixed)
    d, p, q = np.nonzero(local)
    row = np.concatenate([rows[i], rows[k], z1[p]])
    column = np.concatenate([rows[j], z1[m], z1[q]])
    monomial = space.pair(u[i], u[j]), space.pair(u[k], space.moment(c, phi[m])), space.multiplier(d, phi[p], phi[q])
    weights = np.concatenate([both[i, j], mixed[c, m, k], local[d, p, q]]) / 2.0
    # M_pq and M_qp have the same weight.
    where = np.tile(np.concatenate(monomial), 2), np.concatenate([row * size + column, column * size + row])
    matrix = scipy.sparse.coo_array((np.tile(weights, 2), where), shape=(space.size, size * size)).tocsr()
    matrix.eliminate_zeros()
    return matrix


# A small cone inside that of Corollary 2, for cheap programs: positivity by Bessel's inequality.
#
# V = uᵀXu + Σ_i(∫φ_iᵀS_iφ_i - Σ_{c<d} μ_icᵀS_iμ_ic) + Σ_i∫(1+η)φ_iᵀT_iφ_i with X, S_i, T_i ⪰ 0, where μ_ic = ∫p_cφ_i
# and u = (x, μ): the second sum is the energy of φ_i beyond its first d moments. Q has degree d-1 in η, R in both
# arguments, S + (1+η)T degree one. A matrix of order points + d·nK and 2K of order n take the place of two with all
# products of Z_1 and Z_2, in which each such form has matrices, too.


RAMP = (0.5, 0.5 / math.sqrt(3.0))
"""Legendre coefficients of 1+η."""


def cone(space: FormSpace, moments: int, *, ramp: bool) -> tuple[scipy.sparse.csr_array, tuple[Index, ...]]:
    """The form as a linear function of (vec X, vec S_1, .., vec T_1, ..), T only with `ramp`; what each row is."""
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
