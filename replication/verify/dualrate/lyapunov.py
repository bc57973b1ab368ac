"""The stability result of Shao et al., Sec. IV: its steps, P, the constants α₁ … α₄, condition (18), inequality (15).

All norms are spectral; with one input and one output every norm is that of a row or a column.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.linear import between, block, hold, identity, zeros
from replication.verify.algebra.symbolic import IDENTITY, letters, number
from replication.verify.algebra.work import estimate_length, spend_on_products
from replication.verify.dualrate.loop import Loop, Observer, on_paper, pass_period
from replication.verify.kernel import decide, definite, equal, holds, identical, less, semidefinite
from replication.verify.predicate import Says
from replication.verify.reading import integer, matrix, one_of, positive, rational, record, several, sized, symmetric
from replication.verify.statement import Depends, statement
from replication.verify.theorem import Found, require

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
    decide(identical(A @ x + B @ K @ held, first, "the first row of (9) = (10)"))
    second = (A - L @ C) @ xi - L @ (y - C @ x)
    used, whole = (y, second) if case_2 else (predicted, second - L @ (predicted - y))
    decide(identical(A @ xi - L @ (used - C @ zeta), whole, "the second row of (9) = (10)"))


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
    decide(identical(terms, total * V * Vm, "(16) = (17)"))


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
        decide(identical(solution, sampled, f"(3) = (7) in the {derivative} derivative"))


def require_rates() -> None:
    """y' = C A x + C B K ζ_k, K ζ' = K Â ζ + K B K ζ_k + K L C x_k + K L e_p: (1), (3) and (8) with ȳ = C x_k + e_p.

    It holds whatever matrix Â (`guided`) is.
    """
    names = ("A", "guided", "B", "C", "K", "L", "x", "zeta", "first", "held", "gap")
    A, guided, B, C, K, L, x, zeta, first, held, gap = letters(*names)
    u = K @ held
    decide(identical(C @ (A @ x + B @ u), C @ A @ x + C @ B @ K @ held, "the rate of y in (12)"))
    drift = K @ (guided @ zeta + B @ u + L @ (C @ first + gap))
    terms = K @ guided @ zeta + K @ B @ K @ held + K @ L @ C @ first + K @ L @ gap
    decide(identical(drift, terms, "the rate of K ζ in (14)"))


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
        decide(semidefinite(weight * weight * identity(2) - m.transpose() * m, f"the weight {weight} of {signal}"))
    factors = ", ".join(f"{weight} of ‖{term}‖" for term, weight in weights.items())
    return Found(words={"equations": BOUNDS[quantity][1], "factors": factors})


@statement("dualrate.contraction", source="shao", holds=True, says="contraction (22)")
def contraction() -> None:
    """The factor φ of (22) is below one whenever (18) holds: 1 − φ = (1 − E)(1 − c).

    φ = E + (1 − E) c with E = e^{−T/(2 λ_max)} and c the left side of (18). φ < 1 under (18), since 0 < E < 1 for T > 0
    and 0 ≤ c < 1 by (18).
    """
    E, c = map(number, "Ec")
    decide(identical(1 - (E + (1 - E) * c), (1 - E) * (1 - c), "1 − φ = (1 − E)(1 − c)"))


@dataclass(frozen=True, kw_only=True)
class Lyapunov:
    """P of ÃᵀP + P Ã = −I, and balls that hold its smallest and its largest eigenvalue."""

    P: fmpq_mat
    smallest: arb
    largest: arb


def joint_matrix(loop: Loop) -> fmpq_mat:
    """Ã = [A + B K, −B K; 0, A − L C]."""
    n, pushed = loop.order, loop.B * loop.K
    return block([[loop.A + pushed, -pushed], [zeros(n, n), loop.guided]])


def require_solution(loop: Loop, P: fmpq_mat) -> None:
    """Refuse unless P is positive definite and ÃᵀP + P Ã = −I, exactly."""
    joint = joint_matrix(loop)
    decide(
        equal(joint.transpose() * P + P * joint, -identity(2 * loop.order), "P does not solve the Lyapunov equation")
    )
    decide(definite(P, "P"))


def read_lyapunov(value: Any, path: str, loop: Loop) -> Lyapunov:
    """P with its extreme eigenvalues: below by definiteness of P − p I and q I − P, above by Rayleigh quotients."""
    size = 2 * loop.order
    vector = sized(matrix, size, 1)
    readers = {"P": sized(symmetric, size), "low": rational, "high": rational, "least": vector, "most": vector}
    P, low, high, *vectors = record(value, path, readers).values()
    require_solution(loop, P)
    decide(less(0, low, f"{path}.low must be positive"))
    decide(definite(P - low * identity(size), "P − low I"))
    decide(definite(high * identity(size) - P, "high I − P"))
    least, most = (rayleigh(P, vector) for vector in vectors)
    return Lyapunov(P=P, smallest=between(low, least), largest=between(most, high))


def rayleigh(P: fmpq_mat, v: fmpq_mat) -> fmpq:
    """vᵀP v/vᵀv, which lies between the extreme eigenvalues of P."""
    square = (v.transpose() * v)[0, 0]
    require(square != 0, "a vector of the witness is zero")
    return (v.transpose() * P * v)[0, 0] / square


def norm(M: fmpq_mat) -> arb:
    """Spectral norm of a row or a column."""
    require(min(M.nrows(), M.ncols()) == 1, "the norm is that of a row or a column")
    return arb(sum((entry * entry for entry in M.entries()), fmpq(0))).sqrt()


def prediction_constant(loop: Loop, lyapunov: Lyapunov) -> arb:
    """α₃ of (15), as printed."""
    return norm(loop.C * loop.A) / lyapunov.smallest.sqrt()


def condition_per_second(loop: Loop, lyapunov: Lyapunov) -> arb:
    """The left side of (18) over T: α₄ λ_max(P), 1/s, with α₁ of (13), α₂ of (14) and α₄ of (17) as printed."""
    A, B, C, K, L = loop.A, loop.B, loop.C, loop.K, loop.L
    root, prediction = lyapunov.smallest.sqrt(), prediction_constant(loop, lyapunov)
    output = (norm(C * A) + 2 * norm(C * B * K)) / root
    feedback = (2 * norm(K * loop.guided) + 2 * norm(K * B * K) + norm(K * L * C)) / root
    parts = feedback * norm(B) + norm(L) * output + norm(B) * prediction * norm(K * L) + prediction * norm(L)
    return 2 * parts * lyapunov.largest / root * lyapunov.largest


def prediction_sides(loop: Loop, lyapunov: Lyapunov, start: fmpq_mat, longest: fmpq) -> tuple[arb, arb]:
    """Both sides of (15) at t_1 for every period 0 < T ≤ longest at once, from χ(0) = (x, ξ) at a slow instant.

    Left: |y_p(t_1) − y(t_1)| = |C e^{AT} ξ(0)|, by (5) and (6). Right: an upper bound of α₃ √V T with the largest V
    from 0 to t_2 = 2 T, which no V_max of (15) exceeds.
    """
    require(loop.M > 1, "without a second phase there is no virtual measurement")
    n, span = loop.order, between(fmpq(0), longest)
    x, xi = arb_mat(start.tolist()[:n]), arb_mat(start.tolist()[n:])
    passage = pass_period(replace(loop, T=span, M=2), Observer.APO, x, x - xi, lambda _: arb_mat(1, 1))
    first = energy(lyapunov, passage.states[1], passage.used[1])
    largest = first.max(energy(lyapunov, passage.state, passage.estimate))
    gap = (arb_mat(loop.C) * hold(loop.A, loop.B, span)[0] * xi)[0, 0]
    return abs(gap), prediction_constant(loop, lyapunov) * arb(longest) * largest.sqrt()


def energy(lyapunov: Lyapunov, x: arb_mat, zeta: arb_mat) -> arb:
    """V = χᵀP χ."""
    chi = arb_mat(x.tolist() + (x - zeta).tolist())
    return (chi.transpose() * arb_mat(lyapunov.P) * chi)[0, 0]


# Statements on P, on (15) and (18), and on the result itself: a loop that refutes it.


SOLUTION = Depends(lambda values: sized(read_lyapunov, values.plant))


@on_paper(
    "dualrate.lyapunov",
    witness={"P": Depends(lambda values: sized(symmetric, 2 * values.plant.order))},
    holds=True,
    says="Lyapunov equation",
)
def lyapunov(plant: Loop, P: fmpq_mat) -> None:
    """For <the printed data of the plant {plant.name}|this plant> the Lyapunov equation is solved exactly by a positive
    definite matrix.
    """
    require_solution(plant, P)


@on_paper(
    "dualrate.prediction-bound",
    parameters={"longest": positive},
    witness={"lyapunov": SOLUTION, "chi": Depends(lambda values: sized(matrix, 2 * values.plant.order, 1))},
    holds=False,
    says=Says(quantity="bound (15)", setting={}, readings=("elapsed-period",), universal=True),
)
def prediction_bound(plant: Loop, longest: fmpq, lyapunov: Lyapunov, chi: fmpq_mat) -> Found:
    """For the plant {plant.name} and its gains ({plant.data}) (15) holds for no period T up to {longest} s: from
    some χ at a slow instant the error of the next virtual measurement is at least {gap:down}, its bound at most
    {side:up}.
    """
    gap, side = prediction_sides(plant, lyapunov, chi, longest)
    decide(less(side, gap, f"(15) is not proved to fail for all periods up to {longest} s"))
    return Found(words={"gap": gap, "side": side})


@on_paper("dualrate.condition", witness={"lyapunov": SOLUTION}, says="condition (18)")
def condition(plant: Loop, lyapunov: Lyapunov) -> Found:
    """The loop< of the plant {plant.name}|> ({plant.data}, T = {plant.T} s) <{verb} (18), whose left side is|has α₄
    λ_max(P) T, which must be below one, at> {side:down} to {side:up}.
    """
    side = condition_per_second(plant, lyapunov) * arb(plant.T)
    undecided = f"the left side of (18) is {side.str(8)}: not decided"
    met = holds(less(side, 1, undecided))
    if not met:
        decide(less(1, side, undecided))
    return Found(words={"verb": "meets" if met else "does not meet", "side": side}, holds=met)


# The scalar loop A = B = C = 1, L = 2 for all periods at once: with h = e^T − 1 its matrices are rational in h.
#
# Ā = 1 + h, B̄ = h, F = 1/(1 + h), G = h/(1 + h) and H = 2h/(1 + h), so (1 + h)^{2M} det(I − Φ) is a polynomial in h.


H = fmpq_poly([0, 1])
GROWTH = 1 + H
"""e^T."""


def determinant(loop: Loop, ratio: int) -> fmpq_poly:
    """(1 + h)^{2M} det(I − Φ) of the alternating predictive observer, Φ over z = (x, ζ).

    x and ζ at phase k, and what stands for the measurement then, are carried times (1 + h)^k.
    """
    one, L = fmpq(1), loop.L[0, 0]
    shapes = [M.nrows() for M in (loop.A, loop.B, loop.C)]
    unit = shapes == [1, 1, 1] and (loop.A[0, 0], loop.B[0, 0], loop.C[0, 0]) == (one, one, one)
    require(unit and L == 2, "the argument needs A = B = C = 1 and L = 2")
    columns = []
    for x, zeta in ((fmpq_poly([1]), fmpq_poly([0])), (fmpq_poly([0]), fmpq_poly([1]))):
        measured = x
        for k in range(ratio):
            spend_on_products(k + 1, (k + 1) * (estimate_length([loop.K[0, 0]]) + 2), "det(I − Φ)")
            u = loop.K[0, 0] * zeta
            predicted = GROWTH * (GROWTH * zeta + H * u)
            x, zeta = GROWTH * (GROWTH * x + H * u), zeta + H * u + L * H * measured
            measured = predicted
        columns.append((x, zeta))
    (a, c), (b, d) = columns
    scale = GROWTH**ratio
    return (scale - a) * (scale - d) - b * c


def require_negative(polynomial: fmpq_poly, longest: fmpq) -> None:
    """Refuse unless the polynomial in h is negative for all 0 < T ≤ longest.

    With k its lowest power: the positive ones of the other coefficients, at the largest h, do not outweigh the lowest.
    """
    coefficients = polynomial.coeffs()
    lowest = next((k for k, c in enumerate(coefficients) if c != 0), None)
    require(lowest is not None, "det(I − Φ) vanishes for every period")
    reach, low = arb(longest).exp() - 1, lowest or 0
    rest = sum((arb(c).max(arb(0)) * reach**k for k, c in enumerate(coefficients[low + 1 :], 1)), arb(0))
    decide(less(rest, -coefficients[low], f"det(I − Φ) is not proved negative for all periods up to {longest} s"))


LARGEST_RATIO = 100
"""Of a ratio for which det(I − Φ) is expanded for all periods at once."""


@on_paper(
    "dualrate.counterexample",
    parameters={"ratios": sized(several, sized(integer, 2)), "longest": positive},
    witness={"lyapunov": SOLUTION},
    holds=False,
    says=Says(quantity="stability result", setting={}, universal=True),
)
def counterexample(plant: Loop, ratios: list[int], longest: fmpq, lyapunov: Lyapunov) -> Found:
    """The stability result of Sec. IV is false: the loop A = B = C = 1, K = {K}, L = {L} with M = {listed} is unstable
    for every T up to {longest} s; (18) holds for every T below {allowed:down} s and for none from {allowed:up} s.

    det(I − Φ) < 0 means that the characteristic polynomial of Φ is negative at one, so Φ has a real eigenvalue above.
    """
    allowed = 1 / condition_per_second(plant, lyapunov)
    decide(less(allowed, longest, f"(18) may allow periods above {longest} s"))
    require(all(less < more for less, more in pairwise(ratios)), "parameters.ratios must increase")
    require(ratios[-1] <= LARGEST_RATIO, f"parameters.ratios has a ratio above {LARGEST_RATIO}")
    for ratio in ratios:
        require_negative(determinant(plant, ratio), longest)
    listed = ", ".join(map(str, ratios))
    return Found(words={"K": plant.K[0, 0], "L": plant.L[0, 0], "listed": listed, "allowed": allowed})
