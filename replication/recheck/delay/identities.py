"""The identity behind Theorem 3 of Peet and Gu at random points; with any one misprint it fails."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from replication.recheck.exact import blocks, minus, nought, plus, scaled, solved, times, turned
from replication.recheck.identities import Draw, same
from replication.recheck.reading import Certificate, Matrix, Proof, need, one_of, several, take

MISPRINTS = ("d-sign", "f-sign", "e-transposes", "eq10-factor", "theorem-1-sign")
NODES = 7
"""Of the rule that is exact for the polynomials under the integrals, whose degree is five at most."""
N, DELAYS = 2, 2

Curve = Callable[[Fraction], Matrix]


def _weights() -> list[Fraction]:
    """Weights of equally spaced nodes on [-1, 0], exact up to the degree NODES - 1."""
    nodes = [Fraction(k, NODES - 1) - 1 for k in range(NODES)]
    moments = [[Fraction((-1) ** p, p + 1)] for p in range(NODES)]
    return [row[0] for row in solved([[node**p for node in nodes] for p in range(NODES)], moments)]


WEIGHTS = _weights()


def integral(curve: Callable[..., Matrix], delay: Fraction, *more: int) -> Matrix:
    """The integral of a polynomial, in its first argument, over [-delay, 0]."""
    nodes = [delay * (Fraction(k, NODES - 1) - 1) for k in range(NODES)]
    return plus(*(scaled(weight * delay, curve(node, *more)) for weight, node in zip(WEIGHTS, nodes, strict=True)))


def polynomial(coefficients: list[Matrix]) -> Curve:
    """s to the sum of coefficient s^k."""
    return lambda s: plus(*(scaled(s**k, one) for k, one in enumerate(coefficients)))


def sloped(coefficients: list[Matrix]) -> Curve:
    """Its derivative."""
    return lambda s: plus(*(scaled(k * s ** (k - 1) if k else 0, one) for k, one in enumerate(coefficients)))


class Setting:
    """Random plant, storage, injection and history: two states and delays, one disturbance, output and measurement."""

    def __init__(self, draw: Draw) -> None:
        m, pairs = draw.matrix, range(DELAYS)
        self.tau = [draw.number() for _ in pairs]
        self.A = [m(N, N) for _ in range(DELAYS + 1)]
        self.B, self.C2, self.C1 = m(N, 1), m(1, N), [m(1, N) for _ in range(DELAYS + 1)]
        self.P, self.level, self.w, self.v = draw.symmetric(N), draw.number(), m(1, 1), m(1, 1)
        self.Q = [[m(N, N), m(N, N)] for _ in pairs]
        self.S = [[draw.symmetric(N), draw.symmetric(N)] for _ in pairs]
        # R_ij(s, t) = sum s^a t^b R_ij[a][b], and R_ji(t, s) its transpose.
        free = [[[[m(N, N) for _ in range(2)] for _ in range(2)] for _ in pairs] for _ in pairs]
        self.R = [
            [[[plus(free[i][j][a][b], turned(free[j][i][b][a])) for b in range(2)] for a in range(2)] for j in pairs]
            for i in pairs
        ]
        self.Z0, self.Z2 = m(N, 1), [m(N, 1) for _ in pairs]
        self.Z3, self.Z4, self.Z6 = ([polynomial([m(N, 1), m(N, 1)]) for _ in pairs] for _ in range(3))
        self.Z5 = [[polynomial([m(N, 1), m(N, 1)]) for _ in pairs] for _ in pairs]
        self.Z7 = [[[[m(N, 1) for _ in range(2)] for _ in range(2)] for _ in pairs] for _ in pairs]
        self.e0 = m(N, 1)
        self.e = [[self.e0, m(N, 1), m(N, 1)] for _ in pairs]

    @staticmethod
    def kernel(coefficients: list[list[Matrix]], s: Fraction, t: Fraction, ds: int = 0, dt: int = 0) -> Matrix:
        """A kernel of degree one in s and t, or its derivative in either."""

        def power(x: Fraction, k: int, derived: int) -> Fraction:
            return (x**k) if not derived else Fraction(k)

        return plus(
            *(scaled(power(s, a, ds) * power(t, b, dt), coefficients[a][b]) for a in range(2) for b in range(2))
        )


def dissipated(g: Setting, right: set[str]) -> Fraction:
    """2 <e, P A e + Z C2 e - P B w> - level (|w|^2 + |v|^2) + 2 v'C1 e."""
    k, tau = range(DELAYS), g.tau[-1]
    history = [polynomial(one) for one in g.e]
    past = [history[i](-g.tau[i]) for i in k]
    pushed = minus(plus(*(times(a, x) for a, x in zip(g.A, [g.e0, *past], strict=True))), times(g.B, g.w))
    rates = [sloped(one) for one in g.e]
    first = plus(
        times(g.P, pushed),
        *(integral(lambda s, i: times(polynomial(g.Q[i])(s), rates[i](s)), g.tau[i], i) for i in k),
        times(g.Z0, g.C2, g.e0),
        *(times(g.Z2[i], g.C2, past[i]) for i in k),
        *(integral(lambda s, i: times(g.Z3[i](s), g.C2, history[i](s)), g.tau[i], i) for i in k),
    )

    def second(i: int, s: Fraction) -> Matrix:
        injected = plus(
            times(g.Z4[i](s), g.C2, g.e0),
            *(times(g.Z5[i][j](s), g.C2, past[j]) for j in k),
            times(g.Z6[i](s), g.C2, history[i](s)),
            *(integral(lambda t, j: times(g.kernel(g.Z7[i][j], s, t), g.C2, history[j](t)), g.tau[j], j) for j in k),
        )
        return plus(
            scaled(tau, times(turned(polynomial(g.Q[i])(s)), pushed)),
            scaled(tau, times(polynomial(g.S[i])(s), rates[i](s))),
            *(integral(lambda t, j: times(g.kernel(g.R[i][j], s, t), rates[j](t)), g.tau[j], j) for j in k),
            scaled(tau if "eq10-factor" in right else 1, injected),
        )

    whole = plus(
        scaled(tau, times(turned(g.e0), first)),
        *(integral(lambda s, i: times(turned(history[i](s)), second(i, s)), g.tau[i], i) for i in k),
    )[0][0]
    z = plus(*(times(c, x) for c, x in zip(g.C1, [g.e0, *past], strict=True)))[0][0]
    w, v = g.w[0][0], g.v[0][0]
    signed = 2 * v * z - g.level * v * v if "theorem-1-sign" in right else z * z / g.level
    return Fraction(2 * whole - g.level * w * w + signed)


