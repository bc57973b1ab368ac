"""What no observer can beat, LMI (3) on Pade models, and characteristic roots."""

from __future__ import annotations

from fractions import Fraction
from math import factorial
from typing import Any

from replication.recheck.delay.plant import Delayed, changed, read_plant
from replication.recheck.exact import (
    Complex,
    blocks,
    characteristic,
    determinant,
    inverse,
    is_positive,
    minus,
    nought,
    part,
    plus,
    scaled,
    times,
    turned,
    unit,
)
from replication.recheck.interval import Interval, exponential, wave
from replication.recheck.reading import (
    Certificate,
    Matrix,
    Proof,
    count,
    matrix,
    need,
    number,
    positive,
    several,
    square,
    symmetric,
    take,
)

LARGEST_ORDER = 20


def require_hidden(plant: Delayed, level: Fraction, hidden: Any, factors: Any) -> None:
    """Refuse unless |C(iw) x| >= level |B^-1 M(iw) x| for a state that y does not see; factors: of each delay at iw."""
    frequency, state = take(hidden, "hidden", "frequency", "state")
    omega, x = number(frequency, "frequency"), matrix(state, "state", plant.n, 1)
    need(level > 0, "the level is not positive")
    need(not any(map(any, times(plant.C2, x))), "y sees the state")
    need(any(map(any, x)), "the state is zero")
    need(len(plant.B[0]) == plant.n, "B is not square")
    rate: Matrix = minus(scaled(Complex(Fraction(0), omega), x), times(plant.A0, x))
    seen: Matrix = [[Complex.of(entry) for entry in row] for row in times(plant.C10, x)]
    for a, c, delay in zip(plant.A, plant.C1, plant.delays, strict=True):
        factor = factors(omega * delay)
        rate, seen = minus(rate, scaled(factor, times(a, x))), plus(seen, scaled(factor, times(c, x)))
    spent = times(inverse(plant.B), rate)
    sizes = [sum(Complex.of(entry).size2() for (entry,) in column) for column in (seen, spent)]
    need(Interval.of(sizes[0]) >= Interval.of(sizes[1]) * level * level, "the disturbance has a smaller gain")


def turning(angle: Fraction) -> Complex:
    """e^(-i angle)."""
    cosine, sine = wave(angle)
    return Complex(cosine, -sine)


def gain_lower(given: Certificate) -> Proof:
    """No observer has a gain below that."""
    (lower,) = given.stated("lower")
    take(given.parameters, "parameters")
    require_hidden(read_plant(given.plant), lower, dict(given.witness), turning)
    return Proof(lower=lower)


def pade(order: int) -> list[Fraction]:
    """q of the approximant q(-s)/q(s) of e^-s, from its constant coefficient on."""
    return [Fraction(factorial(2 * order - k), factorial(k) * factorial(order - k)) for k in range(order + 1)]


def read_order(value: Any) -> int:
    """The order of an approximant."""
    need(count(value, "order", 1) <= LARGEST_ORDER, f"the order is above {LARGEST_ORDER}")
    return int(value)


def pade_lower(given: Certificate) -> Proof:
    """LMI (3) on the Pade model is infeasible below that."""
    (lower,) = given.stated("lower")
    q = pade(read_order(*take(given.parameters, "parameters", "order")))

    def factor(angle: Fraction) -> Complex:
        # q(-i angle)/q(i angle): conjugates of each other.
        value, power = Complex(Fraction(0)), Complex(Fraction(1))
        for coefficient in q:
            value, power = value + power * coefficient, power * Complex(Fraction(0), angle)
        return Complex(value.re, -value.im) * (1 / value)

    require_hidden(read_plant(given.plant), lower, dict(given.witness), factor)
    return Proof(lower=lower)


def pade_upper(given: Certificate) -> Proof:
    """LMI (3) on the Pade model is feasible at a level: on the kernel of C_2, where Z has no say."""
    (upper,) = given.stated("upper")
    need(upper > 0, "the level is not positive")
    order = read_order(*take(given.parameters, "parameters", "order"))
    change, section, stored = take(given.witness, "witness", "change", "section", "P")
    plant = changed(read_plant(given.plant), change)
    a, b, out, channels = _model(plant, _section(section, order))
    p = symmetric(stored, "P", len(a))
    need(is_positive(p), "P is not positive")
    kept = [*range(plant.unmeasured), *range(plant.n, plant.n + channels)]
    rate = plus(times(p, a), times(turned(a), p))
    inner, driven, seen = part(rate, kept, kept), part(times(p, b), kept, slice(None)), part(out, slice(None), kept)
    w, z = len(b[0]), len(out)
    whole = blocks(
        [
            [scaled(-1, inner), driven, scaled(-1, turned(seen))],
            [turned(driven), unit(w, upper), nought(w, z)],
            [scaled(-1, seen), nought(z, w), unit(z, upper)],
        ]
    )
    need(is_positive(whole), "the inequality fails")
    return Proof(upper=upper)


