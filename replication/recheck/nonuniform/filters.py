"""A filter that solves (6) on the grid of Algorithm 1 and not between; and the output matrices that have a level."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from replication.recheck.exact import Complex, blocks, is_positive, minus, nought, solved, times, turned, unit
from replication.recheck.interval import Interval, enclosed
from replication.recheck.nonuniform.definite import pivots_are_positive
from replication.recheck.nonuniform.grid import run
from replication.recheck.nonuniform.lower import require_attained
from replication.recheck.nonuniform.sampled import (
    Case,
    case_of,
    on_circle,
    printed_filter,
    read_filter,
    read_plant,
    resolved,
    seconds,
)
from replication.recheck.reading import Certificate, Matrix, Proof, need, number, positive, several, symmetric, take

ROUNDS = 3
"""In which the bounds of the entries improve each other."""
MOST_POINTS = 1000


def grid_solution_fails(given: Certificate) -> Proof:
    """One filter and matrix solve (6) at all elements of the grid, and the filter has a larger gain in the range."""
    given.stated()
    take(given.parameters, "parameters")
    names = ("passes", "level", "filter", "P", "pattern", "turn", "w")
    passes, reached, own, stored, pattern, turn, w = take(given.witness, "witness", *names)
    plant, level = read_plant(given.plant), positive(reached, "level")
    case = case_of(plant, read_filter(own, plant), plant.low, plant.high)
    n, inputs = len(case.output[0]), len(plant.B[0])
    p = symmetric(stored, "P", n)
    need(is_positive(p), "P is not positive")
    held = minus(p, times(turned(case.output), case.output))
    supply = blocks([[held, nought(n, inputs)], [nought(inputs, n), unit(inputs, level * level)]])
    for h in run(plant, passes).periods:
        step = case.step_after(0, plant.step(h))
        left = minus(supply, times(turned(step), p, step))
        need(pivots_are_positive(enclosed(left)), "(6) does not hold at an element of the grid")
    require_attained(case, level, {"pattern": pattern, "turn": turn, "w": w})
    return Proof(holds=False)


def output_matrix(given: Certificate) -> Proof:
    """The entries of C_f, if A_f, B_f and C_f have a level at the middle of the range.

    With T(z) = L X(z) - C_f F(z) the transfer function of the error, |T| <= level on the circle. So numbers u at points
    of it give C_f sum Re (u F) <= sum Re (u L X) + level sum |u|, where the sum on the left is nearly a unit vector.
    """
    given.stated()
    (reached,) = take(given.parameters, "parameters", "level")
    above, below = take(given.witness, "witness", "above", "below")
    plant, level = read_plant(given.plant), positive(reached, "level")
    own = printed_filter(given, plant)
    case, size = case_of(plant, own, plant.low, plant.high), len(own.A)
    need(len(plant.B[0]) == len(plant.C) == len(plant.L) == 1, "not one disturbance, measurement and output")
    need(size == len(plant.A), "the filter has another order than the plant")
    case.require_stable()
    step = case.step_after(0, plant.step(seconds(plant.time("middle"))))
    sides = [
        several(listed, name, lambda one, _: _bounded(case, step, level, one), size)
        for name, listed in (("above", above), ("below", below))
    ]
    # sign C_j <= bound + sum |off_k| |C_k|.
    ends = [
        [(bound, _off(direction, j, sign)) for j, (direction, bound) in enumerate(side)]
        for side, sign in zip(sides, (1, -1), strict=True)
    ]
    far = max(sum(off) for side in ends for _, off in side)
    need(far < 1, "the directions are not those of the entries")
    largest = max(0, *(bound for side in ends for bound, _ in side)) / (1 - far)
    sizes = [largest] * size
    for _ in range(ROUNDS):
        tops, bottoms = (
            [bound + sum(a * b for a, b in zip(off, sizes, strict=True)) for bound, off in side] for side in ends
        )
        need(all(-bottom <= top for top, bottom in zip(tops, bottoms, strict=True)), "no C_f has this level")
        sizes = [max(top, bottom) for top, bottom in zip(tops, bottoms, strict=True)]
    return Proof(items=tuple((-bottom, top) for top, bottom in zip(tops, bottoms, strict=True)))


def _bounded(case: Case, step: Matrix, level: Fraction, listed: Any) -> tuple[Matrix, Fraction]:
    """A direction and what C_f times it is at most, from [{turn, u}, ..]."""
    points = several(listed, "points", lambda one, at: take(one, at, "turn", "u"))
    need(0 < len(points) <= MOST_POINTS, f"no point, or more than {MOST_POINTS}")
    n, size = len(case.plant.A), len(step)
    product, driven = [row[:size] for row in step], [row[size:] for row in step]
    direction: Matrix = [[Interval.of(0)] for _ in range(size - n)]
    bound: Any = Interval.of(0)
    for turn, parts in points:
        u = Complex(*several(parts, "u", number, 2))
        state = solved(resolved(on_circle(turn), product), [[Complex(entry)] for (entry,) in driven])
        seen = times(case.plant.L, state[:n])[0][0]
        bound = bound + Complex.of(u * seen).re + Interval.of(u.size2()).root() * level
        direction = [[one + Complex.of(u * entry).re] for (one,), (entry,) in zip(direction, state[n:], strict=True)]
    return direction, bound.ends()[1]


def _off(direction: Matrix, j: int, sign: int) -> list[Fraction]:
    """How far each entry of a direction is from that of sign times the unit vector j, at most."""
    return [abs(Interval.of(one) - (sign if k == j else 0)).ends()[1] for k, (one,) in enumerate(direction)]


CHECKS = {"nonuniform.grid-solution-fails": grid_solution_fails, "nonuniform.output-matrix": output_matrix}
