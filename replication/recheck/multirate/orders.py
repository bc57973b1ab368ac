"""One matrix for all instants, from below; and longer periods that have the smaller optimum."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations
from math import gcd

from replication.recheck.exact import blocks, is_positive, minus, part, plus, times, trace, turned
from replication.recheck.multirate.levels import attained, closed, require_seen_late, schedule, scheduled
from replication.recheck.reading import Certificate, Proof, need, positive, several, symmetric, take


def one_matrix(given: Certificate) -> Proof:
    """No level below that by Theorem 1 with one P, from Z_k > 0 that weigh states after a step more than before it.

    With one P > 0 at all phases the inner products of Z_k and the matrices of Theorem 1 add up to g^2 tr (Z_k)_22
    - tr W (Z_k)_11 W' - tr S P > 0, S the sum of [A_k B_k] Z_k [A_k B_k]' - (Z_k)_11.
    """
    (lower,) = given.stated("lower")
    chosen, periods, offsets = take(given.parameters, "parameters", "sensors", "periods", "offsets")
    plant, (gains,) = scheduled(given.plant, chosen, schedule(periods, offsets), "L")
    (weights,) = take(given.witness, "witness", "Z")
    n, steps = len(plant.A), [blocks([[a, b]]) for a, b in closed(plant, gains)]
    z = several(weights, "Z", lambda value, at: symmetric(value, at, len(steps[0][0])), len(steps))
    need(all(map(is_positive, z)), "a Z is not positive")
    state, rest = slice(n), slice(n, None)
    after = plus(*(times(step, one, turned(step)) for step, one in zip(steps, z, strict=True)))
    before = plus(*(part(one, state, state) for one in z))
    need(is_positive(minus(after, before)), "the states after a step weigh less than before it")
    seen = trace(times(plant.W, before, turned(plant.W)))
    spent = sum((trace(part(one, rest, rest)) for one in z), Fraction(0))
    need(lower > 0 and lower**2 * spent <= seen, "the weights give a smaller level")
    return Proof(lower=lower)


def shorter_periods(given: Certificate) -> Proof:
    """The longer periods reach a level that the shorter ones do not, whatever their offsets.

    Periods without a common factor meet in every combination of phases: other offsets are another start.
    """
    given.stated()
    names = ("sensors", "shorter", "longer")
    chosen, *both = take(given.parameters, "parameters", *names)
    stored = ("level", "P", "Y", "start", "d")
    reached, p, y, start, disturbance = take(given.witness, "witness", *stored)
    level = positive(reached, "level")
    (shorter, _), (longer, _) = (
        scheduled(given.plant, chosen, schedule(one, [0] * len(one) if isinstance(one, list) else one)) for one in both
    )
    pairs = list(zip(shorter.times.periods, longer.times.periods, strict=True))
    need(all(a <= b for a, b in pairs) and any(a < b for a, b in pairs), "the longer periods are no longer ones")
    need(all(gcd(a, b) == 1 for a, b in combinations(shorter.times.periods, 2)), "shorter has a common factor")
    attained(longer, p, y, level)
    require_seen_late(shorter, start, disturbance, level)
    return Proof(holds=False)


CHECKS = {"multirate.one-matrix": one_matrix, "multirate.shorter-periods": shorter_periods}
