"""The stability result of Shao et al., Sec. IV: P, the constants α₁ … α₄, condition (18) and inequality (15).

All norms are spectral; with one input and one output every norm is that of a row or a column.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.linear import between, block, hold, identity, zeros
from replication.verify.dualrate.loop import Loop
from replication.verify.kernel import Below, Equal, Positive, decide
from replication.verify.reading import fields, matrix, rational, symmetric
from replication.verify.theorem import require


@dataclass(frozen=True, kw_only=True)
class Lyapunov:
    """P of ÃᵀP + P Ã = −I, and balls that hold its smallest and its largest eigenvalue."""

    P: fmpq_mat
    smallest: arb
    largest: arb


@dataclass(frozen=True, kw_only=True)
class Constants:
    """α₁, α₂, α₃ and α₄ of (13), (14), (15) and (17)."""

    output: arb
    feedback: arb
    prediction: arb
    total: arb


def joint_matrix(loop: Loop) -> fmpq_mat:
    """Ã = [A + B K, −B K; 0, A − L C]."""
    n, pushed = loop.order, loop.B * loop.K
    return block([[loop.A + pushed, -pushed], [zeros(n, n), loop.guided]])


def require_solution(loop: Loop, P: fmpq_mat) -> None:
    """Refuse unless P is positive definite and ÃᵀP + P Ã = −I, exactly."""
    joint = joint_matrix(loop)
    decide(
        Equal(joint.transpose() * P + P * joint, -identity(2 * loop.order), "P does not solve the Lyapunov equation")
    )
    decide(Positive(P, "P"))


def read_lyapunov(value: Any, path: str, loop: Loop) -> Lyapunov:
    """P with its extreme eigenvalues: below by definiteness of P − p I and q I − P, above by Rayleigh quotients."""
    P, low, high, least, most = fields(value, path, "P", "low", "high", "least", "most")
    size = 2 * loop.order
    P = symmetric(P, f"{path}.P", size)
    require_solution(loop, P)
    low, high = rational(low, f"{path}.low"), rational(high, f"{path}.high")
    decide(Below(0, low, f"{path}.low must be positive"))
    decide(Positive(P - low * identity(size), "P − low I"))
    decide(Positive(high * identity(size) - P, "high I − P"))
    quotients = [rayleigh(P, matrix(v, f"{path}.{name}", size, 1)) for v, name in ((least, "least"), (most, "most"))]
    return Lyapunov(P=P, smallest=between(low, quotients[0]), largest=between(quotients[1], high))


def rayleigh(P: fmpq_mat, v: fmpq_mat) -> fmpq:
    """vᵀP v/vᵀv, which lies between the extreme eigenvalues of P."""
    square = (v.transpose() * v)[0, 0]
    require(square != 0, "a vector of the witness is zero")
    return (v.transpose() * P * v)[0, 0] / square


def norm(M: fmpq_mat) -> arb:
    """Spectral norm of a row or a column."""
    require(min(M.nrows(), M.ncols()) == 1, "the norm is that of a row or a column")
    return arb(sum((entry * entry for entry in M.entries()), fmpq(0))).sqrt()


def constants(loop: Loop, lyapunov: Lyapunov) -> Constants:
    """α₁ … α₄ as printed."""
    A, B, C, K, L = loop.A, loop.B, loop.C, loop.K, loop.L
    root = lyapunov.smallest.sqrt()
    output = (norm(C * A) + 2 * norm(C * B * K)) / root
    feedback = (2 * norm(K * loop.guided) + 2 * norm(K * B * K) + norm(K * L * C)) / root
    prediction = norm(C * A) / root
    parts = feedback * norm(B) + norm(L) * output + norm(B) * prediction * norm(K * L) + prediction * norm(L)
    return Constants(output=output, feedback=feedback, prediction=prediction, total=2 * parts * lyapunov.largest / root)


def condition_per_second(loop: Loop, lyapunov: Lyapunov) -> arb:
    """The left side of (18) over T: α₄ λ_max(P), 1/s."""
    return constants(loop, lyapunov).total * lyapunov.largest


@dataclass(frozen=True)
class Moment:
    """x, ζ, and the measurement, true or virtual, that the observer goes on with."""

    x: arb_mat
    zeta: arb_mat
    measured: arb_mat


def fast_period(loop: Loop, moment: Moment, time: arb) -> Moment:
    """The alternating predictive loop a time after an instant, with the virtual measurement (6) for the time T."""
    u = arb_mat(loop.K) * moment.zeta
    free, driven = hold(loop.A, loop.B, time)
    guided, pushed = hold(loop.guided, loop.B, time)
    corrected = hold(loop.guided, loop.L, time)[1]
    return Moment(
        free * moment.x + driven * u,
        guided * moment.zeta + pushed * u + corrected * moment.measured,
        arb_mat(loop.C) * (free * moment.zeta + driven * u),
    )


def prediction_sides(loop: Loop, lyapunov: Lyapunov, start: fmpq_mat, longest: fmpq) -> tuple[arb, arb]:
    """Both sides of (15) at t_1 for every period 0 < T ≤ longest at once, from χ(0) = (x, ξ) at a slow instant.

    Left: |y_p(t_1) − y(t_1)| = |C e^{AT} ξ(0)|, by (5) and (6). Right: an upper bound of α₃ √V T with the largest V
    from 0 to t_2 = 2 T, which no V_max of (15) exceeds.
    """
    require(loop.M > 1, "without a second phase there is no virtual measurement")
    n, span = loop.order, between(fmpq(0), longest)
    x, xi = arb_mat(start.tolist()[:n]), arb_mat(start.tolist()[n:])
    first = fast_period(loop, Moment(x, x - xi, arb_mat(loop.C) * x), span)
    second = fast_period(loop, first, span)
    largest = energy(lyapunov, first).max(energy(lyapunov, second))
    gap = (arb_mat(loop.C) * hold(loop.A, loop.B, span)[0] * xi)[0, 0]
    return abs(gap), constants(loop, lyapunov).prediction * arb(longest) * largest.sqrt()


def energy(lyapunov: Lyapunov, moment: Moment) -> arb:
    """V = χᵀP χ."""
    chi = arb_mat(moment.x.tolist() + (moment.x - moment.zeta).tolist())
    return (chi.transpose() * arb_mat(lyapunov.P) * chi)[0, 0]
