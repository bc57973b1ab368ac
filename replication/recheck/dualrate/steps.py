"""The steps of the stability result of Shao et al., for all matrices."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from math import factorial
from typing import Any

from replication.recheck.exact import is_semidefinite, minus, nought, plus, scaled, times, turned, unit
from replication.recheck.identities import Draw, same
from replication.recheck.reading import Certificate, Matrix, Proof, need, one_of, positive, take

STATES = 3
"""Of the identities: the size of the example."""

WEIGHTS: Mapping[str, Mapping[str, Matrix]] = {
    "output": {"CA": [[1, 0]], "CBK": [[1, -1]]},
    "feedback": {"KÂ": [[1, -1]], "KBK": [[1, -1]], "KLC": [[1, 0]]},
}
"""By quantity, the matrices of its rate, each with the vector that it multiplies, in terms of x and xi."""


def step_bound(given: Certificate) -> Proof:
    """(12) and (13), or (14): the rate of y or K zeta term by term, each vector at most a weight times |chi|."""
    given.stated()
    take(given.plant, "plant", "name")
    take(given.witness, "witness")
    name, weights = take(given.parameters, "parameters", "quantity", "weights")
    quantity = one_of(name, "quantity", *WEIGHTS)
    vectors = WEIGHTS[quantity]
    for weight, (term, combined) in zip(take(weights, "weights", *vectors), vectors.items(), strict=True):
        above = positive(weight, term)
        short = minus(unit(2, above**2), times(turned(combined), combined))
        need(is_semidefinite(short), f"the weight of {term} is too small")

    def sides(draw: Draw) -> Any:
        n = STATES
        a, b, c, k, gain = (draw.matrix(*size) for size in ((n, n), (n, 1), (1, n), (1, n), (n, 1)))
        x, own, x0, own0, e = (draw.matrix(rows, 1) for rows in (n, n, n, n, 1))
        u, y = times(k, own0), plus(times(c, x0), e)
        if quantity == "output":
            return times(c, plus(times(a, x), times(b, u))), plus(times(c, a, x), times(c, b, k, own0))
        rate = plus(times(minus(a, times(gain, c)), own), times(b, u), times(gain, y))
        terms = times(k, minus(a, times(gain, c)), own), times(k, b, k, own0), times(k, gain, c, x0), times(k, gain, e)
        return times(k, rate), plus(*terms)

    need(same(sides), "the rate has other terms")
    return Proof(holds=True)


def contraction(given: Certificate) -> Proof:
    """1 - phi = (1 - E)(1 - c) for phi = E + (1 - E) c: positive for E and c below one."""
    _bare(given)

    def sides(draw: Draw) -> Any:
        e, c = draw.number(), draw.number()
        return 1 - (e + (1 - e) * c), (1 - e) * (1 - c)

    need(same(sides), "1 - phi is another polynomial")
    return Proof(holds=True)


def _bare(given: Certificate) -> None:
    given.stated()
    take(given.plant, "plant", "name")
    take(given.parameters, "parameters")
    take(given.witness, "witness")


def sampled_observer(given: Certificate) -> Proof:
    """(7) and the solution of (3) have the same derivatives at t = 0.

    That of order j of (3) is hatA times the one before, from the second on; that of (7) is hatA^j zeta + hatA^(j-1)
    (B u + L y), by the series of e^(hatA t) and of its integral. So both pass to the next by hatA.
    """
    _bare(given)

    def sides(draw: Draw) -> Any:
        n = STATES
        a, pushed, own = draw.matrix(n, n), draw.matrix(n, 1), draw.matrix(n, 1)
        solution = [own, plus(times(a, own), pushed)]
        for _ in range(n):
            solution.append(times(a, solution[-1]))
        series, power = [own], unit(n)
        for j in range(1, n + 2):
            # t^j of e^(a t) has the coefficient a^j/j!, and of its integral a^(j-1)/j!.
            integral = scaled(Fraction(1, factorial(j)), power)
            power = times(power, a)
            term = plus(times(scaled(Fraction(1, factorial(j)), power), own), times(integral, pushed))
            series.append(scaled(factorial(j), term))
        return series, solution

    need(same(sides), "the derivatives differ")
    return Proof(holds=True)


def error_equations(given: Certificate) -> Proof:
    """(9) equals (10)."""
    _bare(given)
    need(same(partial(_errors, virtual=True)), "(9) and (10) differ")
    return Proof(holds=True)


def second_case(given: Certificate) -> Proof:
    """(9) with the measurement itself equals (10) without its last term."""
    _bare(given)
    need(same(partial(_errors, virtual=False)), "(9) and (10) without its last term differ")
    return Proof(holds=True)


def _errors(draw: Draw, virtual: bool) -> tuple[Any, Any]:
    """(9) and (10) at a point; virtual: whether y_p(t_k) or y(t_k) is injected."""
    n = STATES
    a, b, c, k, gain = (draw.matrix(*size) for size in ((n, n), (n, 1), (1, n), (1, n), (n, 1)))
    x, own, held, y_held, predicted = (draw.matrix(rows, 1) for rows in (n, n, n, 1, 1))
    xi, fed = minus(x, own), times(b, k)
    injected = predicted if virtual else y_held
    printed = plus(times(a, x), times(fed, held)), minus(times(a, xi), times(gain, minus(injected, times(c, own))))
    above = plus(times(plus(a, fed), x), scaled(-1, times(fed, xi)), times(fed, minus(held, own)))
    wrong = minus(y_held, times(c, x))
    last = minus(predicted, y_held) if virtual else nought(1, 1)
    return printed, (above, minus(times(minus(a, times(gain, c)), xi), times(gain, plus(wrong, last))))


def collected_constant(given: Certificate) -> Proof:
    """The last four terms of (16), with bounds for their norms, are alpha_4 sqrt(V) V_m.

    |P B| is at most |P| c_1, |P L| at most |P| |L|, and |chi| at most sqrt(V)/sqrt(lambda_min); all factors are
    positive or zero, so that the sum is largest with these. The numbers drawn stand for sqrt(lambda_min) and sqrt(V).
    """
    _bare(given)

    def sides(draw: Draw) -> Any:
        a1, a2, a3, c1, injected, both, most, root_least, root_v, v_m = (draw.number() for _ in range(10))
        chi, pb, pl = root_v / root_least, most * c1, most * injected
        terms = (a2 * pb, a1 * pl, a3 * pb * both, a3 * pl)
        a4 = 2 * (a2 * c1 + injected * a1 + c1 * a3 * both + a3 * injected) * most / root_least
        return sum(2 * chi * one * v_m for one in terms), a4 * root_v * v_m

    need(same(sides), "the terms of (16) add up to something else")
    return Proof(holds=True)


CHECKS = {
    "dualrate.step-bound": step_bound,
    "dualrate.contraction": contraction,
    "dualrate.sampled-observer": sampled_observer,
    "dualrate.error-equations": error_equations,
    "dualrate.second-case": second_case,
    "dualrate.collected-constant": collected_constant,
}
