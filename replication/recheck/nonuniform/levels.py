"""Gains over sampling sequences from above: storage functions that read the periods to come; and stability."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise
from math import lcm
from operator import mul
from typing import Any

from replication.recheck.exact import (
    is_positive,
    times,
    turned,
)
from replication.recheck.interval import BITS, Interval, norm_above
from replication.recheck.nonuniform.definite import Whole, surely_positive
from replication.recheck.nonuniform.sampled import (
    Case,
    between,
    read_case,
    seconds,
)
from replication.recheck.reading import (
    Certificate,
    Matrix,
    Proof,
    count,
    need,
    number,
    positive,
    several,
    symmetric,
    take,
)

HALVINGS = 24
PLACES = 160
LONG = Fraction(1, 4)
"""Pieces are halved before anything is asked of them until |N| times their length is below."""


@dataclass(frozen=True)
class Storage:
    """Shares at which the range is cut into cells; for each state and cell the state before it; the matrices, first
    those of all states for the first step of the error, then for the second, ..; for each cell the step after it."""

    cuts: list[Fraction]
    before: list[list[int]]
    P: list[Matrix]
    after: list[int]

    def step(self, place: int) -> int:
        """The step of the error to which the matrix at a place belongs."""
        return place // len(self.before)

    def pairs(self, cell: int) -> list[tuple[int, int]]:
        """The places of the matrices before and after a period in a cell."""
        count_, last = len(self.before), self.after[cell] * len(self.before)
        return [
            (place - d + row[cell], last + d)
            for d, row in enumerate(self.before)
            for place in range(d, len(self.P), count_)
        ]


def read_cells(value: Any, where: str) -> list[Fraction]:
    """The shares at which the cells of a range end."""
    cuts = several(value, where, number)
    need(len(cuts) > 1 and cuts[0] == 0 and cuts[-1] == 1, f"{where} do not cover the range")
    need(all(a < b for a, b in pairwise(cuts)), f"{where} do not follow each other")
    return cuts


def cell_of(cells: list[Fraction], share: Fraction) -> int:
    """The cell of a share; an end that two of them share belongs to the upper one."""
    return max(cell for cell, start in enumerate(cells[:-1]) if start <= share)


def read_storage(value: Any, size: int, known: list[Fraction]) -> Storage:
    """An automaton that reads the periods from the last one on, with a positive matrix for each of its states and each
    of the cells that a filter tells apart."""
    cells, before, stored = take(value, "storage", "cells", "before", "P")
    cuts = read_cells(cells, "the cells")
    p = several(stored, "P", lambda one, at: symmetric(one, at, size))
    states = several(before, "before", lambda row, at: several(row, at, count, len(cuts) - 1))
    need(len(p) == len(states) * (len(known) - 1), "not one matrix for each state and each cell of the filter")
    need(bool(p) and all(one < len(states) for row in states for one in row), "a state is none")
    need(all(map(is_positive, p)), "a matrix is not positive")
    need(set(known) <= set(cuts), "a cell of the filter ends within one of the storage")
    return Storage(cuts, states, p, [cell_of(known, start) for start in cuts[:-1]])


class Inequality:
    """w |e|^2 + x+' P_d x+ <= x' P_c x + w g^2 |w|^2, strictly, on pieces of the range.

    In integers: M and w at an end of a chord times 2^PLACES, with a radius for all that they are off; everything else
    times a common denominator.
    """

    def __init__(self, case: Case, level: Fraction, storage: Storage) -> None:
        self.case, self.storage = case, storage
        generator, seen = case.plant.generator, times(turned(case.output), case.output)
        self.n, self.size = len(case.plant.A), len(seen)
        # By how much the entries of the columns of M change where those of [Phi, Gamma] change by one.
        self.moved = [[sum(map(abs, column)) for column in turned(one)] for one in case.F]
        self.rate, self.bend = norm_above(generator), times(generator, generator)
        rationals = [entry for block in (*storage.P, seen, [[level * level]]) for row in block for entry in row]
        self.common = lcm(*(entry.denominator for entry in rationals))
        self.P = [self._whole(one) for one in storage.P]
        self.seen, ((self.level2,),) = self._whole(seen), self._whole([[level * level]])
        self.at, self.steps, self.over = cache(self._at), cache(self._steps), cache(self._over)
        self.reached: dict[Fraction, tuple[Fraction, Fraction]] = {}

    def _whole(self, matrix_: Matrix) -> Whole:
        return [[int(entry * self.common) for entry in row] for row in matrix_]

    def _at(self, share: Fraction) -> tuple[Interval, Matrix]:
        """The period at a share and [Phi, Gamma] there; from another share and the way between them if one is known."""
        h = seconds(between(self.case.start, self.case.stop, share))
        if share not in self.reached:
            return h, self.case.plant.step(h)
        start, way = self.reached[share]
        return h, times(self.at(start)[1], self.over(way))

    def _over(self, way: Fraction) -> Matrix:
        """exp(N t) for the time t of a way: all pieces of one length share it."""
        n, m = self.n, len(self.case.plant.B[0])
        start, stop = (seconds(between(self.case.start, self.case.stop, share)) for share in (Fraction(0), way))
        return [
            *self.case.plant.step(stop - start),
            *([Fraction(int(i == j - n)) for j in range(n + m)] for i in range(m)),
        ]

    def _steps(self, share: Fraction, which: int) -> tuple[Whole, int, int]:
        """The columns of M after a cell of the filter, w, and how far entries of either are off at most."""
        h, step = self.at(share)
        entries = [[Interval.of(entry) for entry in row] for row in self.case.step_after(which, step)]
        weight = Interval.of(self.case.weight(h))
        off = max(max(entry.high - entry.low for row in entries for entry in row), weight.high - weight.low)
        spare = BITS - PLACES
        rows = [[entry.low >> spare for entry in row] for row in entries]
        return turned(rows), weight.low >> spare, (off >> spare) + 2

    def length(self, left: Fraction, right: Fraction) -> Fraction:
        """At least the seconds between two shares."""
        answer: Fraction = (self.at(right)[0] - self.at(left)[0]).ends()[1]
        return answer

    def curvature(self, left: Fraction, right: Fraction) -> Fraction | None:
        """At least the largest entry of the second derivative of [Phi, Gamma]; None on pieces that are too long.

        On the piece exp(hN) = exp(aN) (1 + X), |X| < x + x^2 in norm for x = |N| times the length, if x is below one.
        """
        x, (_, step) = self.length(left, right) * self.rate, self.at(left)
        if x >= LONG:
            return None
        n, whole = self.n, [list(row) for row in step]
        m = len(whole[0]) - n
        whole += [[Fraction(int(i == j - n)) for j in range(n + m)] for i in range(m)]
        bent = times(self.bend, whole)[:n]
        most = max(abs(Interval.of(entry)).ends()[1] for row in bent for entry in row)
        answer: Fraction = most + norm_above(bent) * (x + x * x)
        return answer

    def holds(self, end: Fraction, rest: int, c: int, d: int) -> bool:
        """Whether it holds at an end of a chord, with so much in each entry of [Phi, Gamma] beside it."""
        which, p, size = self.storage.step(c), self.P[d], self.size
        columns, weight, off = self.steps(end, which)
        pushed = [[sum(map(mul, column, row)) for row in p] for column in columns]
        n, count_ = self.n, len(columns)
        # Only the rows of Phi and Gamma are off by more than rounding.
        moved = [off - int(-rest * one // 1) for one in self.moved[which]]
        sums = [sum(map(abs, one[:n])) for one in pushed]
        others = [off * sum(map(abs, one[n:])) for one in pushed]
        whole = sum(abs(entry) for row in p[:n] for entry in row[:n])
        slight = off * (2 * (rest + off) + off) * sum(abs(entry) for row in p for entry in row)
        middle, radius = [], []
        for i in range(count_):
            row, wide = [], []
            for j in range(count_):
                entry = -sum(map(mul, pushed[i], columns[j]))
                far = moved[j] * (sums[i] + moved[i] * whole) + moved[i] * sums[j] + others[i] + others[j] + slight
                if i < size and j < size:
                    entry += (self.P[c][i][j] << 2 * PLACES) - (weight * self.seen[i][j] << PLACES)
                    far += off * abs(self.seen[i][j]) << PLACES
                elif i == j:
                    entry += weight * self.level2 << PLACES
                    far += off * self.level2 << PLACES
                row.append(entry)
                wide.append(far)
            middle.append(row)
            radius.append(wide)
        return surely_positive(middle, radius)

    def require(self) -> None:
        """Refuse unless it holds for all periods, cell by cell."""
        storage = self.storage
        single = self.case.start == self.case.stop
        for cell, (left, right) in enumerate(pairwise(storage.cuts)):
            waiting = [(left, right, storage.pairs(cell), 0, Fraction(0) if single else None)]
            while waiting:
                start, stop, failed, halvings, curve = waiting.pop()
                # What bounds it on a piece does on a part of that.
                curve = self.curvature(start, stop) if curve is None else curve
                if curve is not None:
                    # From the chord it differs by at most this times length^2 / 8.
                    rest = -int(-(self.length(start, stop) ** 2) / 8 * curve * (1 << PLACES) // 1)
                    ends = {start} if single else {start, stop}
                    failed = [pair for pair in failed if not all(self.holds(end, rest, *pair) for end in ends)]
                    need(not failed or not single, "the inequality fails")
                need(not failed or halvings < HALVINGS, "the inequality fails, or is not decided")
                if failed:
                    middle = (start + stop) / 2
                    self.reached[middle] = (start, middle - start)
                    waiting += [(*ends_, failed, halvings + 1, curve) for ends_ in ((start, middle), (middle, stop))]


def require_level(case: Case, level: Fraction, storage: Any) -> None:
    """Refuse unless the storage proves the level for all sequences."""
    need(level > 0, "the level is not positive")
    Inequality(case, level, read_storage(storage, len(case.output[0]), case.cells)).require()


def gain_upper(given: Certificate) -> Proof:
    """The gain of a filter is at most so large."""
    (upper,) = given.stated("upper")
    (storage,) = take(given.witness, "witness", "storage")
    require_level(read_case(given)[0], upper, storage)
    return Proof(upper=upper)


def keeps_level(given: Certificate) -> Proof:
    """A filter has a level."""
    (upper,) = given.stated("upper")
    (storage,) = take(given.witness, "witness", "storage")
    case, (level,) = read_case(given, "level")
    need(upper <= positive(level, "level"), "the bound is above the level")
    require_level(case, upper, storage)
    return Proof(upper=upper, holds=True)


def optimum_upper(given: Certificate) -> Proof:
    """Some filter has a level."""
    (upper,) = given.stated("upper")
    filter_, storage = take(given.witness, "witness", "filter", "storage")
    require_level(read_case(given, filter_=filter_)[0], upper, storage)
    return Proof(upper=upper)


def stable(given: Certificate) -> Proof:
    """The error system is stable for every sequence."""
    given.stated()
    take(given.witness, "witness")
    read_case(given)[0].require_stable()
    return Proof(holds=True)


CHECKS = {
    "nonuniform.gain-upper": gain_upper,
    "nonuniform.keeps-level": keeps_level,
    "nonuniform.optimum-upper": optimum_upper,
    "nonuniform.stable": stable,
}
