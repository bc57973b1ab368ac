"""The plant of the nonuniform-sampling paper, its filter, and what both are at a period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from replication.recheck.exact import Complex, blocks, characteristic, is_hurwitz, is_schur, nought, scaled, times, unit
from replication.recheck.interval import Interval, enclosed, exponential, pi
from replication.recheck.reading import (
    Certificate,
    Matrix,
    matrix,
    need,
    number,
    one_of,
    several,
    small,
    square,
    take,
)

MOST_STATES = 10

Time = tuple[Fraction, Fraction]
"""(a, b) stands for a + b pi seconds."""


@dataclass(frozen=True)
class Plant:
    """x' = A x + B w, y = C x + D w, z = L x, and the range of periods."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    L: Matrix
    low: Time
    high: Time

    def time(self, name: Any) -> Time:
        """The period that goes by a name."""
        chosen = one_of(name, "period", "h_l", "h_u", "middle")
        return {"h_l": self.low, "h_u": self.high, "middle": between(self.low, self.high, Fraction(1, 2))}[chosen]

    def step(self, h: Any) -> Matrix:
        """[Phi(h), Gamma(h)]."""
        whole = exponential(scaled(h, self.generator))
        return whole[: len(self.A)]

    @property
    def generator(self) -> Matrix:
        """N = [A, B; 0, 0]."""
        n, m = len(self.A), len(self.B[0])
        return blocks([[self.A, self.B], [nought(m, n + m)]])


@dataclass(frozen=True)
class Filter:
    """(A_f, B_f, C_f) of (4)."""

    A: Matrix
    B: Matrix
    C: Matrix


def between(start: Time, stop: Time, share: Fraction) -> Time:
    """The time that divides the way from one to the other."""
    return start[0] + share * (stop[0] - start[0]), start[1] + share * (stop[1] - start[1])


def seconds(time: Time) -> Interval:
    """a + b pi."""
    answer: Interval = Interval.of(time[0]) + (pi() * time[1] if time[1] else 0)
    return answer


def read_plant(plant: Mapping[str, Any]) -> Plant:
    """The plant of a certificate."""
    names = ("name", "A", "B", "C", "D", "L", "h_l", "h_u", *(["filter"] if "filter" in plant else []))
    _, a, b, c, d, out, low, high, *_ = take(plant, "plant", *names)
    state = square(a, "A")
    small(len(state) <= MOST_STATES, f"more than {MOST_STATES} states")
    drive, seen = matrix(b, "B", len(state)), matrix(c, "C", None, len(state))
    ends = [several(end, "h", number, 2) for end in (low, high)]
    found = Plant(
        state,
        drive,
        seen,
        matrix(d, "D", len(seen), len(drive[0])),
        matrix(out, "L", None, len(state)),
        (ends[0][0], ends[0][1]),
        (ends[1][0], ends[1][1]),
    )
    need(seconds(found.low) > 0 and seconds(found.high) > seconds(found.low), "the range is none")
    return found


def printed_filter(given: Certificate, plant: Plant) -> Filter:
    """The filter that stands with the plant of a certificate."""
    need("filter" in given.plant, "no filter stands with the plant")
    return read_filter(given.plant["filter"], plant)


def read_filter(value: Any, plant: Plant) -> Filter:
    """A filter that fits the plant."""
    a, b, c = take(value, "filter", "A", "B", "C")
    state = square(a, "A_f")
    small(len(state) <= MOST_STATES, f"more than {MOST_STATES} states")
    return Filter(state, matrix(b, "B_f", len(state), len(plant.C)), matrix(c, "C_f", len(plant.L), len(state)))


@dataclass(frozen=True)
class Case:
    """The error of a filter over a range of periods: x+ = [[Phi, Gamma] F; R] [x; w], e = output x.

    F is that of the cell in which the period before lies; the cells end at these shares, from 0 to 1.
    """

    plant: Plant
    start: Time
    stop: Time
    by_duration: bool
    output: Matrix
    cells: list[Fraction]
    F: list[Matrix]
    R: Matrix

    def step_after(self, cell: int, step: Matrix) -> Matrix:
        """[A-bar, B-bar] after a cell, from [Phi, Gamma]."""
        return [*times(step, self.F[cell]), *self.R]

    def weight(self, h: Any) -> Any:
        """Of a sample with this period."""
        return h if self.by_duration else Fraction(1)

    def require_stable(self) -> None:
        """Refuse unless A is Hurwitz and A_f, which stands in R, is Schur."""
        n = len(self.plant.A)
        need(is_hurwitz(self.plant.A), "A is not Hurwitz")
        need(is_schur(characteristic([row[n : n + len(self.R)] for row in self.R])), "A_f is not Schur")


def case_of(plant: Plant, own: Filter, start: Time, stop: Time, by_duration: bool = False) -> Case:
    """That of a filter (4): x and w enter the plant, and the filter goes on by itself."""
    n, m, nf = len(plant.A), len(plant.B[0]), len(own.A)
    enters = blocks([[unit(n), nought(n, nf + m)], [nought(m, n + nf), unit(m)]])
    goes_on = blocks([[times(own.B, plant.C), own.A, times(own.B, plant.D)]])
    output = blocks([[plant.L, scaled(-1, own.C)]])
    return Case(plant, start, stop, by_duration, output, [Fraction(0), Fraction(1)], [enters], goes_on)


def read_case(given: Certificate, *more: str, filter_: Any = None) -> tuple[Case, list[Any]]:
    """The case of a certificate; the filter stands with the plant, among the parameters, or in the witness."""
    plant = read_plant(given.plant)
    names = ("from", "to", "weight", *more)
    if filter_ is None and "filter" not in given.plant:
        *values, filter_ = take(given.parameters, "parameters", *names, "filter")
    else:
        values = list(take(given.parameters, "parameters", *names))
    start, stop = plant.time(values[0]), plant.time(values[1])
    need(start == stop or seconds(start) < seconds(stop), "the range is empty")
    weight = one_of(values[2], "weight", "samples", "duration")
    own = read_filter(given.plant["filter"] if filter_ is None else filter_, plant)
    return case_of(plant, own, start, stop, weight == "duration"), values[3:]


def on_circle(turn: Any) -> Complex:
    """((1 - t^2) + 2it)/(1 + t^2)."""
    t = number(turn, "turn")
    return Complex((1 - t * t) / (1 + t * t), 2 * t / (1 + t * t))


def complex_column(value: Any, where: str, size: int) -> Matrix:
    """A column of complex numbers from pairs."""
    return [[Complex(*pair)] for pair in several(value, where, lambda pair, at: several(pair, at, number, 2), size)]


def modulus2(column: Matrix) -> Any:
    """The sum of the squares of the moduli."""
    return sum(Complex.of(entry).size2() for (entry,) in column)


def resolved(z: Complex, matrix_: Matrix) -> Matrix:
    """z - matrix, in complex intervals."""
    whole = enclosed(matrix_)
    return [
        [z - entry if i == j else Complex(-entry, Interval.of(0)) for j, entry in enumerate(row)]
        for i, row in enumerate(whole)
    ]
