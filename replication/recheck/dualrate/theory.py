"""The stability result of Shao et al., and a loop that refutes it."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from replication.recheck.dualrate.loop import Loop, read_loop
from replication.recheck.dualrate.scalar import margin
from replication.recheck.exact import (
    blocks,
    is_positive,
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
from replication.recheck.interval import Interval, exponential, largest
from replication.recheck.reading import (
    Certificate,
    Matrix,
    Proof,
    count,
    matrix,
    need,
    positive,
    several,
    symmetric,
    take,
)


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
    need(listed == sorted({*listed}), "the ratios do not increase")
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


CHECKS = {
    "dualrate.lyapunov": lyapunov,
    "dualrate.condition": condition,
    "dualrate.prediction-bound": prediction_bound,
    "dualrate.counterexample": counterexample,
}
