"""Sec. IV-C: the plant with another diagonal of A, its poles, and what the printed gains (42) make of it."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from replication.recheck.exact import Complex, characteristic, minus, times, unit
from replication.recheck.multirate.levels import Schedule, Sensed, attained, schedule
from replication.recheck.reading import (
    Certificate,
    Matrix,
    Proof,
    matrix,
    need,
    number,
    positive,
    several,
    square,
    take,
)
from replication.recheck.roots import roots

Disc = tuple[Complex, Fraction]


def _plant(given: Certificate, *more: str) -> tuple[Matrix, Schedule, list[Matrix], list[Disc]]:
    """A with the stated diagonal, the schedule, further matrices, and the discs of the stated poles, in their order."""
    printed = _printed(given)
    periods, offsets, diagonal, *others = take(given.parameters, "parameters", "periods", "offsets", "diagonal", *more)
    a = square(printed["A"], "A")
    for i, entry in enumerate(several(diagonal, "diagonal", number, len(a))):
        a[i][i] = entry
    matched = _matched(printed, a)
    need(any(_outside(disc) for disc in matched), "no pole lies outside the unit circle")
    return a, schedule(periods, offsets), [matrix(value, "a matrix") for value in others], matched


def _printed(given: Certificate) -> dict[str, Any]:
    names = ("name", "A", "C", "L", "poles", "half_unit", "error_poles")
    return dict(zip(names, take(given.plant, "plant", *names), strict=True))


def _matched(printed: dict[str, Any], a: Matrix) -> list[Disc]:
    """The discs of the stated poles, in their order; refused unless A has these and no others."""
    stated = several(printed["poles"], "poles", lambda value, at: several(value, at, number, 2))
    half = positive(printed["half_unit"], "half_unit")
    matched = []
    for real, imaginary in stated:
        near = [
            (centre, radius)
            for centre, radius in roots(characteristic(a))
            if abs(centre.re - real) + radius <= half and abs(centre.im - imaginary) + radius <= half
        ]
        need(len(near) == 1, f"A has no pole, or several, at {real} and {imaginary}")
        matched += near
    need(sum(1 if imaginary == 0 else 2 for _, imaginary in stated) == len(a), "A has other poles too")
    return matched


def _outside(disc: Disc) -> bool:
    return bool(disc[0].size2() > (1 + disc[1]) ** 2)


def _inside(disc: Disc) -> bool:
    return bool(disc[1] < 1 and disc[0].size2() < (1 - disc[1]) ** 2)


def _around(value: Fraction, radius: Fraction) -> tuple[Fraction, Fraction]:
    return value - radius, value + radius


def poles(given: Certificate) -> Proof:
    """The poles of A are those that are stated, to their digits."""
    given.stated()
    take(given.witness, "witness")
    parts = []
    for centre, radius in _plant(given)[3]:
        parts += [_around(centre.re, radius), *([_around(centre.im, radius)] if centre.im != 0 else [])]
    return Proof(holds=True, items=tuple(parts))


def _loop(given: Certificate, a: Matrix, c: Matrix, planned: Schedule) -> list[Disc]:
    """The poles of A_e over one period with the printed gains."""
    gains = several(given.plant["L"], "L", lambda value, at: matrix(value, at, len(a), len(c)), planned.length)
    need(len(planned.periods) == len(c) and all(len(row) == len(a) for row in c), "C does not fit")
    product = unit(len(a))
    for k, gain in enumerate(gains):
        seen = [row if i in planned.measured(k) else [Fraction(0)] * len(a) for i, row in enumerate(c)]
        product = times(minus(a, times(gain, seen)), product)
    return roots(characteristic(product))


def same_setting(given: Certificate) -> Proof:
    """With the C of Sec. IV-A the gains (42) leave poles outside the unit circle, so the setting is another one."""
    given.stated()
    take(given.witness, "witness")
    a, planned, _, _ = _plant(given)
    found = _loop(given, a, matrix(given.plant["C"], "C"), planned)
    need(any(_outside(disc) for disc in found), "no pole of A_e lies outside the unit circle")
    return Proof(holds=False)


def free_setting(given: Certificate) -> Proof:
    """With an A of other entries, which has the stated poles, and the C of Sec. IV-A the gains (42) stabilise A_e."""
    given.stated()
    take(given.witness, "witness")
    periods, offsets, entries = take(given.parameters, "parameters", "periods", "offsets", "A")
    a = square(entries, "A")
    _matched(_printed(given), a)
    found = _loop(given, a, matrix(given.plant["C"], "C"), schedule(periods, offsets))
    need(all(map(_inside, found)), "a pole of A_e may lie outside the unit circle")
    return Proof(holds=True)


def error_poles(given: Certificate) -> Proof:
    """The poles of A_e with another C, all real, by their size as the stated ones; and whether they are stable."""
    given.stated()
    take(given.witness, "witness")
    a, planned, (c,), _ = _plant(given, "C")
    stated = several(given.plant["error_poles"], "error_poles", number)
    found = _loop(given, a, c, planned)
    need(len(stated) == len(found) and all(centre.im == 0 for centre, _ in found), "A_e has other poles than real ones")
    stable = all(map(_inside, found))
    need(stable or any(map(_outside, found)), "whether the poles of A_e lie in the unit circle is not decided")
    order = sorted(range(len(stated)), key=lambda i: abs(stated[i]))
    ranked = sorted(found, key=lambda disc: abs(disc[0].re))
    items: dict[int, Any] = {place: _around(disc[0].re, disc[1]) for place, disc in zip(order, ranked, strict=True)}
    return Proof(holds=stable, items=tuple(items[i] for i in range(len(stated))))


def design(given: Certificate) -> Proof:
    """A level that Theorem 2 reaches for the plant with this diagonal, C, B_d and D."""
    (upper,) = given.stated("upper")
    a, planned, (c, b, d), _ = _plant(given, "C", "B_d", "D")
    need(upper > 0 and len(planned.periods) == len(c) == len(d) and len(b) == len(a), "the sizes do not fit")
    p, y = take(given.witness, "witness", "P", "Y")
    attained(Sensed(a, b, c, d, unit(len(a)), planned), p, y, upper)
    return Proof(upper=upper, holds=True)


CHECKS = {
    "multirate.recovered-poles": poles,
    "multirate.same-setting": same_setting,
    "multirate.free-setting": free_setting,
    "multirate.recovered-error-poles": error_poles,
    "multirate.recovered-design": design,
}
