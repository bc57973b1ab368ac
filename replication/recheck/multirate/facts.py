"""What is counted or computed from schedules and plants, and the identities of the multi-rate paper."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

from replication.recheck.exact import (
    blocks,
    characteristic,
    inverse,
    minus,
    nought,
    plus,
    rank,
    scaled,
    times,
    turned,
    unit,
)
from replication.recheck.identities import Draw, same
from replication.recheck.multirate.levels import MOST_STATES, Schedule, schedule
from replication.recheck.reading import Certificate, Matrix, Proof, count, matrix, need, several, small, square, take

LARGEST = 6
"""Of a size at which an identity is checked."""


def _times(given: Certificate) -> Schedule:
    given.stated(*given.bound)
    take(given.witness, "witness")
    return schedule(*take(given.parameters, "parameters", "periods", "offsets"))


def _field(given: Certificate, name: str) -> Any:
    need(name in given.plant, f"plant has no field {name}")
    return given.plant[name]


def _states(given: Certificate) -> Matrix:
    found = square(_field(given, "A"), "A")
    small(len(found) <= MOST_STATES, f"more than {MOST_STATES} states")
    return found


def _exactly(value: int) -> Proof:
    return Proof(Fraction(value), Fraction(value))


def selection(given: Certificate) -> Proof:
    """The diagonals of S_0, S_1, ..."""
    planned = _times(given)
    shown = [Fraction(i in planned.measured(k)) for k in range(planned.length) for i in range(len(planned.periods))]
    return Proof(items=tuple((one, one) for one in shown))


def common_period(given: Certificate) -> Proof:
    """Instants until the schedule repeats."""
    return _exactly(_times(given).length)


def idle_instants(given: Certificate) -> Proof:
    """The longest run of instants without a measurement."""
    planned = _times(given)
    busy = [k for k in range(2 * planned.length) if planned.measured(k)]
    return _exactly(max(later - sooner - 1 for sooner, later in zip(busy, [*busy[1:], busy[-1] + 1], strict=True)))


def dual_rate(given: Certificate) -> Proof:
    """Whether all sensors measure at the first instant, and none at another."""
    planned = _times(given)
    numbers = [len(planned.measured(k)) for k in range(planned.length)]
    return Proof(holds=numbers == [len(planned.periods), *([0] * (planned.length - 1))])


def variables(given: Certificate) -> Proof:
    """The unknowns of Theorem 2."""
    planned, (n, _, q, _) = _times(given), _sizes(given)
    need(len(planned.periods) == q, "a period for each sensor")
    return _exactly(planned.length * (n * (n + 1) // 2 + n * q) + 1)


def rows(given: Certificate) -> Proof:
    """The rows of the matrix (30)."""
    take(given.witness, "witness")
    n, inputs, _, noises = _sizes(given)
    return _exactly(2 * n + inputs + noises)


def cyclic_rows(given: Certificate) -> Proof:
    """The rows of the matrix (30) of one plant with as many times the states, disturbances and sensors as instants."""
    planned, (n, inputs, q, noises) = _times(given), _sizes(given)
    need(len(planned.periods) == q, "a period for each sensor")
    return _exactly(planned.length * (2 * n + inputs + noises))


def _sizes(given: Certificate) -> tuple[int, int, int, int]:
    """The states, disturbances, sensors and sensor noises."""
    n = len(_states(given))
    inputs, q = len(matrix(_field(given, "B_d"), "B_d", n)[0]), len(matrix(_field(given, "C"), "C", None, n))
    return n, inputs, q, len(matrix(_field(given, "D"), "D", q)[0])


def unmeasured(given: Certificate) -> Proof:
    """Whether the gains are zero where no sensor measures."""
    planned, gains = _times(given), _gains(given)
    need(len(gains) == planned.length, "a gain for each phase")
    need(all(len(one[0]) == len(planned.periods) for one in gains), "a column for each sensor")
    idle = (
        row[i] for k, one in enumerate(gains) for row in one for i in range(len(row)) if i not in planned.measured(k)
    )
    return Proof(holds=not any(idle))


def _gains(given: Certificate) -> list[Matrix]:
    size = len(_states(given))
    found: list[Matrix] = several(_field(given, "L"), "L", lambda value, at: matrix(value, at, size))
    return found


def observable(given: Certificate) -> Proof:
    """Whether the observability matrix has full rank."""
    take(given.witness, "witness")
    a = _states(given)
    c = matrix(_field(given, "C"), "C", None, len(a))
    seen = [c]
    for _ in a[1:]:
        seen.append(times(seen[-1], a))
    return Proof(holds=rank([row for block in seen for row in block]) == len(a))


def order_of_factors(given: Certificate) -> Proof:
    """Whether the poles of A_e depend on the order of its factors, though not on where the period begins."""
    planned, a = _times(given), _states(given)
    c, gains = matrix(_field(given, "C"), "C", len(planned.periods), len(a)), _gains(given)
    need(len(gains) == planned.length, "a gain for each phase")
    factors = []
    for k, one in enumerate(gains):
        kept = [row if i in planned.measured(k) else [Fraction(0)] * len(row) for i, row in enumerate(c)]
        factors.append(minus(a, times(one, kept)))
    first, shifted = times(*factors[::-1]), times(factors[0], *factors[:0:-1])
    poles = characteristic(first)
    return Proof(holds=poles == characteristic(shifted) and poles != characteristic(times(*factors)))


def _identity(given: Certificate) -> tuple[int, int, int, int]:
    take(given.plant, "plant", "name")
    take(given.witness, "witness")
    sizes = take(given.parameters, "parameters", "states", "sensors", "disturbances", "inputs")
    n, q, m, r = (count(size, "a size", 1) for size in sizes)
    need(max(n, q, m, r) <= LARGEST, f"sizes of more than {LARGEST}")
    return n, q, m, r


def _selections(sensors: int) -> list[Matrix]:
    """All diagonal matrices of zeros and ones."""
    return [
        [[Fraction(chosen[i] if i == j else 0) for j in range(sensors)] for i in range(sensors)]
        for chosen in product((0, 1), repeat=sensors)
    ]


def error_system(given: Certificate) -> Proof:
    """The error of the observer (15) on the plant (2), (13) obeys (16), for every selection S."""
    n, q, m, r = _identity(given)
    for s in _selections(q):

        def sides(draw: Draw, s: Matrix = s) -> Any:
            a, b_u, b_d, c, d = (draw.matrix(*size) for size in ((n, n), (n, r), (n, m), (q, n), (q, q)))
            gain, x, held, u, v, w = (draw.matrix(k, k2) for k, k2 in ((n, q), (n, 1), (n, 1), (r, 1), (m, 1), (q, 1)))
            y = plus(times(s, c, x), times(s, d, w))
            closed = minus(a, times(gain, s, c))
            after = plus(times(a, x), times(b_u, u), times(b_d, v))
            estimated = plus(times(closed, held), times(b_u, u), times(gain, s, y))
            stated = plus(times(closed, minus(x, held)), scaled(-1, times(gain, s, d, w)), times(b_d, v))
            return minus(after, estimated), stated

        need(same(sides), "the error does not obey (16)")
    return Proof(holds=True)


def _inequality(draw: Draw, n: int, q: int, m: int) -> dict[str, Any]:
    """Random matrices of Theorem 1, and its matrix (20) as it is printed."""
    a, b, c, d, w = (draw.matrix(*size) for size in ((n, n), (n, m), (q, n), (q, q), (n, n)))
    s, gain, before, p, level = (
        draw.matrix(q, q), draw.matrix(n, q), draw.symmetric(n), draw.symmetric(n), draw.number(),
    )  # fmt: skip
    closed, noise = minus(a, times(gain, s, c)), times(gain, s, d)
    t = turned
    first = minus(minus(before, times(t(closed), p, closed)), times(t(w), w))
    second, third = scaled(-1, times(t(closed), p, b)), times(t(closed), p, noise)
    printed = blocks(
        [
            [first, second, third],
            [t(second), minus(unit(m, level), times(t(b), p, b)), times(t(b), p, noise)],
            [t(third), t(times(t(b), p, noise)), minus(unit(q, level), times(t(noise), p, noise))],
        ]
    )
    return {"printed": printed, "p": p, "before": before, "level": level, "w": w, "steps": (closed, b, noise)}


def dissipation(given: Certificate) -> Proof:
    """The quadratic form of (20) is the left-hand side of (23)."""
    n, q, m, _ = _identity(given)

    def sides(draw: Draw) -> Any:
        made = _inequality(draw, n, q, m)
        e, v, noise = draw.matrix(n, 1), draw.matrix(m, 1), draw.matrix(q, 1)
        closed, b, injected = made["steps"]
        after = minus(plus(times(closed, e), times(b, v)), times(injected, noise))
        z, level = times(made["w"], e), made["level"]
        terms = (form(made["before"], e), -form(made["p"], after), level * (form1(v) + form1(noise)), -form1(z))
        return form(made["printed"], [*e, *v, *noise]), sum(terms)

    need(same(sides), "(20) is not the form (23)")
    return Proof(holds=True)


def form(matrix: Matrix, vector: Matrix) -> Any:
    """A quadratic form."""
    return times(turned(vector), matrix, vector)[0][0]


def form1(vector: Matrix) -> Any:
    """The square of the length."""
    return times(turned(vector), vector)[0][0]


def schur(given: Certificate) -> Proof:
    """With Y = P L the Schur complement of P in (30) is (20)."""
    n, q, m, _ = _identity(given)

    def sides(draw: Draw) -> Any:
        made = _inequality(draw, n, q, m)
        p, (closed, b, injected) = made["p"], made["steps"]
        # P A - Y S C = P (A - L S C), and -Y S D = -P L S D.
        beside = blocks([[times(p, closed), times(p, b), scaled(-1, times(p, injected))]])
        rest = unit(n + m + q, made["level"])
        corner = minus(made["before"], times(turned(made["w"]), made["w"]))
        for i in range(n):
            rest[i] = [*corner[i], *nought(1, m + q)[0]]
        return minus(rest, times(turned(beside), inverse(p), beside)), made["printed"]

    need(same(sides), "the Schur complement is another matrix")
    return Proof(holds=True)


CHECKS = {
    "multirate.selection": selection,
    "multirate.common-period": common_period,
    "multirate.idle-instants": idle_instants,
    "multirate.dual-rate": dual_rate,
    "multirate.variables": variables,
    "multirate.rows": rows,
    "multirate.cyclic-rows": cyclic_rows,
    "multirate.unmeasured": unmeasured,
    "multirate.observable": observable,
    "multirate.product": order_of_factors,
    "multirate.error-system": error_system,
    "multirate.dissipation": dissipation,
    "multirate.schur": schur,
}
