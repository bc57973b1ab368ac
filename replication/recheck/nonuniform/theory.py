"""Lemmas 2 and 3, the map of (7), the congruence behind (10), the recovery (11), and entries of the printed filter."""

from __future__ import annotations

from typing import Any

from replication.recheck.exact import blocks, inverse, minus, nought, part, plus, scaled, times, turned, unit
from replication.recheck.identities import Draw, same
from replication.recheck.interval import Interval
from replication.recheck.nonuniform.grid import logarithmic_norm
from replication.recheck.nonuniform.sampled import printed_filter, read_plant, seconds
from replication.recheck.reading import Certificate, Matrix, Proof, count, need, take

STATES = 2
FIRST, LAST = slice(0, STATES), slice(STATES, None)


def _bare(given: Certificate) -> None:
    given.stated()
    take(given.parameters, "parameters")
    take(given.witness, "witness")


def _no_plant(given: Certificate) -> None:
    _bare(given)
    take(given.plant, "plant", "name")


def lemma_2(given: Certificate) -> Proof:
    """[Phi, Gamma](h_0 + theta) = [Phi, Gamma](h_0) + Delta [A Phi, A Gamma + B], for polynomials in A.

    With I_0 and Delta the integrals of e^(At) up to h_0 and theta, e^(A h_0) = 1 + A I_0, e^(A theta) = 1 + A Delta,
    and the integral up to h_0 + theta is Delta + e^(A theta) I_0.
    """
    _no_plant(given)

    def sides(draw: Draw) -> Any:
        a, b = draw.matrix(STATES, STATES), draw.matrix(STATES, 1)
        first, second = (plus(unit(STATES, draw.number()), scaled(draw.number(), a)) for _ in range(2))
        one = unit(STATES)
        phi, turned_on = plus(one, times(a, first)), plus(one, times(a, second))
        later = times(turned_on, phi), times(plus(second, times(turned_on, first)), b)
        gamma = times(first, b)
        looped = plus(phi, times(second, a, phi)), plus(gamma, times(second, plus(times(a, gamma), b)))
        return later, looped

    need(same(sides), "the loop is another system")
    return Proof(holds=True)


def lemma_3(given: Certificate) -> Proof:
    """d|x|^2/dt = 2 x'Sx, and mu I - S, of determinant zero and trace r >= 0, is semidefinite.

    With S = [p q; q s], mu = (p + s + r)/2 and r^2 = (p - s)^2 + 4 q^2: (p, q, s, r) is drawn on this surface, by
    p - s = (u^2 - v^2) w, 2 q = 2 u v w, r = (u^2 + v^2) w.
    """
    _bare(given)
    logarithmic_norm(read_plant(given.plant).A)

    def sides(draw: Draw) -> Any:
        u, v, w, s = (draw.number() for _ in range(4))
        p, q, r = s + (u * u - v * v) * w, u * v * w, (u * u + v * v) * w
        mu = (p + s + r) / 2
        a, x = draw.matrix(2, 2), draw.matrix(2, 1)
        rate = plus(times(turned(times(a, x)), x), times(turned(x), times(a, x)))
        return ((mu - p) * (mu - s) - q * q, (mu - p) + (mu - s), rate), (
            0,
            r,
            times(turned(x), plus(a, turned(a)), x),
        )

    need(same(sides), "mu I - S has another determinant or trace")
    return Proof(holds=True)


def loop_map(given: Certificate) -> Proof:
    """w -> e is S_22 + S_21 Delta (1 - S_11 Delta)^-1 S_12; the printed order of the factors does not fit."""
    _bare(given)
    plant = read_plant(given.plant)
    n, m, s = len(plant.A), len(plant.B[0]), len(plant.L)
    need(m != n and s != n, "the printed products have a value")

    def sides(draw: Draw) -> Any:
        k = STATES
        a, b, b1 = draw.matrix(2 * k, 2 * k), draw.matrix(2 * k, k), blocks([[unit(k)], [nought(k, k)]])
        c, c1, d, delta = draw.matrix(k, 2 * k), draw.matrix(k, 2 * k), draw.matrix(k, k), draw.matrix(k, k)
        z = unit(2 * k, draw.number())
        whole = inverse(minus(z, plus(a, times(b1, delta, c1))))
        direct = times(c, whole, plus(b, times(b1, delta, d)))
        r = inverse(minus(z, a))
        s11, s12, s21, s22 = times(c1, r, b1), plus(d, times(c1, r, b)), times(c, r, b1), times(c, r, b)
        return direct, plus(s22, times(s21, delta, inverse(minus(unit(k), times(s11, delta))), s12))

    need(same(sides), "the map is another one")
    return Proof(holds=True)


def _partitioned(draw: Draw) -> tuple[Matrix, ...]:
    """P-bar with its inverse, in blocks: P-bar, U, Y, V and Z = X^-1."""
    p = draw.symmetric(2 * STATES)
    q = inverse(p)
    return p, part(p, FIRST, LAST), part(q, FIRST, FIRST), part(q, FIRST, LAST), inverse(part(p, FIRST, FIRST))


