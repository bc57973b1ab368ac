"""Theorem 4 and Lemma 5 of Peet and Gu at random points: the inverse of an operator (8), and the gains it gives.

The formulas use the histories through products at one point and through integrals only. So an integral is a sum over a
few points with random weights, and a history is its values there; y_j(-tau_j) is a number of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

from replication.recheck.exact import blocks, inverse, minus, nought, plus, scaled, times, turned, unit
from replication.recheck.identities import Draw, same
from replication.recheck.reading import Certificate, Matrix, Proof, need, one_of, take

DELAYS = 2
SIZES = {"theorem-4": ((2, 2, 1), (1, 2, 3), (2, 2, 2)), "lemma-5": ((2, 4, 4),)}
"""States, rows of Z and points of each integral."""


@dataclass(frozen=True)
class Operator:
    """P{P, Q_i, S_i, R_ij} of (8) on values: Q_i and S_i at the points of delay i, R_ij at pairs of points."""

    tau: Fraction
    weights: list[list[Fraction]]
    P: Matrix
    Q: list[list[Matrix]]
    S: list[list[Matrix]]
    R: list[list[list[list[Matrix]]]]

    def applied(self, first: Matrix, histories: list[list[Matrix]]) -> tuple[Matrix, list[list[Matrix]]]:
        """The operator on a vector and histories."""
        above = plus(times(self.P, first), self._summed(lambda j, b: times(self.Q[j][b], histories[j][b])))
        below = [
            [
                plus(
                    scaled(self.tau, times(turned(self.Q[i][a]), first)),
                    scaled(self.tau, times(self.S[i][a], value)),
                    self._summed(lambda j, b, i=i, a=a: times(self.R[i][j][a][b], histories[j][b])),
                )
                for a, value in enumerate(history)
            ]
            for i, history in enumerate(histories)
        ]
        return above, below

    def _summed(self, curve: Any) -> Matrix:
        """The sum over the delays of the integrals of curve(delay, point)."""
        return plus(*(scaled(w, curve(j, b)) for j, row in enumerate(self.weights) for b, w in enumerate(row)))


class Setting:
    """A random operator as in Theorem 4, and its inverse by the theorem, corrected or as it is printed.

    coupled: whether Q_i, and with it H, is not zero.
    """

    def __init__(self, draw: Draw, size: tuple[int, int, int], corrected: bool, coupled: bool = True) -> None:
        self.n, self.rows, points = size
        n, rows, pairs = self.n, self.rows, range(DELAYS)
        self.tau = draw.number()
        self.weights = [[draw.number() for _ in range(points)] for _ in pairs]
        p, h, gamma = draw.symmetric(n), draw.matrix(n, DELAYS * rows), draw.symmetric(DELAYS * rows)
        h = h if coupled else nought(n, DELAYS * rows)
        self.z = [[draw.matrix(rows, n) for _ in range(points)] for _ in pairs]
        s = [[draw.symmetric(n) for _ in range(points)] for _ in pairs]
        self.back = [[inverse(one) for one in row] for row in s]
        self.operator = self._operator(p, h, gamma, s)
        # V = Z S^-1 Z'; its integral T_i is K_i.
        self.v = [[times(a, self.back[i][q], turned(a)) for q, a in enumerate(self.z[i])] for i in pairs]
        self.t = [self._integral(i, self.v[i]) for i in pairs]
        k = blocks([[self.t[i] if i == j else nought(rows, rows) for j in pairs] for i in pairs])
        one, inner = unit(DELAYS * rows), scaled(1 / self.tau if corrected else 1, gamma)
        again = inverse(p)
        middle = minus(times(k, turned(h), again, h), plus(one, times(k, inner)))
        self.h = times(again, h, inverse(middle))
        self.gamma = scaled(-1, times(plus(times(turned(self.h), h), inner), inverse(plus(one, times(k, inner)))))
        self.p = times(minus(unit(n), times(self.h, k, turned(h))), again)
        power = 2 if corrected else 1
        self.inverse = self._operator(
            self.p,
            scaled(1 / self.tau, self.h),
            scaled(1 / self.tau, self.gamma),
            [[scaled(1 / self.tau**power, b) for b in row] for row in self.back],
            [[times(z, b) for z, b in zip(*both, strict=True)] for both in zip(self.z, self.back, strict=True)],
        )

    def _integral(self, i: int, values: list[Matrix]) -> Matrix:
        return plus(*(scaled(w, value) for w, value in zip(self.weights[i], values, strict=True)))

    def block(self, matrix: Matrix, i: int, j: int | None = None) -> Matrix:
        """H_i, or Gamma_ij."""
        columns = slice((i if j is None else j) * self.rows, ((i if j is None else j) + 1) * self.rows)
        chosen = matrix if j is None else matrix[i * self.rows : (i + 1) * self.rows]
        return [row[columns] for row in chosen]

    def _operator(
        self, p: Matrix, h: Matrix, gamma: Matrix, s: list[list[Matrix]], z: list[list[Matrix]] | None = None
    ) -> Operator:
        """The operator with Q_i = H_i Z and R_ij = Z' Gamma_ij Z."""
        shape, pairs = z or self.z, range(DELAYS)
        q = [[times(self.block(h, i), one) for one in shape[i]] for i in pairs]
        r = [
            [[[times(turned(a), self.block(gamma, i, j), b) for b in shape[j]] for a in shape[i]] for j in pairs]
            for i in pairs
        ]
        return Operator(self.tau, self.weights, p, q, s, r)


