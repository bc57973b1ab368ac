"""A Galerkin check of Theorem 1: 𝒫 coercive and the dissipation inequality, on all histories of a given degree.

Both quadratic forms are evaluated from the definition of the operators (8)-(10) on polynomial histories that satisfy
φ_i(0) = e; no code of the cone or of the derivative of its coefficients is used. On this finite-dimensional space the
eigenvalues decide; as the degree grows they bound those of the operators from inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.operators import Operator, injection_operator, resized, storage_operator
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.certificate import Certificate
from replication.estimation.validation import Array, positive_integer


@dataclass(frozen=True)
class GalerkinCheck:
    """Eigenvalues of the two inequalities of Theorem 1 on polynomial histories."""

    storage: float  # Least eigenvalue of 𝒫, which must be positive
    dissipation: float  # Largest eigenvalue of the form, which must not be positive
    scale: float  # Largest coefficient in size, against which rounding is to be seen


def matrix(operator: Operator, count: int) -> Array:
    """⟨ψ, 𝒪φ⟩ on histories with `count` coefficients, ordered (x; φ_1 channel by channel, coefficient last; φ_2 ..)."""
    full = resized(operator, count)
    product = legendre.products(count, operator.count, count, False)
    delays, out, _, into = full.column.shape[0], full.column.shape[1], count, full.row.shape[2]
    local = np.einsum("cad,kija->kicjd", product, operator.multiplier)
    kernel = full.kernel.copy()
    for k in range(delays):
        kernel[k, :, :, k] += local[k]
    points_out, points_in = full.point.shape
    return np.block(
        [
            [full.point, full.row.reshape(points_out, -1)],
            [full.column.reshape(-1, points_in), kernel.reshape(delays * out * count, delays * into * count)],
        ]
    )


def generator(system: DelayPlant, count: int) -> Array:
    """𝒜 on polynomial histories: (x, φ) ↦ (A_0x + ΣA_iφ_i(-1), φ_i'/τ_i), in the order of `matrix`."""
    n, k = system.states, system.delay_count
    size = n + k * n * count
    late = end_values(system, count, -1.0)
    result = np.zeros((size, size))
    result[:n, :n] = system.a0
    for i, a in enumerate(system.a):
        result[:n] += a @ late[i]
    rates = np.kron(np.eye(n), legendre.derivative(count))
    for i, delay in enumerate(system.delays):
        part = slice(n + i * n * count, n + (i + 1) * n * count)
        result[part, part] = rates / delay
    return result


def end_values(system: DelayPlant, count: int, point: float) -> Array:
    """Rows that evaluate φ_i at `point`: shape (K, n, size)."""
    n, k = system.states, system.delay_count
    values = legendre.evaluate(count, point)
    rows = np.zeros((k, n, n + k * n * count))
    for i in range(k):
        start = n + i * n * count
        rows[i, :, start : start + n * count] = np.kron(np.eye(n), values)
    return rows


def measured_histories(system: DelayPlant, count: int) -> Array:
    """𝒞_2 with end values: (x, φ) ↦ (y_0, y_1(-1), .., y_K(-1); y_i), in the order of `matrix`."""
    n, k = system.states, system.delay_count
    size = n + k * n * count
    now = np.hstack([system.c2, np.zeros((system.measurements, size - n))])
    late = [system.c2 @ rows for rows in end_values(system, count, -1.0)]
    spread = np.kron(np.eye(k), np.kron(system.c2, np.eye(count)))
    histories = np.hstack([np.zeros((spread.shape[0], n)), spread])
    return np.vstack([now, *late, histories])


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
    output = np.hstack([system.c10, np.zeros((p, size - n))]) + sum(c @ late[i] for i, c in enumerate(system.c1))
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
    basis = np.block([[np.eye(r + p), np.zeros((r + p, domain.shape[1]))], [np.zeros((size, r + p)), domain]])
    restricted = basis.T @ form @ basis
    return GalerkinCheck(
        storage=float(np.linalg.eigvalsh((storage + storage.T) / 2.0)[0]),
        dissipation=float(np.linalg.eigvalsh((restricted + restricted.T) / 2.0)[-1]),
        scale=float(np.abs(form).max()),
    )
