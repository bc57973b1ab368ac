"""Lemma 5: the gains L_0..L_7 of the observer from the storage operator 𝒫 and the operator 𝒵, ℒ = 𝒫⁻¹𝒵.

Everything here is in scaled histories y_i(η), η ∈ [-1, 0]. In the units of (9), with s = τ_iη and θ = τ_jη',
L_3i(θ) = values.l3/τ_i and L_7ij(s, θ) = values.l7/τ_j; the other gains keep their values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import legendre, lie
from replication.estimation.delay.sos.certificate import Certificate
from replication.estimation.validation import Array, positive_integer

# Operators of the form (8)-(10) with polynomial parts, as Legendre coefficients.
#
# An operator maps (x, φ_1..φ_K) ∈ R^mi × L2^ni[-1,0]^K to (y, ψ_1..ψ_K) ∈ R^mo × L2^no[-1,0]^K:
#   y = P x + Σ_j ∫Q_j(θ)φ_j(θ)dθ,   ψ_i(s) = G_i(s)x + S_i(s)φ_i(s) + Σ_j ∫R_ij(s,θ)φ_j(θ)dθ.
# Histories are scaled to [-1, 0] and the inner product is xᵀy + Σ∫φ_iᵀψ_i. For 𝒫 of (8) divided by τ_K, the parts here
# are P, τ_iQ_i(τ_iη), τ_iS_i(τ_iη) and τ_iτ_jR_ij(τ_iη, τ_jθ)/τ_K.


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


# Theorem 4: the inverse of a self-adjoint coercive operator of the form (8), in scaled histories (τ_K = 1).
#
# With Q = H·Z, R = ZᵀΓZ in the Legendre basis Z and K = diag ∫Z S_i⁻¹Zᵀ:
# Ĥ = P⁻¹H(KHᵀP⁻¹H - I - KΓ)⁻¹, Γ̂ = -(ĤᵀH + Γ)(I + KΓ)⁻¹, P̂ = (I - ĤKHᵀ)P⁻¹, and Ŝ = S⁻¹ pointwise.


QUADRATURE = 64
"""Gauss points for the integrals of rational functions S⁻¹; poles keep away from [-1, 0] by coercivity."""


@dataclass(frozen=True)
class Inverse:
    """The parts of the inverse that are matrices; the functions follow from them and from S.

    point (n, n): P̂. h (n, K, n, C): Ĥ. gamma (K, n, C, K, n, C): Γ̂.
    """

    operator: Operator
    point: Array
    h: Array
    gamma: Array


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


def invert(operator: Operator) -> Inverse:
    """Invert a self-adjoint coercive operator. Raises InvalidInputError if S or P is not positive definite."""
    size, delays, channels, count = operator.row.shape
    if float(np.linalg.eigvalsh(operator.point)[0]) <= 0.0:
        raise InvalidInputError("P is not positive definite: the operator is not coercive; ask for a positive epsilon")
    nodes, weights = legendre.gauss(max(QUADRATURE, 2 * count))
    basis = legendre.evaluate(count, nodes)
    inverse = multiplier_inverse(operator, nodes)
    moment = np.einsum("t,tc,tkij,td->kicjd", weights, basis, inverse, basis, optimize=True)
    width = delays * channels * count
    h, gamma = operator.row.reshape(size, width), operator.kernel.reshape(width, width)
    diagonal = scipy.linalg.block_diag(*moment.reshape(delays, channels * count, channels * count))
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
    )


@dataclass(frozen=True)
class GainValues:
    """Gains of eq. (9) at M points of [-1, 0], in 1/s; [s, i, j] names point, delay and delay of y."""

    l0: Array  # (n, q) L_0
    l2: Array  # (K, n, q) L_2
    l3: Array  # (M, K, n, q) L_3
    l4: Array  # (M, K, n, q) L_4
    l5: Array  # (M, K, K, n, q) L_5, [s, i, j]
    l6: Array  # (M, K, n, q) L_6
    l7: Array  # (M, K, M', K, n, q) L_7, [s, i, θ, j]


@dataclass(frozen=True)
class ObserverGains:
    """The operators behind the gains, for x' = change·x and t' = t/time; `evaluate` gives them in the plant's units."""

    inverse: Inverse  # 𝒫⁻¹ (Theorem 4)
    injection: Operator  # 𝒵, so that the gains are those of 𝒫⁻¹𝒵 (Lemma 5)
    change: Array  # (n, n) Coordinates of the program in those of the plant
    gamma: float  # The level that they prove
    time: float = 1.0  # Unit of time of the program, s