def form(g: Setting, right: set[str]) -> Fraction:
    """<h, P{D, E, F, G} h> of Theorem 3, with these misprints corrected."""
    k, tau, t = range(DELAYS), g.tau[-1], turned
    history = [polynomial(one) for one in g.e]
    past = [history[i](-g.tau[i]) for i in k]
    h0 = [*g.w, *g.v, *g.e0, *(row for one in past for row in one)]
    q, s_ = [polynomial(one) for one in g.Q], [polynomial(one) for one in g.S]
    zero = Fraction(0)
    injected = times(g.Z0, g.C2)
    start = plus(times(g.P, g.A[0]), times(t(g.A[0]), g.P), *(plus(q[i](zero), t(q[i](zero)), s_[i](zero)) for i in k))
    corner = plus(start, injected, t(injected))
    delayed = [plus(times(g.P, g.A[i + 1]), scaled(-1, q[i](-g.tau[i])), times(g.Z2[i], g.C2)) for i in k]
    sign = -1 if "d-sign" in right else 1
    gain = [[-g.level / tau]]
    upper = [
        [gain, nought(1, 1), scaled(-1, t(times(g.P, g.B))), *(nought(1, N) for _ in k)],
        [gain, *(scaled(1 / tau, c) for c in g.C1)],
        [corner, *delayed],
        *([scaled(sign, s_[i](-g.tau[i])), *(nought(N, N) for _ in range(i + 1, DELAYS))] for i in k),
    ]
    size = len(upper)
    d = blocks([[upper[i][j - i] if j >= i else t(upper[j][i - j]) for j in range(size)] for i in range(size)])

    def beside(i: int, s: Fraction) -> Matrix:
        """E_i(s), whose rows stand for h_0. As printed all blocks are transposed, the right ones and the others."""
        own = plus(
            times(t(g.A[0]), q[i](s)),
            *(scaled(1 / tau, t(g.kernel(g.R[i][j], s, zero))) for j in k),
            scaled(-1, sloped(g.Q[i])(s)),
        )
        more = plus(times(g.Z4[i](s), g.C2), times(t(g.C2), t(g.Z3[i](s))))
        others = [
            minus(times(t(g.A[j + 1]), q[i](s)), scaled(1 / tau, t(g.kernel(g.R[i][j], s, -g.tau[j])))) for j in k
        ]
        rest = [times(g.Z5[i][j](s), g.C2) for j in k]
        pairs = zip([own, *others], [more, *rest], strict=True)
        held = [plus(a, t(b)) if "e-transposes" in right else t(plus(a, b)) for a, b in pairs]
        return [*scaled(-1, times(t(g.B), q[i](s))), *nought(1, N), *(row for block in held for row in block)]

    def second(i: int, s: Fraction) -> Matrix:
        z6 = times(g.Z6[i](s), g.C2)
        f = plus(scaled(-1 if "f-sign" in right else 1, sloped(g.S[i])(s)), z6, t(z6))

        def kernel(j: int, u: Fraction) -> Matrix:
            moved = plus(g.kernel(g.R[i][j], s, u, 1), g.kernel(g.R[i][j], s, u, 0, 1))
            both = plus(times(g.kernel(g.Z7[i][j], s, u), g.C2), times(t(g.C2), t(g.kernel(g.Z7[j][i], u, s))))
            return minus(scaled(tau, both), moved)

        return plus(
            scaled(tau, times(t(beside(i, s)), h0)),
            scaled(tau, times(f, history[i](s))),
            *(integral(lambda u, j: times(kernel(j, u), history[j](u)), g.tau[j], j) for j in k),
        )

    first = plus(times(d, h0), *(integral(lambda s, i: times(beside(i, s), history[i](s)), g.tau[i], i) for i in k))
    return Fraction(
        plus(
            scaled(tau, times(t(h0), first)),
            *(integral(lambda s, i: times(t(history[i](s)), second(i, s)), g.tau[i], i) for i in k),
        )[0][0]
    )


def _bare(given: Certificate) -> None:
    given.stated()
    take(given.plant, "plant", "name")
    take(given.witness, "witness")


def dissipation_identity(given: Certificate) -> Proof:
    """The dissipation is the form of Theorem 3 if these misprints are corrected, and not if one of them stands."""
    _bare(given)
    (listed,) = take(given.parameters, "parameters", "misprints")
    corrected = {*several(listed, "misprints", lambda one, at: one_of(one, at, *MISPRINTS))}
    need(len(corrected) == len(listed), "a misprint stands twice")

    def sides(right: set[str]) -> Callable[[Draw], tuple[Any, Any]]:
        def both(draw: Draw) -> tuple[Any, Any]:
            g = Setting(draw)
            return dissipated(g, right), form(g, right)

        return both

    need(same(sides(corrected)), "the dissipation is another form")
    for one in corrected:
        need(not same(sides(corrected - {one})), f"it is the form with {one} as printed too")
    return Proof(holds=True)


CHECKS = {"delay.dissipation-identity": dissipation_identity}
