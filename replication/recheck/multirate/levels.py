"""Levels of multi-rate observers: storage functions from above, disturbances that are seen badly from below."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from math import lcm
from typing import Any

from replication.recheck.exact import (
    blocks,
    characteristic,
    is_positive,
    is_schur,
    minus,
    nought,
    plus,
    scaled,
    solved,
    squares,
    times,
    turned,
    unit,
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
    small,
    square,
    symmetric,
    take,
)

MOST_STATES = 12
LONGEST = 1000
"""Instants after which a schedule must repeat."""


@dataclass(frozen=True)
class Schedule:
    """When which sensor measures."""

    periods: list[int]
    offsets: list[int]

    @property
    def length(self) -> int:
        """Instants until it repeats."""
        return lcm(*self.periods)

    def measured(self, instant: int) -> list[int]:
        """The sensors that measure at an instant."""
        pairs = zip(self.periods, self.offsets, strict=True)
        return [i for i, (period, offset) in enumerate(pairs) if (instant - offset) % period == 0]


def schedule(periods: Any, offsets: Any) -> Schedule:
    """A schedule, as it stands in parameters."""
    found = several(periods, "periods", lambda value, at: count(value, at, 1))
    later = several(offsets, "offsets", count, len(found))
    need(bool(found) and lcm(*found) <= LONGEST, f"no sensor, or no repetition within {LONGEST} instants")
    return Schedule(found, later)


@dataclass(frozen=True)
class Sensed:
    """A plant under a schedule: x+ = A x + B d, measured C_k x + D_k w, z = W x."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    W: Matrix
    times: Schedule

    def rows(self, matrix: Matrix, instant: int) -> Matrix:
        """S_k times a matrix: the rows of sensors that do not measure are zero."""
        measured = self.times.measured(instant)
        return [row if i in measured else [Fraction(0)] * len(row) for i, row in enumerate(matrix)]

    def hiding(self, instant: int, states: Matrix) -> Matrix:
        """The smallest w that makes the measurements of these states zero: -D_k' (D_k D_k')^-1 C_k x."""
        measured = self.times.measured(instant)
        if not measured:
            return nought(len(self.D[0]), len(states[0]))
        c, d = ([rows[i] for i in measured] for rows in (self.C, self.D))
        return scaled(-1, times(turned(d), solved(times(d, turned(d)), times(c, states))))


def sensed(plant: Any, parameters: Any, *more: str) -> tuple[Sensed, list[Any], Fraction]:
    """The plant with the sensors chosen, further fields of it as they stand, and the width that is asked for."""
    chosen, periods, offsets, relative = take(parameters, "parameters", "sensors", "periods", "offsets", "relative")
    found, others = scheduled(plant, chosen, schedule(periods, offsets), *more)
    return found, others, positive(relative, "relative")


def scheduled(plant: Any, chosen: Any, planned: Schedule, *more: str) -> tuple[Sensed, list[Any]]:
    """The plant with the sensors chosen under a schedule, and further fields of it as they stand."""
    _, *matrices = take(plant, "plant", "name", "A", "B_d", "C", "D", "W", *more)
    a = square(matrices[0], "A")
    small(len(a) <= MOST_STATES, f"more than {MOST_STATES} states")
    b, c = matrix(matrices[1], "B_d", len(a)), matrix(matrices[2], "C", None, len(a))
    d, w = matrix(matrices[3], "D", len(c)), matrix(matrices[4], "W", None, len(a))
    kept = several(chosen, "sensors", count)
    need(bool(kept) and all(i < len(c) for i in kept) and len({*kept}) == len(kept), "sensors that are none, or twice")
    need(len(planned.periods) == len(kept), "a period for each sensor")
    return Sensed(a, b, [c[i] for i in kept], [d[i] for i in kept], w, planned), matrices[5:]


def closed(plant: Sensed, gains: Any) -> list[tuple[Matrix, Matrix]]:
    """(A_k, B_k) of the error system with these gains, phase by phase."""
    injected = several(gains, "L", lambda value, at: matrix(value, at, len(plant.A)), plant.times.length)
    need(all(len(one[0]) == len(plant.C) for one in injected), "L has a column for each sensor")
    found = []
    for k, one in enumerate(injected):
        a = minus(plant.A, times(one, plant.rows(plant.C, k)))
        found.append((a, blocks([[plant.B, scaled(-1, times(one, plant.rows(plant.D, k)))]])))
    return found


def gain(given: Certificate) -> Proof:
    """The gain of given gains L_k."""
    plant, (gains,), relative = sensed(given.plant, given.parameters, "L")
    size, length = len(plant.A), plant.times.length
    stored, turn, v = take(given.witness, "witness", "P", "turn", "v")
    lower, upper = _bracket(given, relative)
    steps = closed(plant, gains)
    storage = several(stored, "P", lambda value, at: symmetric(value, at, size), length)
    for k, (a, b) in enumerate(steps):
        both = blocks([[a, b]])
        entries = len(both[0])
        supplied = unit(entries, upper**2)
        for i in range(size):
            supplied[i] = [
                *minus(storage[k - 1], times(turned(plant.W), plant.W))[i],
                *([Fraction(0)] * (entries - size)),
            ]
        need(is_positive(storage[k]), f"P[{k}] is not positive")
        need(is_positive(minus(supplied, times(turned(both), storage[k], both))), f"the inequality fails at phase {k}")
    rotation, inputs = inputs_over(turn, v, len(steps[0][1][0]), length)
    need(is_schur(characteristic(times(*(a for a, _ in steps[::-1])))), "the error system is not stable")
    produced, spent = Fraction(0), Fraction(0)
    states = recurrent(((*steps[k % length], one) for k, one in enumerate(inputs)), rotation)
    for state, one in zip(states, inputs, strict=True):
        produced, spent = produced + squares(times(plant.W, state)), spent + squares(one)
    need(spent > 0 and produced >= lower**2 * spent, "the disturbance has a smaller gain")
    return Proof(lower, upper, True)


