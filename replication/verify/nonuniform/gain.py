"""Gain of the error system (5) over sampling sequences: Lyapunov functions above, periodic disturbances below.

The gain is the least g with sum w_k |e_k|^2 <= g^2 sum w_k |w_k|^2 from rest, for every disturbance and every sequence
of periods h_k in a range; the weights w_k are 1, or h_k for the gain per duration.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.balls import require_positive_definite
from replication.verify.algebra.linear import block, identity, zeros
from replication.verify.algebra.linear import require_positive_definite as require_definite
from replication.verify.nonuniform.system import (
    Filter,
    Plant,
    Time,
    along,
    chord_remainder,
    error_output,
    error_step,
    require_stable,
    seconds,
    solved,
    step_at,
    widened,
)
from replication.verify.reading import MAX_ENTRIES, fields, integer, positive, rational, sequence, symmetric
from replication.verify.theorem import Refused, require

Pair = tuple[int, int]
Fails = Callable[[fmpq, fmpq, list[Pair]], list[Pair]]

HALVINGS = 24
"""Times that a piece of the range may be halved before the storage matrices are refused."""


def lyapunov_level(plant: Plant, filter_: Filter, ends: tuple[Time, Time], weight: str, bound: Any, given: Any) -> fmpq:
    """The level g of `bound`, after proving from the witness that no sequence with periods between `ends` exceeds it.

    `given` holds the cells that cut the range (shares from 0 to 1), the storage matrices P_c, and `before`: the matrix
    that precedes P_d when the period lies in cell a. For every d, a and every h of the cell, with c = before[d][a],

        [P_c - w C'C, 0; 0, w g^2 I] - M' P_d M > 0,   M = [A-bar(h), B-bar(h)], C = C-bar, w = 1 or h.

    For a finite sequence of periods choose any matrix at its end, and go backwards: at each step x'P_c x covers what is
    still to come, x+'P_d x+ + w |e|^2 <= x'P_c x + w g^2 |w|^2. Summed from rest, that is the bound.
    """
    (stated,) = fields(bound, "bound", "upper")
    level = positive(stated, "bound.upper")
    shares, before, P = _automaton(given, plant.A.nrows() + filter_.A.nrows())
    for c, storage in enumerate(P):
        require_definite(storage, f"P[{c}]")
    proof = _Inequality(plant, filter_, weight, level, [arb_mat(storage) for storage in P], ends)
    for letter, (a, b) in enumerate(pairwise(shares)):
        require_everywhere(proof.fails, a, b, [(row[letter], d) for d, row in enumerate(before)], HALVINGS)
    return level


def _automaton(given: Any, size: int) -> tuple[list[fmpq], list[list[int]], list[fmpq_mat]]:
    """Cells that cover the range exactly, a preceding matrix for each matrix and cell, and the matrices."""
    edges, rows, matrices = fields(given, "witness.storage", "cells", "before", "P")
    shares = sequence(edges, "witness.storage.cells", rational)
    increasing = all(a < b for a, b in pairwise(shares))
    require(shares[:1] == [0] and shares[-1:] == [1] and increasing, "witness.storage.cells must rise from 0 to 1")
    P = sequence(matrices, "witness.storage.P", lambda value, path: symmetric(value, path, size))
    require(P != [], "witness.storage.P must not be empty")
    cells = len(list(pairwise(shares)))
    before = sequence(rows, "witness.storage.before", lambda row, path: sequence(row, path, integer, cells), len(P))
    outside = [c for row in before for c in row if c >= len(P)]
    require(not outside, f"witness.storage.before points at P{outside[:1]}, but there are {len(P)} matrices")
    return shares, before, P


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
    """The inequality of `lyapunov_level` on pieces of the range."""

    def __init__(
        self, plant: Plant, filter_: Filter, weight: str, level: fmpq, P: list[arb_mat], ends: tuple[Time, Time]
    ) -> None:
        require(weight in ("samples", "duration"), f"the weight must be samples or duration, got {weight!r:.20}")
        self.plant, self.filter, self.weight, self.P, self.ends = plant, filter_, weight, P, ends
        output = error_output(plant, filter_)
        states, inputs = output.ncols(), plant.B.ncols()
        demanded = -(output.transpose() * output)
        supplied = identity(inputs) * level**2
        corner = zeros(states, inputs)
        self.paid = arb_mat(block([[demanded, corner], [corner.transpose(), supplied]]))
        self.kept = arb_mat(block([[identity(states), corner]]))

    def fails(self, a: fmpq, b: fmpq, transitions: list[Pair]) -> list[Pair]:
        """The pairs (c, d) for which the inequality is not proved at every period between the shares a and b.

        It is concave in M and w together (P_d > 0), so that it need hold only at both ends of a chord, each with the
        remainder of the chord as the radius of a ball.
        """
        start, stop = (seconds(along(*self.ends, share)) for share in (a, b))
        rest = chord_remainder(self.plant, start, stop - start)
        corners = [
            (error_step(self.plant, self.filter, widened(step_at(self.plant, h), rest)), h) for h in (start, stop)
        ]
        return [pair for pair in transitions if not all(self._holds(pair, M, h) for M, h in corners)]

    def _holds(self, pair: Pair, M: arb_mat, h: arb) -> bool:
        before, after = (self.P[i] for i in pair)
        paid = self.paid * h if self.weight == "duration" else self.paid
        try:
            room = self.kept.transpose() * before * self.kept + paid - M.transpose() * after * M
            require_positive_definite(room, "the storage inequality")
        except Refused:
            return False
        return True


def attained_level(plant: Plant, filter_: Filter, ends: tuple[Time, Time], weight: str, bound: Any, given: Any) -> fmpq:
    """The level of `bound`, after proving that a periodic sequence of periods and a disturbance exceed it.

    `given` holds the pattern of periods, as shares of the way between `ends` with numbers of samples, a point z of the
    unit circle by t = tan(arg(z) / 2), and the complex disturbances w_0 ... w_{p-1} of a pattern. With w_{k+p} = z w_k
    the stable error system tends to a motion with x_p = z x_0, whose ratio of sum |e|^2 to sum |w|^2 over a pattern is
    what the ratio over N patterns tends to as N grows; the real or the imaginary part of w attains at least as much.
    """
    (stated,) = fields(bound, "bound", "lower")
    level = positive(stated, "bound.lower")
    require(weight in ("samples", "duration"), f"the weight must be samples or duration, got {weight!r:.20}")
    require_stable(plant, filter_)
    runs, turn, disturbances = fields(given, "witness", "pattern", "turn", "w")
    periods = _pattern(runs, ends)
    inputs = plant.B.ncols()
    w = sequence(disturbances, "witness.w", lambda value, path: complex_vector(value, path, inputs), len(periods))
    steps = {time: acb_mat(error_step(plant, filter_, step_at(plant, seconds(time)))) for time in set(periods)}
    states = plant.A.nrows() + filter_.A.nrows()
    through, forced = acb_mat(identity(states)), acb_mat(zeros(states, 1))
    frame = acb_mat(block([[identity(states)], [zeros(inputs, states)]]))
    for k, time in enumerate(periods):
        through = steps[time] * frame * through
        forced = _advance(steps[time], forced, w[k])
    z = circle_point(rational(turn, "witness.turn"))
    x = solved(acb_mat(identity(states)) * z - through, forced, "zI - A")
    output = acb_mat(error_output(plant, filter_))
    errors, supplied = [], []
    for k, time in enumerate(periods):
        seen, given_ = energy(output * x), energy(w[k])
        errors.append(seen * seconds(time) if weight == "duration" else seen)
        supplied.append(given_ * seconds(time) if weight == "duration" else given_)
        x = _advance(steps[time], x, w[k])
    require_ratio(total(errors), total(supplied), level, "the disturbance")
    return level


def _pattern(value: Any, ends: tuple[Time, Time]) -> list[Time]:
    """The periods of one pattern from pairs [share of the way between the ends, number of samples]."""

    def run(pair: Any, path: str) -> tuple[Time, int]:
        require(isinstance(pair, list) and len(pair) == 2, f"{path} must be [share, samples]")
        share = rational(pair[0], path)
        require(0 <= share <= 1, f"{path} must lie between the ends: a share from 0 to 1")
        return along(*ends, share), integer(pair[1], path, 1)

    runs = sequence(value, "witness.pattern", run)
    samples = sum(count for _, count in runs)
    require(samples <= MAX_ENTRIES, f"witness.pattern has {samples} samples, more than {MAX_ENTRIES}")
    return [time for time, count in runs for _ in range(count)]


def complex_vector(value: Any, path: str, size: int) -> acb_mat:
    """A column of complex numbers from pairs [real, imaginary]."""
    pairs = sequence(value, path, lambda entry, where: sequence(entry, where, rational, 2), size)
    return acb_mat(size, 1, [acb(arb(real), arb(imaginary)) for real, imaginary in pairs])


def _advance(step: acb_mat, x: acb_mat, drive: acb_mat) -> acb_mat:
    """A-bar x + B-bar w."""
    return step * acb_mat(x.tolist() + drive.tolist())


def circle_point(t: fmpq) -> acb:
    """(1 + it) / (1 - it) = (1 - t^2 + 2it) / (1 + t^2), a point of the unit circle."""
    return acb(arb((1 - t * t) / (1 + t * t)), arb(2 * t / (1 + t * t)))


def energy(column: acb_mat) -> arb:
    """The sum of the squared moduli."""
    return total([entry.real * entry.real + entry.imag * entry.imag for entry in column.entries()])


def total(terms: Sequence[arb]) -> arb:
    """The sum of at least one term."""
    return sum(terms[1:], terms[0])


def require_ratio(seen: arb, supplied: arb, level: fmpq, what: str) -> None:
    """Refuse unless 0 < level^2 supplied < seen: both are energies, and the gain is then above `level`."""
    require(supplied > 0, f"{what} must not be zero")
    require(seen > level**2 * supplied, f"{what} does not attain {level}: {(seen / supplied).sqrt()}")