def _section(value: Any, order: int) -> tuple[Matrix, Matrix, Matrix, Fraction]:
    """A realisation of the approximant, checked coefficient by coefficient."""
    a, b, c, d = take(value, "section", "a", "b", "c", "d")
    state = square(a, "a", order)
    drive, seen, through = matrix(b, "b", order, 1), matrix(c, "c", 1, order), number(d, "d")
    q = pade(order)
    denominator = characteristic(state)
    need([entry * q[-1] for entry in denominator] == q, "the poles are not those of the approximant")
    # c adj(s - a) b = det(s - a + b c) - det(s - a).
    closed = characteristic(minus(state, times(drive, seen)))
    top = [through * entry + more - entry for entry, more in zip(denominator, closed, strict=True)]
    need(
        [entry * q[-1] for entry in top] == [(-1) ** k * entry for k, entry in enumerate(q)], "it has another numerator"
    )
    return state, drive, seen, through


def _model(plant: Delayed, section: tuple[Matrix, Matrix, Matrix, Fraction]) -> tuple[Matrix, Matrix, Matrix, int]:
    """A, B, C1 of x and the sections, one for each delay and state that has an effect; and their states."""
    a, b, c, d = section
    order, n = len(a), plant.n
    used = [
        (i, j) for i in range(len(plant.delays)) for j in range(n) if any(row[j] for row in (*plant.A[i], *plant.C1[i]))
    ]
    size = n + order * len(used)
    state, out = nought(size, size), nought(len(plant.C10), size)
    for matrix_, current in ((state, plant.A0), (out, plant.C10)):
        for row, given in zip(matrix_, current, strict=False):
            row[:n] = given
    for place, (i, j) in enumerate(used):
        first = n + place * order
        for rows, delayed in ((state, plant.A[i]), (out, plant.C1[i])):
            for row, given in zip(rows, delayed, strict=False):
                row[j] += d * given[j]
                row[first : first + order] = [given[j] * entry for entry in c[0]]
        for k in range(order):
            state[first + k][j] = b[k][0] / plant.delays[i]
            state[first + k][first : first + order] = [entry / plant.delays[i] for entry in a[k]]
    drive = [*plant.B, *nought(size - n, len(plant.B[0]))]
    return state, drive, out, size - n


def unstable(given: Certificate) -> Proof:
    """det M(s) has two signs at two positive s."""
    given.stated()
    take(given.parameters, "parameters")
    plant = read_plant(given.plant)
    ends = [positive(end, "an end") for end in take(given.witness, "witness", "left", "right")]
    need(ends[0] < ends[1], "the ends are crossed")
    values = []
    for s in ends:
        whole = minus(unit(plant.n, s), plant.A0)
        for a, delay in zip(plant.A, plant.delays, strict=True):
            whole = minus(whole, scaled(exponential([[-s * delay]])[0][0], a))
        values.append(Interval.of(determinant(whole)))
    need(values[0] * values[1] < 0, "det M(s) has no two signs")
    return Proof(holds=True)


def not_unstable(given: Certificate) -> Proof:
    """s + (a/K) sum e^(-si/K) has no root with Re s >= 0 if 0 < a <= 1: there |s| <= a, so that |Im s| i/K < pi/2."""
    given.stated()
    take(given.plant, "plant", "name")
    take(given.witness, "witness")
    (listed,) = take(given.parameters, "parameters", "eigenvalues")
    eigenvalues = several(listed, "eigenvalues", number)
    need(bool(eigenvalues) and all(0 < one <= 1 for one in eigenvalues), "an eigenvalue lies outside (0, 1]")
    return Proof(holds=False)


CHECKS = {
    "delay.gain-lower": gain_lower,
    "delay.pade-lower": pade_lower,
    "delay.pade-upper": pade_upper,
    "delay.unstable": unstable,
    "delay.not-unstable": not_unstable,
}
