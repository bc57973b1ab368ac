"""The stability theorem of Shao et al., its steps, and a loop that refutes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import factorial
from typing import Any

from replication.recheck.dualrate.loop import Loop, read_loop
from replication.recheck.dualrate.scalar import margin
from replication.recheck.exact import (
    blocks,
    is_positive,
    is_semidefinite,
    minus,
    nought,
    part,
    plus,
    scaled,
    squares,
    times,
    turned,
    unit,
)
from replication.recheck.identities import Draw, same
from replication.recheck.interval import Interval, exponential, largest
from replication.recheck.reading import (
    Certificate,
    Matrix,
    Proof,
    count,
    matrix,
    need,
    one_of,
    positive,
    several,
    symmetric,
    take,
)

STATES = 3
"""Of the identities: the size of the example."""


def joint(loop: Loop) -> Matrix:
    """The matrix of (10): [A + B K, -B K; 0, A - L C]."""
    fed = times(loop.B, loop.K)
    return blocks([[plus(loop.A, fed), scaled(-1, fed)], [nought(len(fed), len(fed)), loop.guided]])


def require_solution(loop: Loop, p: Matrix) -> None:
    """Refuse unless P > 0 solves the Lyapunov equation with -I."""
    a = joint(loop)
    need(plus(times(turned(a), p), times(p, a)) == unit(len(a), Fraction(-1)), "the Lyapunov equation does not hold")
    need(is_positive(p), "P is not positive")


def lyapunov(given: Certificate) -> Proof:
    """The Lyapunov equation has a positive definite solution."""
    given.stated()
    take(given.parameters, "parameters")
    (p,) = take(given.witness, "witness", "P")
    loop = read_loop(given.plant)
    require_solution(loop, symmetric(p, "P", 2 * len(loop.A)))
    return Proof(holds=True)


@dataclass(frozen=True)
class Storage:
    """P and its extreme eigenvalues, enclosed."""

    P: Matrix
    least: Interval
    most: Interval


def read_storage(loop: Loop, value: Any) -> Storage:
    """P with p and q such that p I < P < q I, and vectors whose Rayleigh quotients come near."""
    p, low, high, least, most = take(value, "lyapunov", "P", "low", "high", "least", "most")
    size = 2 * len(loop.A)
    storage = symmetric(p, "P", size)
    require_solution(loop, storage)
    below, above = positive(low, "low"), positive(high, "high")
    need(is_positive(minus(storage, unit(size, below))), "low is not below the eigenvalues")
    need(is_positive(minus(unit(size, above), storage)), "high is not above the eigenvalues")
    quotients = []
    for vector in (matrix(least, "least", size, 1), matrix(most, "most", size, 1)):
        need(squares(vector) > 0, "a vector is zero")
        quotients.append(times(turned(vector), storage, vector)[0][0] / squares(vector))
    return Storage(storage, Interval.between(below, quotients[0]), Interval.between(quotients[1], above))


def _length(vector: Matrix) -> Interval:
    """The norm of a row or a column."""
    return Interval.of(squares(vector)).root()


def constants(loop: Loop, storage: Storage) -> tuple[Interval, Interval]:
    """alpha_3 of (15), and the left side of (18) for a period of one second."""
    root = storage.least.root()
    a, b, c, k, gain = loop.A, loop.B, loop.C, loop.K, loop.L
    first = (_length(times(c, a)) + _length(times(c, b, k)) * 2) / root
    second = (_length(times(k, loop.guided)) * 2 + _length(times(k, b, k)) * 2 + _length(times(k, gain, c))) / root
    third = _length(times(c, a)) / root
    c1, injected, both = _length(b), _length(gain), abs(Interval.of(times(k, gain)[0][0]))
    fourth = (second * c1 + injected * first + c1 * third * both + third * injected) * storage.most * 2 / root
    return third, fourth * storage.most


def condition(given: Certificate) -> Proof:
    """Whether the loop meets (18)."""
    given.stated()
    take(given.parameters, "parameters")
    (solution,) = take(given.witness, "witness", "lyapunov")
    loop = read_loop(given.plant)
    side = constants(loop, read_storage(loop, solution))[1] * loop.T
    need(side < 1 or side > 1, "the left side of (18) is not told from one")
    return Proof(holds=side < 1)


def prediction_bound(given: Certificate) -> Proof:
    """(15) fails at t_1 for each period up to the longest: both fast periods are enclosed for all of them at once."""
    given.stated()
    (longest,) = take(given.parameters, "parameters", "longest")
    solution, start = take(given.witness, "witness", "lyapunov", "chi")
    loop, time = read_loop(given.plant), positive(longest, "longest")
    storage, n = read_storage(loop, solution), len(loop.A)
    chi = matrix(start, "chi", 2 * n, 1)
    span = Interval.between(Fraction(0), time)
    a, b = loop.A, loop.B
    plant = exponential(scaled(span, blocks([[a, b], [nought(1, n + 1)]])))
    observer = exponential(scaled(span, blocks([[loop.guided, b, loop.L], [nought(2, n + 2)]])))
    x, own = chi[:n], minus(chi[:n], chi[n:])
    measured = times(loop.C, x)
    energies = []
    for _ in range(2):
        u = times(loop.K, own)
        ahead = times(plant, [*own, *u])[:n]
        x, own = times(plant, [*x, *u])[:n], times(observer, [*own, *u, *measured])[:n]
        measured = times(loop.C, ahead)
        both = [*x, *minus(x, own)]
        energies.append(times(turned(both), storage.P, both)[0][0])
    missed = abs(times(loop.C, part(plant, slice(n), slice(n)), chi[n:])[0][0])
    energy = largest(Fraction(0), *energies)
    need(missed > constants(loop, storage)[0] * energy.root() * time, "(15) may hold from there")
    return Proof(holds=False)


def counterexample(given: Certificate) -> Proof:
    """A = B = C = 1, L = 2: unstable for all periods that (18) allows, and each of the ratios."""
    given.stated()
    ratios, longest = take(given.parameters, "parameters", "ratios", "longest")
    (solution,) = take(given.witness, "witness", "lyapunov")
    loop, time = read_loop(given.plant), positive(longest, "longest")
    need((loop.A, loop.B, loop.C, loop.L) == ([[1]], [[1]], [[1]], [[2]]), "the loop is another one")
    need(constants(loop, read_storage(loop, solution))[1] * time > 1, "(18) may allow longer periods")
    highest = exponential([[time]])[0][0] - 1
    listed = several(ratios, "ratios", lambda value, at: count(value, at, 2))
    need(bool(listed) and max(listed) <= 30, "no ratio, or one above 30")
    for ratio in listed:
        coefficients = margin(loop.K[0][0], ratio)
        start = next((i for i, c in enumerate(coefficients) if c != 0), None)
        need(start is not None and coefficients[start] < 0, f"det(I - Phi) is not negative at first for M = {ratio}")
        rest = [max(c, Fraction(0)) for c in coefficients[start:]][1:]
        total, power = Interval.of(coefficients[start or 0]), Interval.of(1)
        for c in rest:
            power = power * highest
            total = total + power * c
        need(total < 0, f"det(I - Phi) may not be negative for M = {ratio}")
    return Proof(holds=False)


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

    def sides(draw: Draw) -> Any:
        n = STATES
        a, b, c, k, gain = (draw.matrix(*size) for size in ((n, n), (n, 1), (1, n), (1, n), (n, 1)))
        x, own, held, y_held, predicted = (draw.matrix(rows, 1) for rows in (n, n, n, 1, 1))
        xi, fed = minus(x, own), times(b, k)
        printed = plus(times(a, x), times(fed, held)), minus(times(a, xi), times(gain, minus(predicted, times(c, own))))
        above = plus(times(plus(a, fed), x), scaled(-1, times(fed, xi)), times(fed, minus(held, own)))
        wrong = plus(minus(y_held, times(c, x)), minus(predicted, y_held))
        return printed, (above, minus(times(minus(a, times(gain, c)), xi), times(gain, wrong)))

    need(same(sides), "(9) and (10) differ")
    return Proof(holds=True)


CHECKS = {
    "dualrate.lyapunov": lyapunov,
    "dualrate.condition": condition,
    "dualrate.prediction-bound": prediction_bound,
    "dualrate.counterexample": counterexample,
    "dualrate.step-bound": step_bound,
    "dualrate.contraction": contraction,
    "dualrate.sampled-observer": sampled_observer,
    "dualrate.error-equations": error_equations,
}
