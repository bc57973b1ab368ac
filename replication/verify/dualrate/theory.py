"""Statements on the stability result of Shao et al., Sec. IV: its steps, its condition, and a loop that refutes it."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from flint import arb, fmpq, fmpq_mat

from replication.verify.dualrate import identities
from replication.verify.dualrate import lyapunov as equation
from replication.verify.dualrate.loop import Loop, on_loop
from replication.verify.dualrate.lyapunov import Lyapunov, read_lyapunov
from replication.verify.dualrate.scalar import determinant, require_negative
from replication.verify.kernel import Below, decide, holds
from replication.verify.reading import fields, integer, matrix, positive, several, sized, symmetric, text
from replication.verify.says import Says
from replication.verify.statement import Depends, statement
from replication.verify.theorem import Found, require

LARGEST_RATIO = 100
"""Of a ratio for which det(I − Φ) is expanded for all periods at once."""
SOLUTION = Depends(lambda given: sized(read_lyapunov, given.plant))


@statement("dualrate.sampled-observer", source="shao", holds=True, says="equivalent observers")
def sampled_observer() -> None:
    """At the instants (7) has the estimates of (3), for all matrices of any size."""
    identities.require_sampled_observer()


@statement("dualrate.error-equations", source="shao", holds=True, says="equations (9) and (10)")
def error_equations() -> None:
    """(9) equals (10), for all matrices and states of any size."""
    identities.require_error_equations()


@statement("dualrate.second-case", source="shao", holds=True, says="Case 2")
def second_case() -> None:
    """In Case 2 (9) equals (10) without its last term, for all matrices and states of any size."""
    identities.require_second_case()


@statement("dualrate.collected-constant", source="shao", holds=True, says="constant (17)")
def collected_constant() -> None:
    """The last four terms of (16) add up to at most α₄ √V V_m with the constant of (17), for all loops."""
    identities.require_collected()


@on_loop(
    "dualrate.lyapunov",
    source="shao",
    witness={"P": Depends(lambda given: sized(symmetric, 2 * given.plant.order))},
    holds=True,
    says="Lyapunov equation",
)
def lyapunov(plant: Loop, P: fmpq_mat) -> None:
    """For <the printed data of the plant {plant.name}|this plant> the Lyapunov equation is solved exactly by a positive
    definite matrix.

    ÃᵀP + P Ã = −I has a positive definite solution.
    """
    equation.require_solution(plant, P)


STEPS: Mapping[str, Mapping[str, str]] = {
    "output": {"CA": "x", "CBK": "zeta"},
    "feedback": {"KÂ": "zeta", "KBK": "zeta", "KLC": "x"},
}
"""Terms of (12) and (14) by what their matrix multiplies: the state, or the estimate."""


def read_quantity(value: Any, path: str) -> str:
    """One of `STEPS`."""
    name = text(value, path)
    require(name in STEPS, f"{path} must be one of {', '.join(STEPS)}")
    return name


def read_weights(value: Any, path: str, quantity: str) -> dict[str, fmpq]:
    """The weight of each term."""
    terms = STEPS[quantity]
    return {
        term: positive(weight, f"{path}.{term}")
        for term, weight in zip(terms, fields(value, path, *terms), strict=True)
    }


@statement(
    "dualrate.step-bound",
    source="shao",
    parameters={
        "quantity": read_quantity,
        "weights": Depends(lambda given: sized(read_weights, given.quantity)),
    },
    holds=True,
    says=Says(
        quantity=lambda parameters: {"output": "bounds (12) and (13)", "feedback": "bound (14)"}[
            parameters["quantity"]
        ],
        setting={},
    ),
)
def step_bound(quantity: str, weights: Mapping[str, fmpq]) -> Found:
    """For every loop, all states and every period {equations}, with the factors {factors}.

    (12) and (13), or (14), for all loops: |term| ≤ ‖matrix‖ · weight · |χ| and |χ| ≤ √(V/λ_min(P)), term by term.

    Integrated from t_k to t this is the bound; the term K L e_p, constant over the period, gives ‖K L‖ |e_p| (t − t_k).
    As printed, with e_p for its modulus, (14) fails at t = t_k wherever e_p < 0 and K L is not zero: 0 ≤ ‖K L‖ e_p.
    """
    identities.require_rates()
    for term, weight in weights.items():
        identities.require_weight(STEPS[quantity][term], weight)
    equations = {
        "output": "(12) and (13) hold",
        "feedback": "(14) holds with |e_p(t_k)| (t − t_k) where e_p(t_k) is printed",
    }
    factors = ", ".join(f"{weight} of ‖{term}‖" for term, weight in weights.items())
    return Found(words={"equations": equations[quantity], "factors": factors})


@on_loop(
    "dualrate.prediction-bound",
    source="shao",
    parameters={"longest": positive},
    witness={"lyapunov": SOLUTION, "chi": Depends(lambda given: sized(matrix, 2 * given.plant.order, 1))},
    holds=False,
    says=Says(quantity="bound (15)", setting={}, readings=("elapsed-period",), universal=True),
)
def prediction_bound(plant: Loop, longest: fmpq, lyapunov: Lyapunov, chi: fmpq_mat) -> Found:
    """For the plant {plant.name} and its gains ({plant.data}) (15) holds for no period T up to {longest} s: from
    some χ at a slow instant the error of the next virtual measurement is at least {gap:down}, its bound at most
    {side:up}.
    """
    gap, side = equation.prediction_sides(plant, lyapunov, chi, longest)
    decide(Below(side, gap, f"(15) is not proved to fail for all periods up to {longest} s"))
    return Found(words={"gap": gap, "side": side})


@on_loop("dualrate.condition", source="shao", witness={"lyapunov": SOLUTION}, says="condition (18)")
def condition(plant: Loop, lyapunov: Lyapunov) -> Found:
    """The loop< of the plant {plant.name}|> ({plant.data}, T = {plant.T} s) <{verb} (18), whose left side is|has α₄
    λ_max(P) T, which must be below one, at> {side:down} to {side:up}.
    """
    side = equation.condition_per_second(plant, lyapunov) * arb(plant.T)
    undecided = f"the left side of (18) is {side.str(8)}: not decided"
    met = holds(Below(side, 1, undecided))
    if not met:
        decide(Below(1, side, undecided))
    return Found(words={"verb": "meets" if met else "does not meet", "side": side}, holds=met)


@statement("dualrate.contraction", source="shao", holds=True, says="contraction (22)")
def contraction() -> None:
    """The factor φ of (22) is below one whenever (18) holds: 1 − φ = (1 − E)(1 − c).

    φ < 1 under (18), since 0 < E < 1 for T > 0 and 0 ≤ c < 1 by (18).
    """
    identities.require_contraction()


@on_loop(
    "dualrate.counterexample",
    source="shao",
    parameters={"ratios": sized(several, sized(integer, 2)), "longest": positive},
    witness={"lyapunov": SOLUTION},
    holds=False,
    says=Says(quantity="stability result", setting={}, universal=True),
)
def counterexample(plant: Loop, ratios: list[int], longest: fmpq, lyapunov: Lyapunov) -> Found:
    """The stability result of Sec. IV is false: the loop A = B = C = 1, K = {K}, L = {L} with M = {listed} is unstable
    for every T up to {longest} s; (18) holds for every T below {allowed:down} s and for none from {allowed:up} s.

    A loop that is unstable for every period that (18) allows, for each of the ratios M.

    det(I − Φ) < 0 means that the characteristic polynomial of Φ is negative at one, so Φ has a real eigenvalue above.
    """
    allowed = 1 / equation.condition_per_second(plant, lyapunov)
    decide(Below(allowed, longest, f"(18) may allow periods above {longest} s"))
    require(all(less < more for less, more in pairwise(ratios)), "parameters.ratios must increase")
    require(ratios[-1] <= LARGEST_RATIO, f"parameters.ratios has a ratio above {LARGEST_RATIO}")
    for ratio in ratios:
        require_negative(determinant(plant, ratio), longest)
    listed = ", ".join(map(str, ratios))
    return Found(words={"K": plant.K[0, 0], "L": plant.L[0, 0], "listed": listed, "allowed": allowed})
