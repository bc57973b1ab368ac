"""Operators of the form (8)-(10) with polynomial parts, as Legendre coefficients.

An operator maps (x, φ_1..φ_K) ∈ R^mi × L2^ni[-1,0]^K to (y, ψ_1..ψ_K) ∈ R^mo × L2^no[-1,0]^K:
  y = P x + Σ_j ∫Q_j(θ)φ_j(θ)dθ,   ψ_i(s) = G_i(s)x + S_i(s)φ_i(s) + Σ_j ∫R_ij(s,θ)φ_j(θ)dθ.
Histories are scaled to [-1, 0] and the inner product is xᵀy + Σ∫φ_iᵀψ_i. For 𝒫 of (8) divided by τ_K, the parts here
are P, τ_iQ_i(τ_iη), τ_iS_i(τ_iη) and τ_iτ_jR_ij(τ_iη, τ_jθ)/τ_K.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.estimation.validation import Array


@dataclass(frozen=True)
class Operator:
    """Legendre coefficients of the parts, all with the same count C.

    point (mo, mi): P. row (mo, K, ni, C): Q. column (K, no, C, mi): G. multiplier (K, no, ni, C): S.
    kernel (K, no, C, K, ni, C): R, with p_a(s)p_b(θ).
    """

    point: Array
    row: Array
    column: Array
    multiplier: Array
    kernel: Array

    @property
    def count(self) -> int:
        """Number of Legendre coefficients C."""
        return int(self.row.shape[-1])


def padded(array: Array, count: int, axes: tuple[int, ...]) -> Array:
    """`array` with `count` entries along each axis: zeros appended, or the highest coefficients dropped."""
    for axis in axes:
        missing = count - array.shape[axis]
        if missing > 0:
            array = np.pad(array, [(0, missing if i == axis else 0) for i in range(array.ndim)])
        elif missing < 0:
            array = np.take(array, np.arange(count), axis=axis)
    return array


def resized(operator: Operator, count: int) -> Operator:
    """The operator with `count` coefficients: padded, or projected on the first ones."""
    return Operator(
        operator.point,
        padded(operator.row, count, (3,)),
        padded(operator.column, count, (2,)),
        padded(operator.multiplier, count, (3,)),
        padded(operator.kernel, count, (2, 5)),
    )


def self_adjoint(core: Array, multiplier: Array, points: int, delays: int, channels: int) -> Operator:
    """The operator of the form uᵀWu + Σ∫φᵀSφ: `core` W (m + C·nK)², `multiplier` (C, nK, nK), as `FormSpace.split`."""
    count = multiplier.shape[0]
    width = delays * channels
    corner = core[:points, points:].reshape(points, count, delays, channels)
    row = np.einsum("mcki->mkic", corner)
    block = core[points:, points:].reshape(count, delays, channels, count, delays, channels)
    parts = multiplier.reshape(count, delays, channels, delays, channels)
    diagonal = np.stack([parts[:, k, :, k, :] for k in range(delays)])
    assert core.shape[0] == points + count * width
    return Operator(
        core[:points, :points],
        row,
        np.einsum("mkic->kicm", row),
        np.einsum("kcij->kijc", diagonal),
        np.einsum("ckidlj->kicljd", block),
    )
