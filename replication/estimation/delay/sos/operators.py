"""Lemma 5: the gains L_0..L_7 of the observer from the storage operator 𝒫 and the operator 𝒵, as ℒ = 𝒫⁻¹𝒵.

Everything here is in scaled histories y_i(η), η ∈ [-1, 0]. In the units of (9), with s = τ_iη and θ = τ_jη',
L_3i(θ) = values.l3/τ_i and L_7ij(s, θ) = values.l7/τ_j; the other gains keep their values.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.certificate import Certificate
from replication.estimation.delay.sos.cone import FormSpace
from replication.estimation.delay.sos.synthesis import derivative_space, point_offsets, state_space
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

    core (mo + K·no·C, mi + K·ni·C): [P, Q; G, R], histories by delay, channel and coefficient.
    multiplier (K, no, ni, C): S.
    """

    core: Array
    multiplier: Array

    @property
    def count(self) -> int:
        """Number of Legendre coefficients C."""
        return int(self.multiplier.shape[-1])


def self_adjoint(space: FormSpace, coefficients: Array) -> Operator:
    """The operator of a form, whose S couples no two delays."""
    core = np.zeros((space.functionals,) * 2)
    core[np.triu_indices(space.functionals)] = coefficients[: space.pair_count] / 2.0
    local = np.zeros((space.count, space.functions, space.functions))
    local[:, *np.triu_indices(space.functions)] = coefficients[space.pair_count :].reshape(space.count, -1) / 2.0
    core, local = core + core.T, local + local.mT
    functions = np.arange(space.functions)[:, None]
    order = np.concatenate([np.arange(space.points), space.moment(np.arange(space.count), functions).ravel()])
    parts = local.reshape(space.count, space.delays, space.channels, space.delays, space.channels)
    return Operator(core[np.ix_(order, order)], np.einsum("ckikj->kijc", parts))


# The gains: ℒ = 𝒫⁻¹𝒵, column by column. With Q = HZ and R = ZᵀΓZ in the Legendre basis Z, and K = diag ∫ZS_i⁻¹Zᵀ,
# 𝒫(x, φ) = (a, ζ) is Px + Hμ = a and φ = S⁻¹(ζ - Zᵀ(Hᵀx + Γμ)), where μ = ∫Zφ = ∫ZS⁻¹ζ - K(Hᵀx + Γμ).


QUADRATURE = 64
"""Gauss points for the integrals of rational functions S⁻¹; poles keep away from [-1, 0] by coercivity."""


def multiplier_inverse(operator: Operator, points: Array) -> Array:
    """S_i(s)⁻¹ at the points: shape (M, K, n, n). Raises InvalidInputError where S_i is not positive definite."""
    basis = legendre.evaluate(operator.count, points)
    values = np.einsum("tc,kijc->tkij", basis, operator.multiplier)
    least = float(np.linalg.eigvalsh(values).min())
    if least <= 0.0:
        raise InvalidInputError(
            f"S is not positive definite (least eigenvalue {least:.2e}): the operator has no inverse"
        )
    return np.linalg.inv(values)


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

    storage: Operator  # 𝒫
    injection: Operator  # 𝒵, so that the gains are those of 𝒫⁻¹𝒵 (Lemma 5)
    change: Array  # (n, n) Coordinates of the program in those of the plant
    time: float = 1.0  # Unit of time of the program, s


def observer_gains(certificate: Certificate) -> ObserverGains:
    """The operators of a certificate: 𝒫 is self-adjoint, with V = ⟨e, 𝒫e⟩ on R^n × L2^n[-1,0]^K."""
    storage = self_adjoint(state_space(certificate.system, certificate.count), certificate.storage)
    return ObserverGains(storage, _injection(certificate), certificate.change, certificate.time)


def _injection(certificate: Certificate) -> Operator:
    """𝒵 from the coefficients of 2⟨e, 𝒵C_2e⟩: maps (y_0, y_1(-1), .., y_K(-1)) ∈ R^{q(K+1)} and y_i ∈ L2^q."""
    system, count = certificate.system, certificate.count
    n, q, k = system.states, system.measurements, system.delay_count
    space, (_, e, late) = derivative_space(system, count), point_offsets(system)
    whole, at_once = self_adjoint(space, certificate.residual), np.r_[e:late, space.points : space.functionals]
    # Where both sides are measured, each has half of a symmetric coefficient; of end values only one side is.
    share, sensor = np.where(np.arange(n) < n - q, 1.0, 0.5), np.zeros((n, q))
    sensor[n - q :] = np.linalg.inv(system.c2[:, n - q :])
    core = whole.core[at_once]
    core[:, at_once] *= np.concatenate([share, np.tile(np.repeat(share, count), k)])[:, None]
    each = np.kron(np.eye(k), np.kron(sensor, np.eye(count)))
    reading = scipy.linalg.block_diag(np.kron(np.eye(k + 1), sensor), each)
    local = np.einsum("i,kimc,mq->kiqc", share, whole.multiplier, sensor)
    return Operator(core[:, e:] @ reading, local)