def observer_gains(certificate: Certificate) -> ObserverGains:
    """The operators 𝒫⁻¹ and 𝒵 of a certificate, by Theorem 4; raises InvalidInputError if 𝒫 is not coercive."""
    return ObserverGains(
        invert(storage_operator(certificate)),
        injection_operator(certificate),
        certificate.change,
        certificate.gamma,
        certificate.time,
    )


def storage_operator(certificate: Certificate) -> Operator:
    """𝒫 with V = ⟨e, 𝒫e⟩, as a self-adjoint operator on R^n × L2^n[-1,0]^K."""
    system = certificate.system
    space = lie.state_space(system, certificate.count)
    return self_adjoint(*space.split(certificate.storage), system.states, system.delay_count, system.states)


def injection_operator(certificate: Certificate) -> Operator:
    """𝒵 from the coefficients of 2⟨e, 𝒵C_2e⟩: maps (y_0, y_1(-1), .., y_K(-1)) ∈ R^{q(K+1)} and y_i ∈ L2^q."""
    system, count = certificate.system, certificate.count
    n, q, k = system.states, system.measurements, system.delay_count
    space = lie.derivative_space(system, count)
    _, e, late = lie.point_offsets(system)
    whole = self_adjoint(*space.split(certificate.residual), space.points, k, n)
    measured = (np.arange(n) >= n - q).astype(float)
    weight = measured * (1.0 - measured[:, None] / 2.0)  # the share of a symmetric coefficient that a column takes
    now = slice(e, e + n)
    point = np.zeros((n, k + 1, n))
    point[:, 0] = whole.point[now, now] * weight
    point[:, 1:] = whole.point[now, late:].reshape(n, k, n)
    row = whole.row[now] * weight[:, None, :, None]
    column = np.zeros((k, n, count, k + 1, n))
    column[..., 0, :] = whole.column[..., now] * weight[None, :, None, :]
    column[..., 1:, :] = whole.column[..., late:].reshape(k, n, count, k, n)
    multiplier = whole.multiplier * weight[None, :, :, None]
    kernel = whole.kernel * weight[None, :, None, None, :, None]
    sensor = np.linalg.inv(system.c2[:, n - q :])
    return Operator(
        np.einsum("nkm,mq->nkq", point[..., n - q :], sensor).reshape(n, (k + 1) * q),
        np.einsum("nkmc,mq->nkqc", row[:, :, n - q :], sensor),
        np.einsum("kiclm,mq->kiclq", column[..., n - q :], sensor).reshape(k, n, count, (k + 1) * q),
        np.einsum("kimc,mq->kiqc", multiplier[:, :, n - q :], sensor),
        np.einsum("kiclmd,mq->kiclqd", kernel[..., n - q :, :], sensor),
    )


