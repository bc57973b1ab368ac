"""Identities of Shao et al. with a letter for every matrix: they hold for any number of states, inputs and outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import identity
from replication.verify.algebra.symbolic import Symbolic, letters, symbols, unit
from replication.verify.algebra.words import one
from replication.verify.kernel import Identity, Nonnegative, decide

ONE = (1, 1)


def require_error_equations() -> None:
    """(9) is (10), entry by entry, with y_p (case 1) and with y (case 2) at t_k."""
    A, B, C, K, L, x, xi, held, y, predicted = letters("A", "B", "C", "K", "L", "x", "xi", "held", "y", "predicted")
    zeta = x - xi
    for used in (predicted, y):
        joint = A @ x + B @ K @ x - B @ K @ xi
        decide(Identity(A @ x + B @ K @ held, joint + B @ K @ (held - zeta), "the first row of (9) = (10)"))
        second = A @ xi - L @ (used - C @ zeta)
        rest = (A - L @ C) @ xi - L @ (y - C @ x) - L @ (used - y)
        decide(Identity(second, rest, "the second row of (9) = (10)"))


def require_second_case() -> None:
    """(9) with ȳ(t_k) = y(t_k) is (10) without its last term."""
    A, B, C, K, L, x, xi, held, y = letters("A", "B", "C", "K", "L", "x", "xi", "held", "y")
    zeta = x - xi
    first = (A + B @ K) @ x - B @ K @ xi + B @ K @ (held - zeta)
    decide(Identity(A @ x + B @ K @ held, first, "the first row of Case 2"))
    second = (A - L @ C) @ xi - L @ (y - C @ x)
    decide(Identity(A @ xi - L @ (y - C @ zeta), second, "the second row of Case 2"))


def require_collected() -> None:
    """The terms of (16), with ‖PB‖ ≤ λ c₁, ‖PL‖ ≤ λ ‖L‖ and ‖χ‖ ≤ √V/r, r = √λ_min: their sum is α₄ √V V_m of (17).

    All factors are non-negative, so that these bounds may be put in their places. Both sides times r.
    """
    names = ("a1", "a2", "a3", "c1", "L", "KL", "most", "V", "Vm")
    a1, a2, a3, c1, L, KL, most, V, Vm = (symbol.entry for symbol in symbols(dict.fromkeys(names, ONE)).values())
    PB, PL = most * c1, most * L
    terms = 2 * a2 * V * PB * Vm + 2 * a1 * V * PL * Vm + 2 * a3 * V * PB * KL * Vm + 2 * a3 * V * PL * Vm
    total = 2 * (a2 * c1 + L * a1 + c1 * a3 * KL + a3 * L) * most
    decide(Identity(Symbolic(((terms,),)), Symbolic(((total * V * Vm,),)), "(16) = (17)"))


def require_sampled_observer() -> None:
    """(7) solves (3): the derivatives at t = 0 of both, which determine them.

    By (3), the derivative k + 1 of z is Â times the derivative k, and Â z + B u + L ȳ for k = 0. By (7), the derivative
    k is F_k ζ + G_k u + H_k ȳ with F_k = Â^k of e^{Ât}, and G_k = F_{k−1} B, H_k = F_{k−1} L of its integral times B
    and L. Both are multiplied by Â for k ≥ 1, so k = 1 and k = 2 settle all.
    """
    A, B, L, zeta, u, y = letters("A", "B", "L", "zeta", "u", "y")
    pushed = B @ u + L @ y
    solution, rate, F = zeta, pushed, unit(1, one())
    for derivative in ("first", "second"):
        solution, rate = A @ solution + rate, pushed * 0
        previous, F = F, A @ F
        decide(
            Identity(
                solution, F @ zeta + previous @ B @ u + previous @ L @ y, f"(3) = (7) in the {derivative} derivative"
            )
        )


def require_rates() -> None:
    """y' = C A x + C B K ζ_k, K ζ' = K Â ζ + K B K ζ_k + K L C x_k + K L e_p: (1), (3) and (8) with ȳ = C x_k + e_p.

    It holds whatever matrix Â (`guided`) is.
    """
    names = ("A", "guided", "B", "C", "K", "L", "x", "zeta", "first", "held", "gap")
    A, guided, B, C, K, L, x, zeta, first, held, gap = letters(*names)
    u = K @ held
    decide(Identity(C @ (A @ x + B @ u), C @ A @ x + C @ B @ K @ held, "the rate of y in (12)"))
    drift = K @ (guided @ zeta + B @ u + L @ (C @ first + gap))
    terms = K @ guided @ zeta + K @ B @ K @ held + K @ L @ C @ first + K @ L @ gap
    decide(Identity(drift, terms, "the rate of K ζ in (14)"))


SIGNALS: Mapping[str, Sequence[int]] = {"x": (1, 0), "zeta": (1, -1)}
"""State and estimate as combinations of (x, ξ)."""


def require_weight(signal: str, weight: fmpq) -> None:
    """Refuse unless |signal| ≤ |weight| |χ| for all χ = (x, ξ): weight² I − mᵀm ⪰ 0, m the map from χ to the signal."""
    m = fmpq_mat([list(SIGNALS[signal])])
    decide(Nonnegative(weight * weight * identity(2) - m.transpose() * m, f"the weight {weight} of {signal}"))


def require_contraction() -> None:
    """1 − φ = (1 − E)(1 − c) with φ = E + (1 − E) c of (22), E = e^{−T/(2 λ_max)} and c the left side of (18)."""
    E, c = (symbol.entry for symbol in symbols({"E": ONE, "c": ONE}).values())
    left, right = 1 - (E + (1 - E) * c), (1 - E) * (1 - c)
    decide(Identity(Symbolic(((left,),)), Symbolic(((right,),)), "1 − φ = (1 − E)(1 − c)"))
