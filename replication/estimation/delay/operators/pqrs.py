"""Operators of the form (8)-(10) with polynomial parts, as an algebra in Legendre coefficients.

An operator maps (x, φ_1..φ_K) ∈ R^mi × L2^ni[-1,0]^K to (y, ψ_1..ψ_K) ∈ R^mo × L2^no[-1,0]^K:
  y = P x + Σ_j ∫Q_j(θ)φ_j(θ)dθ,   ψ_i(s) = G_i(s)x + S_i(s)φ_i(s) + Σ_j ∫R_ij(s,θ)φ_j(θ)dθ.
Histories are scaled to [-1, 0] and the inner product is xᵀy + Σ∫φ_iᵀψ_i. For 𝒫 of (8) divided by τ_K, the parts here
are P, τ_iQ_i(τ_iη), τ_iS_i(τ_iη) and τ_iτ_jR_ij(τ_iη, τ_jθ)/τ_K.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.delay.sos import legendre
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

    def __matmul__(self, other: Operator) -> Operator:
        """The composition self ∘ other, exact: degrees add."""
        return compose(self, other, self.count + other.count - 1)

    def __add__(self, other: Operator) -> Operator:
        """The sum; the shorter expansion is padded with zeros."""
        count = max(self.count, other.count)
        first, second = resized(self, count), resized(other, count)
        return Operator(
            first.point + second.point,
            first.row + second.row,
            first.column + second.column,
            first.multiplier + second.multiplier,
            first.kernel + second.kernel,
        )

    def scaled(self, factor: float) -> Operator:
        """The operator times a number."""
        return Operator(
            factor * self.point,
            factor * self.row,
            factor * self.column,
            factor * self.multiplier,
            factor * self.kernel,
        )


def compose(first: Operator, second: Operator, count: int) -> Operator:
    """first ∘ second with `count` coefficients kept: exact from first.count + second.count - 1 on, else a projection.

    Raises InvalidInputError if the inner dimensions differ.
    """
    if first.point.shape[1] != second.point.shape[0] or first.row.shape[1:3] != second.column.shape[:2]:
        raise InvalidInputError(
            f"operators do not compose: inner sizes {first.point.shape[1]}, {first.row.shape[1:3]} against"
            f" {second.point.shape[0]}, {second.column.shape[:2]}"
        )
    product = legendre.products(count, first.count, second.count, False)
    point = first.point @ second.point + np.einsum("mkic,kicn->mn", *_common(first.row, second.column, (3,), (2,)))
    row = np.einsum("mn,nkic->mkic", first.point, second.row)
    row = _pad(row, count, (3,)) + np.einsum("cab,mkia,kijb->mkjc", product, first.row, second.multiplier)
    inner = np.einsum("mkic,kicljd->mljd", *_common(first.row, second.kernel, (3,), (2,)))
    row = row + _pad(inner, count, (3,))
    column = _pad(np.einsum("kicm,mn->kicn", first.column, second.point), count, (2,))
    column = column + np.einsum("cab,kija,kjbn->kicn", product, first.multiplier, second.column)
    inner = np.einsum("kicljd,ljdn->kicn", *_common(first.kernel, second.column, (5,), (2,)))
    column = column + _pad(inner, count, (2,))
    multiplier = np.einsum("cab,kila,kljb->kijc", product, first.multiplier, second.multiplier)
    kernel = _pad(np.einsum("kicm,mljd->kicljd", first.column, second.row), count, (2, 5))
    left = np.einsum("cab,kina,knbljd->kicljd", product, first.multiplier, second.kernel, optimize=True)
    right = np.einsum("dab,kicnla,nljb->kicnjd", product, first.kernel, second.multiplier, optimize=True)
    both = np.einsum("kicljd,ljdnqe->kicnqe", *_common(first.kernel, second.kernel, (5,), (2,)))
    kernel = kernel + _pad(left, count, (5,)) + _pad(right, count, (2,)) + _pad(both, count, (2, 5))
    return Operator(point, row, column, multiplier, kernel)


def _pad(array: Array, count: int, axes: tuple[int, ...]) -> Array:
    """`array` with `count` entries along each axis: zeros appended, or the highest coefficients dropped."""
    for axis in axes:
        missing = count - array.shape[axis]
        if missing > 0:
            array = np.pad(array, [(0, missing if i == axis else 0) for i in range(array.ndim)])
        elif missing < 0:
            array = np.take(array, np.arange(count), axis=axis)
    return array


def _common(first: Array, second: Array, axes: tuple[int], others: tuple[int]) -> tuple[Array, Array]:
    """Both arrays with the same number of coefficients along the axes that are summed."""
    count = max(first.shape[axes[0]], second.shape[others[0]])
    return _pad(first, count, axes), _pad(second, count, others)


def resized(operator: Operator, count: int) -> Operator:
    """The operator with `count` coefficients: padded, or projected on the first ones."""
    return Operator(
        operator.point,
        _pad(operator.row, count, (3,)),
        _pad(operator.column, count, (2,)),
        _pad(operator.multiplier, count, (3,)),
        _pad(operator.kernel, count, (2, 5)),
    )


def adjoint(operator: Operator) -> Operator:
    """The adjoint for the inner product xᵀy + Σ∫φ_iᵀψ_i."""
    return Operator(
        operator.point.T,
        np.einsum("kicm->mkic", operator.column),
        np.einsum("mkic->kicm", operator.row),
        np.einsum("kijc->kjic", operator.multiplier),
        np.einsum("kicljd->ljdkic", operator.kernel),
    )


def identity(points: int, channels: int, delays: int, count: int = 1) -> Operator:
    """The identity on R^points × L2^channels[-1,0]^delays."""
    multiplier = np.zeros((delays, channels, channels, count))
    multiplier[..., 0] = np.eye(channels)
    return Operator(
        np.eye(points),
        np.zeros((points, delays, channels, count)),
        np.zeros((delays, channels, count, points)),
        multiplier,
        np.zeros((delays, channels, count, delays, channels, count)),
    )


def apply(operator: Operator, point: Array, histories: Array) -> tuple[Array, Array]:
    """The image of (x, φ), φ given by Legendre coefficients (K, ni, C'): y (mo,) and ψ (K, no, C'')."""
    size = histories.shape[-1]
    count = operator.count + size - 1
    product = legendre.products(count, operator.count, size, False)
    row = np.einsum("mkic,kic->m", *_common(operator.row, histories, (3,), (2,)))
    column = np.einsum("kicm,m->kic", operator.column, point)
    inner = np.einsum("kicljd,ljd->kic", *_common(operator.kernel, histories, (5,), (2,)))
    local = np.einsum("cab,kija,kjb->kic", product, operator.multiplier, histories)
    return operator.point @ point + row, local + _pad(column, count, (2,)) + _pad(inner, count, (2,))


def differentiated(operator: Operator) -> Operator:
    """The parts G, S and R differentiated in s, P and Q dropped: ψ ↦ ψ' for the terms that act on constant histories.

    With it, (𝒫(x,φ))' = differentiated(𝒫)(x,φ) + (0, S φ').
    """
    slope = legendre.derivative(operator.count)
    return Operator(
        np.zeros_like(operator.point),
        np.zeros_like(operator.row),
        np.einsum("ca,kiam->kicm", slope, operator.column),
        np.einsum("ca,kija->kijc", slope, operator.multiplier),
        np.einsum("ca,kialjd->kicljd", slope, operator.kernel),
    )


def largest(operator: Operator) -> float:
    """The largest coefficient in size: zero only for the zero operator; the measure of residuals."""
    parts = (operator.point, operator.row, operator.column, operator.multiplier, operator.kernel)
    return max(float(np.abs(part).max(initial=0.0)) for part in parts)


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
