"""Theorem 3 with sums of squares: a level from rational Gram matrices.

A form u'P u + 2 u' int Q f + int f'S f + int int f(s)'R(s, t)f(t) is kept by its coefficients, by place: ("P", i, j),
("Q", i, j, k) of s^k, ("S", i, j, k), ("R", i, j, k, m) of s^k t^m. P, S and R are symmetric.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from typing import Any

from replication.recheck.delay.levels import require_hidden, turning
from replication.recheck.delay.plant import Delayed, changed, read_plant
from replication.recheck.exact import is_positive
from replication.recheck.reading import (
    Certificate,
    Matrix,
    Proof,
    count,
    need,
    one_of,
    positive,
    several,
    symmetric,
    take,
)

MOST_DEGREE = 4

Place = tuple[Any, ...]
Form = dict[Place, Fraction]
WEIGHTS: tuple[dict[int, int], ...] = ({0: 1}, {1: -1, 2: -1})
"""1 and -s(s + 1), coefficients by power."""


@lru_cache
def moment(weight: int, power: int) -> Fraction:
    """The integral of the weight times s^power over [-1, 0]."""
    return sum((Fraction(c * (-1) ** (power + k), power + k + 1) for k, c in WEIGHTS[weight].items()), Fraction(0))


Entry = tuple[Any, ...]
"""Of zeta: ("u", i), ("f", i, a) for s^a f_i(s), ("h", i, a, b) for s^a times the integral of t^b f_i."""


def held(rule: str, a: int, b: int, most: int) -> bool:
    """Whether zeta has s^a times the integral of t^b f, a and b up to the degree of the rule.

    `most` is the degree under the weight: that of the rule, or one less. Of "outer" b is the same under both weights.
    """
    if rule == "total":
        return a + b <= most
    return {"tensor": max(a, b) <= most, "inner": b == 0 and a <= most, "outer": a == 0}[rule]


def entries(us: int, functions: int, degree: int, weight: int, rule: str) -> list[Entry]:
    """The entries of zeta in order, under a weight that takes this much from the degree of a rule."""
    most, powers = degree - weight, range(degree + 1)
    return [
        *(("u", i) for i in range(us)),
        *(("f", i, a) for a in range(most + 1) for i in range(functions)),
        *(("h", i, a, b) for a in powers for b in powers if held(rule, a, b, most) for i in range(functions)),
    ]


def narrow(rule: Any) -> str:
    """The rule of powers of one variable alone that a certificate names."""
    return one_of(rule, "rule", "inner", "outer")


def product(weight: int, left: Entry, right: Entry) -> Iterator[tuple[Place, Fraction]]:
    """Where the integral of weight * left * right has coefficients, for left before right in zeta.

    The term stands once; the one with both exchanged, which the symmetric matrix has too, stands beside it.
    """
    one = Fraction(1)
    kinds = left[0] + right[0]
    if kinds == "uu":
        yield ("P", left[1], right[1]), moment(weight, 0)
    elif kinds == "uf":
        for k, c in WEIGHTS[weight].items():
            yield ("Q", left[1], right[1], k + right[2]), one * c
    elif kinds == "uh":
        yield ("Q", left[1], right[1], right[3]), moment(weight, right[2])
    elif kinds == "ff":
        for k, c in WEIGHTS[weight].items():
            yield ("S", left[1], right[1], k + left[2] + right[2]), one * c
    elif kinds == "fh":
        for k, c in WEIGHTS[weight].items():
            yield ("R", left[1], right[1], k + left[2] + right[2], right[3]), one * c
    else:
        yield ("R", left[1], right[1], left[3], right[3]), moment(weight, left[2] + right[2])


def exchanged(place: Place) -> Place:
    """The place of the same coefficient with both sides exchanged."""
    if place[0] == "R":
        return ("R", place[2], place[1], place[4], place[3])
    return (place[0], place[2], place[1], *place[3:]) if place[0] != "Q" else place


def terms(weight: int, left: Entry, right: Entry) -> Iterator[tuple[Place, Fraction]]:
    """The form of left * right + right * left, halved on the diagonal: what a pair of symmetric entries adds."""
    for place, value in product(weight, left, right):
        if place[0] == "Q":
            yield place, value
        else:
            share = value if left != right else value / 2
            yield place, share
            yield exchanged(place), share


def squared(gram: list[Matrix], zetas: list[list[Entry]]) -> Form:
    """The sum of squares of Gram matrices, for both weights."""
    found: Form = defaultdict(Fraction)
    for weight, (one, zeta) in enumerate(zip(gram, zetas, strict=True)):
        for i, left in enumerate(zeta):
            for j in range(i, len(zeta)):
                if one[i][j]:
                    for place, value in terms(weight, left, zeta[j]):
                        found[place] += value * one[i][j]
    return found


class Error:
    """The error system e' = A0 e + [A_1 ..] l - B w with scaled histories, and forms of u = (w, v, e, l) on it."""

    def __init__(self, plant: Delayed) -> None:
        self.plant, n = plant, plant.n
        self.rates = [1 / delay for delay in plant.delays for _ in range(n)]
        self.w, self.v = len(plant.B[0]), len(plant.C10)
        self.e = self.w + self.v
        self.l = self.e + n
        self.functions = n * len(plant.delays)
        self.us = self.l + self.functions
        # By state: the coefficients of its rate in u.
        self.flow = [
            {
                k: value
                for k, value in enumerate(
                    [*(-b for b in plant.B[i]), *([0] * self.v), *plant.A0[i], *(x for a in plant.A for x in a[i])]
                )
                if value
            }
            for i in range(n)
        ]

    def measured(self, state: int) -> bool:
        """Whether y sees a state, or a history, of this number."""
        return state % self.plant.n >= self.plant.unmeasured

    def rate(self, place: Place) -> Iterator[tuple[Place, Fraction]]:
        """The rate of the term of V at a place, which stands for itself alone: u of V is e.

        S of V must not couple two delays; where it does, nothing is counted, and the coupling of a functional stands
        for any rate.
        """
        kind, i, j, *powers = place
        one, n = Fraction(1), self.plant.n
        if kind == "S" and i // n != j // n:
            return
        if kind == "P":
            for u, value in self.flow[i].items():
                yield from self._both("P", u, self.e + j, value / 2)
            for u, value in self.flow[j].items():
                yield from self._both("P", u, self.e + i, value / 2)
        elif kind == "Q":
            (k,), rate = powers, self.rates[j]
            for u, value in self.flow[i].items():
                yield ("Q", u, j, k), one * value
            # By parts: at 0 the history is e, at -1 it is l.
            if k == 0:
                yield from self._both("P", self.e + i, self.e + j % n, rate)
            yield from self._both("P", self.e + i, self.l + j, -rate * (-1) ** k)
            if k:
                yield ("Q", self.e + i, j, k - 1), -rate * k
        elif kind == "S":
            (k,), rate = powers, self.rates[i]
            if k == 0:
                yield ("P", self.e + i % n, self.e + j % n), rate
            yield ("P", self.l + i, self.l + j), -rate * (-1) ** k
            if k:
                yield ("S", i, j, k - 1), -rate * k
        else:
            k, m = powers
            if k == 0:
                yield ("Q", self.e + i % n, j, m), self.rates[i]
            yield ("Q", self.l + i, j, m), -self.rates[i] * (-1) ** k
            if k:
                yield ("R", i, j, k - 1, m), -self.rates[i] * k
            if m:
                yield ("R", i, j, k, m - 1), -self.rates[j] * m

    @staticmethod
    def _both(kind: str, i: int, j: int, value: Any) -> Iterator[tuple[Place, Fraction]]:
        """2 value u_i u_j, in a symmetric matrix."""
        yield (kind, i, j), Fraction(value)
        yield (kind, j, i), Fraction(value)

    def cancelled(self, place: Place) -> bool:
        """Whether 2 <(e, f), Z C2 (e, f)> reaches a coefficient."""
        kind, i, j, *_ = place
        if kind in ("S", "R"):
            return (self.measured(i) or self.measured(j)) and (kind == "R" or i // self.plant.n == j // self.plant.n)
        if min(i, j if kind == "P" else i) < self.e:
            return False
        if kind == "Q":
            return self._seen(i) if i >= self.l else self._seen(i) or self.measured(j)
        first, second = min(i, j), max(i, j)
        if first >= self.l:
            return False
        return self._seen(second) if second >= self.l else self._seen(first) or self._seen(second)

    def _seen(self, u: int) -> bool:
        return self.measured(u - self.e if u < self.l else u - self.l)

    def supplied(self, level: Fraction) -> Form:
        """-level (|w|^2 + |v|^2) + 2 v'z."""
        found: Form = defaultdict(Fraction)
        for i in range(self.e):
            found["P", i, i] -= level
        for i in range(self.v):
            outputs = [*self.plant.C10[i], *(x for c in self.plant.C1 for x in c[i])]
            for j, value in enumerate(outputs):
                for place, one in self._both("P", self.w + i, self.e + j, value):
                    found[place] += one
        return found


def require_squares(plant: Delayed, degree: int, level: Fraction, value: Any, rule: str = "tensor") -> None:
    """Refuse unless the identity of Theorem 3 holds with these Gram matrices, but for what Z cancels."""
    change, stored, dissipated = take(value, "sos", "change", "storage", "dissipation")
    need(1 <= degree <= MOST_DEGREE and level > 0, "the degree is too large, or the level not positive")
    system = Error(changed(plant, change))
    v, n = (several(grams, name, symmetric, 2) for grams, name in ((stored, "storage"), (dissipated, "dissipation")))
    of_v, of_n = (
        [entries(us, system.functions, degree, weight, rule) for weight in (0, 1)] for us in (plant.n, system.us)
    )
    for gram, zeta in zip([*v, *n], [*of_v, *of_n], strict=True):
        need(len(gram) == len(zeta), "a Gram matrix has another size")
        need(is_positive(gram), "a Gram matrix is not positive")
    storage, total = squared(v, of_v), squared(n, of_n)
    for place, one in system.supplied(level).items():
        total[place] += one
    for place, coefficient in storage.items():
        if coefficient:
            need(place[0] != "S" or place[1] // plant.n == place[2] // plant.n, "S of the storage couples two delays")
            for reached, one in system.rate(place):
                total[reached] += coefficient * one
    left = _symmetric(total)
    for place, one in left.items():
        need(one == 0 or system.cancelled(place), f"a coefficient is left at {place}")


def _symmetric(form: Form) -> Form:
    """The same form with symmetric P, S and R."""
    found: Form = defaultdict(Fraction)
    for place, one in form.items():
        found[place] += one / 2
        found[exchanged(place)] += one / 2
    return found


def _feasible(given: Certificate, degree: Any, rule: str) -> Proof:
    (upper,) = given.stated("upper")
    require_squares(read_plant(given.plant), count(degree, "degree", 1), upper, dict(given.witness), rule)
    return Proof(upper=upper)


def gain_upper(given: Certificate) -> Proof:
    """Theorem 3 is feasible at a level."""
    (degree,) = take(given.parameters, "parameters", "degree")
    return _feasible(given, degree, "tensor")


def total_upper(given: Certificate) -> Proof:
    """The same with powers of s and t that are at most the degree together."""
    (degree,) = take(given.parameters, "parameters", "degree")
    return _feasible(given, degree, "total")


def narrow_upper(given: Certificate) -> Proof:
    """The same with powers of one variable alone."""
    degree, rule = take(given.parameters, "parameters", "degree", "rule")
    return _feasible(given, degree, narrow(rule))


def near_optimal(given: Certificate) -> Proof:
    """The level of an observer, at most so many times that of any."""
    given.stated()
    degree, factor = take(given.parameters, "parameters", "degree", "factor")
    level, hidden, sos = take(given.witness, "witness", "level", "hidden", "sos")
    plant, reached = read_plant(given.plant), positive(level, "level")
    require_squares(plant, count(degree, "degree", 1), reached, sos)
    require_hidden(plant, reached / positive(factor, "factor"), hidden, turning)
    return Proof(holds=True)


CHECKS = {
    "delay.gain-upper": gain_upper,
    "delay.total-upper": total_upper,
    "delay.narrow-upper": narrow_upper,
    "delay.near-optimal": near_optimal,
}
