"""Statements on the steps of the stability result of Shao et al., Sec. IV."""

from collections.abc import Mapping, Sequence

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import identity
from replication.verify.algebra.symbolic import IDENTITY, letters, number
from replication.verify.kernel import Identity, Nonnegative, decide
from replication.verify.predicate import Says
from replication.verify.reading import one_of, positive, record, sized
from replication.verify.statement import Depends, statement
from replication.verify.theorem import Found

# Identities of Shao et al. with a letter for every matrix: they hold for any number of states, inputs and outputs.


@statement("dualrate.error-equations", source="shao", holds=True, says="equations (9) and (10)")
def error_equations() -> None:
    """(9) equals (10), for all matrices and states of any size.

    With y_p (case 1) and with y (case 2) at t_k.
    """
    require_errors(case_2=False)
    require_errors(case_2=True)


@statement("dualrate.second-case", source="shao", holds=True, says="Case 2")
def second_case() -> None:
    """In Case 2 (9) equals (10) without its last term, for all matrices and states of any size.

    In Case 2 ȳ(t_k) = y(t_k).
    """
    require_errors(case_2=True)


def require_errors(*, case_2: bool) -> None:
    """Refuse unless both rows of (9) are those of (10), in Case 2 without its last term."""
    A, B, C, K, L, x, xi, held, y, predicted = letters("A", "B", "C", "K", "L", "x", "xi", "held", "y", "predicted")
    zeta = x - xi
    first = (A + B @ K) @ x - B @ K @ xi + B @ K @ (held - zeta)
    decide(Identity(A @ x + B @ K @ held, first, "the first row of (9) = (10)"))
    second = (A - L @ C) @ xi - L @ (y - C @ x)
    used, whole = (y, second) if case_2 else (predicted, second - L @ (predicted - y))
    decide(Identity(A @ xi - L @ (used - C @ zeta), whole, "the second row of (9) = (10)"))


@statement("dualrate.collected-constant", source="shao", holds=True, says="constant (17)")
def collected_constant() -> None:
    """The last four terms of (16) add up to at most α₄ √V V_m with the constant of (17), for all loops.

    The terms of (16), with ‖PB‖ ≤ λ c₁, ‖PL‖ ≤ λ ‖L‖ and ‖χ‖ ≤ √V/r, r = √λ_min: their sum is α₄ √V V_m of (17).

    All factors are non-negative, so that these bounds may be put in their places. Both sides times r.
    """
    names = ("a1", "a2", "a3", "c1", "L", "KL", "most", "V", "Vm")
    a1, a2, a3, c1, L, KL, most, V, Vm = map(number, names)
    PB, PL = most * c1, most * L
    terms = 2 * a2 * V * PB * Vm + 2 * a1 * V * PL * Vm + 2 * a3 * V * PB * KL * Vm + 2 * a3 * V * PL * Vm
    total = 2 * (a2 * c1 + L * a1 + c1 * a3 * KL + a3 * L) * most
    decide(Identity(terms, total * V * Vm, "(16) = (17)"))


@statement("dualrate.sampled-observer", source="shao", holds=True, says="equivalent observers")
def sampled_observer() -> None:
    """At the instants (7) has the estimates of (3), for all matrices of any size.

    (7) solves (3): the derivatives at t = 0 of both, which determine them.

    By (3), the derivative k + 1 of z is Â times the derivative k, and Â z + B u + L ȳ for k = 0. By (7), the derivative
    k is F_k ζ + G_k u + H_k ȳ with F_k = Â^k of e^{Ât}, and G_k = F_{k−1} B, H_k = F_{k−1} L of its integral times B
    and L. Both are multiplied by Â for k ≥ 1, so k = 1 and k = 2 settle all.
    """
    A, B, L, zeta, u, y = letters("A", "B", "L", "zeta", "u", "y")
    pushed = B @ u + L @ y
    solution, rate, F = zeta, pushed, IDENTITY
    for derivative in ("first", "second"):
        solution, rate = A @ solution + rate, pushed * 0
        previous, F = F, A @ F
        sampled = F @ zeta + previous @ B @ u + previous @ L @ y
        decide(Identity(solution, sampled, f"(3) = (7) in the {derivative} derivative"))


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


STEPS: Mapping[str, Mapping[str, str]] = {
    "output": {"CA": "x", "CBK": "zeta"},
    "feedback": {"KÂ": "zeta", "KBK": "zeta", "KLC": "x"},
}
"""Terms of (12) and (14) by what their matrix multiplies: the state, or the estimate."""
BOUNDS = {
    "output": ("bounds (12) and (13)", "(12) and (13) hold"),
    "feedback": ("bound (14)", "(14) holds with |e_p(t_k)| (t − t_k) where e_p(t_k) is printed"),
}


@statement(
    "dualrate.step-bound",
    source="shao",
    parameters={
        "quantity": sized(one_of, STEPS),
        "weights": Depends(lambda values: sized(record, dict.fromkeys(STEPS[values.quantity], positive))),
    },
    holds=True,
    says=Says(quantity=lambda parameters: BOUNDS[parameters["quantity"]][0], setting={}),
)
def step_bound(quantity: str, weights: Mapping[str, fmpq]) -> Found:
    """For every loop, all states and every period {equations}, with the factors {factors}.

    (12) and (13), or (14), for all loops: |term| ≤ ‖matrix‖ · weight · |χ| and |χ| ≤ √(V/λ_min(P)), term by term.

    Integrated from t_k to t this is the bound; the term K L e_p, constant over the period, gives ‖K L‖ |e_p| (t − t_k).
    As printed, with e_p for its modulus, (14) fails at t = t_k wherever e_p < 0 and K L is not zero: 0 ≤ ‖K L‖ e_p.
    """
    require_rates()
    for term, weight in weights.items():
        # |signal| ≤ |weight| |χ| for all χ = (x, ξ): weight² I − mᵀm ⪰ 0, m the map from χ to the signal.
        signal = STEPS[quantity][term]
        m = fmpq_mat([list(SIGNALS[signal])])
        decide(Nonnegative(weight * weight * identity(2) - m.transpose() * m, f"the weight {weight} of {signal}"))
    factors = ", ".join(f"{weight} of ‖{term}‖" for term, weight in weights.items())
    return Found(words={"equations": BOUNDS[quantity][1], "factors": factors})


@statement("dualrate.contraction", source="shao", holds=True, says="contraction (22)")
def contraction() -> None:
    """The factor φ of (22) is below one whenever (18) holds: 1 − φ = (1 − E)(1 − c).

    φ = E + (1 − E) c with E = e^{−T/(2 λ_max)} and c the left side of (18). φ < 1 under (18), since 0 < E < 1 for T > 0
    and 0 ≤ c < 1 by (18).
    """
    E, c = map(number, "Ec")
    decide(Identity(1 - (E + (1 - E) * c), (1 - E) * (1 - c), "1 − φ = (1 − E)(1 − c)"))
