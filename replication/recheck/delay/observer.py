"""What the inequality of Theorem 1 of Peet and Gu says of the observer, and where it does not suffice.

An inner product of finite sums stands for that of the space: the operators enter through products and adjoints alone.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from replication.recheck.exact import (
    blocks,
    inverse,
    is_positive,
    minus,
    nought,
    plus,
    scaled,
    times,
    trace,
    turned,
    unit,
)
from replication.recheck.identities import Draw, same
from replication.recheck.reading import Certificate, Matrix, Proof, need, take

N, W, Z, Y = 3, 2, 2, 2
"""States, disturbances, outputs and measurements of the identities."""


def _product(left: Matrix, right: Matrix) -> Any:
    return times(turned(left), right)[0][0]


class Setting:
    """A random system, storage, injection, error and signals."""

    def __init__(self, draw: Draw) -> None:
        m = draw.matrix
        self.A, self.B, self.C1, self.C2, self.D = m(N, N), m(N, W), m(Z, N), m(Y, N), m(Y, W)
        self.P, self.Z, self.level = draw.symmetric(N), m(N, Y), draw.number()
        self.e, self.w, self.v = m(N, 1), m(W, 1), m(Z, 1)

    def inequality(self, v: Matrix) -> Any:
        """The left side of Theorem 1."""
        driven = plus(times(self.P, self.A), times(self.Z, self.C2))
        pushed = plus(times(self.P, self.B), times(self.Z, self.D))
        first = 2 * _product(self.e, minus(times(driven, self.e), times(pushed, self.w)))
        supplied = self.level * (_product(self.w, self.w) + _product(v, v))
        return first - supplied + 2 * _product(v, times(self.C1, self.e))

    def lmi_3(self) -> Matrix:
        """The matrix of LMI (3)."""
        driven, pushed = (
            plus(times(self.P, one), times(self.Z, other)) for one, other in ((self.A, self.C2), (self.B, self.D))
        )
        above, beside = scaled(-1, pushed), turned(self.C1)
        return blocks(
            [
                [plus(driven, turned(driven)), above, beside],
                [turned(above), unit(W, -self.level), nought(W, Z)],
                [self.C1, nought(Z, W), unit(Z, -self.level)],
            ]
        )


def along(draw: Draw) -> tuple[Any, Any]:
    """The left side of Theorem 1 at v = z/level, and V' - level |w|^2 + |z|^2/level along (6) for L = P^-1 Z."""
    g = Setting(draw)
    gain, z = times(inverse(g.P), g.Z), times(g.C1, g.e)
    closed, disturbed = plus(g.A, times(gain, g.C2)), plus(g.B, times(gain, g.D))
    rate = minus(times(closed, g.e), times(disturbed, g.w))
    grown = 2 * _product(g.e, times(g.P, rate))
    supplied = g.level * _product(g.w, g.w) - _product(z, z) / g.level
    return g.inequality(scaled(1 / g.level, z)), grown - supplied


def matrices(draw: Draw) -> tuple[Any, Any]:
    """The left side of Theorem 1, and the form of LMI (3)."""
    g = Setting(draw)
    whole = [*g.e, *g.w, *g.v]
    return g.inequality(g.v), _product(whole, times(g.lmi_3(), whole))


def require_insufficient() -> None:
    """Refuse unless the inequality holds in an example with P != P*, of which the error is unstable.

    P = I + J with J the turn by a right angle, A = P^-1 (2J - I), B = C1 = I, level 2 and no injection: e' = A e - w
    grows after a pulse, since B reaches all states and tr A > 0.
    """
    one, none = unit(2), nought(2, 2)
    j: Matrix = [[Fraction(0), Fraction(-1)], [Fraction(1), Fraction(0)]]
    p, level = plus(one, j), Fraction(2)
    a = times(inverse(p), minus(scaled(2, j), one))
    need(p != turned(p) and is_positive(plus(p, turned(p))), "P is self-adjoint, or not coercive")
    # -2 <e, P A e> + 2 <e, P w> + level (|w|^2 + |v|^2) - 2 <v, e> as a symmetric matrix.
    inner = scaled(-1, plus(times(p, a), turned(times(p, a))))
    spent, outward = unit(2, level), scaled(-1, one)
    form = blocks([[inner, p, outward], [turned(p), spent, none], [outward, none, spent]])
    need(is_positive(form), "the inequality does not hold")
    need(trace(a) > 0, "the error may be stable")


def observer_bound(given: Certificate) -> Proof:
    """The inequality at v = z/level is V' <= level |w|^2 - |z|^2/level - eps |e|^2: summed from rest it is (7).

    With c = |P| it gives V' <= level |w|^2 - (eps/c) V, so that the error vanishes with w. LMI (3) is the same.
    """
    given.stated()
    take(given.plant, "plant", "name")
    take(given.parameters, "parameters")
    take(given.witness, "witness")
    need(same(along), "the inequality is another one along the error system")
    need(same(matrices), "LMI (3) is another form")
    require_insufficient()
    return Proof(holds=True)


CHECKS = {"delay.observer-bound": observer_bound}
