"""The motor of Shao et al., Sec. V, exactly: torque constant, coordinates, Hurwitz matrices, feedforward."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_poly

from replication.verify.dualrate.loop import Loop, on_loop
from replication.verify.dualrate.response import require_position_form
from replication.verify.kernel import Equal, Hurwitz, decide
from replication.verify.reading import fields, integer, matrix, positive, sequence, sized, text
from replication.verify.says import Says
from replication.verify.statement import statement
from replication.verify.theorem import Found, require

LARGEST_ORDER = 20
"""Of a derivative in the feedforward."""
PARAMETERS = ("R", "Psi", "Lq", "p", "Bw", "J", "KT")


@dataclass(frozen=True)
class Motor:
    """The parameters of the motor by their symbols, and A (3, 3), B (3, 1), C (1, 3)."""

    given: Mapping[str, fmpq]
    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat


def read_motor(value: Any, path: str) -> Motor:
    """The motor of a certificate."""
    _, *values, A, B, C = fields(value, path, "name", *PARAMETERS, "A", "B", "C")
    given = {name: positive(number, f"{path}.{name}") for name, number in zip(PARAMETERS, values, strict=True)}
    return Motor(given, matrix(A, f"{path}.A", 3, 3), matrix(B, f"{path}.B", 3, 1), matrix(C, f"{path}.C", 1, 3))


@statement(
    "dualrate.torque-constant",
    plant=read_motor,
    bound=None,
    says=Says(quantity="torque constant", readings=("surface-magnets",)),
)
def torque_constant(plant: Motor) -> Found:
    """1.5 p Ψ_f is {value} N m/A.

    K_T = 1.5 p Ψ_f of a surface-magnet machine.
    """
    return _computed(fmpq(3, 2) * plant.given["p"] * plant.given["Psi"])


@on_loop("dualrate.slow-period", bound=None, says="slow period")
def slow_period(plant: Loop) -> Found:
    """The sensor's period M T is {value} s.

    T_s = M T.
    """
    return _computed(plant.M * plant.T)


@statement("dualrate.coordinates", source="shao", plant=read_motor, holds=True, says="coordinates of the motor")
def coordinates(plant: Motor) -> None:
    """With x = (θ, ω, ω') the equations (23) with these parameters are those of A, B and C, exactly.

    (23) with z = (i_q, ω, θ), z' = N z + e u_q, and x = S z = (θ, ω, ω'): S N = A S, S e = B and C S z = θ.

    S is invertible, its determinant being −K_T/J.
    """
    R, Psi, Lq, p, Bw, J, KT = (plant.given[name] for name in PARAMETERS)
    N = fmpq_mat([[-R / Lq, -p * Psi / Lq, 0], [KT / J, -Bw / J, 0], [0, 1, 0]])
    S = fmpq_mat([[0, 0, 1], [0, 1, 0], [KT / J, -Bw / J, 0]])
    decide(Equal(S * N, plant.A * S, "A is not that of (23) in these coordinates"))
    decide(Equal(S * fmpq_mat([[1 / Lq], [0], [0]]), plant.B, "B is not that of (23) in these coordinates"))
    decide(Equal((plant.C * S).entries(), [0, 0, 1], "C does not read the position"))


@on_loop("dualrate.hurwitz", parameters={"matrix": text}, holds=True, says="Hurwitz")
def hurwitz(plant: Loop, matrix: str) -> Found:
    """<For the plant {plant.name}, {name}|{name}> is Hurwitz: the Hurwitz determinants of its characteristic polynomial
    are positive.

    All eigenvalues of A + B K (`feedback`) or A − L C (`observer`) have negative real parts.
    """
    matrices = {"feedback": ("A + B K", plant.A + plant.B * plant.K), "observer": ("A − L C", plant.guided)}
    require(matrix in matrices, f"parameters.matrix must be one of {', '.join(matrices)}")
    name, M = matrices[matrix]
    decide(Hurwitz(M, name))
    return Found(words={"name": name})


@on_loop(
    "dualrate.feedforward",
    parameters={"orders": sized(sequence, integer, 3)},
    says=Says(quantity="feedforward inverts the motor", readings=("inverse-feedforward",)),
)
def feedforward(plant: Loop, orders: list[int]) -> Found:
    """The feedforward with derivatives of orders {orders} is {negation}the inverse of the plant, as an identity of
    rational functions.

    Whether (y^(i) + a₂ y^(j) + a₃ y^(k))/b, (i, j, k) = orders, is the input with the output y of the plant.

    The transfer function is C adj(sI − A) B/det(sI − A); a₂, a₃ and b are entries of A and B.
    """
    require(max(orders) <= LARGEST_ORDER, f"parameters.orders must be at most {LARGEST_ORDER}, got {max(orders)}")
    require_position_form(plant)
    factors = (fmpq(1), -plant.A[2, 1], -plant.A[2, 2])
    numerator = sum((_power(order) * factor for order, factor in zip(orders, factors, strict=True)), fmpq_poly([0]))
    inverse = numerator * transfer_numerator(plant) == plant.B[2, 0] * plant.A.charpoly()
    return Found(words={"negation": "" if inverse else "not "}, holds=inverse)


def transfer_numerator(loop: Loop) -> fmpq_poly:
    """C adj(sI − A) B with adj(sI − A) = Σ_k A^k Σ_{j > k} c_j s^{j−1−k}, c the characteristic polynomial of A."""
    coefficients, total, power = loop.A.charpoly().coeffs(), fmpq_poly([0]), loop.B
    for k in range(loop.order):
        total += fmpq_poly(coefficients[k + 1 :]) * (loop.C * power)[0, 0]
        power = loop.A * power
    return total


def _power(order: int) -> fmpq_poly:
    return fmpq_poly([0] * order + [1])


def _computed(value: fmpq) -> Found:
    return Found(words={"value": value}, lower=value, upper=value)
