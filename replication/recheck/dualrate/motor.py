"""The motor of Sec. V, exactly: torque constant, coordinates, rates, Hurwitz matrices, feedforward."""

from __future__ import annotations

from fractions import Fraction

from replication.recheck.dualrate.loop import read_loop
from replication.recheck.exact import determinant, is_hurwitz, minus, plus, solved, times, unit
from replication.recheck.reading import (
    Certificate,
    Matrix,
    Proof,
    count,
    matrix,
    need,
    one_of,
    positive,
    several,
    take,
)


def _motor(given: Certificate) -> tuple[list[Fraction], list[Matrix]]:
    symbols = ("R", "Psi", "Lq", "p", "Bw", "J", "KT")
    _, *values = take(given.plant, "plant", "name", *symbols, "A", "B", "C")
    take(given.parameters, "parameters")
    take(given.witness, "witness")
    a, b, c = values[7:]
    read = [matrix(a, "A", 3, 3), matrix(b, "B", 3, 1), matrix(c, "C", 1, 3)]
    return [positive(value, name) for name, value in zip(symbols, values, strict=False)], read


def torque_constant(given: Certificate) -> Proof:
    """1.5 p Psi_f."""
    (_, psi, _, p, *_), _ = _motor(given)
    value = Fraction(3, 2) * p * psi
    return Proof(value, value)


def coordinates(given: Certificate) -> Proof:
    """(23) in the coordinates (theta, omega, omega') has the printed A, B and C."""
    given.stated()
    (r, psi, l_q, p, b_w, j, k_t), (a, b, c) = _motor(given)
    need(l_q != 0 and j != 0, "an inductance or an inertia is zero")
    nought_, one = Fraction(0), Fraction(1)
    printed = [[-r / l_q, -p * psi / l_q, nought_], [k_t / j, -b_w / j, nought_], [nought_, one, nought_]]
    change = [[nought_, nought_, one], [nought_, one, nought_], [k_t / j, -b_w / j, nought_]]
    need(times(change, printed) == times(a, change), "the rates differ")
    need(times(change, [[1 / l_q], [nought_], [nought_]]) == b, "B is another one")
    need(times(c, change) == [[nought_, nought_, one]], "C does not give theta")
    return Proof(holds=True)


def slow_period(given: Certificate) -> Proof:
    """M T."""
    loop = read_loop(given.plant)
    take(given.parameters, "parameters")
    take(given.witness, "witness")
    return Proof(loop.M * loop.T, loop.M * loop.T)


def hurwitz(given: Certificate) -> Proof:
    """A + B K or A - L C has all eigenvalues in the left half-plane."""
    given.stated()
    take(given.witness, "witness")
    loop, (name,) = read_loop(given.plant), take(given.parameters, "parameters", "matrix")
    feedback = one_of(name, "matrix", "feedback", "observer") == "feedback"
    need(is_hurwitz(plus(loop.A, times(loop.B, loop.K)) if feedback else loop.guided), "it is not Hurwitz")
    return Proof(holds=True)


def feedforward(given: Certificate) -> Proof:
    """Whether (y^(i) + a_2 y^(j) + a_3 y^(k))/b is the input: polynomials in s, at more points than degrees."""
    given.stated()
    take(given.witness, "witness")
    loop, (listed,) = read_loop(given.plant), take(given.parameters, "parameters", "orders")
    orders = several(listed, "orders", count, 3)
    n = len(loop.A)
    need(n == 3 and max(orders) <= 20, "not three states, or orders above 20")
    (zero, a2, a3), b = loop.A[2], loop.B[2][0]
    one = Fraction(1)
    need(loop.A[:2] == [[0, one, 0], [0, 0, one]] and zero == 0 and b != 0, "the plant has another form")
    need(loop.B[:2] == [[0], [0]] and [[one, 0, 0]] == loop.C, "B or C has another form")
    # Above this number no s is an eigenvalue.
    beyond = 1 + max(int(sum(map(abs, row))) for row in loop.A)
    for s in range(beyond, beyond + n + max(orders) + 1):
        shifted = minus(unit(n, Fraction(s)), loop.A)
        whole = determinant(shifted)
        numerator = whole * times(loop.C, solved(shifted, loop.B))[0][0]
        given_ = Fraction(s) ** orders[0] - a2 * Fraction(s) ** orders[1] - a3 * Fraction(s) ** orders[2]
        if given_ * numerator != b * whole:
            return Proof(holds=False)
    return Proof(holds=True)


CHECKS = {
    "dualrate.torque-constant": torque_constant,
    "dualrate.coordinates": coordinates,
    "dualrate.slow-period": slow_period,
    "dualrate.hurwitz": hurwitz,
    "dualrate.feedforward": feedforward,
}
