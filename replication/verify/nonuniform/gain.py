"""Gain of the error system (5) over sampling sequences: Lyapunov functions above, periodic disturbances below.

The gain is the least g with sum w_k |e_k|^2 <= g^2 sum w_k |w_k|^2 from rest, for every disturbance and every sequence
of periods h_k in a range; the weights w_k are 1, or h_k for the gain per duration.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

from flint import acb_mat, arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.linear import (
    amplitudes,
    block,
    circle_point,
    complex_of,
    energy,
    identity,
    parts,
    resolved,
    zeros,
)
from replication.verify.algebra.work import BALL, STEP, spend
from replication.verify.kernel import decide, definite, holds, less
from replication.verify.nonuniform import system
from replication.verify.nonuniform.system import ONE_CELL, Case, Plant
from replication.verify.reading import MAX_ENTRIES, fields, integer, rational, sequence, several, sized, symmetric
from replication.verify.statement import Depends, Table
from replication.verify.theorem import Refused, require

Pair = tuple[int, int]
Fails = Callable[[fmpq, fmpq, list[Pair]], list[Pair]]
Corner = tuple[arb_mat, list[arb_mat]]
"""What is paid at a period, and the steps, one for each gain of the filter."""

HALVINGS = 24
"""Times that a piece of the range may be halved before the storage matrices are refused."""


@dataclass(frozen=True)
class Storage:
    """The ends of the cells that cut the range, as shares; for each state and cell the state before it; the matrices,
    those of all states for the first gain of the filter, then for the next; for each cell the gain that follows it."""

    shares: list[fmpq]
    before: list[list[int]]
    P: list[fmpq_mat]
    following: list[int]

    def transitions(self, cell: int) -> list[Pair]:
        """For each state and gain the matrix before and the one after a period in a cell."""
        states, after = len(self.before), len(self.before) * self.following[cell]
        return [
            (start + row[cell], after + d)
            for start in range(0, len(self.P), states)
            for d, row in enumerate(self.before)
        ]


def read_cells(value: Any, path: str) -> list[fmpq]:
    """Shares between which the cells of a range lie, one beside the other."""
    shares = sequence(value, path, rational)
    increasing = all(a < b for a, b in pairwise(shares))
    require(shares[:1] == [0] and shares[-1:] == [1] and increasing, f"{path} must rise from 0 to 1")
    return shares


def read_storage(value: Any, path: str, size: int, known: Sequence[fmpq] = ONE_CELL) -> Storage:
    """Cells that cover the range exactly, a preceding state for each state and cell, and the matrices.

    known: the cells of the filter, each of which holds some of the storage's whole.
    """
    edges, rows, matrices = fields(value, path, "cells", "before", "P")
    shares = read_cells(edges, f"{path}.cells")
    require({*known} <= {*shares}, f"{path}.cells must have all those of the filter")
    P = sequence(matrices, f"{path}.P", sized(symmetric, size))
    require(P != [], f"{path}.P must not be empty")
    states, left = divmod(len(P), len(known) - 1)
    require(left == 0, f"{path}.P must have as many matrices for each gain of the filter")
    before = sequence(rows, f"{path}.before", sized(sequence, integer, len(shares) - 1), states)
    outside = [c for row in before for c in row if c >= states]
    require(not outside, f"{path}.before points at P{outside[:1]}, but there are {states} matrices")
    return Storage(shares, before, P, [system.cell_of(known, share) for share in shares[:-1]])


def require_level(plant: Plant, case: Case, level: fmpq, storage: Storage) -> None:
    """Refuse unless the storage proves that no sequence of the case exceeds the level g.

    With `before` the state that precedes d when the period lies in cell a: for every d, a and gain k of the filter, and
    every h of the cell, with c = before[d][a] and l the gain that follows periods in a,

        [P_kc - w C'C, 0; 0, w g^2 I] - M_k' P_ld M_k > 0,   M_k = [A-bar(h), B-bar(h)], C = C-bar, w = 1 or h.

    For a finite sequence of periods choose any state at its end, and go backwards: at each step x'P_kc x covers what is
    still to come, x+'P_ld x+ + w |e|^2 <= x'P_kc x + w g^2 |w|^2. Summed from rest, that is the bound.
    """
    # Of each transition four corners, with a few small matrices each, however small they are.
    spend((len(storage.shares) - 1) * len(storage.P) * 5 * STEP, "the storage inequality")
    for c, matrix in enumerate(storage.P):
        decide(definite(matrix, f"P[{c}]"))
    proof = _Inequality(plant, case, level, [arb_mat(matrix) for matrix in storage.P])
    for cell, (a, b) in enumerate(pairwise(storage.shares)):
        require_everywhere(proof.fails, a, b, storage.transitions(cell), HALVINGS)


def require_at(plant: Plant, case: Case, level: fmpq, P: fmpq_mat, h: arb) -> None:
    """Refuse unless the inequality of `require_level` holds with one matrix at every period in a ball."""
    proof = _Inequality(plant, case, level, [arb_mat(P)])
    require(proof.holds((0, 0), proof.corner(system.step_at(plant, h), h)), f"(6) is not proved at {h.str(6)} s")


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
        self.plant, self.case, self.P, self.time = plant, case, P, case.time
        self.states = len(P) // (len(case.filter.cells) - 1)
        output = case.filter.output(plant)
        states, inputs = output.ncols(), plant.B.ncols()
        demanded = -(output.transpose() * output)
        supplied = identity(inputs) * level**2
        corner = zeros(states, inputs)
        self.paid = arb_mat(block([[demanded, corner], [corner.transpose(), supplied]]))
        self.kept = arb_mat(block([[identity(states), corner]]))
        self.before = [self.kept.transpose() * matrix * self.kept for matrix in P]
        # By share, e^{N h} there; by the width of a piece, its balls over all h from 0 to that.
        self.flow = cache(lambda share: system.flow(plant, self.time(share)))
        self.spread = cache(lambda share: system.flow(plant, arb(0).union(self.time(share) - self.time(fmpq(0)))))
        self.at_end = cache(lambda share: self.corner(system.upper_rows(plant, self.flow(share)), self.time(share)))
        self.holds_at_end = cache(lambda pair, share: self.holds(pair, self.at_end(share)))

    def fails(self, a: fmpq, b: fmpq, transitions: list[Pair]) -> list[Pair]:
        """The pairs (c, d) for which the inequality is not proved at every period between the shares a and b.

        It is concave in M and w together (P_d > 0). At the part s of the way from one end of the piece to the other
        [Phi, Gamma] is the point s of the chord, less 4 s (1 - s) times a matrix in the balls of `bend`. So it lies
        between the corners: both ends, and both less that matrix.
        """
        spend((len(transitions) + 5) * (self.kept.nrows() + self.kept.ncols()) ** 3 * BALL, "the storage inequality")
        less = system.bend(self.plant, self.flow(a), self.spread(b - a), self.time(b) - self.time(a))
        bent = [self.corner(system.upper_rows(self.plant, self.flow(end)) - less, self.time(end)) for end in (a, b)]
        return [
            pair
            for pair in transitions
            if not all(self.holds_at_end(pair, end) for end in (a, b))
            or not all(self.holds(pair, corner) for corner in bent)
        ]

    def corner(self, step: arb_mat, h: arb) -> Corner:
        """What the inequality is about for a step in balls at the period h."""
        paid = self.paid * h if self.case.weight == "duration" else self.paid
        return paid, self.case.filter.steps(self.plant, step)

    def holds(self, pair: Pair, corner: Corner) -> bool:
        """Whether it holds there."""
        before, after, (paid, steps) = self.before[pair[0]], self.P[pair[1]], corner
        M = steps[pair[0] // self.states]
        return holds(definite(before + paid - M.transpose() * after * M, "the storage inequality"))


def read_pattern(value: Any, path: str) -> list[fmpq]:
    """The periods of one pattern, as shares of the way between the ends, from pairs [share, number of samples]."""

    def run(pair: Any, path: str) -> tuple[fmpq, int]:
        require(isinstance(pair, list) and len(pair) == 2, f"{path} must be [share, samples]")
        share = rational(pair[0], path)
        require(0 <= share <= 1, f"{path} must lie between the ends: a share from 0 to 1")
        return share, integer(pair[1], path, 1)

    runs = several(value, path, run)
    samples = sum(count for _, count in runs)
    require(samples <= MAX_ENTRIES, f"{path} has {samples} samples, more than {MAX_ENTRIES}")
    return [share for share, count in runs for _ in range(count)]


def complex_vector(value: Any, path: str, size: int) -> acb_mat:
    """A column of complex numbers from pairs [real, imaginary]."""
    pairs = sequence(value, path, sized(sequence, rational, 2), size)
    return acb_mat(size, 1, [complex_of(pair) for pair in pairs])


ATTAINED: Table = {
    "pattern": read_pattern,
    "turn": rational,
    "w": Depends(lambda values: sized(sequence, sized(complex_vector, values.plant.B.ncols()), len(values.pattern))),
}
"""The witness of a gain: a motion, as `require_motion` takes it."""


def require_attained(plant: Plant, case: Case, level: fmpq, **motion: Any) -> None:
    """Refuse unless a pattern of periods and a disturbance, repeated for ever, exceed the level."""
    system.require_stable(plant, case.filter)
    require_motion(plant, case, level, **motion)


def require_motion(plant: Plant, case: Case, level: fmpq, pattern: list[fmpq], turn: fmpq, w: list[acb_mat]) -> None:
    """`require_attained` for an error system that is known to be stable for every sequence.

    z = circle_point(turn), w_0 ... w_{p-1} are the complex disturbances of a pattern. With w_{k+p} = z w_k
    the stable error system tends to a motion with x_p = z x_0, whose ratio of sum |e|^2 to sum |w|^2 over a pattern is
    what the ratio over N patterns tends to as N grows; the real or the imaginary part of w attains at least as much.
    """
    z, output, inputs = circle_point(turn), arb_mat(case.filter.output(plant)), plant.B.ncols()
    states, cells = output.ncols(), case.filter.cells
    distinct = set(pattern)
    spend(
        (len(pattern) + 30 * len(distinct) * len(cells)) * (states + inputs) ** 3 * BALL, "the motion under the pattern"
    )
    times = {share: case.time(share) for share in distinct}
    moves = {share: case.filter.steps(plant, system.step_at(plant, h)) for share, h in times.items()}
    gains = [system.cell_of(cells, share) for share in (pattern[-1], *pattern[:-1])]
    steps = [moves[share][gain] for share, gain in zip(pattern, gains, strict=True)]
    drives = [parts(vector.entries()) for vector in w]
    through, forced = arb_mat(identity(states)), arb_mat(states, 2)
    frame = arb_mat(block([[identity(states)], [zeros(inputs, states)]]))
    for step, drive in zip(steps, drives, strict=True):
        through = step * frame * through
        forced = _advance(step, forced, drive)
    end = acb_mat([[entry] for entry in amplitudes(forced)])
    x = parts(resolved(through, z, end).entries())
    seen, supplied = arb(0), arb(0)
    for share, step, drive in zip(pattern, steps, drives, strict=True):
        weight = times[share] if case.weight == "duration" else arb(1)
        seen += energy(output * x) * weight
        supplied += energy(drive) * weight
        x = _advance(step, x, drive)
    require_ratio(seen, supplied, level, "the disturbance")


def _advance(step: arb_mat, x: arb_mat, drive: arb_mat) -> arb_mat:
    """A-bar x + B-bar w."""
    return step * arb_mat(x.tolist() + drive.tolist())


def require_ratio(seen: arb, supplied: arb, level: fmpq, what: str) -> None:
    """Refuse unless 0 < level^2 supplied < seen: both are energies, and the gain is then above `level`."""
    decide(less(0, supplied, f"{what} must not be zero"))
    decide(less(level**2 * supplied, seen, f"{what} does not attain {level}: {(seen / supplied).sqrt()}"))
