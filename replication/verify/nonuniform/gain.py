"""Gain of the error system (5) over sampling sequences: Lyapunov functions above, periodic disturbances below.

The gain is the least g with sum w_k |e_k|^2 <= g^2 sum w_k |w_k|^2 from rest, for every disturbance and every sequence
of periods h_k in a range; the weights w_k are 1, or h_k for the gain per duration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.balls import complex_of, energy
from replication.verify.algebra.linear import block, identity, solved, zeros
from replication.verify.algebra.work import BALL, spend
from replication.verify.kernel import Below, Positive, decide, holds
from replication.verify.nonuniform import system
from replication.verify.nonuniform.system import Case, Ends, Plant, Time
from replication.verify.reading import MAX_ENTRIES, fields, integer, rational, sequence, sized, symmetric
from replication.verify.theorem import Refused, require

Pair = tuple[int, int]
Fails = Callable[[fmpq, fmpq, list[Pair]], list[Pair]]

HALVINGS = 24
"""Times that a piece of the range may be halved before the storage matrices are refused."""


@dataclass(frozen=True)
class Storage:
    """The ends of the cells that cut the range, as shares; for each matrix and cell the one before it; the matrices."""

    shares: list[fmpq]
    before: list[list[int]]
    P: list[fmpq_mat]


def read_storage(value: Any, path: str, size: int) -> Storage:
    """Cells that cover the range exactly, a preceding matrix for each matrix and cell, and the matrices."""
    edges, rows, matrices = fields(value, path, "cells", "before", "P")
    shares = sequence(edges, f"{path}.cells", rational)
    increasing = all(a < b for a, b in pairwise(shares))
    require(shares[:1] == [0] and shares[-1:] == [1] and increasing, f"{path}.cells must rise from 0 to 1")
    P = sequence(matrices, f"{path}.P", sized(symmetric, size))
    require(P != [], f"{path}.P must not be empty")
    cells = len(list(pairwise(shares)))
    before = sequence(rows, f"{path}.before", sized(sequence, integer, cells), len(P))
    outside = [c for row in before for c in row if c >= len(P)]
    require(not outside, f"{path}.before points at P{outside[:1]}, but there are {len(P)} matrices")
    return Storage(shares, before, P)


def require_level(plant: Plant, case: Case, level: fmpq, storage: Storage) -> None:
    """Refuse unless the storage proves that no sequence of the case exceeds the level g.

    With `before` the matrix that precedes P_d when the period lies in cell a: for every d, a and every h of the cell,
    with c = before[d][a],

        [P_c - w C'C, 0; 0, w g^2 I] - M' P_d M > 0,   M = [A-bar(h), B-bar(h)], C = C-bar, w = 1 or h.

    For a finite sequence of periods choose any matrix at its end, and go backwards: at each step x'P_c x covers what is
    still to come, x+'P_d x+ + w |e|^2 <= x'P_c x + w g^2 |w|^2. Summed from rest, that is the bound.
    """
    for c, matrix in enumerate(storage.P):
        decide(Positive(matrix, f"P[{c}]"))
    proof = _Inequality(plant, case, level, [arb_mat(matrix) for matrix in storage.P])
    for letter, (a, b) in enumerate(pairwise(storage.shares)):
        require_everywhere(proof.fails, a, b, [(row[letter], d) for d, row in enumerate(storage.before)], HALVINGS)


def require_at(plant: Plant, case: Case, level: fmpq, P: fmpq_mat, h: arb) -> None:
    """Refuse unless the inequality of `require_level` holds with one matrix at every period in a ball."""
    M = system.error_step(plant, case.filter, system.step_at(plant, h))
    require(_Inequality(plant, case, level, [arb_mat(P)]).holds((0, 0), M, h), f"(6) is not proved at {h.str(6)} s")


def require_everywhere(fails: Fails, a: fmpq, b: fmpq, transitions: list[Pair], halvings: int) -> None:
    """Refuse unless no transition fails between a and b; those that do are tried again on both halves."""
    left = fails(a, b, transitions)
    if left and halvings <= 0:
        c, d = left[0]
        raise Refused(f"the storage inequality from P[{c}] to P[{d}] is not proved between the shares {a} and {b}")
    if left:
        middle = (a + b) / 2
        require_everywhere(fails, a, middle, left, halvings - 1)
        require_everywhere(fails, middle, b, left, halvings - 1)


class _Inequality:
    """The inequality of `require_level` on pieces of the range."""

    def __init__(self, plant: Plant, case: Case, level: fmpq, P: list[arb_mat]) -> None:
        self.plant, self.case, self.P = plant, case, P
        output = system.error_output(plant, case.filter)
        states, inputs = output.ncols(), plant.B.ncols()
        demanded = -(output.transpose() * output)
        supplied = identity(inputs) * level**2
        corner = zeros(states, inputs)
        self.paid = arb_mat(block([[demanded, corner], [corner.transpose(), supplied]]))
        self.kept = arb_mat(block([[identity(states), corner]]))

    def fails(self, a: fmpq, b: fmpq, transitions: list[Pair]) -> list[Pair]:
        """The pairs (c, d) for which the inequality is not proved at every period between the shares a and b.

        It is concave in M and w together (P_d > 0). At the part s of the way from one end of the piece to the other
        [Phi, Gamma] is the point s of the chord, less 4 s (1 - s) times a matrix in the balls of `bend`. So it lies
        between the corners: both ends, and both less that matrix.
        """
        spend((len(transitions) + 5) * (self.kept.nrows() + self.kept.ncols()) ** 3 * BALL, "the storage inequality")
        start, stop = (system.seconds(system.along(*self.case.ends, share)) for share in (a, b))
        less = system.bend(self.plant, start, stop - start)
        steps = [(system.step_at(self.plant, h), h) for h in (start, stop)]
        corners = [
            (system.error_step(self.plant, self.case.filter, step), h)
            for step, h in [*steps, *((step - less, h) for step, h in steps)]
        ]
        return [pair for pair in transitions if not all(self.holds(pair, M, h) for M, h in corners)]

    def holds(self, pair: Pair, M: arb_mat, h: arb) -> bool:
        """Whether it holds for every step M in balls, at the period h."""
        before, after = (self.P[i] for i in pair)
        paid = self.paid * h if self.case.weight == "duration" else self.paid
        room = self.kept.transpose() * before * self.kept + paid - M.transpose() * after * M
        return holds(Positive(room, "the storage inequality"))


def read_pattern(value: Any, path: str, ends: Ends) -> list[Time]:
    """The periods of one pattern from pairs [share of the way between the ends, number of samples]."""

    def run(pair: Any, path: str) -> tuple[Time, int]:
        require(isinstance(pair, list) and len(pair) == 2, f"{path} must be [share, samples]")
        share = rational(pair[0], path)
        require(0 <= share <= 1, f"{path} must lie between the ends: a share from 0 to 1")
        return system.along(*ends, share), integer(pair[1], path, 1)

    runs = sequence(value, path, run)
    samples = sum(count for _, count in runs)
    require(samples <= MAX_ENTRIES, f"{path} has {samples} samples, more than {MAX_ENTRIES}")
    return [time for time, count in runs for _ in range(count)]


def complex_vector(value: Any, path: str, size: int) -> acb_mat:
    """A column of complex numbers from pairs [real, imaginary]."""
    pairs = sequence(value, path, sized(sequence, rational, 2), size)
    return acb_mat(size, 1, [complex_of(pair) for pair in pairs])


def require_attained(plant: Plant, case: Case, level: fmpq, pattern: list[Time], z: acb, w: list[acb_mat]) -> None:
    """Refuse unless a pattern of periods and a disturbance, repeated for ever, exceed the level.

    z is a point of the unit circle, w_0 ... w_{p-1} are the complex disturbances of a pattern. With w_{k+p} = z w_k
    the stable error system tends to a motion with x_p = z x_0, whose ratio of sum |e|^2 to sum |w|^2 over a pattern is
    what the ratio over N patterns tends to as N grows; the real or the imaginary part of w attains at least as much.
    """
    system.require_stable(plant, case.filter)
    inputs, states = plant.B.ncols(), plant.A.nrows() + case.filter.A.nrows()
    steps = {
        time: acb_mat(system.error_step(plant, case.filter, system.step_at(plant, system.seconds(time))))
        for time in set(pattern)
    }
    spend((len(pattern) + 30 * len(steps)) * (states + inputs) ** 3 * BALL, "the motion under the pattern")
    through, forced = acb_mat(identity(states)), acb_mat(zeros(states, 1))
    frame = acb_mat(block([[identity(states)], [zeros(inputs, states)]]))
    for time, drive in zip(pattern, w, strict=True):
        through = steps[time] * frame * through
        forced = _advance(steps[time], forced, drive)
    x = solved(acb_mat(identity(states)) * z - through, forced, "zI - A is not proved invertible")
    output = acb_mat(system.error_output(plant, case.filter))
    seen, supplied = arb(0), arb(0)
    for time, drive in zip(pattern, w, strict=True):
        share = system.seconds(time) if case.weight == "duration" else arb(1)
        seen += energy(output * x) * share
        supplied += energy(drive) * share
        x = _advance(steps[time], x, drive)
    require_ratio(seen, supplied, level, "the disturbance")


def _advance(step: acb_mat, x: acb_mat, drive: acb_mat) -> acb_mat:
    """A-bar x + B-bar w."""
    return step * acb_mat(x.tolist() + drive.tolist())


def require_ratio(seen: arb, supplied: arb, level: fmpq, what: str) -> None:
    """Refuse unless 0 < level^2 supplied < seen: both are energies, and the gain is then above `level`."""
    decide(Below(0, supplied, f"{what} must not be zero"))
    decide(Below(level**2 * supplied, seen, f"{what} does not attain {level}: {(seen / supplied).sqrt()}"))
