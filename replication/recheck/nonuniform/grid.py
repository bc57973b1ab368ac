"""Theorem 1, (9) and Algorithm 1: which periods the small-gain condition covers, and the grid that it leads to."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from replication.recheck.exact import blocks, is_hurwitz, is_positive, minus, plus, scaled, solved, times, turned, unit
from replication.recheck.identities import Draw, same
from replication.recheck.interval import Interval, enclosed, exponential, logarithm
from replication.recheck.nonuniform.definite import pivots_are_positive
from replication.recheck.nonuniform.levels import require_level
from replication.recheck.nonuniform.sampled import (
    Plant,
    case_of,
    complex_column,
    modulus2,
    on_circle,
    read_filter,
    read_plant,
    resolved,
    seconds,
)
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

MOST_PASSES = 10


def logarithmic_norm(a: Matrix) -> Interval:
    """The larger eigenvalue of (A + A')/2, for two states."""
    need(len(a) == 2, "the logarithmic norm is that of two states")
    (p, q), (_, r) = scaled(Fraction(1, 2), plus(a, turned(a)))
    answer: Interval = (Interval.of((p - r) ** 2 + 4 * q * q).root() + (p + r)) * Fraction(1, 2)
    return answer


def before(first: Any, second: Any) -> bool:
    """Whether one number is smaller; refused if that is not decided."""
    one, other = Interval.of(first), Interval.of(second)
    need(one < other or other < one, "a comparison is not decided")
    return one < other


def require_response(a: Matrix, phi: Matrix, lower: Fraction, turn: Any, direction: Any) -> None:
    """Refuse unless A Phi (z - Phi)^-1 amplifies a direction by more than the bound at a point of the circle."""
    vector = complex_column(direction, "direction", len(phi))
    answer = times(a, phi, solved(resolved(on_circle(turn), phi), vector))
    spent = modulus2(vector)
    need(spent > 0 and modulus2(answer) > lower * lower * spent, "the response is no larger than that")


def alpha(plant: Plant, h: Interval, value: Any) -> Interval:
    """||A Phi (z - Phi)^-1||: above by the bounded real lemma, below by a response."""
    lower, upper, p, turn, direction = take(value, "alpha", "lower", "upper", "P", "turn", "direction")
    n = len(plant.A)
    low, high, stored = positive(lower, "lower"), positive(upper, "upper"), symmetric(p, "P", n)
    phi = [row[:n] for row in plant.step(h)]
    output = times(plant.A, phi)
    need(is_positive(stored), "P is not positive")
    step = [[*row, *beside] for row, beside in zip(phi, unit(n), strict=True)]
    supply = [[*row, *([Fraction(0)] * n)] for row in minus(stored, times(turned(output), output))]
    supply += [[*([Fraction(0)] * n), *row] for row in unit(n, high * high)]
    left = minus(supply, times(turned(step), stored, step))
    need(pivots_are_positive(enclosed(left)), "the bounded real lemma does not hold")
    require_response(plant.A, phi, low, turn, direction)
    need(low <= high, "the bounds are crossed")
    return Interval.between(low, high)


@dataclass(frozen=True)
class Span:
    """An open interval of periods."""

    low: Interval
    high: Interval


def covered(plant: Plant, h: Interval, gain: Interval, printed: bool = False) -> Span:
    """(9), cases L3 and U3; as printed, mu(-A) stands in the logarithm of U3 too."""
    above, below = logarithmic_norm(plant.A), logarithmic_norm(scaled(-1, plant.A))
    need(above > 0 or above < 0, "mu(A) may be zero")
    need(below > 0 and above > -gain, "this is no case L3, or no case U3")
    low = h - logarithm(below / gain + 1) / below
    high = h + logarithm((below if printed else above) / gain + 1) / above
    return Span(low, high)


@dataclass(frozen=True)
class Ended:
    """How Algorithm 1 ended."""

    periods: list[Interval]
    passes: int
    first: Span


def run(plant: Plant, value: Any) -> Ended:
    """Algorithm 1 with alpha in both steps, mu(A) in U3 and a set-minus in step 4, until the range is covered."""
    passes = several(value, "passes", lambda one, at: several(one, at, lambda entry, _: entry))
    need(0 < len(passes) <= MOST_PASSES, f"no pass, or more than {MOST_PASSES}")
    start, stop = seconds(plant.low), seconds(plant.high)
    added = [seconds(plant.time("middle"))]
    spans: list[Span] = []
    periods: list[Interval] = []
    for i, witnesses in enumerate(passes):
        need(len(witnesses) == len(added), "each new element needs its bracket")
        periods += added
        for h, one in zip(added, witnesses, strict=True):
            spans.append(covered(plant, h, alpha(plant, h, one)))
        holes = _holes(spans, start, stop)
        if not holes:
            need(i == len(passes) - 1, "the algorithm has ended, but there are more passes")
            return Ended(periods, len(passes), spans[0])
        added = [(low + high) * Fraction(1, 2) for low, high in holes]
    need(False, "the range is not covered after these passes")
    raise AssertionError


def _holes(spans: list[Span], start: Interval, stop: Interval) -> list[tuple[Interval, Interval]]:
    """The parts of the range that no span covers, from below."""
    holes, reached = [], start
    # Each span is open, and holds a point of the range.
    for span in _sorted(spans):
        if before(reached, span.low):
            holes.append((reached, span.low))
        elif not before(reached, span.high):
            continue
        reached = span.high
        if before(stop, reached):
            return holes
    return [*holes, (reached, stop)]


def _sorted(spans: list[Span]) -> list[Span]:
    found: list[Span] = []
    for span in spans:
        place = sum(before(other.low, span.low) for other in found)
        found.insert(place, span)
    return found


def grid_size(given: Certificate) -> Proof:
    """How many elements the grid has in the end."""
    take(given.parameters, "parameters")
    given.stated("lower", "upper")
    ended = run(read_plant(given.plant), *take(given.witness, "witness", "passes"))
    return Proof(Fraction(len(ended.periods)), Fraction(len(ended.periods)))


def one_interval(given: Certificate) -> Proof:
    """The interval (9) about the middle leaves out a part of the range, which more elements cover."""
    given.stated()
    take(given.parameters, "parameters")
    plant = read_plant(given.plant)
    ended = run(plant, *take(given.witness, "witness", "passes"))
    need(is_hurwitz(plant.A), "A is not Hurwitz")
    need(len(ended.periods) > 1 and not _covers(ended.first, plant), "the first interval covers the range")
    return Proof(holds=True)


def _covers(span: Span, plant: Plant) -> bool:
    return before(span.low, seconds(plant.low)) and before(seconds(plant.high), span.high)


def stalls(given: Certificate) -> Proof:
    """Algorithm 1 as printed: the first element fails in step 3, and step 4 adds none, with a set-minus or without.

    Without one the union is the whole range, whose middle is in the grid. With one, the interval by the root of alpha
    is empty, so that the whole range is left, or it covers the range, so that nothing is.
    """
    given.stated()
    take(given.parameters, "parameters")
    plant = read_plant(given.plant)
    middle = seconds(plant.time("middle"))
    gain = alpha(plant, middle, dict(given.witness))
    first = covered(plant, middle, gain, printed=True)
    need(not _covers(first, plant), "step 3 holds")
    above, below = logarithmic_norm(plant.A), logarithmic_norm(scaled(-1, plant.A))
    root = gain.root()
    need(below > 0 and above > -root, "this is no case L3, or no case U3")
    second = covered(plant, middle, root, printed=True)
    need(before(second.high, second.low) or _covers(second, plant), "step 4 adds an element")
    return Proof(holds=False)


def same_level(given: Certificate) -> Proof:
    """One level for both channels of (13) is above the level that a filter has for every sequence."""
    given.stated()
    (cells,) = take(given.parameters, "parameters", "cells")
    names = ("cell", "alpha", "response", "radius", "direction", "filter", "level", "storage")
    cell, lower, response, radius, direction, filter_, level, storage = take(given.witness, "witness", *names)
    plant, number = read_plant(given.plant), count(cells, "cells", 1)
    need(count(cell, "cell") < number, "the cell is none")
    gain, far, reached = positive(lower, "alpha"), positive(radius, "radius"), positive(level, "level")
    start, length = seconds(plant.low), seconds(plant.high) - seconds(plant.low)
    n, modal = len(plant.A), _modal(plant.A)
    centre = start + length * Fraction(2 * cell + 1, 2 * number)
    phi = exponential(scaled(centre, modal))
    require_response(modal, phi, gain, *take(response, "response", "turn", "direction"))
    # Delta(theta), the integral of e^(At), stands beside e^(A theta) in exp of [A, I; 0, 0] theta.
    theta = length * Fraction(1, 2 * number)
    zero = unit(n, Fraction(0))
    delta = [row[n:] for row in exponential(scaled(theta, blocks([[modal, unit(n)], [zero, zero]])))[:n]]
    vector = matrix(direction, "direction", n, 1)
    spent = modulus2(vector)
    need(spent > 0 and modulus2(times(delta, vector)) > far * far * spent, "Delta is no larger than that")
    need(reached < min(gain, gain * far), "the filter's level is no lower")
    require_level(case_of(plant, read_filter(filter_, plant), plant.low, plant.high), reached, storage)
    return Proof(holds=True)


def _modal(a: Matrix) -> Matrix:
    """[a, b; -b, a] for the eigenvalues a + ib and a - ib."""
    need(len(a) == 2, "modal coordinates are those of two states")
    middle = (a[0][0] + a[1][1]) / 2
    square_ = a[0][0] * a[1][1] - a[0][1] * a[1][0] - middle * middle
    need(square_ > 0, "the eigenvalues are real")
    b = Interval.of(square_).root()
    return [[Interval.of(middle), b], [-b, Interval.of(middle)]]


def _sharp() -> bool:
    """alpha (E - 1)/m is one for E = 1 + m/alpha, E = e^(m theta) at theta = log(1 + m/alpha)/m."""

    def sides(draw: Draw) -> Any:
        m, gain = draw.number(), draw.number()
        return gain * (1 + m / gain - 1) / m, Fraction(1)

    return same(sides)


def upper_end(given: Certificate) -> Proof:
    """U3 with mu(A) is sharp for the bound of Lemma 3; with the printed mu(-A) it misses the end."""
    _bare(given)
    plant = read_plant(given.plant)
    above, below = logarithmic_norm(plant.A), logarithmic_norm(scaled(-1, plant.A))
    need(below > 0 and (above > 0 or above < 0), "mu(-A) is not positive, or mu(A) may be zero")
    if above > 0:
        need(below / above > 1, "the printed end may not be too far")
    else:
        # U3 stands for mu(A) > -alpha, and alpha is at least the response at z = 1, to either unit vector.
        n = len(plant.A)
        phi = [row[:n] for row in plant.step(seconds(plant.time("middle")))]
        answer = times(plant.A, phi, solved(minus(unit(n), phi), unit(n)))
        need(any(sum(row[j] * row[j] for row in answer) > above * above for j in range(n)), "this may be no case U3")
    need(_sharp(), "the end is not sharp")
    return Proof(holds=True)


def lower_end(given: Certificate) -> Proof:
    """L3 is sharp for the bound of Lemma 3 for -A."""
    _bare(given)
    need(logarithmic_norm(scaled(-1, read_plant(given.plant).A)) > 0, "mu(-A) may not be positive")
    need(_sharp(), "the end is not sharp")
    return Proof(holds=True)


def _bare(given: Certificate) -> None:
    given.stated()
    take(given.parameters, "parameters")
    take(given.witness, "witness")


CHECKS = {
    "nonuniform.grid-size": grid_size,
    "nonuniform.one-interval": one_interval,
    "nonuniform.stalls": stalls,
    "nonuniform.same-level": same_level,
    "nonuniform.upper-end": upper_end,
    "nonuniform.lower-end": lower_end,
}
