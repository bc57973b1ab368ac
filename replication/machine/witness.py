"""Witnesses of Coq's checkers from those of certificates: storage with room, and disturbances from rest.

Exact arithmetic, and never trusted: what is wrong here, Coq refuses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isqrt, lcm

from flint import fmpq, fmpq_mat, fmpz

from replication.errors import InfeasibleError
from replication.verify.algebra.linear import block, identity, submatrix, zeros
from replication.verify.multirate.sensing import Sensing, advanced, recurrent

ROOM = range(12, 61, 4)
"""Exponents tried for the room 2^-k that is left in the matrix of Theorem 2."""
MORE_BITS = 24
"""By which a factor is finer than the room."""
LONGEST_WAY = 50
"""Most periods that the way from rest to a steady state may take."""


@dataclass(frozen=True)
class Storage:
    """The matrices (30) are positive definite: F_k F_k' + room I is below each; and above * I is above each P_k."""

    factors: list[fmpq_mat]
    room: fmpq
    above: fmpq


def storage(system: Sensing, P: Sequence[fmpq_mat], gains: Sequence[fmpq_mat], level: fmpq) -> Storage:
    """The factors for gains L_k of the sensors of the system; raises InfeasibleError where there is no room."""
    steps, n = system.error_system(gains), system.order
    weight, wholes = system.W.transpose() * system.W, []
    for k, step in enumerate(steps):
        M, m = P[k] * step, step.ncols() - n
        rest = block([[P[k - 1] - weight, zeros(n, m)], [zeros(m, n), identity(m) * level**2]])
        wholes.append(block([[P[k], M], [M.transpose(), rest]]))
    above = max(sum((abs(entry) for entry in row), fmpq(0)) for matrix in P for row in matrix.tolist())
    for exponent in ROOM:
        room = fmpq(1, 2**exponent)
        factors = [factor(whole - identity(whole.nrows()) * (2 * room), exponent + MORE_BITS) for whole in wholes]
        if all(found is not None for found in factors):
            return Storage([found for found in factors if found is not None], room, above)
    raise InfeasibleError("the matrix of Theorem 2 is not positive definite with room for rounding")


def factor(M: fmpq_mat, bits: int) -> fmpq_mat | None:
    """A lower triangular F in multiples of 2^-bits with F F' about M; None if M is not clearly positive definite."""
    size, one = M.nrows(), 1 << bits
    F = [[0] * size for _ in range(size)]
    for i in range(size):
        for j in range(i + 1):
            scaled = M[i, j] * one * one
            left = int(scaled.p // scaled.q) - sum(F[i][k] * F[j][k] for k in range(j))
            if i == j and left <= 0:
                return None
            F[i][j] = isqrt(left) if i == j else left // F[j][j]
    return fmpq_mat(size, size, [fmpq(entry, one) for row in F for entry in row])


def stacked(system: Sensing, x: fmpq_mat, v: fmpq_mat, phase: int, *, hidden: bool) -> fmpq_mat:
    """Error above disturbance; with the sensor noise that hides the state if it is to be hidden."""
    return block([[x], [v], [system.concealing(phase, x)]] if hidden else [[x], [v]])


def driven_by(system: Sensing, *, hidden: bool) -> list[fmpq_mat]:
    """The steps that a disturbance drives: of the plant if noise hides it, else of the error system of the gains."""
    return [block([[system.A, system.B_d]])] * system.phases if hidden else system.error_system(system.gains)


def cycle(system: Sensing, turn: fmpq_mat, v: Sequence[fmpq_mat], *, hidden: bool) -> tuple[list[fmpq_mat], ...]:
    """One period of the steady state under v_k, turned by `turn` in each; and a way to it from rest."""
    steps, n, m = driven_by(system, hidden=hidden), system.order, v[0].nrows()
    total, forced = identity(n), zeros(n, turn.nrows())
    for step, v_k in zip(steps, v, strict=True):
        total, forced = submatrix(step, range(n), range(n)) * total, advanced(step, forced, v_k)
    first = x = recurrent(total, forced, turn)
    period = []
    for k, (step, v_k) in enumerate(zip(steps, v, strict=True)):
        period.append(stacked(system, x, v_k, k, hidden=hidden))
        x = advanced(step, x, v_k)
    inputs: list[fmpq_mat] = []
    reach = zeros(n, 0)
    while len(inputs) < LONGEST_WAY * system.phases:
        for step in steps:
            A, B = submatrix(step, range(n), range(n)), submatrix(step, range(n), range(n, n + m))
            reach = block([[A * reach, B]])
            inputs.append(step)
        gram = reach * reach.transpose()
        if gram.rank() == n:
            u = reach.transpose() * gram.solve(first)
            chosen = [submatrix(u, range(m * t, m * t + m), range(turn.nrows())) for t in range(len(inputs))]
            return from_rest(system, steps, chosen, 0, hidden=hidden)[:-1], period
    raise InfeasibleError(f"no disturbance leads from rest to the steady state within {LONGEST_WAY} periods")


def from_rest(
    system: Sensing, steps: Sequence[fmpq_mat], v: Sequence[fmpq_mat], start: int, *, hidden: bool
) -> list[fmpq_mat]:
    """Error above disturbance at each instant from 0 on if v_k acts from `start` on; undisturbed at the last one."""
    width = v[0].ncols()
    x = zeros(system.order, width)
    found = [zeros(system.order + system.noises, width)] * start
    for t, v_t in enumerate(v, start):
        found.append(stacked(system, x, v_t, t % system.phases, hidden=hidden))
        x = advanced(steps[t % system.phases], x, v_t)
    return [*found, block([[x], [zeros(system.noises, width)]])]


def common_denominator(matrices: Sequence[fmpq_mat]) -> int:
    """The least common denominator of all entries."""
    return lcm(1, *(int(fmpz(matrix.numer_denom()[1])) for matrix in matrices))