def evaluate(gains: ObserverGains, points: Array) -> GainValues:
    """All gains of eq. (9) at points η (M,) of [-1, 0], in the plant's own coordinates and time, 1/s (Lemma 5).

    Raises InvalidInputError if 𝒫 is not coercive.
    """
    storage, z = gains.storage, gains.injection
    (k, n, _, count), q, m = storage.multiplier.shape, z.multiplier.shape[2], len(points)
    P, H, Gamma = storage.core[:n, :n], storage.core[:n, n:], storage.core[n:, n:]
    if float(np.linalg.eigvalsh(P)[0]) <= 0.0:
        raise InvalidInputError("P is not positive definite: the operator is not coercive; ask for a positive epsilon")
    nodes, weights = legendre.gauss(max(QUADRATURE, 2 * count))
    fine, basis = legendre.evaluate(count, nodes), legendre.evaluate(count, points)
    moment = np.einsum("t,tc,tkij,td->kicjd", weights, fine, multiplier_inverse(storage, nodes), fine, optimize=True)
    K = scipy.linalg.block_diag(*moment.reshape(k, n * count, n * count))
    s = multiplier_inverse(storage, points)
    # Columns of 𝒵: y_0 and the end values, then y_j at every point, which acts through W_6 at that point alone as well.
    at_once = np.einsum("tkij,td,kjqd->tkiq", s, basis, z.multiplier, optimize=True)
    sharp = np.einsum("tc,tkiq,kl->kictlq", basis, at_once, np.eye(k)).reshape(len(K), -1)
    at_ends, lines = np.split(z.core, [(k + 1) * q], axis=1)
    spread = np.einsum("rljd,td->rtlj", lines.reshape(-1, k, q, count), basis).reshape(len(lines), -1)
    now, smooth = np.split(np.hstack([at_ends, spread]), [n])
    moved = K @ smooth
    moved[:, -sharp.shape[1] :] += sharp
    whole = np.block([[P, H], [K @ H.T, np.eye(len(K)) + K @ Gamma]])
    x, mu = np.split(np.linalg.solve(whole, np.vstack([now, moved])), [n])
    rest = (smooth - H.T @ x - Gamma @ mu).reshape(k, n, count, -1)
    back = np.linalg.inv(gains.change) / gains.time  # every gain is a rate
    x, phi = back @ x, np.einsum("ij,tkjl,tc,klcr->tkir", back, s, basis, rest, optimize=True)
    points_x, lines_x = np.split(x, [(k + 1) * q], axis=1)
    points_phi, lines_phi = np.split(phi, [(k + 1) * q], axis=3)
    ends, at_ends = points_x.reshape(n, k + 1, q), points_phi.reshape(m, k, n, k + 1, q)
    return GainValues(
        l0=ends[:, 0],
        l2=np.einsum("nkq->knq", ends[:, 1:]),
        l3=np.einsum("ntlq->tlnq", lines_x.reshape(n, m, k, q)),
        l4=at_ends[..., 0, :],
        l5=np.einsum("tkilq->tkliq", at_ends[..., 1:, :]),
        l6=np.einsum("ij,tkjq->tkiq", back, at_once),
        l7=np.einsum("tkiulq->tkuliq", lines_phi.reshape(m, k, n, m, k, q)),
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
    delays, out, into, own = operator.multiplier.shape
    fit = np.eye(count, own)  # appends zeros, or leaves the highest coefficients out
    points = [size - delays * width * own for size, width in zip(operator.core.shape, (out, into), strict=True)]
    left, right = (
        scipy.linalg.block_diag(np.eye(size), np.kron(np.eye(delays * width), fit))
        for size, width in zip(points, (out, into), strict=True)
    )
    local = np.einsum("cad,kija->kicjd", legendre.products(count, own, count, False), operator.multiplier)
    diagonal = scipy.linalg.block_diag(np.zeros(points), *local.reshape(delays, out * count, -1))
    return np.asarray(left @ operator.core @ right.T + diagonal)


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
    operators = observer_gains(certificate)
    storage, injection = (matrix(part, count) for part in (operators.storage, operators.injection))
    rate = storage @ generator(system, count) + injection @ measured_histories(system, count)
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