def evaluate(gains: ObserverGains, points: Array) -> GainValues:
    """All gains of eq. (9) at points η (M,) of [-1, 0], in the plant's own coordinates and time, 1/s (Lemma 5)."""
    inverse, z = gains.inverse, gains.injection
    n, k, q = inverse.h.shape[0], inverse.h.shape[1], z.row.shape[2]
    basis = legendre.evaluate(inverse.operator.count, points)
    tests = legendre.evaluate(z.count, points)
    s = multiplier_inverse(inverse.operator, points)
    fine_nodes, fine_weights = legendre.gauss(max(64, 2 * z.count))
    s_fine = multiplier_inverse(inverse.operator, fine_nodes)
    fine = legendre.evaluate(inverse.operator.count, fine_nodes)
    fine_tests = legendre.evaluate(z.count, fine_nodes)
    # T_i: ∫Z Ŝ_i Zᵀ, between the basis of the inverse and the basis of 𝒵.
    moment = np.einsum("t,tc,tkij,td->kicjd", fine_weights, fine, s_fine, fine_tests, optimize=True)
    pulled = np.einsum("kicjd,kjdp->kicp", moment, z.column)
    point = inverse.point @ z.point + np.einsum("mkic,kicp->mp", inverse.h, pulled)
    local = np.einsum("tc,tkij,td,kjqd->tkicq", basis, s, tests, z.multiplier, optimize=True)  # V_j(θ)W_6j
    kernel_at = np.einsum("kicljd,td->kictlj", z.kernel, tests)
    pulled_kernel = np.einsum("kicjd,kjdtlq->kictlq", moment, kernel_at)
    l3 = (
        np.einsum("mn,nljd,td->tlmj", inverse.point, z.row, tests, optimize=True)
        + np.einsum("mlic,tlicq->tlmq", inverse.h, local)
        + np.einsum("mkic,kictlq->tlmq", inverse.h, pulled_kernel)
    )
    inner = np.einsum("mkic,mp->kicp", inverse.h, z.point) + np.einsum("kicljd,ljdp->kicp", inverse.gamma, pulled)
    columns = np.einsum("tkij,tc,kjcp->tkip", s, basis, inner, optimize=True)
    columns += np.einsum("tkij,td,kjdp->tkip", s, tests, z.column, optimize=True)
    kernel = (
        np.einsum("mkic,mljd,td->kictlj", inverse.h, z.row, tests, optimize=True)
        + np.einsum("kicljd,tljdq->kictlq", inverse.gamma, local, optimize=True)
        + np.einsum("kicnjd,njdtlq->kictlq", inverse.gamma, pulled_kernel, optimize=True)
    )
    l7 = np.einsum("tkij,tc,kjculq->tkiulq", s, basis, kernel, optimize=True)
    l7 = l7 + np.einsum("tkij,td,kjdulq->tkiulq", s, tests, kernel_at, optimize=True)
    l6 = np.einsum("tkij,td,kjqd->tkiq", s, tests, z.multiplier, optimize=True)
    back = np.linalg.inv(gains.change) / gains.time  # every gain is a rate
    split = (back @ point).reshape(n, k + 1, q)
    ends = np.einsum("ij,tkjp->tkip", back, columns).reshape(len(points), k, n, k + 1, q)
    return GainValues(
        l0=split[:, 0],
        l2=np.einsum("nkq->knq", split[:, 1:]),
        l3=np.einsum("ij,tljq->tliq", back, l3),
        l4=ends[..., 0, :],
        l5=np.einsum("tkilq->tkliq", ends[..., 1:, :]),
        l6=np.einsum("ij,tkjq->tkiq", back, l6),
        l7=np.einsum("ij,tkjulq->tkuliq", back, l7),
    )


# A Galerkin check of Theorem 1: 𝒫 coercive and the dissipation inequality, on all histories of a given degree.
#
# Both quadratic forms are evaluated from the definition of the operators (8)-(10) on polynomial histories that satisfy
# φ_i(0) = e; no code of the cone or of the derivative of its coefficients is used. On this finite-dimensional space the
# eigenvalues decide; as the degree grows they bound those of the operators from inside.


@dataclass(frozen=True)
class GalerkinCheck:
    """Eigenvalues of the two inequalities of Theorem 1 on polynomial histories."""

    storage: float  # Least eigenvalue of 𝒫, which must be positive
    dissipation: float  # Largest eigenvalue of the form, which must not be positive
    scale: float  # Largest coefficient in size, against which rounding is to be seen


