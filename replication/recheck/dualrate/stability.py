"""Dual-rate loops without a reference: eigenvalues over one slow period; and what a reference then excites."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from replication.recheck.dualrate.loop import Loop, monodromy, read_loop, read_observer, steady
from replication.recheck.exact import Complex, characteristic, is_schur, minus, plus, scaled, times
from replication.recheck.interval import Interval
from replication.recheck.reading import Certificate, Matrix, Proof, need, number, one_of, positive, several, take
from replication.recheck.roots import distance


def require_within(loop: Loop, observer: str, radius: Fraction) -> None:
    """Refuse unless all eigenvalues lie inside a circle."""
    inside = is_schur(characteristic(monodromy(loop, observer)), radius)
    need(inside, f"an eigenvalue of {observer} may have a modulus of {float(radius):.9g} or more")


def eigenvalue(loop: Loop, observer: str, guess: Any) -> tuple[Complex, Interval]:
    """A point near the guess, and how far from it an eigenvalue is at most."""
    point = Complex(*several(guess, "root", number, 2))
    return point, distance(characteristic(monodromy(loop, observer)), point)


def require_beyond(loop: Loop, observer: str, guess: Any, radius: Fraction) -> None:
    """Refuse unless an eigenvalue has at least this modulus."""
    point, away = eigenvalue(loop, observer, guess)
    least = Interval.of(point.size2()).root() - away
    need(least >= radius, f"no eigenvalue of {observer} at {float(radius):.9g} or beyond is found near the root")


def radius(given: Certificate) -> Proof:
    """The spectral radius over one slow period, between two numbers."""
    loop = read_loop(given.plant)
    (name,) = take(given.parameters, "parameters", "observer")
    (guess,) = take(given.witness, "witness", "root")
    observer, (lower, upper) = read_observer(name), given.stated("lower", "upper")
    need(0 < lower <= upper, "the bounds are not positive, or crossed")
    require_within(loop, observer, upper)
    require_beyond(loop, observer, guess, lower)
    return Proof(lower, upper)


def stable(given: Certificate) -> Proof:
    """All eigenvalues inside the unit circle."""
    given.stated()
    (name,) = take(given.parameters, "parameters", "observer")
    (circle,) = take(given.witness, "witness", "radius")
    need(positive(circle, "radius") < 1, "the circle is no smaller than the unit circle")
    require_within(read_loop(given.plant), read_observer(name), Fraction(circle))
    return Proof(holds=True)


def no_bounded_error(given: Certificate) -> Proof:
    """An eigenvalue outside the unit circle is in the tracking error, from x(0) and each zeta(0) that is given."""
    given.stated()
    loop = read_loop(given.plant, "start")
    name, sigma, listed = take(given.parameters, "parameters", "observer", "frequency", "starts")
    (guess,) = take(given.witness, "witness", "root")
    observer, n = read_observer(name), len(loop.A)
    assert loop.start is not None
    zero: Matrix = [[Fraction(0)] for _ in range(n)]
    own = {"zero": zero, "output": [*times(loop.C, loop.start), *zero[1:]], "true": loop.start}
    starts = [own[one] for one in several(listed, "starts", lambda value, at: one_of(value, at, *own))]
    need(0 < len({*listed}) == len(starts), "no start, or one twice")
    phi = monodromy(loop, observer)
    polynomial = characteristic(phi)
    point, away = eigenvalue(loop, observer, guess)
    need(Interval.of(point.size2()).root() - away > 1, "the eigenvalue may lie in the unit circle")
    root = Complex(Interval.of(point.re).widened(away), Interval.of(point.im).widened(away))
    # p(z)/(z - root), by synthetic division; highest power first.
    quotient: list[Any] = [polynomial[-1]]
    for coefficient in polynomial[-2:0:-1]:
        quotient.append(root * quotient[-1] + coefficient)
    periodic, _ = steady(loop, observer, positive(sigma, "frequency"))
    for start in starts:
        offset = minus([*loop.start, *start], [[Complex.of(entry).im] for (entry,) in periodic])
        grown: Matrix = [[0] for _ in offset]
        for coefficient in quotient:
            grown = plus(times(phi, grown), scaled(coefficient, offset))
        c = Complex.of(times(loop.C, grown[:n])[0][0])
        need(c.weight() > 0, "the eigenvalue may not be excited")
    return Proof(holds=True)


CHECKS = {
    "dualrate.radius": radius,
    "dualrate.stable": stable,
    "dualrate.no-bounded-error": no_bounded_error,
}