def theorem_4(draw: Draw, size: tuple[int, int, int], corrected: bool) -> Any:
    """The product of inverse and operator on a vector and histories, and these themselves."""
    g = Setting(draw, size, corrected)
    given = draw.matrix(g.n, 1), [[draw.matrix(g.n, 1) for _ in row] for row in g.weights]
    return (g.inverse.applied(*g.operator.applied(*given)), g.operator.applied(*g.inverse.applied(*given))), (
        given,
        given,
    )


@dataclass(frozen=True)
class Injection:
    """The operator (10) by its parts, for one measurement, at the points of each delay.

    Z_7ij = Z' W_7ij Z(theta) has one column for one measurement, of which Z(theta) there is a column, seen.
    """

    Z0: Matrix
    Z2: list[Matrix]
    Z3: list[list[Matrix]]
    W4: list[Matrix]
    W5: list[list[Matrix]]
    W6: list[Matrix]
    W7: list[list[Matrix]]
    seen: list[list[Matrix]]


class Gains:
    """The gains of Lemma 5: L_0, L_2i and L_3i; and what stands after X_i(s) in L_4i, L_5ij, L_6i and L_7ij."""

    def __init__(self, g: Setting, z: Injection) -> None:
        k, points = range(DELAYS), range(len(g.weights[0]))
        h = [g.block(g.h, i) for i in k]
        turned_h = [turned(one) for one in h]
        beside = [[times(g.block(g.gamma, i, j), g.t[j]) for j in k] for i in k]
        third = [[[times(z.W7[i][j], z.seen[j][b]) for b in points] for j in k] for i in k]
        self.X = [[times(g.back[i][a], turned(g.z[i][a])) for a in points] for i in k]
        self.L0 = plus(times(g.p, z.Z0), *(times(h[i], g.t[i], z.W4[i]) for i in k))
        self.L2 = [plus(times(g.p, z.Z2[i]), *(times(h[j], g.t[j], z.W5[j][i]) for j in k)) for i in k]
        self.L3 = [
            [
                plus(
                    times(g.p, z.Z3[i][b]),
                    times(h[i], g.v[i][b], z.W6[i]),
                    *(times(h[j], g.t[j], third[j][i][b]) for j in k),
                )
                for b in points
            ]
            for i in k
        ]
        self.L4 = [plus(times(turned_h[i], z.Z0), z.W4[i], *(times(beside[i][j], z.W4[j]) for j in k)) for i in k]
        self.L5 = [
            [plus(times(turned_h[i], z.Z2[j]), z.W5[i][j], *(times(beside[i][q], z.W5[q][j]) for q in k)) for j in k]
            for i in k
        ]
        self.L6 = z.W6
        self.L7 = [
            [
                [
                    plus(
                        times(turned_h[i], z.Z3[j][b]),
                        third[i][j][b],
                        times(g.block(g.gamma, i, j), g.v[j][b], z.W6[j]),
                        *(times(beside[i][q], third[q][j][b]) for q in k),
                    )
                    for b in points
                ]
                for j in k
            ]
            for i in k
        ]

    def histories(self) -> list[Matrix]:
        """All gains but L_0 and L_2i, those with X_i(s) without it: X_i(s) times zero is zero."""
        after = [*self.L4, *self.L6, *(one for row in self.L5 for one in row)]
        return [
            *(one for row in self.L3 for one in row),
            *after,
            *(one for block in self.L7 for row in block for one in row),
        ]