def matrix(operator: Operator, count: int) -> Array:
    """⟨ψ, 𝒪φ⟩ on histories with `count` coefficients, ordered (x; φ_1 channel by channel, coefficient last; φ_2 ..)."""
    fit = np.eye(count, operator.count)  # appends zeros, or leaves the highest coefficients out
    delays, out = operator.column.shape[:2]
    row, column = operator.row @ fit.T, np.einsum("kicm,ac->kiam", operator.column, fit)
    kernel = np.einsum("kicljd,ac,bd->kialjb", operator.kernel, fit, fit, optimize=True)
    product = legendre.products(count, operator.count, count, False)
    for k, local in enumerate(np.einsum("cad,kija->kicjd", product, operator.multiplier)):
        kernel[k, :, :, k] += local
    points_out, points_in = operator.point.shape
    return np.block(
        [
            [operator.point, row.reshape(points_out, -1)],
            [column.reshape(-1, points_in), kernel.reshape(delays * out * count, -1)],
        ]
    )


def generator(system: DelayPlant, count: int) -> Array:
    """𝒜 on polynomial histories: (x, φ) ↦ (A_0x + ΣA_iφ_i(-1), φ_i'/τ_i), in the order of `matrix`."""
    n, k = system.states, system.delay_count
    rates = np.kron(np.eye(k * n), legendre.derivative(count)) / np.repeat(system.delays, n * count)[:, None]
    result: Array = scipy.linalg.block_diag(system.a0, rates)
    for a, late in zip(system.a, end_values(system, count, -1.0), strict=True):
        result[:n] += a @ late
    return result


def end_values(system: DelayPlant, count: int, point: float) -> Array:
    """Rows that evaluate φ_i at `point`: shape (K, n, size)."""
    n, k = system.states, system.delay_count
    rows = np.kron(np.eye(k * n), legendre.evaluate(count, point))
    return np.hstack([np.zeros((k * n, n)), rows]).reshape(k, n, -1)


def measured_histories(system: DelayPlant, count: int) -> Array:
    """𝒞_2 with end values: (x, φ) ↦ (y_0, y_1(-1), .., y_K(-1); y_i), in the order of `matrix`."""
    q, each = system.measurements, np.kron(np.eye(system.delay_count), np.kron(system.c2, np.eye(count)))
    whole = scipy.linalg.block_diag(system.c2, each)
    return np.vstack([whole[:q], *(system.c2 @ end_values(system, count, -1.0)), whole[q:]])


def check(certificate: Certificate, degree: int = 12) -> GalerkinCheck:
    """Both inequalities of a certificate on polynomial histories up to `degree`: there the eigenvalues decide."""
    count = positive_integer("degree", degree) + 1
    system = certificate.system
    n, r, p = system.states, system.inputs, system.outputs
    storage = matrix(storage_operator(certificate), count)
    injection = matrix(injection_operator(certificate), count) @ measured_histories(system, count)
    rate = storage @ generator(system, count) + injection
    late = end_values(system, count, -1.0)
    size = storage.shape[0]
    output = np.pad(system.c10, ((0, 0), (0, size - n))) + sum(c @ late[i] for i, c in enumerate(system.c1))
    drive = -storage[:, :n] @ system.b
    gamma = certificate.gamma
    form = np.block(
        [
            [-gamma * np.eye(r), np.zeros((r, p)), drive.T],
            [np.zeros((p, r)), -gamma * np.eye(p), output],
            [drive, output.T, rate + rate.T],
        ]
    )
    # The domain of 𝒜: φ_i(0) = x for every delay.
    now = end_values(system, count, 0.0)
    meet = np.vstack([rows - np.eye(n, size) for rows in now])
    domain = np.linalg.svd(meet)[2][meet.shape[0] :].T
    basis = scipy.linalg.block_diag(np.eye(r + p), domain)
    restricted = basis.T @ form @ basis
    return GalerkinCheck(
        storage=float(np.linalg.eigvalsh((storage + storage.T) / 2.0)[0]),
        dissipation=float(np.linalg.eigvalsh((restricted + restricted.T) / 2.0)[-1]),
        scale=float(np.abs(form).max()),
    )