def congruence(given: Certificate) -> Proof:
    """(10) is J' (6) J with J = diag(J_1, I, J_1, I)."""
    _no_plant(given)

    def sides(draw: Draw) -> Any:
        k, t = STATES, turned
        p, u, y, v, z = _partitioned(draw)
        phi, gamma, level = draw.matrix(k, k), draw.matrix(k, 1), draw.number()
        a_f, b_f, c_f = draw.matrix(k, k), draw.matrix(k, 1), draw.matrix(1, k)
        c, d, out = draw.matrix(1, k), draw.matrix(1, 1), draw.matrix(1, k)
        a = blocks([[phi, nought(k, k)], [times(b_f, c), a_f]])
        b, seen = [*gamma, *times(b_f, d)], blocks([[out, scaled(-1, c_f)]])
        low, one = scaled(-1, p), [[-level]]
        six = _mirrored(
            [
                [low, nought(2 * k, 1), times(a, p), b],
                [unit(1, -1), times(seen, p), nought(1, 1)],
                [low, nought(2 * k, 1)],
                [one],
            ]
        )
        j1 = blocks([[z, y], [nought(k, k), t(v)]])
        j = _diagonal([j1, unit(1), j1, unit(1)])
        f, g = times(v, b_f), times(c_f, t(u), z)
        q = times(v, a_f, t(u), z)
        first, second = times(y, phi), times(f, c)
        zz, yy = scaled(-1, z), scaled(-1, y)
        ten = _mirrored(
            [
                [zz, zz, nought(k, 1), times(z, phi), times(z, phi), times(z, gamma)],
                [yy, nought(k, 1), plus(first, second, q), plus(first, second), plus(times(y, gamma), times(f, d))],
                [unit(1, -1), minus(out, g), out, nought(1, 1)],
                [zz, zz, nought(k, 1)],
                [yy, nought(k, 1)],
                [one],
            ]
        )
        return times(t(j), six, j), ten

    need(same(sides), "(10) is another matrix")
    return Proof(holds=True)


def _mirrored(upper: list[list[Matrix]]) -> Matrix:
    """A symmetric matrix from its blocks on and above the diagonal."""
    size = len(upper)
    return blocks([[upper[i][j - i] if j >= i else turned(upper[j][i - j]) for j in range(size)] for i in range(size)])


def _diagonal(parts: list[Matrix]) -> Matrix:
    return blocks(
        [
            [one if i == j else nought(len(one), len(other[0])) for j, other in enumerate(parts)]
            for i, one in enumerate(parts)
        ]
    )


def recovery(given: Certificate) -> Proof:
    """(11) gives S A_f S^-1, S B_f and C_f S^-1 with S = -Y^-1 V."""
    _no_plant(given)

    def sides(draw: Draw) -> Any:
        k = STATES
        _, u, y, v, z = _partitioned(draw)
        a_f, b_f, c_f = draw.matrix(k, k), draw.matrix(k, 1), draw.matrix(1, k)
        f, q, g = times(v, b_f), times(v, a_f, turned(u), z), times(c_f, turned(u), z)
        back = scaled(-1, inverse(y))
        rest = inverse(plus(unit(k), times(back, z)))
        change = times(back, v)
        again = inverse(change)
        return (times(back, q, rest), times(back, f), times(g, rest)), (
            times(change, a_f, again),
            times(change, b_f),
            times(c_f, again),
        )

    need(same(sides), "(11) is another filter")
    return Proof(holds=True)


def sizes(given: Certificate) -> Proof:
    """F = V B_f is n x r, and the print says r x n."""
    _bare(given)
    plant = read_plant(given.plant)
    need(
        len(printed_filter(given, plant).A) == len(plant.A) != len(plant.C), "another order, or both sizes are the same"
    )
    return Proof(holds=True)


def observer_column(given: Certificate) -> Proof:
    """A column of Phi(h) - B_f C in the middle of the range, with the printed B_f."""
    given.stated()
    take(given.witness, "witness")
    (column,) = take(given.parameters, "parameters", "column")
    plant = read_plant(given.plant)
    n = len(plant.A)
    own = printed_filter(given, plant)
    need(count(column, "column") < n and len(own.A) == n, "the column is none, or the filter has another order")
    phi = [row[:n] for row in plant.step(seconds(plant.time("middle")))]
    entries = [row[column] for row in minus(phi, times(own.B, plant.C))]
    return Proof(items=tuple(Interval.of(entry).ends() for entry in entries))


CHECKS = {
    "nonuniform.lemma-2": lemma_2,
    "nonuniform.lemma-3": lemma_3,
    "nonuniform.map": loop_map,
    "nonuniform.congruence": congruence,
    "nonuniform.recovery": recovery,
    "nonuniform.sizes": sizes,
    "nonuniform.observer-column": observer_column,
}
