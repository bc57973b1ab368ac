"""Theorem 4: the inverse of a self-adjoint coercive operator of the form (8), in scaled histories (τ_K = 1).

With Q = H·Z, R = ZᵀΓZ in the Legendre basis Z and K = diag ∫Z S_i⁻¹Zᵀ:
Ĥ = P⁻¹H(KHᵀP⁻¹H - I - KΓ)⁻¹, Γ̂ = -(ĤᵀH + Γ)(I + KΓ)⁻¹, P̂ = (I - ĤKHᵀ)P⁻¹, and Ŝ = S⁻¹ pointwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.delay.operators.pqrs import Operator
from replication.estimation.delay.sos import legendre
from replication.estimation.validation import Array

QUADRATURE = 64
"""Gauss points for the integrals of rational functions S⁻¹; poles keep away from [-1, 0] by coercivity."""


@dataclass(frozen=True)
class Inverse:
    """The parts of the inverse that are matrices; the functions follow from them and from S.

    point (n, n): P̂. h (n, K, n, C): Ĥ. gamma (K, n, C, K, n, C): Γ̂. moment (K, n, C, n, C): the blocks of K.
    """

    operator: Operator
    point: Array
    h: Array
    gamma: Array
    moment: Array


def multiplier_inverse(operator: Operator, points: Array) -> Array:
    """S_i(s)⁻¹ at the points: shape (M, K, n, n). Raises InvalidInputError where S_i is not positive definite."""
    basis = legendre.evaluate(operator.count, points)
    values = np.einsum("tc,kijc->tkij", basis, operator.multiplier)
    least = float(np.linalg.eigvalsh(values).min())
    if least <= 0.0:
        raise InvalidInputError(
            f"S is not positive definite (least eigenvalue {least:.2e}): the operator has no inverse"
        )
    result: Array = np.linalg.inv(values)
    return result


def invert(operator: Operator, quadrature: int = QUADRATURE) -> Inverse:
    """Invert a self-adjoint coercive operator. Raises InvalidInputError if S or P is not positive definite."""
    size, delays, channels, count = operator.row.shape
    if float(np.linalg.eigvalsh(operator.point)[0]) <= 0.0:
        raise InvalidInputError("P is not positive definite: the operator is not coercive; ask for a positive epsilon")
    nodes, weights = legendre.gauss(max(quadrature, 2 * count))
    basis = legendre.evaluate(count, nodes)
    inverse = multiplier_inverse(operator, nodes)
    moment = np.einsum("t,tc,tkij,td->kicjd", weights, basis, inverse, basis, optimize=True)
    width = delays * channels * count
    h = operator.row.reshape(size, width)
    gamma = operator.kernel.reshape(width, width)
    big = np.zeros((delays, channels * count, delays, channels * count))
    for k in range(delays):
        big[k, :, k, :] = moment[k].reshape(channels * count, channels * count)
    diagonal = big.reshape(width, width)
    eye = np.eye(width)
    solved = np.linalg.solve(operator.point, h)
    middle = diagonal @ h.T @ solved - eye - diagonal @ gamma
    hat = np.linalg.solve(middle.T, solved.T).T
    gamma_hat = -np.linalg.solve((eye + diagonal @ gamma).T, (hat.T @ h + gamma).T).T
    point = np.linalg.solve(operator.point.T, (np.eye(size) - hat @ diagonal @ h.T).T).T
    shape = (delays, channels, count)
    return Inverse(
        operator,
        np.asarray(point, dtype=float),
        hat.reshape(size, *shape),
        np.asarray(gamma_hat, dtype=float).reshape(*shape, *shape),
        np.asarray(moment, dtype=float),
    )
