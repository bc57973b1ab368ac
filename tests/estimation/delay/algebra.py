"""The algebra of operators of the form (8)-(10): sum, composition, adjoint, image, derivative; an oracle of tests."""

from __future__ import annotations

import numpy as np

from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.operators import (
    QUADRATURE,
    Inverse,
    Operator,
    multiplier_inverse,
    padded,
    resized,
)
from replication.estimation.validation import Array


def parts(operator: Operator) -> tuple[Array, ...]:
    """In the order of its fields."""
    return operator.point, operator.row, operator.column, operator.multiplier, operator.kernel


def add(first: Operator, second: Operator) -> Operator:
    """The sum; the shorter expansion is padded with zeros."""
    count = max(first.count, second.count)
    first, second = resized(first, count), resized(second, count)
    return Operator(*(a + b for a, b in zip(parts(first), parts(second), strict=True)))


def scaled(operator: Operator, factor: float) -> Operator:
    """The operator times a number."""
    return Operator(*(factor * part for part in parts(operator)))


def product(first: Operator, second: Operator) -> Operator:
    """The composition first o second, exact: degrees add."""
    return compose(first, second, first.count + second.count - 1)


def compose(first: Operator, second: Operator, count: int) -> Operator:
    """first ∘ second with `count` coefficients kept: exact from first.count + second.count - 1 on, else a projection.

    Raises ValueError if the inner dimensions differ.
    """
    if first.point.shape[1] != second.point.shape[0] or first.row.shape[1:3] != second.column.shape[:2]:
        raise ValueError(
            f"operators do not compose: inner sizes {first.point.shape[1]}, {first.row.shape[1:3]} against"
            f" {second.point.shape[0]}, {second.column.shape[:2]}"
        )
    triple = legendre.products(count, first.count, second.count, False)
    point = first.point @ second.point + np.einsum("mkic,kicn->mn", *_common(first.row, second.column, (3,), (2,)))
    row = np.einsum("mn,nkic->mkic", first.point, second.row)
    row = padded(row, count, (3,)) + np.einsum("cab,mkia,kijb->mkjc", triple, first.row, second.multiplier)
    inner = np.einsum("mkic,kicljd->mljd", *_common(first.row, second.kernel, (3,), (2,)))
    row = row + padded(inner, count, (3,))
    column = padded(np.einsum("kicm,mn->kicn", first.column, second.point), count, (2,))
    column = column + np.einsum("cab,kija,kjbn->kicn", triple, first.multiplier, second.column)
    inner = np.einsum("kicljd,ljdn->kicn", *_common(first.kernel, second.column, (5,), (2,)))
    column = column + padded(inner, count, (2,))
    multiplier = np.einsum("cab,kila,kljb->kijc", triple, first.multiplier, second.multiplier)
    kernel = padded(np.einsum("kicm,mljd->kicljd", first.column, second.row), count, (2, 5))
    left = np.einsum("cab,kina,knbljd->kicljd", triple, first.multiplier, second.kernel, optimize=True)
    right = np.einsum("dab,kicnla,nljb->kicnjd", triple, first.kernel, second.multiplier, optimize=True)
    both = np.einsum("kicljd,ljdnqe->kicnqe", *_common(first.kernel, second.kernel, (5,), (2,)))
    kernel = kernel + padded(left, count, (5,)) + padded(right, count, (2,)) + padded(both, count, (2, 5))
    return Operator(point, row, column, multiplier, kernel)


def _common(first: Array, second: Array, axes: tuple[int], others: tuple[int]) -> tuple[Array, Array]:
    """Both arrays with the same number of coefficients along the axes that are summed."""
    count = max(first.shape[axes[0]], second.shape[others[0]])
    return padded(first, count, axes), padded(second, count, others)


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
    triple = legendre.products(count, operator.count, size, False)
    row = np.einsum("mkic,kic->m", *_common(operator.row, histories, (3,), (2,)))
    column = np.einsum("kicm,m->kic", operator.column, point)
    inner = np.einsum("kicljd,ljd->kic", *_common(operator.kernel, histories, (5,), (2,)))
    local = np.einsum("cab,kija,kjb->kic", triple, operator.multiplier, histories)
    return operator.point @ point + row, local + padded(column, count, (2,)) + padded(inner, count, (2,))


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
    return max(float(np.abs(part).max(initial=0.0)) for part in parts(operator))


# The inverse of an operator of the form (8) as one of that form again, to be composed with others


def as_operator(inverse: Inverse, count: int, quadrature: int = 2 * QUADRATURE) -> Operator:
    """The inverse with its rational functions projected on `count` Legendre polynomials (converges geometrically)."""
    operator = inverse.operator
    nodes, weights = legendre.gauss(max(quadrature, count + 8))
    fine = legendre.evaluate(count, nodes) * weights[:, None]
    basis = legendre.evaluate(operator.count, nodes)
    s = multiplier_inverse(operator, nodes)
    shape = np.einsum("te,tkij,tc->kiejc", fine, s, basis, optimize=True)  # coefficients of Ŝ p_c, column by column
    row = np.einsum("mkjc,kiejc->mkie", inverse.h, shape, optimize=True)  # S symmetric
    multiplier = np.einsum("te,tkij->kije", fine, s)
    kernel = np.einsum("kiejc,kjclqd,lrfqd->kielrf", shape, inverse.gamma, shape, optimize=True)
    return Operator(inverse.point, row, np.einsum("mkie->kiem", row), multiplier, kernel)
