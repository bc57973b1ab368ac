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
    """A random operator as in Theorem 4, and its inverse by the theorem, corrected or as it is printed."""

    def __init__(self, draw: Draw, size: tuple[int, int, int], corrected: bool) -> None:
        self.n, self.rows, points = size
        n, rows, pairs = self.n, self.rows, range(DELAYS)
        self.tau = draw.number()
        self.weights = [[draw.number() for _ in range(points)] for _ in pairs]
        p, h, gamma = draw.symmetric(n), draw.matrix(n, DELAYS * rows), draw.symmetric(DELAYS * rows)
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


def lemma_5(draw: Draw, size: tuple[int, int, int], corrected: bool) -> Any:
    """The inverse on the injection (10), and the gains of the lemma, on one measurement and its histories."""
    g = Setting(draw, size, corrected)
    k, n, rows, m = range(DELAYS), g.n, g.rows, draw.matrix
    y0, past = m(1, 1), [m(1, 1) for _ in k]
    y = [[m(1, 1) for _ in row] for row in g.weights]
    z0, z2, z3 = m(n, 1), [m(n, 1) for _ in k], [[m(n, 1) for _ in row] for row in g.weights]
    w4, w5, w6 = [m(rows, 1) for _ in k], [[m(rows, 1) for _ in k] for _ in k], [m(rows, 1) for _ in k]
    w7 = [[m(rows, rows) for _ in k] for _ in k]
    # Z_7ij = Z' W_7ij Z(theta) has one column for one measurement, of which Z(theta) there is a column.
    zc = [[m(rows, 1) for _ in row] for row in g.weights]

    def summed(curve: Any) -> Matrix:
        return plus(*(scaled(w, curve(j, b)) for j, row in enumerate(g.weights) for b, w in enumerate(row)))

    first = plus(times(z0, y0), *(times(z2[i], past[i]) for i in k), summed(lambda j, b: times(z3[j][b], y[j][b])))
    factor = g.tau if corrected else Fraction(1)
    second = []
    for i in k:
        common = plus(
            times(w4[i], y0),
            *(times(w5[i][j], past[j]) for j in k),
            summed(lambda j, b, i=i: times(w7[i][j], zc[j][b], y[j][b])),
        )
        second.append(
            [scaled(factor, times(turned(g.z[i][a]), plus(common, times(w6[i], y[i][a])))) for a in range(len(y[i]))]
        )
    h = [g.block(g.h, i) for i in k]
    gamma = [[g.block(g.gamma, i, j) for j in k] for i in k]
    l0 = plus(times(g.p, z0), *(times(h[i], g.t[i], w4[i]) for i in k))
    l2 = [plus(times(g.p, z2[i]), *(times(h[j], g.t[j], w5[j][i]) for j in k)) for i in k]

    def l3(i: int, b: int) -> Matrix:
        inner = plus(*(times(h[j], g.t[j], w7[j][i], zc[i][b]) for j in k))
        return plus(times(g.p, z3[i][b]), times(h[i], g.v[i][b], w6[i]), inner)

    gained = plus(times(l0, y0), *(times(l2[i], past[i]) for i in k), summed(lambda j, b: times(l3(j, b), y[j][b])))
    below = []
    for i in k:
        l4 = plus(times(turned(h[i]), z0), w4[i], *(times(gamma[i][j], g.t[j], w4[j]) for j in k))
        l5 = [plus(times(turned(h[i]), z2[j]), w5[i][j], *(times(gamma[i][q], g.t[q], w5[q][j]) for q in k)) for j in k]

        def l7(j: int, b: int, i: int = i) -> Matrix:
            inner = plus(*(times(gamma[i][q], g.t[q], w7[q][j], zc[j][b]) for q in k))
            own = times(w7[i][j], zc[j][b])
            return plus(times(turned(h[i]), z3[j][b]), own, times(gamma[i][j], g.v[j][b], w6[j]), inner)

        common = plus(
            times(l4, y0), *(times(l5[j], past[j]) for j in k), summed(lambda j, b, l7=l7: times(l7(j, b), y[j][b]))
        )
        row = []
        for a in range(len(y[i])):
            x = times(g.back[i][a], turned(g.z[i][a]))
            row.append(times(x, plus(common, times(w6[i], y[i][a]))))
        below.append(row)
    return g.inverse.applied(first, second), (gained, below)


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


CHECKS = {"delay.operator-identity": operator_identity}
