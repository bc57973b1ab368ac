"""The sampled plant and filter of the nonuniform-sampling paper, eqs. (1)-(5), in rationals and balls.

A time is a pair (a, b) of rationals and stands for a + b pi seconds, since one of the printed periods is pi/25.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.linear import block, generator
from replication.verify.kernel import decide, hurwitz, within
from replication.verify.reading import fields, matrix, one_of, rational, record, sequence, sized, states
from replication.verify.statement import statement
from replication.verify.theorem import Refused, require

PRECISION = 128
"""Bits of the balls."""

Time = tuple[fmpq, fmpq]
Ends = tuple[Time, Time]
PERIODS = ("h_l", "middle", "h_u")
"""Names of the periods of a range, in increasing order."""
PERIOD = sized(one_of, PERIODS)
"""The reader of such a name."""
ONE_CELL = (fmpq(0), fmpq(1))


@dataclass(frozen=True)
class Filter:
    """Eq. (4): A (nf, nf), B (nf, r), C (s, nf)."""

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat

    @property
    def cells(self) -> Sequence[fmpq]:
        """Where the cells end, as shares of the way between the ends of the range: it does not know the period."""
        return ONE_CELL

    def steps(self, plant: Plant, step: arb_mat) -> list[arb_mat]:
        """M = [A-bar, B-bar] of eq. (5) after each cell, for [Phi, Gamma] in a ball: (n + nf, n + nf + m)."""
        n, nf = plant.A.nrows(), self.A.nrows()
        upper = [[*row[:n], *[arb(0)] * nf, *row[n:]] for row in step.tolist()]
        lower = arb_mat(block([[self.B * plant.C, self.A, self.B * plant.D]])).tolist()
        return [arb_mat(upper + lower)]

    def output(self, plant: Plant) -> fmpq_mat:
        """C-bar = [L, -C_f] of eq. (5)."""
        return block([[plant.L, -self.C]])


@dataclass(frozen=True)
class Plant:
    """Eq. (1): A (n, n), B (n, m), C (r, n), D (r, m), L (s, n), the ends of the range of periods, a printed filter."""

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat
    D: fmpq_mat
    L: fmpq_mat
    h_l: Time
    h_u: Time
    filter: Filter | None = None

    @property
    def order(self) -> int:
        """The number n of states."""
        return int(self.A.nrows())

    @property
    def middle(self) -> Time:
        """The period in the middle of the range."""
        return self.along(fmpq(1, 2))

    def along(self, share: fmpq) -> Time:
        """The time that divides the range, exactly."""
        return along(self.h_l, self.h_u, share)

    @property
    def printed(self) -> Filter:
        """The filter that is printed with it; refused without one."""
        if self.filter is None:
            raise Refused("plant lacks the field filter")
        return self.filter

    def period(self, name: str) -> Time:
        """The one of `PERIODS` that goes by this name."""
        return (self.h_l, self.middle, self.h_u)[PERIODS.index(name)]


def read_plant(value: Any, path: str = "plant") -> Plant:
    """The plant of a certificate, shapes checked, with the filter that is printed with it, if any."""
    beside = ["filter"] if isinstance(value, dict) and "filter" in value else []
    A, B, C, D, L, *ends, _ = fields(value, path, "A", "B", "C", "D", "L", "h_l", "h_u", *beside, "name")
    A = states(A, f"{path}.A")
    n = A.nrows()
    B, C = matrix(B, f"{path}.B", rows=n), matrix(C, f"{path}.C", columns=n)
    D, L = matrix(D, f"{path}.D", C.nrows(), B.ncols()), matrix(L, f"{path}.L", columns=n)
    h_l, h_u = (read_time(end, f"{path}.{name}") for end, name in zip(ends[:2], ("h_l", "h_u"), strict=True))
    require(seconds(h_l) > 0, f"{path}.h_l must be positive")
    require(seconds(h_u) > seconds(h_l), f"{path}.h_u must exceed {path}.h_l")
    plant = Plant(A, B, C, D, L, h_l, h_u)
    return replace(plant, filter=read_filter(ends[2], f"{path}.filter", plant)) if beside else plant


def read_time(value: Any, path: str) -> Time:
    """A time from the strings of its two rationals."""
    a, b = sequence(value, path, rational, 2)
    return a, b


def read_filter(value: Any, path: str, plant: Plant) -> Filter:
    """A filter that fits the plant."""
    A, B, C = fields(value, path, "A", "B", "C")
    A = states(A, f"{path}.A")
    return Filter(
        A, matrix(B, f"{path}.B", A.nrows(), plant.C.nrows()), matrix(C, f"{path}.C", plant.L.nrows(), A.nrows())
    )


@dataclass(frozen=True, kw_only=True)
class Case:
    """A filter, both ends of a range of periods, a weight, and the level in question, or 0.

    filter: a `Filter`, or what else makes an error system x+ = M(h) [x; w], e = C-bar x by `cells`, `steps`, `output`.
    """

    ends: Ends
    weight: str
    filter: Any
    level: fmpq

    @property
    def scope(self) -> str:
        """For which sequences, and in which norm, in words."""
        low, high = map(in_words, self.ends)
        sequences = f"at the constant period {low} s" if low == high else f"over all periods from {low} to {high} s"
        return sequences + {"samples": "", "duration": ", both norms weighted by the periods,"}[self.weight]

    def time(self, share: fmpq) -> arb:
        """The period at this share of the way between the ends."""
        return seconds(along(*self.ends, share))

    @property
    def least(self) -> str:
        """The shortest period, in words."""
        return in_words(self.ends[0])


def in_words(time: Time) -> str:
    """A number of seconds, exactly."""
    rational_, pi = time
    return " + ".join([str(rational_)] * (rational_ != 0) + [f"{pi} pi"] * (pi != 0))


on_plant = partial(statement, source="mustafa", plant=read_plant, bits=PRECISION)
on_filtered = partial(on_plant, source="")
"""Statements on a plant, with the words of the paper, and on one with the filter that is printed with it."""


def ends_between(plant: Plant, first: str, last: str) -> Ends:
    """Both ends of the range of periods; refused if they stand in the wrong order."""
    require(PERIODS.index(first) <= PERIODS.index(last), "parameters.from exceeds parameters.to")
    return plant.period(first), plant.period(last)


SCOPE = {"from": PERIOD, "to": PERIOD, "weight": sized(one_of, ("samples", "duration"))}
"""weight: whether all samples count alike, or by their periods."""


def read_case(value: Any, path: str, plant: Plant, **more: Any) -> Case:
    """Range, weight and what is asked for beside: the filter stands with the plant if it is printed, else here."""
    filter_ = {} if plant.filter else {"filter": sized(read_filter, plant)}
    values = {"level": fmpq(0), "filter": plant.filter, **record(value, path, {**SCOPE, **more, **filter_})}
    return Case(ends=ends_between(plant, values.pop("from"), values.pop("to")), **values)


def seconds(time: Time) -> arb:
    """A ball that holds a + b pi."""
    return arb(time[0]) + arb(time[1]) * arb.pi()


def along(start: Time, stop: Time, share: fmpq) -> Time:
    """The time that divides the way from start to stop, exactly."""
    return start[0] + share * (stop[0] - start[0]), start[1] + share * (stop[1] - start[1])


def cell_of(cells: Sequence[fmpq], share: fmpq) -> int:
    """The cell in which a share lies; where two meet, the latter."""
    return sum(1 for edge in cells[1:-1] if edge <= share)


def flow(plant: Plant, h: arb) -> arb_mat:
    """e^{N h} for every h in a ball, N = [A, B; 0, 0]: its upper rows are [Phi(h), Gamma(h)]."""
    return (generator(plant.A, plant.B) * h).exp()


def upper_rows(plant: Plant, M: arb_mat) -> arb_mat:
    """Those of the states."""
    return arb_mat(M.tolist()[: plant.A.nrows()])


def step_at(plant: Plant, h: arb) -> arb_mat:
    """[Phi(h), Gamma(h)] of eq. (3) for every h in a ball, (n, n + m)."""
    return upper_rows(plant, flow(plant, h))


def bend(plant: Plant, start: arb_mat, spread: arb_mat, length: arb) -> arb_mat:
    """Balls of length^2 / 8 times N^2 e^{Nh}, the second derivative of [Phi, Gamma], over a piece of this length.

    So far a function is from its chord in the middle, and less elsewhere. start: e^{Nh} where the piece begins; spread:
    e^{Nh} for all h from zero to its length.
    """
    N = generator(plant.A, plant.B)
    return upper_rows(plant, N * N * start * spread) * (length * length / 8)


def require_stable(plant: Plant, filter_: Filter) -> None:
    """Refuse unless A is Hurwitz and A_f Schur: then (5) is exponentially stable for every sampling sequence.

    A-bar(h) is block triangular; a product of the Phi(h_k) is e^{A t} with t the sum of the h_k >= h_l > 0, and decays.
    """
    decide(hurwitz(plant.A, "the plant"))
    decide(within(filter_.A, "the poles of the filter"))