def lemma_5(draw: Draw, size: tuple[int, int, int], corrected: bool) -> Any:
    """The inverse on the injection (10), and the gains of the lemma, on one measurement and its histories."""
    g = Setting(draw, size, corrected)
    k, n, rows, m = range(DELAYS), g.n, g.rows, draw.matrix
    points = range(len(g.weights[0]))
    y0, past, y = m(1, 1), [m(1, 1) for _ in k], [[m(1, 1) for _ in points] for _ in k]
    z = Injection(
        m(n, 1),
        [m(n, 1) for _ in k],
        [[m(n, 1) for _ in points] for _ in k],
        [m(rows, 1) for _ in k],
        [[m(rows, 1) for _ in k] for _ in k],
        [m(rows, 1) for _ in k],
        [[m(rows, rows) for _ in k] for _ in k],
        [[m(rows, 1) for _ in points] for _ in k],
    )
    gains = Gains(g, z)

    def summed(curve: Any) -> Matrix:
        return plus(*(scaled(w, times(curve(j, b), y[j][b])) for j in k for b, w in enumerate(g.weights[j])))

    def injected(i: int, a: int) -> Matrix:
        common = plus(times(z.W4[i], y0), *(times(z.W5[i][j], past[j]) for j in k))
        inner = summed(lambda j, b: times(z.W7[i][j], z.seen[j][b]))
        value = times(turned(g.z[i][a]), plus(common, inner, times(z.W6[i], y[i][a])))
        return scaled(g.tau if corrected else Fraction(1), value)

    def gained(i: int, a: int) -> Matrix:
        common = plus(times(gains.L4[i], y0), *(times(gains.L5[i][j], past[j]) for j in k))
        inner = summed(lambda j, b: gains.L7[i][j][b])
        return times(gains.X[i][a], plus(common, inner, times(gains.L6[i], y[i][a])))

    first = plus(times(z.Z0, y0), *(times(z.Z2[i], past[i]) for i in k), summed(lambda j, b: z.Z3[j][b]))
    above = plus(times(gains.L0, y0), *(times(gains.L2[i], past[i]) for i in k), summed(lambda j, b: gains.L3[j][b]))
    second, below = ([[curve(i, a) for a in points] for i in k] for curve in (injected, gained))
    return g.inverse.applied(first, second), (above, below)


def corrections(draw: Draw, size: tuple[int, int, int]) -> Any:
    """All gains of Lemma 5 with Q_i and Z_3i to Z_7ij zero, and P^-1 Z_0, P^-1 Z_2i and zeros."""
    g = Setting(draw, size, corrected=True, coupled=False)
    k, n, rows, points = range(DELAYS), g.n, g.rows, range(len(g.weights[0]))
    z0, z2, none = draw.matrix(n, 1), [draw.matrix(n, 1) for _ in k], nought(rows, 1)
    z = Injection(
        z0,
        z2,
        [[nought(n, 1) for _ in points] for _ in k],
        [none for _ in k],
        [[none for _ in k] for _ in k],
        [none for _ in k],
        [[nought(rows, rows) for _ in k] for _ in k],
        [[draw.matrix(rows, 1) for _ in points] for _ in k],
    )
    gains, again = Gains(g, z), inverse(g.operator.P)
    others = gains.histories()
    return (gains.L0, gains.L2, others), (
        times(again, z0),
        [times(again, one) for one in z2],
        [nought(len(one), 1) for one in others],
    )


PARTS = {"theorem-4": theorem_4, "lemma-5": lemma_5}


def operator_identity(given: Certificate) -> Proof:
    """Theorem 4 or Lemma 5 holds with its corrections, and not as it is printed."""
    given.stated()
    take(given.plant, "plant", "name")
    take(given.witness, "witness")
    (name,) = take(given.parameters, "parameters", "part")
    chosen = one_of(name, "part", *PARTS)
    for size in SIZES[chosen]:
        need(same(partial(PARTS[chosen], size=size, corrected=True)), f"{chosen} does not hold when corrected")
        need(not same(partial(PARTS[chosen], size=size, corrected=False)), f"{chosen} holds as printed")
    return Proof(holds=True)


def present_only(given: Certificate) -> Proof:
    """Where Q_i and Z_3i to Z_7ij are zero, the gains of Lemma 5 are L_0 = P^-1 Z_0, L_2i = P^-1 Z_2i, and zero."""
    given.stated()
    take(given.plant, "plant", "name")
    take(given.parameters, "parameters")
    take(given.witness, "witness")
    for size in SIZES["theorem-4"]:
        need(same(partial(corrections, size=size)), "other gains are not zero, or L_0 or L_2i is another one")
    return Proof(holds=True)


CHECKS = {"delay.operator-identity": operator_identity, "delay.present-only": present_only}