def _bracket(given: Certificate, relative: Fraction) -> tuple[Fraction, Fraction]:
    """The bounds: positive, and no further apart than the theorem wants them."""
    lower, upper = given.stated("lower", "upper")
    need(0 < lower <= upper <= lower * (1 + relative), "the bounds are not positive, crossed, or too far apart")
    return lower, upper


def inputs_over(turn: Any, inputs: Any, rows: int, length: int) -> tuple[Matrix, list[Matrix]]:
    """A rotation and the inputs of one period, whole periods of the schedule."""
    rotation = square(turn, "turn")
    order = len(rotation)
    need(order <= 2 and times(turned(rotation), rotation) == unit(order), "turn is not orthogonal of order 1 or 2")
    read = several(inputs, "inputs", lambda value, at: matrix(value, at, rows, order))
    need(bool(read) and len(read) % length == 0, "the inputs are not those of whole periods")
    return rotation, read


def recurrent(steps: Iterable[tuple[Matrix, Matrix, Matrix]], rotation: Matrix) -> list[Matrix]:
    """The states X_0 .. of X+ = A X + B v over (A, B, v), where the last leads to X_0 times the rotation."""
    listed = list(steps)
    size, order = len(listed[0][0]), len(rotation)
    product, forced = unit(size), nought(size, order)
    for a, b, v in listed:
        product, forced = times(a, product), plus(times(a, forced), times(b, v))
    # Column j of X_0 R - product X_0 = forced, all columns of X_0 below each other.
    system = blocks(
        [
            [minus(unit(size, rotation[i][j]), product) if i == j else unit(size, rotation[i][j]) for i in range(order)]
            for j in range(order)
        ]
    )
    stacked = solved(system, [[forced[i][j]] for j in range(order) for i in range(size)])
    state = [[stacked[j * size + i][0] for j in range(order)] for i in range(size)]
    found = []
    for a, b, v in listed:
        found.append(state)
        state = plus(times(a, state), times(b, v))
    return found


def attained(plant: Sensed, stored: Any, changed: Any, upper: Fraction) -> None:
    """Refuse unless P_k and Y_k solve the inequality (30) of Theorem 2 at this level."""
    size, length = len(plant.A), plant.times.length
    p = several(stored, "P", lambda value, at: symmetric(value, at, size), length)
    y = several(changed, "Y", lambda value, at: matrix(value, at, size, len(plant.C)), length)
    inputs, noises = len(plant.B[0]), len(plant.D[0])
    for k in range(length):
        beside = [
            minus(times(p[k], plant.A), times(y[k], plant.rows(plant.C, k))),
            times(p[k], plant.B),
            scaled(-1, times(y[k], plant.rows(plant.D, k))),
        ]
        middle = minus(p[k - 1], times(turned(plant.W), plant.W))
        whole = blocks(
            [
                [p[k], *beside],
                [turned(beside[0]), middle, nought(size, inputs), nought(size, noises)],
                [turned(beside[1]), nought(inputs, size), unit(inputs, upper**2), nought(inputs, noises)],
                [turned(beside[2]), nought(noises, size), nought(noises, inputs), unit(noises, upper**2)],
            ]
        )
        need(is_positive(whole), f"the matrix of Theorem 2 is not positive at phase {k}")


def optimum_noncausal(given: Certificate) -> Proof:
    """The least level, where a disturbance that no measurement ever shows meets it."""
    plant, _, relative = sensed(given.plant, given.parameters)
    p, y, turn, d = take(given.witness, "witness", "P", "Y", "turn", "d")
    lower, upper = _bracket(given, relative)
    attained(plant, p, y, upper)
    need(is_schur(characteristic(plant.A)), "the plant is not stable")
    rotation, inputs = inputs_over(turn, d, len(plant.B[0]), plant.times.length)
    states = recurrent(((plant.A, plant.B, one) for one in inputs), rotation)
    produced = sum(squares(times(plant.W, state)) for state in states)
    spent = sum(squares(one) for one in inputs) + sum(squares(plant.hiding(k, x)) for k, x in enumerate(states))
    need(spent > 0 and produced >= lower**2 * spent, "the disturbance has a smaller gain")
    return Proof(lower, upper, True)


def require_seen_late(plant: Sensed, start: Any, disturbance: Any, level: Fraction) -> None:
    """Refuse unless a disturbance from rest at an instant, hidden up to its end, has this gain."""
    inputs = several(disturbance, "d", lambda value, at: matrix(value, at, len(plant.B[0]), 1))
    state = nought(len(plant.A), 1)
    produced, spent = Fraction(0), Fraction(0)
    for k, one in enumerate(inputs, count(start, "start")):
        spent += squares(one) + squares(plant.hiding(k, state))
        state = plus(times(plant.A, state), times(plant.B, one))
        produced += squares(times(plant.W, state))
    need(spent > 0 and produced >= level**2 * spent, "the disturbance has a smaller gain")


def optimum_causal(given: Certificate) -> Proof:
    """The least level of predictors, where a disturbance that is seen too late meets it."""
    plant, _, relative = sensed(given.plant, given.parameters)
    p, y, start, d = take(given.witness, "witness", "P", "Y", "start", "d")
    lower, upper = _bracket(given, relative)
    attained(plant, p, y, upper)
    require_seen_late(plant, start, d, lower)
    return Proof(lower, upper, True)


CHECKS = {
    "multirate.gain": gain,
    "multirate.optimum-noncausal": optimum_noncausal,
    "multirate.optimum-causal": optimum_causal,
}
