"""Statements on the stability theorem of Shao et al., Sec. IV: its steps, its condition, and a loop that refutes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

from flint import arb

from replication.verify.algebra.decimals import above, below
from replication.verify.dualrate.identities import (
    require_contraction,
    require_error_equations,
    require_rates,
    require_sampled_observer,
    require_weight,
)
from replication.verify.dualrate.loop import LARGEST_RATIO, precisely, read_loop
from replication.verify.dualrate.lyapunov import condition_per_second, prediction_sides, read_lyapunov, require_solution
from replication.verify.dualrate.roots import is_less
from replication.verify.dualrate.scalar import determinant, require_negative
from replication.verify.reading import fields, integer, matrix, positive, require_empty, sequence, symmetric, text
from replication.verify.theorem import Theorem, require


def sampled_observer(certificate: Mapping[str, Any]) -> Theorem:
    """(7) gives the estimates of (3) at the instants."""
    require_empty(certificate, "parameters", "bound", "witness")
    require_sampled_observer()
    return Theorem(
        sentence="Between two instants (7) is the solution of (3), for all matrices of the example's size.", holds=True
    )


def error_equations(certificate: Mapping[str, Any]) -> Theorem:
    """(9) is (10)."""
    require_empty(certificate, "parameters", "bound", "witness")
    require_error_equations()
    return Theorem(sentence="(9) equals (10), for all matrices and states of the example's size.", holds=True)


def lyapunov(certificate: Mapping[str, Any]) -> Theorem:
    """ÃᵀP + P Ã = −I has a positive definite solution."""
    require_empty(certificate, "parameters", "bound")
    (P,) = fields(certificate["witness"], "witness", "P")
    loop = read_loop(certificate["plant"])
    require_solution(loop, symmetric(P, "witness.P", 2 * loop.order))
    return Theorem(sentence="The Lyapunov equation is solved exactly by a positive definite matrix.", holds=True)


STEPS: Mapping[str, Mapping[str, str]] = {
    "output": {"CA": "x", "CBK": "zeta"},
    "feedback": {"KA": "zeta", "KBK": "zeta", "KLC": "x"},
}
"""Terms of (12) and (14) by what their matrix multiplies: the state, or the estimate."""


def step_bound(certificate: Mapping[str, Any]) -> Theorem:
    """(12) and (13), or (14), for all loops: |term| ≤ ‖matrix‖ · weight · |χ| and |χ| ≤ √(V/λ_min(P)), term by term.

    Integrated from t_k to t this is the bound; the term K L e_p of (14) comes with the factor t − t_k, which its
    bound lacks, so that it holds for periods of up to a second.
    """
    quantity, weights, longest = fields(certificate["parameters"], "parameters", "quantity", "weights", "longest")
    require_empty(certificate, "bound", "witness")
    name = text(quantity, "parameters.quantity")
    require(name in STEPS, f"parameters.quantity must be one of {', '.join(STEPS)}")
    terms = STEPS[name]
    given = dict(zip(terms, fields(weights, "parameters.weights", *terms), strict=True))
    require_rates()
    for term, signal in terms.items():
        require_weight(signal, positive(given[term], f"parameters.weights.{term}"))
    until = positive(longest, "parameters.longest")
    require(until <= 1, "beyond one second the term K L e_p may exceed its bound")
    equations = {"output": "(12) and (13) hold", "feedback": f"(14) holds for t − t_k up to {until} s"}
    factors = ", ".join(f"{given[term]} of |{term}|" for term in terms)
    return Theorem(sentence=f"For every loop and all states {equations[name]}, with the factors {factors}.", holds=True)


def prediction_bound(certificate: Mapping[str, Any]) -> Theorem:
    """(15) fails for all periods up to `longest`."""
    (given,) = fields(certificate["parameters"], "parameters", "longest")
    require_empty(certificate, "bound")
    matrices, chi = fields(certificate["witness"], "witness", "lyapunov", "chi")
    loop = read_loop(certificate["plant"])
    longest = positive(given, "parameters.longest")
    found = read_lyapunov(loop, matrices, "witness.lyapunov")
    gap, bound = prediction_sides(loop, found, matrix(chi, "witness.chi", 2 * loop.order, 1), longest)
    require(is_less(bound, gap), f"(15) is not proved to fail for all periods up to {longest} s")
    return Theorem(
        sentence=f"For no period T up to {above(longest)} s does (15) hold: from some χ at a slow instant the error of "
        f"the next virtual measurement is at least {below(gap.lower().fmpq())}, its bound at most "
        f"{above(bound.upper().fmpq())}.",
        holds=False,
    )


def condition(certificate: Mapping[str, Any]) -> Theorem:
    """Whether (18) holds."""
    require_empty(certificate, "parameters", "bound")
    (matrices,) = fields(certificate["witness"], "witness", "lyapunov")
    loop = read_loop(certificate["plant"])
    side = condition_per_second(loop, read_lyapunov(loop, matrices, "witness.lyapunov")) * arb(loop.T)
    holds = is_less(side, 1)
    require(holds or is_less(1, side), f"the left side of (18) is {side.str(8)}: not decided")
    low, high = side.lower().fmpq(), side.upper().fmpq()
    return Theorem(
        sentence=f"The loop {'meets' if holds else 'does not meet'} (18), whose left side is {below(low)} to "
        f"{above(high)}.",
        holds=holds,
    )


def contraction(certificate: Mapping[str, Any]) -> Theorem:
    """φ < 1 under (18), since 0 < E < 1 for T > 0 and 0 ≤ c < 1 by (18)."""
    require_empty(certificate, "parameters", "bound", "witness")
    require_contraction()
    return Theorem(
        sentence="The factor φ of (22) is below one whenever (18) holds: 1 − φ = (1 − E)(1 − c).", holds=True
    )


def counterexample(certificate: Mapping[str, Any]) -> Theorem:
    """A loop that is unstable for every period that (18) allows, for each of the ratios M.

    det(I − Φ) < 0 means that the characteristic polynomial of Φ is negative at one, so Φ has a real eigenvalue above.
    """
    ratios, given = fields(certificate["parameters"], "parameters", "ratios", "longest")
    require_empty(certificate, "bound")
    (matrices,) = fields(certificate["witness"], "witness", "lyapunov")
    loop = read_loop(certificate["plant"])
    longest = positive(given, "parameters.longest")
    allowed = 1 / condition_per_second(loop, read_lyapunov(loop, matrices, "witness.lyapunov"))
    require(is_less(allowed, arb(longest)), f"(18) may allow periods above {longest} s")
    read = sequence(ratios, "parameters.ratios", lambda value, path: integer(value, path, 2))
    require(len(read) > 0, "parameters.ratios is empty")
    require(all(less < more for less, more in pairwise(read)), "parameters.ratios must increase")
    require(read[-1] <= LARGEST_RATIO, f"parameters.ratios has a ratio above {LARGEST_RATIO}")
    for ratio in read:
        require_negative(determinant(loop, ratio), longest)
    return Theorem(
        sentence=f"The stability theorem is false: the loop A = B = C = 1, K = {loop.K[0, 0]}, L = {loop.L[0, 0]} with "
        f"M = {', '.join(map(str, read))} is unstable for every T up to {longest} s; (18) holds for every T below "
        f"{below(allowed.lower().fmpq())} s and for none from {above(allowed.upper().fmpq())} s.",
        holds=False,
    )


STATEMENTS: Mapping[str, Callable[[Mapping[str, Any]], Theorem]] = {
    "dualrate.sampled-observer": sampled_observer,
    "dualrate.error-equations": error_equations,
    "dualrate.lyapunov": lyapunov,
    "dualrate.step-bound": step_bound,
    "dualrate.prediction-bound": precisely(prediction_bound),
    "dualrate.condition": precisely(condition),
    "dualrate.contraction": contraction,
    "dualrate.counterexample": precisely(counterexample),
}
