"""Identities of Shao et al. with a symbol for every entry, at the size of the example: three states, input, output.

An identity holds iff the difference of its sides is the zero polynomial in these symbols.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import identity, require_positive_semidefinite
from replication.verify.algebra.symbols import add, product, require_equal, scale, symbols

STATES = 3


def require_error_equations() -> None:
    """(9) is (10), entry by entry, with y_p (case 1) and with y (case 2) at t_k."""
    n = STATES
    square, column, row, one = (n, n), (n, 1), (1, n), (1, 1)
    s = symbols(A=square, B=column, C=row, K=row, L=column, x=column, xi=column, held=column, y=one, predicted=one)
    A, B, C, K, L = (s[name] for name in "ABCKL")
    zeta = add(s["x"], scale(-1, s["xi"]))
    guided = add(A, scale(-1, product(L, C)))
    moved = add(s["held"], scale(-1, zeta))
    change = add(s["y"], scale(-1, product(C, s["x"])))
    for used in (s["predicted"], s["y"]):
        first = add(product(A, s["x"]), product(B, K, s["held"]))
        second = add(product(A, s["xi"]), scale(-1, product(L, add(used, scale(-1, product(C, zeta))))))
        joint = add(product(A, s["x"]), product(B, K, s["x"]), scale(-1, product(B, K, s["xi"])))
        require_equal(first, add(joint, product(B, K, moved)), "the first row of (9) = (10)")
        gap = add(used, scale(-1, s["y"]))
        rest = add(product(guided, s["xi"]), scale(-1, product(L, change)), scale(-1, product(L, gap)))
        require_equal(second, rest, "the second row of (9) = (10)")


def require_sampled_observer() -> None:
    """(7) solves (3): the derivatives at t = 0 of both, which determine them.

    By (3), the derivative k + 1 of z is Â times the derivative k, and Â z + B u + L ȳ for k = 0. By (7), the derivative
    k is F_k ζ + G_k u + H_k ȳ with F_k = Â^k of e^{Ât}, and G_k = F_{k−1} B, H_k = F_{k−1} L of its integral times B
    and L. Both are multiplied by Â for k ≥ 1, so k = 1 and k = 2 settle all.
    """
    n = STATES
    s = symbols(A=(n, n), B=(n, 1), L=(n, 1), zeta=(n, 1), u=(1, 1), y=(1, 1))
    A, B, L = s["A"], s["B"], s["L"]
    pushed = add(product(B, s["u"]), product(L, s["y"]))
    solution, rate = s["zeta"], pushed
    F = [[entry * 0 + int(i == j) for j, entry in enumerate(row)] for i, row in enumerate(A)]
    for derivative in ("first", "second"):
        solution = add(product(A, solution), rate)
        rate = scale(0, pushed)
        previous, F = F, product(A, F)
        sampled = add(product(F, s["zeta"]), product(previous, B, s["u"]), product(previous, L, s["y"]))
        require_equal(solution, sampled, f"(3) = (7) in the {derivative} derivative")


def require_rates() -> None:
    """y' = C A x + C B K ζ_k, K ζ' = K Â ζ + K B K ζ_k + K L C x_k + K L e_p: (1), (3) and (8) with ȳ = C x_k + e_p.

    It holds whatever matrix Â (`guided`) is.
    """
    n = STATES
    column, row = (n, 1), (1, n)
    s = symbols(
        A=(n, n),
        guided=(n, n),
        B=column,
        C=row,
        K=row,
        L=column,
        x=column,
        zeta=column,
        first=column,
        held=column,
        gap=(1, 1),
    )
    A, B, C, K, L = (s[name] for name in "ABCKL")
    u = product(K, s["held"])
    speed = product(C, add(product(A, s["x"]), product(B, u)))
    require_equal(speed, add(product(C, A, s["x"]), product(C, B, K, s["held"])), "the rate of y in (12)")
    measured = add(product(C, s["first"]), s["gap"])
    drift = product(K, add(product(s["guided"], s["zeta"]), product(B, u), product(L, measured)))
    terms = (
        product(K, s["guided"], s["zeta"]),
        product(K, B, K, s["held"]),
        product(K, L, C, s["first"]),
        product(K, L, s["gap"]),
    )
    require_equal(drift, add(*terms), "the rate of K ζ in (14)")


SIGNALS: Mapping[str, Sequence[int]] = {"x": (1, 0), "zeta": (1, -1)}
"""State and estimate as combinations of (x, ξ)."""


def require_weight(signal: str, weight: fmpq) -> None:
    """Refuse unless |signal| ≤ |weight| |χ| for all χ = (x, ξ): weight² I − mᵀm ⪰ 0, m the map from χ to the signal."""
    m = fmpq_mat([list(SIGNALS[signal])])
    require_positive_semidefinite(weight * weight * identity(2) - m.transpose() * m, f"the weight {weight} of {signal}")


def require_contraction() -> None:
    """1 − φ = (1 − E)(1 − c) with φ = E + (1 − E) c of (22), E = e^{−T/(2 λ_max)} and c the left side of (18)."""
    E, c = (entry for row in symbols(e=(1, 2))["e"] for entry in row)
    require_equal([[1 - (E + (1 - E) * c)]], [[(1 - E) * (1 - c)]], "1 − φ = (1 − E)(1 − c)")
