"""The positive cone of forms V = Σ_g ∫g(η) ζ(η)ᵀM_gζ(η)dη, g ∈ {1, -η(η+1)}, M_g ⪰ 0 (Corollary 2), as a sparse map.

ζ(η) = [x; (Z_1(η)⊗I)φ(η); ∫(Z_2(η,θ)⊗I)φ(θ)dθ]. Every such form is non-negative by construction.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import scipy

from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.forms import FormSpace, Index


class DegreeRule(StrEnum):
    """Which monomials η^a θ^b the basis Z_2 of degree d holds, and the degree of the weighted term (Corollary 2).

    tensor: a, b <= d; total: a + b <= d; inner: a <= d, b = 0; outer: a = 0, b <= d; all with a weighted term of
    degree d-1, so that both terms reach the same degrees; for outer it keeps b <= d. wide: a <= d, b <= 2d, both terms
    of degree d; no strictly feasible point exists, and solvers stop early. bessel: the smaller cone of `bessel` with d
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
    """One matrix M_g: the degree of its bases, the rule for Z_2, and whether g = -η(η+1)."""

    degree: int
    rule: DegreeRule
    weighted: bool

    def kernel_basis(self) -> tuple[Index, Index]:
        """Degrees (in η, in θ) of the members of Z_2."""
        inner = 0 if self.rule is DegreeRule.OUTER else self.degree
        outer = self.degree
        if self.rule is DegreeRule.WIDE:
            outer = 2 * self.degree
        elif self.rule is DegreeRule.OUTER:
            outer = self.degree + self.weighted
        elif self.rule is DegreeRule.INNER:
            outer = 0
        first, second = np.divmod(np.arange((inner + 1) * (outer + 1), dtype=np.int64), outer + 1)
        if self.rule is DegreeRule.TOTAL:
            keep = first + second <= self.degree
            first, second = first[keep], second[keep]
        return first, second

    def size(self, space: FormSpace) -> int:
        """Order of the matrix M_g."""
        return space.points + space.functions * (self.degree + 1 + self.kernel_basis()[0].size)

    def labels(self, space: FormSpace) -> Index:
        """The variable behind each row of M_g: points are numbered first, then functions."""
        members = self.degree + 1 + self.kernel_basis()[0].size
        functions = space.points + np.arange(space.functions, dtype=np.int64)
        return np.concatenate([np.arange(space.points, dtype=np.int64), np.tile(functions, members)])


def cone_blocks(degree: int, rule: DegreeRule) -> tuple[ConeBlock, ConeBlock]:
    """The two matrices of the cone of degree d >= 1, for every rule but bessel."""
    weighted = degree if rule is DegreeRule.WIDE else degree - 1
    return ConeBlock(degree, rule, False), ConeBlock(weighted, rule, True)


def required_count(degree: int, rule: DegreeRule) -> int:
    """Legendre coefficients that hold every product in the cone of degree d: the highest is that of g Z_1 Z_1."""
    if rule is DegreeRule.BESSEL:
        return max(degree, 2)  # the multiplier S + (1+η)T has degree one
    return 2 * degree + (3 if rule is DegreeRule.WIDE else 1)


def cone_map(block: ConeBlock, space: FormSpace) -> scipy.sparse.csr_array:
    """Coefficients of ∫gζᵀMζ as a linear function of vec(M): sparse, shape (space.size, N²), rows symmetric in M.

    M is ordered as ζ: x; then Z_1 by (degree, function); then Z_2 by (member, function).
    """
    size, points, width = block.size(space), space.points, space.functions
    first, second = block.kernel_basis()
    count = block.degree + 1
    moments = legendre.products(1, count, count, block.weighted)[0]  # ∫g p_a p_b
    triple = legendre.products(space.count, count, count, block.weighted)  # coefficients of g p_a p_b
    x = np.arange(points, dtype=np.int64)
    function = np.arange(width, dtype=np.int64)
    z1, z2 = points, points + count * width
    entries: list[tuple[Index, Index, Index, float]] = []  # row of M, column of M, monomial, weight

    def add(rows: Index, columns: Index, monomial: Index, weight: float) -> None:
        shape = np.broadcast_shapes(rows.shape, columns.shape, monomial.shape)
        row, column, target = (np.broadcast_to(part, shape).ravel() for part in (rows, columns, monomial))
        entries.append((row, column, target, weight))

    left, up = function[:, None], function[None, :]
    add(x[:, None], x[None, :], space.pair(x[:, None], x[None, :]), float(moments[0, 0]))
    for a in range(count):
        columns = z1 + a * width + up
        for c in range(space.count):
            # x against Z_1, and Z_1 against Z_1 (the multiplier S). Most weights are zero.
            if triple[c, a, 0]:
                add(x[:, None], columns, space.pair(x[:, None], space.moment(c, up)), 2.0 * float(triple[c, a, 0]))
            for b in np.flatnonzero(triple[c, a]).tolist():
                rows = z1 + b * width + left
                add(rows, columns, space.multiplier(np.int64(c), left, up), float(triple[c, a, b]))  # type: ignore[arg-type]
    for member, (inner, outer) in enumerate(zip(first, second, strict=True)):
        columns = z2 + member * width + up
        target = space.moment(outer, up)
        if moments[0, inner]:
            add(x[:, None], columns, space.pair(x[:, None], target), 2.0 * float(moments[0, inner]))
        for a in range(count):
            for c in np.flatnonzero(triple[:, a, inner]).tolist():
                rows = z1 + a * width + left
                add(rows, columns, space.pair(space.moment(c, left), target), 2.0 * float(triple[c, a, inner]))
        for other in np.flatnonzero(moments[first, inner]).tolist():
            rows = z2 + other * width + left
            weight = float(moments[first[other], inner])
            add(rows, columns, space.pair(space.moment(second[other], left), target), weight)
    return _assemble(entries, space.size, size)


def _assemble(entries: list[tuple[Index, Index, Index, float]], monomials: int, size: int) -> scipy.sparse.csr_array:
    """Sum the entries into a sparse matrix that gives M_pq and M_qp the same weight."""
    rows = np.concatenate([entry[0] for entry in entries])
    columns = np.concatenate([entry[1] for entry in entries])
    target = np.concatenate([entry[2] for entry in entries])
    weights = np.concatenate([np.full(entry[0].size, entry[3] / 2.0) for entry in entries])
    where = (np.concatenate([target, target]), np.concatenate([rows * size + columns, columns * size + rows]))
    matrix = scipy.sparse.coo_array((np.concatenate([weights, weights]), where), shape=(monomials, size * size)).tocsr()
    matrix.sum_duplicates()
    matrix.eliminate_zeros()
    return matrix
