"""Condition (8) itself, for the middle of the range: broken at one period in all coordinates, or met over the range."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any

from replication.recheck.exact import blocks, is_hurwitz, is_positive, minus, nought, scaled, times, turned, unit
from replication.recheck.interval import Interval, enclosed, exponential
from replication.recheck.nonuniform.definite import pivots_are_positive
from replication.recheck.nonuniform.sampled import Plant, between, read_plant, seconds
from replication.recheck.reading import Certificate, Matrix, Proof, need, several, small, symmetric, take

HALVINGS = 10
MOST_PIECES = 1000


def eigenvalues(a: Matrix) -> list[tuple[Any, Any]]:
    """Real and imaginary parts of both eigenvalues of a matrix of two states, enclosed."""
    small(len(a) == 2, "more than two states")
    middle = (a[0][0] + a[1][1]) / 2
    spread = middle * middle - (a[0][0] * a[1][1] - a[0][1] * a[1][0])
    root = Interval.of(abs(spread)).root()
    if spread < 0:
        return [(middle, root), (middle, -root)]
    return [(middle + root, Fraction(0)), (middle - root, Fraction(0))]


def response(eigenvalue: tuple[Any, Any], h: Interval, middle: Interval) -> Interval:
    """|e^(ah) - e^(a h_0)|/(1 - |e^(a h_0)|): the largest modulus over the circle of an eigenvalue of T(z)."""
    real, imaginary = eigenvalue

    def grown(time: Interval) -> Matrix:
        return exponential(scaled(time, [[real, -imaginary], [imaginary, real]]))

    (cosine, _), (sine, _) = minus(grown(h), grown(middle))
    apart = (cosine * cosine + sine * sine).root()
    answer: Interval = apart / (1 - exponential([[middle * real]])[0][0])
    return answer


def breaks(given: Certificate) -> Proof:
    """At a constant period T(z) has an eigenvalue above one somewhere on the circle, in whatever coordinates."""
    given.stated()
    take(given.witness, "witness")
    (period,) = take(given.parameters, "parameters", "period")
    plant = read_plant(given.plant)
    need(is_hurwitz(plant.A), "A is not Hurwitz")
    h, middle = seconds(plant.time(period)), seconds(plant.time("middle"))
    need(any(response(one, h, middle) > 1 for one in eigenvalues(plant.A)), "(8) may hold")
    return Proof(holds=False)


def meets(given: Certificate) -> Proof:
    """(8) holds for every sequence in modal coordinates, and for every constant change in those of the plant.

    In modal coordinates the factors are diagonal, and |e^(ah) - e^(a h_0)| is largest at an end for real a.
    """
    given.stated()
    take(given.parameters, "parameters")
    (stored,) = take(given.witness, "witness", "P")
    plant = read_plant(given.plant)
    need(is_hurwitz(plant.A), "A is not Hurwitz")
    middle = seconds(plant.time("middle"))
    modes = eigenvalues(plant.A)
    need(all(imaginary == 0 for _, imaginary in modes), "the eigenvalues are not real")
    need(modes[0][0] > modes[1][0], "the eigenvalues may be equal")
    ends = (seconds(plant.low), seconds(plant.high))
    need(all(response(one, end, middle) < 1 for one in modes for end in ends), "(8) may fail in modal coordinates")
    p = several(stored, "P", lambda one, at: symmetric(one, at, len(plant.A)))
    need(bool(p) and all(map(is_positive, p)), "no P, or one that is not positive")
    small(len(p) <= MOST_PIECES, f"more than {MOST_PIECES} pieces")
    cuts = [Fraction(i, len(p)) for i in range(len(p) + 1)]
    for (start, stop), one in zip(pairwise(cuts), p, strict=True):
        _require_piece(plant, start, stop, one)
    return Proof(holds=True)


def _require_piece(plant: Plant, start: Fraction, stop: Fraction, p: Matrix) -> None:
    """Refuse unless x+ = Phi x + Delta u, y = A Phi x has a gain below one for all periods between two shares.

    By the bounded real lemma with P; Delta stands beside e^(A theta) in exp of [A, I; 0, 0] theta.
    """
    n = len(plant.A)
    middle = seconds(plant.time("middle"))
    phi = [row[:n] for row in plant.step(middle)]
    output = times(plant.A, phi)
    generator = blocks([[plant.A, unit(n)], [nought(n, 2 * n)]])
    supply = blocks([[minus(p, times(turned(output), output)), nought(n, n)], [nought(n, n), unit(n)]])
    waiting = [(start, stop, 0)]
    while waiting:
        left, right, halvings = waiting.pop()
        low, high = (seconds(between(plant.low, plant.high, share)) - middle for share in (left, right))
        grown = exponential(scaled(Interval.between(low, high), generator))
        step = [[*row, *beside[n:]] for row, beside in zip(phi, grown[:n], strict=True)]
        if not pivots_are_positive(enclosed(minus(supply, times(turned(step), p, step)))):
            need(halvings < HALVINGS, "the bounded real lemma does not hold, or is not decided")
            half = (left + right) / 2
            waiting += [(left, half, halvings + 1), (half, right, halvings + 1)]


CHECKS = {"nonuniform.breaks-condition-8": breaks, "nonuniform.meets-condition-8": meets}
