"""The largest errors in the steady state that a reference sin(sigma t) brings about."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import factorial
from operator import attrgetter, mul
from typing import Any

from replication.recheck.dualrate.loop import Loop, Passage, held, read_loop, read_observer, steady_passage, turn
from replication.recheck.dualrate.stability import require_within
from replication.recheck.exact import Complex, blocks, minus, nought, times
from replication.recheck.interval import BITS, Interval, enclosed, largest
from replication.recheck.reading import (
    Certificate,
    Matrix,
    Proof,
    count,
    need,
    number,
    one_of,
    positive,
    several,
    small,
    take,
)
from replication.recheck.roots import horner, slope

PIECES, TERMS = 32, 30
HALVINGS = 40


@dataclass(frozen=True)
class Tracked:
    """A loop in the steady state under a reference: amplitudes by phase."""

    loop: Loop
    sigma: Fraction
    passage: Passage

    def error(self, phase: int, time: Fraction) -> Complex:
        """The amplitude of y - y_d so long after the instant of a phase."""
        state, _, w = self.signals(phase, time)
        return Complex.of(times(self.loop.C, state)[0][0]) - w

    def signals(self, phase: int, time: Fraction) -> tuple[Matrix, Complex, Complex]:
        """State, input and reference."""
        free, driven = held(self.loop.A, self.loop.B, time)
        u = self.passage.inputs[phase]
        state = [[a[0] + b[0]] for a, b in zip(times(free, self.passage.states[phase]), times(driven, u), strict=True)]
        return state, u[0][0], turn(self.sigma, phase * self.loop.T) * turn(self.sigma, time)


def tracked(loop: Loop, observer: str, sigma: Fraction, corrected: bool = False) -> Tracked:
    """The steady state; refused unless the loop is stable, so that there is one."""
    require_within(loop, observer, Fraction(1))
    return Tracked(loop, sigma, steady_passage(loop, observer, sigma, corrected))


def read_place(loop: Loop, phase: Any, time: Any, scales: Any) -> tuple[int, Fraction, list[Fraction]]:
    """A phase, a time after its instant, and weights of (x, u, y_d)."""
    after = number(time, "time")
    need(count(phase, "phase") < loop.M and 0 <= after <= loop.T, "the place lies outside the period")
    return phase, after, several(scales, "scales", positive, len(loop.A) + 2)


def require_below(moving: Tracked, bound: Fraction, scales: list[Fraction]) -> None:
    """Refuse unless the error is below the bound at all times.

    On each piece of a fast period the error is its Taylor polynomial up to |row| |v| x^n/n! e^x, in weighted largest
    entries, x being the norm of v' = N v times half the length. The square of the bound less the sum of squares of
    both parts is positive at a point by more than its slope and its largest second derivative can take on the part.
    """
    loop, half = moving.loop, moving.loop.T / (2 * PIECES)
    n = len(loop.A)
    motion = blocks([[loop.A, loop.B], [nought(1, n + 1)]])
    rows = [[*loop.C[0], Fraction(0)]]
    for _ in range(TERMS - 1):
        rows.append(times([rows[-1]], motion)[0])
    *weights, last = scales
    sums = [
        sum(abs(a) * s for a, s in zip(row, weights, strict=True)) / s for row, s in zip(motion, weights, strict=True)
    ]
    x = max(*sums, moving.sigma) * half
    need(x < TERMS / 4, "the motion is too fast in these weights")
    series = sum((x**i / factorial(i) for i in range(TERMS)), Fraction(0)) + 2 * x**TERMS / factorial(TERMS)
    left = (
        (sum(abs(c) * s for c, s in zip(rows[0], weights, strict=True)) + last) * x**TERMS / factorial(TERMS) * series
    )
    taylor = enclosed([[c * half**j / factorial(j) for c in row] for j, row in enumerate(rows)])
    turns = [Interval.of((moving.sigma * half) ** j / factorial(j)) for j in range(TERMS)]
    for phase in range(loop.M):
        for piece in range(PIECES):
            state, u, w = moving.signals(phase, (2 * piece + 1) * half)
            vector = [*(Complex.of(entry) for (entry,) in state), Complex.of(u)]
            sizes = [
                abs(part) / s for entry, s in zip([*vector, w], scales, strict=True) for part in (entry.re, entry.im)
            ]
            rest = largest(*sizes) * left * 2
            turned = [w, Complex(-w.im, w.re), Complex(-w.re, -w.im), Complex(w.im, -w.re)]
            parts = [
                [sum(map(mul, row, column)) - of(turned[j % 4]) * turns[j] for j, row in enumerate(taylor)]
                for of in (attrgetter("re"), attrgetter("im"))
                for column in [list(map(of, vector))]
            ]
            need(
                _is_below(parts, Interval.of(bound) - rest), f"the error may reach {float(bound):.9g} in phase {phase}"
            )


def _is_below(parts: list[list[Interval]], bound: Interval) -> bool:
    """Whether the sum of squares of two polynomials is below the square of the bound on [-1, 1]."""
    # The middles of the coefficients are exact; the widths together, twice for two parts, are taken off the bound.
    bound = bound - Interval(0, 2 * max(sum(c.high - c.low for c in part) for part in parts))
    if not bound > 0:
        return False
    squared = [0] * (2 * TERMS - 1)
    for part in parts:
        middles = [(c.low + c.high) // 2 for c in part]
        for i, a in enumerate(middles):
            for j, b in enumerate(middles):
                squared[i + j] += a * b
    gap = [Interval(-(c >> BITS) - 1, -(c >> BITS)) for c in squared]
    gap[0] = gap[0] + bound * bound
    change = slope(gap)
    bend = sum((abs(c) for c in slope(change)), Interval(0, 0))
    waiting = [(Fraction(0), Fraction(1))]
    while waiting:
        middle, radius = waiting.pop()
        lost = abs(horner(change, middle)) * radius + bend * (radius * radius / 2)
        if horner(gap, middle) > lost:
            continue
        if radius < Fraction(1, 1 << HALVINGS):
            return False
        waiting += [(middle - radius / 2, radius / 2), (middle + radius / 2, radius / 2)]
    return True


def tracking_errors(given: Certificate) -> Proof:
    """The largest |y - y_d| for each frequency, in percent of the amplitude, between two numbers."""
    given.stated()
    loop = read_loop(given.plant)
    names = ("observer", "feedforward", "instants", "frequencies")
    name, feedforward, instants, listed = take(given.parameters, "parameters", *names)
    observer = read_observer(name)
    corrected = one_of(feedforward, "feedforward", "printed", "corrected") == "corrected"
    everywhere = one_of(instants, "instants", "all", "fast") == "all"
    frequencies = several(listed, "frequencies", positive)
    small(0 < len(frequencies) <= 20, "no frequency, or more than 20")
    fields = ("lower", "upper", "phase", "time", "scales")
    (errors,) = take(given.witness, "witness", "errors")
    places = several(errors, "errors", lambda one, at: take(one, at, *fields), len(frequencies))
    items = []
    for sigma, one in zip(frequencies, places, strict=True):
        lower, upper = (positive(end, "a bound") for end in one[:2])
        phase, time, scales = read_place(loop, *one[2:])
        need(everywhere or time == 0, "the place is no fast instant")
        moving = tracked(loop, observer, sigma, corrected)
        need(moving.error(phase, time).size2() >= (lower / 100) ** 2, "the error is smaller at the place that is named")
        if everywhere:
            require_below(moving, upper / 100, scales)
        else:
            sizes = [moving.error(k, Fraction(0)).size2() for k in range(loop.M)]
            need(all(size <= (upper / 100) ** 2 for size in sizes), "the error is larger at an instant")
        items.append((lower, upper))
    return Proof(items=tuple(items))


def estimates_ordered(given: Certificate) -> Proof:
    """The largest |y - C xhat| over the fast instants is smaller with one observer than with another."""
    given.stated()
    take(given.witness, "witness")
    loop = read_loop(given.plant)
    name, than, frequency = take(given.parameters, "parameters", "observer", "than", "frequency")
    sizes = []
    for observer in (read_observer(name), read_observer(than)):
        passage = tracked(loop, observer, positive(frequency, "frequency")).passage
        pairs = zip(passage.states, passage.estimates, strict=True)
        sizes.append(largest(*(Complex.of(times(loop.C, minus(x, guess))[0][0]).size2() for x, guess in pairs)))
    need(sizes[0] < sizes[1], "the first error is not surely the smaller one")
    return Proof(holds=True)


CHECKS = {
    "dualrate.tracking-errors": tracking_errors,
    "dualrate.estimates-ordered": estimates_ordered,
}
