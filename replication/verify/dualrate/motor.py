"""The motor of Shao et al., Sec. V, exactly: torque constant, coordinates, Hurwitz matrices, feedforward."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.decimals import below
from replication.verify.algebra.linear import require_hurwitz
from replication.verify.dualrate.loop import Loop, read_loop
from replication.verify.dualrate.response import require_position_form
from replication.verify.reading import fields, integer, matrix, positive, require_empty, sequence, text
from replication.verify.theorem import Theorem, require

LARGEST_ORDER = 20
"""Of a derivative in the feedforward."""
PARAMETERS = ("R", "Psi", "Lq", "p", "Bw", "J", "KT")


def torque_constant(certificate: Mapping[str, Any]) -> Theorem:
    """K_T = 1.5 p Ψ_f of a surface-magnet machine."""
    require_empty(certificate, "parameters", "witness")
    read, _ = _motor(certificate["plant"])
    value = fmpq(3, 2) * read["p"] * read["Psi"]
    return Theorem(sentence=f"1.5 p Ψ_f is {below(value)} N m/A.", lower=value, upper=value)


def slow_period(certificate: Mapping[str, Any]) -> Theorem:
    """T_s = M T."""
    require_empty(certificate, "parameters", "witness")
    loop = read_loop(certificate["plant"])
    value = loop.M * loop.T
    return Theorem(sentence=f"The sensor's period M T is {below(value)} s.", lower=value, upper=value)


def coordinates(certificate: Mapping[str, Any]) -> Theorem:
    """(23) with z = (i_q, ω, θ), z' = N z + e u_q, and x = S z = (θ, ω, ω'): S N = A S, S e = B and C S z = θ.

    S is invertible, its determinant being −K_T/J.
    """
    require_empty(certificate, "parameters", "bound", "witness")
    read, (A, B, C) = _motor(certificate["plant"])
    R, Psi, Lq, p, Bw, J, KT = (read[name] for name in PARAMETERS)
    N = fmpq_mat([[-R / Lq, -p * Psi / Lq, 0], [KT / J, -Bw / J, 0], [0, 1, 0]])
    S = fmpq_mat([[0, 0, 1], [0, 1, 0], [KT / J, -Bw / J, 0]])
    require(S * N == A * S, "A is not that of (23) in these coordinates")
    require(S * fmpq_mat([[1 / Lq], [0], [0]]) == B, "B is not that of (23) in these coordinates")
    require((C * S).entries() == [0, 0, 1], "C does not read the position")
    return Theorem(
        sentence="With x = (θ, ω, ω') the equations (23) with these parameters are those of A, B and C, exactly.",
        holds=True,
    )


def hurwitz(certificate: Mapping[str, Any]) -> Theorem:
    """All eigenvalues of A + B K (`feedback`) or A − L C (`observer`) have negative real parts."""
    (which,) = fields(certificate["parameters"], "parameters", "matrix")
    require_empty(certificate, "bound", "witness")
    loop = read_loop(certificate["plant"])
    matrices = {"feedback": ("A + B K", loop.A + loop.B * loop.K), "observer": ("A − L C", loop.guided)}
    require(text(which, "parameters.matrix") in matrices, f"parameters.matrix must be one of {', '.join(matrices)}")
    name, M = matrices[which]
    require_hurwitz(M, name)
    return Theorem(sentence=f"{name} is Hurwitz: its Hurwitz determinants are positive.", holds=True)


def feedforward(certificate: Mapping[str, Any]) -> Theorem:
    """Whether (y^(i) + a₂ y^(j) + a₃ y^(k))/b, (i, j, k) = orders, is the input with the output y of the plant.

    The transfer function is C adj(sI − A) B/det(sI − A); a₂, a₃ and b are entries of A and B.
    """
    (given,) = fields(certificate["parameters"], "parameters", "orders")
    require_empty(certificate, "bound", "witness")
    orders = sequence(given, "parameters.orders", integer, 3)
    require(max(orders) <= LARGEST_ORDER, f"parameters.orders must be at most {LARGEST_ORDER}, got {max(orders)}")
    loop = read_loop(certificate["plant"])
    require_position_form(loop)
    factors = (fmpq(1), -loop.A[2, 1], -loop.A[2, 2])
    numerator = sum((_power(order) * factor for order, factor in zip(orders, factors, strict=True)), fmpq_poly([0]))
    inverse = numerator * transfer_numerator(loop) == loop.B[2, 0] * loop.A.charpoly()
    words = (
        f"The feedforward with derivatives of orders {orders} is {'' if inverse else 'not '}the inverse of the plant"
    )
    return Theorem(sentence=f"{words}, as an identity of rational functions.", holds=inverse)


def transfer_numerator(loop: Loop) -> fmpq_poly:
    """C adj(sI − A) B with adj(sI − A) = Σ_k A^k Σ_{j > k} c_j s^{j−1−k}, c the characteristic polynomial of A."""
    coefficients, total, power = loop.A.charpoly().coeffs(), fmpq_poly([0]), loop.B
    for k in range(loop.order):
        total += fmpq_poly(coefficients[k + 1 :]) * (loop.C * power)[0, 0]
        power = loop.A * power
    return total


def _motor(plant: Any) -> tuple[dict[str, fmpq], tuple[fmpq_mat, fmpq_mat, fmpq_mat]]:
    _, *values, A, B, C = fields(plant, "plant", "name", *PARAMETERS, "A", "B", "C")
    read = {name: positive(value, f"plant.{name}") for name, value in zip(PARAMETERS, values, strict=True)}
    return read, (matrix(A, "plant.A", 3, 3), matrix(B, "plant.B", 3, 1), matrix(C, "plant.C", 1, 3))


def _power(order: int) -> fmpq_poly:
    return fmpq_poly([0] * order + [1])


STATEMENTS: Mapping[str, Callable[[Mapping[str, Any]], Theorem]] = {
    "dualrate.torque-constant": torque_constant,
    "dualrate.slow-period": slow_period,
    "dualrate.coordinates": coordinates,
    "dualrate.hurwitz": hurwitz,
    "dualrate.feedforward": feedforward,
}
