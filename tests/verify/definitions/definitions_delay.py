"""The sentences on observers of systems with delays against numerics from their definitions.

Gains of disturbances that y does not show are swept over the frequency. A storage is differentiated along polynomial
histories that y does not show: there no injection acts, and an observer with the level exists only if the dissipation
holds (and, for matrices, if it does). Roots are found by collocation, identities tried at seeded operators.
"""

import re
from collections.abc import Callable, Sequence
from itertools import product
from math import factorial
from typing import Any

import numpy as np
import scipy.linalg
from definition import Check, Data, Matrix, array, checks, largest, norms, number, smallest, spoken, within
from numpy.polynomial import legendre

PAPER = "peet2019"
FACTORS = {"(3)": 1.0, "Theorem 3": 1.0, "Theorem 4": 1.0, "Lemma 5": 1.0}
"""Of one term of an equation that has no data of its own: one, unless a test alters it."""
SLACK = 1e-3
"""By how much, relative, a level is missed for a Riccati equation to have a solution in floats."""
ORDER = 9
"""Degree of the histories along which a storage is differentiated."""
Lag = Callable[[complex], complex]
RULES: dict[str, Callable[[int, int, int], bool]] = {
    "each": lambda a, b, degree: True,
    "total": lambda a, b, degree: a + b <= degree,
    "outer": lambda a, b, degree: a == 0,
    "inner": lambda a, b, degree: b == 0,
}


class Delayed:
    """x' = A0 x + sum A_i x(t - tau_i) + B w, z = C10 x + sum C1_i x(t - tau_i), y = C2 x."""

    def __init__(self, plant: Data) -> None:
        self.A0, self.A, self.B, self.C10, self.C1, self.C2 = (
            array(plant[name]) for name in ("A0", "A", "B", "C10", "C1", "C2")
        )
        self.delays, self.n, self.unseen = array(plant["delays"]), len(self.A0), scipy.linalg.null_space(self.C2)

    def characteristic(self, s: complex, lag: Lag = lambda a: np.exp(-a)) -> Any:
        return s * np.eye(self.n) - self.A0 - sum(lag(s * t) * A for t, A in zip(self.delays, self.A, strict=True))

    def hidden(self, frequency: float, lag: Lag = lambda a: np.exp(-a)) -> float:
        """The largest |z|/|w| of motions at a frequency with C2 x = 0, under the w that solves the equation."""
        s, unseen = 1j * frequency, self.unseen
        w = np.linalg.solve(self.B, self.characteristic(s, lag) @ unseen)
        z = (self.C10 + sum(lag(s * t) * C for t, C in zip(self.delays, self.C1, strict=True))) @ unseen
        return float(np.linalg.norm(z @ np.linalg.inv(np.linalg.qr(w)[1]), 2))

    def unbeaten(self, lag: Lag = lambda a: np.exp(-a)) -> float:
        return largest(np.vectorize(lambda frequency: self.hidden(frequency, lag)), np.linspace(0, 30, 301))

    def roots(self, points: int = 40) -> Any:
        """Characteristic roots by collocation of the history at Chebyshev points of [-tau_K, 0]."""
        k = np.arange(points + 1)
        nodes = np.cos(np.pi * k / points)
        c = np.where((k == 0) | (k == points), 2.0, 1.0) * (-1.0) ** k
        D = np.outer(c, 1 / c) / (nodes[:, None] - nodes + np.eye(points + 1))
        D -= np.diag(D.sum(axis=1))
        last = self.delays[-1]
        whole = np.kron(D * 2 / last, np.eye(self.n))
        whole[: self.n] = 0
        whole[: self.n, : self.n] = self.A0
        for delay, A in zip(self.delays, self.A, strict=True):
            basis = np.polynomial.chebyshev.chebvander(nodes, points)
            at = np.polynomial.chebyshev.chebvander([1 - 2 * delay / last], points)
            row = np.linalg.solve(basis.T, at[0])
            whole[: self.n] += np.kron(row, A)
        return np.linalg.eigvals(whole)


def near(told: Data) -> float:
    (frequency,) = re.findall(r"near (\S+) rad/s", spoken(told))
    return float(frequency)


def gain_lower(told: Data) -> None:
    plant, lower = Delayed(told["plant"]), number(told["bound"]["lower"])
    assert plant.unbeaten() >= lower
    assert plant.hidden(near(told)) >= lower * (1 - 1e-6)


def pade(order: int) -> Lag:
    """The Pade approximant q(-s)/q(s) of e^-s."""
    q = np.array([factorial(2 * order - k) / (factorial(k) * factorial(order - k)) for k in range(order + 1)])
    return lambda a: complex(np.polynomial.polynomial.polyval(-a, q) / np.polynomial.polynomial.polyval(a, q))


def pade_lower(told: Data) -> None:
    plant, lower, lag = Delayed(told["plant"]), number(told["bound"]["lower"]), pade(told["parameters"]["order"])
    assert plant.unbeaten(lag) >= lower
    assert plant.hidden(near(told), lag) >= lower * (1 - 1e-6)


def approximant(order: int) -> tuple[Matrix, Matrix, Matrix, float]:
    """A realisation of q(-s)/q(s): a chain of all-pass sections, for each pair of poles and each real one."""
    poles = np.polynomial.polynomial.polyroots(
        [factorial(2 * order - k) / (factorial(k) * factorial(order - k)) for k in range(order + 1)]
    )
    a, b, c = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0))
    for pole in poles[poles.imag >= 0]:
        damping, stiff = -pole.real * (2 if pole.imag else 1), abs(pole)
        own = np.array([[-damping, -stiff], [stiff, 0]]) if pole.imag else np.array([[-damping]])
        enter = np.eye(len(own))[:, :1] * np.sqrt(2 * damping)
        a = np.block([[a, np.zeros((len(a), len(own)))], [enter @ c, own]])
        b, c = np.vstack([b, enter]), np.hstack([c, -enter.T])
    return a, b, c * (-1) ** order, (-1.0) ** order


def approximated(plant: Delayed, order: int) -> tuple[Matrix, Matrix, Matrix]:
    """A, B, C of the plant whose delayed states that have an effect pass through approximants."""
    a, b, c, d = approximant(order)
    n, A, C = plant.n, plant.A0.copy(), plant.C10.copy()
    lines, columns, sections = [], [], []
    for delay, late, output in zip(plant.delays, plant.A, plant.C1, strict=True):
        for j in np.flatnonzero(np.any(np.vstack([late, output]) != 0, axis=0)):
            A[:, j] += d * late[:, j]
            C[:, j] += d * output[:, j]
            columns.append(np.vstack([late[:, [j]], output[:, [j]]]) @ c)
            lines.append(b @ np.eye(n)[[j]] / delay)
            sections.append(a / delay)
    beside = np.hstack(columns)
    whole = np.block([[A, beside[:n]], [np.vstack(lines), scipy.linalg.block_diag(*sections)]])
    return whole, np.vstack([plant.B, np.zeros((len(whole) - n, plant.B.shape[1]))]), np.hstack([C, beside[n:]])


def lmi_3(A: Matrix, B: Matrix, C: Matrix, C2: Matrix, D: Matrix, P: Matrix, Z: Matrix, level: float) -> Matrix:
    """The matrix of (3)."""
    drift, driven = P @ A + Z @ C2, -(P @ B + Z @ D) * FACTORS["(3)"]
    r, p = B.shape[1], len(C)
    return np.block(
        [
            [drift + drift.T, driven, C.T],
            [driven.T, -level * np.eye(r), np.zeros((r, p))],
            [C, np.zeros((p, r)), -level * np.eye(p)],
        ]
    )


def pade_upper(told: Data) -> None:
    """P is gamma/Y, of the Riccati equation of a filter that sees y with little noise."""
    plant, upper = Delayed(told["plant"]), number(told["bound"]["upper"])
    assert plant.unbeaten(pade(told["parameters"]["order"])) <= upper
    A, B, C = approximated(plant, told["parameters"]["order"])
    seen = np.hstack([plant.C2, np.zeros((len(plant.C2), len(A) - plant.n))])
    level, noise, extra = upper * (1 + SLACK), 1e-5, 1e-6
    weights = scipy.linalg.block_diag(noise * np.eye(len(seen)), -(level**2) * np.eye(len(C)))
    try:
        Y = scipy.linalg.solve_continuous_are(A.T, np.vstack([seen, C]).T, B @ B.T + extra * np.eye(len(A)), weights)
    except np.linalg.LinAlgError as failure:
        raise AssertionError("the Riccati equation has no solution") from failure
    assert smallest(Y) > 0
    P, Z = level * np.linalg.inv(Y), -level / (2 * noise) * seen.T
    none = np.zeros((len(seen), B.shape[1]))
    T = scipy.linalg.block_diag(np.linalg.inv(np.linalg.cholesky(P)).T, np.eye(B.shape[1] + len(C)))
    assert smallest(-T.T @ lmi_3(A, B, C, seen, none, P, Z, level) @ T) > 0


# A storage along histories that y does not show.


def storage_form(grams: Sequence[Any], states: int, functions: int, degree: int, rule: str) -> Matrix:
    """The quadratic form of the storage on e and the Legendre coefficients of the histories f(s), s in [-1, 0].

    The sum over the weights 1 and -s(s + 1) of the integrals of zeta'M zeta, zeta = [e; s^a f; s^a int t^b f dt].
    """
    x, weights = legendre.leggauss(2 * ORDER + 6)
    s, weights = (x - 1) / 2, weights / 2
    values = legendre.legvander(x, ORDER)
    moments = np.array([weights * s**b @ values for b in range(degree + 1)])
    total = np.zeros((states + functions * (ORDER + 1),) * 2)
    for gram, bump in zip(map(array, grams), (False, True), strict=True):
        order = degree - bump
        several = range((degree if rule == "outer" else order) + 1)
        powers = [(a, b) for a, b in product(several, several) if RULES[rule](a, b, several[-1])]
        for point, weight, at in zip(s, weights, values, strict=True):
            rows = [point**a * at for a in range(order + 1)] + [point**a * moments[b] for a, b in powers]
            zeta = scipy.linalg.block_diag(np.eye(states), np.kron(np.array(rows), np.eye(functions)))
            total += weight * (-point * (point + 1) if bump else 1.0) * zeta.T @ gram @ zeta
    return total


def dissipates(plant: Delayed, proof: Data, degree: int, rule: str, level: float) -> None:
    """V > 0, and V' <= level |w|^2 - |z|^2/level along all histories of the sample, whatever w."""
    T, count, n = array(proof["change"]), len(plant.delays), plant.n
    back, q = np.linalg.inv(T), len(plant.C2)
    V = storage_form(proof["storage"], n, n * count, degree, rule)
    # Unmeasured coordinates of the coefficients, with f_i(0) = e for every delay: each Legendre polynomial is 1 there.
    coefficients = np.kron(np.eye(ORDER + 1), np.kron(np.eye(count), np.eye(n)[:, : n - q]))
    now = np.kron(np.ones((1, ORDER + 1)), np.eye(n * count))
    differ = np.kron(np.eye(count)[1:] - np.eye(count)[:1], np.eye(n)) @ now @ coefficients
    free = coefficients @ (scipy.linalg.null_space(differ) if count > 1 else np.eye(coefficients.shape[1]))
    e = (now @ free)[:n]
    late = np.kron((-1.0) ** np.arange(ORDER + 1), np.eye(n * count)) @ free
    slopes = np.array([[*legendre.legder(row, scl=2), 0] for row in np.eye(ORDER + 1)]).T
    rates = np.kron(np.diag(1 / plant.delays), np.eye(n))
    delayed = [np.hstack([M @ back for M in matrices]) for matrices in (plant.A, plant.C1)]
    drift = T @ (plant.A0 @ back @ e + delayed[0] @ late)
    moved = np.vstack([drift, np.kron(slopes, rates) @ free])
    driven = np.vstack([-T @ plant.B, np.zeros((len(free), plant.B.shape[1]))])
    x, z = np.vstack([e, free]), plant.C10 @ back @ e + delayed[1] @ late
    assert smallest(x.T @ V @ x) > 0
    cross = x.T @ V @ moved
    corner = -cross - cross.T - z.T @ z / level
    supply = np.block([[corner, -x.T @ V @ driven], [-driven.T @ V @ x, level * np.eye(plant.B.shape[1])]])
    assert smallest(supply) >= -1e-9 * np.abs(supply).max(), "the storage grows by more than what is supplied"


def stored(rule: str) -> Check:
    def check(told: Data) -> None:
        plant, chosen, upper = Delayed(told["plant"]), told["parameters"], number(told["bound"]["upper"])
        dissipates(plant, told["named"], chosen["degree"], chosen.get("rule", rule), upper)
        if plant.B.shape[1] == plant.n:
            assert plant.unbeaten() <= upper

    return check


def near_optimal(told: Data) -> None:
    plant, chosen, level = Delayed(told["plant"]), told["parameters"], number(told["named"]["level"])
    dissipates(plant, told["named"]["sos"], chosen["degree"], "each", level)
    assert plant.unbeaten() <= level <= number(chosen["factor"]) * plant.unbeaten()
    (printed,) = re.findall(r"L2 gain below (\S+),", spoken(told))
    within(float(printed) - 1e-8, level, float(printed))


# Characteristic roots.


def unstable(told: Data) -> None:
    plant, ends = Delayed(told["plant"]), [number(told["named"][name]) for name in ("left", "right")]
    root = max(value.real for value in plant.roots() if abs(value.imag) < 1e-9)
    assert 0 < ends[0] < root < ends[1]
    assert abs(np.linalg.det(plant.characteristic(root))) < 1e-6
    printed = re.findall(r"between (\S+) and (\S+) per", spoken(told))[0]
    assert float(printed[0]) < root < float(printed[1])


def not_unstable(told: Data) -> None:
    """Example 4 with Jordan blocks of one to three states and one to four delays."""
    listed = told["parameters"]["eigenvalues"]
    assert f"has none but {', '.join(listed)}, Example 4" in spoken(told)
    for value, n, count in product(map(number, listed), (1, 2, 3), (1, 2, 4)):
        J = value * np.eye(n) + np.eye(n, k=1)
        late = [(-J / count).tolist()] * count
        delays = [(i + 1) / count for i in range(count)]
        empty = {name: np.ones((1, n)).tolist() for name in ("C10", "C2")}
        zero, outputs = np.zeros((n, n)).tolist(), [np.zeros((1, n)).tolist()] * count
        plant = Delayed(empty | {"A0": zero, "A": late, "delays": delays, "B": zero, "C1": outputs})
        assert plant.roots(20).real.max() < 0


# Theorems 1, 3 and 4 and Lemma 5 at seeded systems and operators.


def observer_bound(_: Data) -> None:
    met = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        n, r, p, q = rng.integers(1, 4, 4)
        A, B, C, C2, D, L = (rng.normal(size=shape) for shape in ((n, n), (n, r), (p, n), (q, n), (q, r), (n, q)))
        closed, driven = A + L @ C2, B + L @ D
        closed -= (margin := max(np.linalg.eigvals(closed).real.max() + 0.3, 0)) * np.eye(n)
        A = A - margin * np.eye(n)
        gain = largest(
            lambda w, a=closed, b=driven, c=C: norms(
                c @ np.linalg.solve(np.multiply.outer(1j * w, np.eye(len(a))) - a, b)
            ),
            np.linspace(0, 20, 201),
        )
        for factor in (0.85, 0.95, 1.1, 1.5):
            level = factor * gain
            weight = FACTORS["(3)"] * driven
            try:
                P = scipy.linalg.solve_continuous_are(
                    closed, weight, C.T @ C / level + 1e-4 * np.eye(n), -level * np.eye(r)
                )
            except np.linalg.LinAlgError:
                continue
            if smallest(P) > 0 and smallest(-lmi_3(A, B, C, C2, D, P, P @ L, level)) > 0:
                assert gain < level
                assert np.linalg.eigvals(closed).real.max() < 0
                met += 1
    assert met >= 12
    J, one = np.array([[0.0, 1.0], [-1.0, 0.0]]), np.eye(2)
    P = one + J
    A = np.linalg.solve(P, 2 * J - one)
    M = np.block([[P @ A + (P @ A).T, -P, one], [-P.T, -2 * one, 0 * one], [one, 0 * one, -2 * one]])
    assert smallest(P + P.T) > 0 and smallest(-M) > 0
    assert np.linalg.eigvals(A).real.max() > 0


class Drawn:
    """Seeded operators (8) and (10) on histories over K = 2 delays, by their values at Gauss points.

    Q_i = H_i Z and R_ij = Z' Gamma_ij Z with Z = [I; sI; s^2 I]; Z_4i = Z'W_4i and so on.
    """

    def __init__(self, seed: int = 3, n: int = 2, q: int = 1) -> None:
        rng = np.random.default_rng(seed)
        self.n, self.q, self.delays = n, q, (0.7, 2.0)
        x, weights = legendre.leggauss(12)
        self.s = [(x - 1) / 2 * t for t in self.delays]
        self.w = [weights / 2 * t for t in self.delays]
        self.tau, m = self.delays[-1], 3 * n
        self.H, root = 0.3 * rng.normal(size=(2, n, m)), 0.1 * rng.normal(size=(2 * m, 2 * m))
        self.G = (root + root.T).reshape(2, m, 2, m).transpose(0, 2, 1, 3)
        self.P = 4 * np.eye(n) + 0.3 * (lambda M: M + M.T)(rng.normal(size=(n, n)))
        self.S_0, self.S_1 = 3 * np.eye(n), 0.2 * (lambda M: M + M.transpose(0, 2, 1))(rng.normal(size=(2, n, n)))
        self.Z_0, self.Z_2, self.W_3 = rng.normal(size=(n, q)), rng.normal(size=(2, n, q)), rng.normal(size=(2, n, q))
        self.W_4, self.W_6 = rng.normal(size=(2, m, q)), rng.normal(size=(2, m, q))
        self.W_5, self.W_7 = rng.normal(size=(2, 2, m, q)), rng.normal(size=(2, 2, m, 3 * q))

    def Z(self, s: float, size: int | None = None, slope: int = 0) -> Matrix:
        """Z(s), or its derivative."""
        powers = [1.0, s, s * s] if not slope else [0.0, 1.0, 2 * s]
        return np.kron(np.array(powers)[:, None], np.eye(size or self.n))

    def S(self, i: int, s: float) -> Matrix:
        return np.asarray(self.S_0 + s * self.S_1[i])

    def Z_3(self, i: int, s: float) -> Matrix:
        return np.asarray(self.W_3[i] * (1 + s))

    def history(self, seed: int) -> tuple[Matrix, list[Callable[[float, int], Matrix]]]:
        """e_0, and e_i(s), or its derivative, with e_i(0) = e_0."""
        c = np.random.default_rng(seed).normal(size=(2, 4, self.n))
        c[1, 0] = c[0, 0]
        return c[0, 0], [
            (
                lambda s, k=0, one=one: np.polynomial.polynomial.polyval(
                    s, np.polynomial.polynomial.polyder(one, k) if k else one
                )
            )
            for one in c
        ]


def both_sides(drawn: Drawn, misprint: str) -> tuple[float, float]:
    """2<e, (P A + Z C_2) e - P B w> - gamma |w|^2 + 2 v'z - gamma |v|^2, and <h, P_(D,E,F,G) h> of Theorem 3."""
    o, n, q, tau = drawn, drawn.n, drawn.q, drawn.tau
    rng, level = np.random.default_rng(11), 1.3
    A_0, A, B = rng.normal(size=(n, n)), rng.normal(size=(2, n, n)), rng.normal(size=(n, 1))
    C_2, C_10, C_1 = rng.normal(size=(q, n)), rng.normal(size=(1, n)), rng.normal(size=(2, 1, n))
    w, v = rng.normal(size=1), rng.normal(size=1)
    e_0, e = o.history(7)
    late = [e[i](-t, 0) for i, t in enumerate(o.delays)]
    drift = A_0 @ e_0 + sum(A[i] @ late[i] for i in (0, 1))
    z = C_10 @ e_0 + sum(C_1[i] @ late[i] for i in (0, 1))
    inside, slopes = (np.concatenate([e[i](s, k) for i in (0, 1) for s in o.s[i]]) for k in (0, 1))
    measured = np.concatenate(
        [C_2 @ e_0, *(C_2 @ one for one in late), np.kron(np.eye(len(inside) // n), C_2) @ inside]
    )
    at = AtPoints(o)
    image = forward(at) @ np.concatenate([drift - B @ w, slopes])
    image += injection(at, of_10(at), 1.0 if misprint == "eq10-factor" else tau) @ measured
    left = 2 * np.concatenate([tau * e_0, at.w * inside]) @ image
    left += -level * w @ w + (z @ z / level if misprint == "theorem-1-sign" else 2 * v @ z - level * v @ v)

    Q, slope, C = at.H @ at.Z.T, at.H @ at.slope.T, np.kron(np.eye(len(at.w) // n), C_2)

    def printed(blocks: Matrix) -> Matrix:
        """Of E_i, n x n at each point."""
        return blocks.reshape(n, -1, n).T.reshape(n, -1) if misprint == "e-transposes" else blocks

    T_00 = o.P @ A_0 + o.Z_0 @ C_2 + sum(o.H[i] @ o.Z(0) + o.S(i, 0) / 2 for i in (0, 1))
    right = -level * (w @ w + v @ v) + 2 * v @ z + tau * (2 * e_0 @ T_00 @ e_0 - 2 * e_0 @ o.P @ B @ w)
    start = np.vstack([o.Z(0)] * 2)
    E = e_0 @ (printed(A_0.T @ Q + start.T @ at.G @ at.Z.T / tau - slope) + (at.Z @ at.W_4 @ C_2).T + at.Z_3 @ C)
    E = E - w @ B.T @ Q
    for i, delay in enumerate(o.delays):
        right += 2 * tau * e_0 @ (o.P @ A[i] - o.H[i] @ o.Z(-delay) + o.Z_2[i] @ C_2) @ late[i]
        right -= (-1 if misprint == "d-sign" else 1) * tau * late[i] @ o.S(i, -delay) @ late[i]
        end, Z_5 = np.kron(np.eye(2)[:, [i]], o.Z(-delay)), at.Z @ at.W_5[:, i * q : (i + 1) * q] @ C_2
        E = E + late[i] @ (printed(A[i].T @ Q - end.T @ at.G @ at.Z.T / tau) + Z_5.T)
    steep = scipy.linalg.block_diag(*(np.kron(np.eye(len(o.s[i])), o.S_1[i]) for i in (0, 1)))
    F, G = at.Z_6 @ C, tau * at.Z @ at.W_7 @ C - at.slope @ at.G @ at.Z.T
    F = F + F.T + (1 if misprint == "f-sign" else -1) * FACTORS["Theorem 3"] * steep
    values = at.w * inside
    right += tau * (2 * E @ values + inside @ F @ values) + values @ (G + G.T) @ values
    return float(left), float(right)


def dissipation_identity(told: Data) -> None:
    left, right = both_sides(Drawn(), "")
    assert abs(left - right) < 1e-9 * abs(left)
    for misprint in told["parameters"]["misprints"]:
        left, right = both_sides(Drawn(), misprint)
        assert abs(left - right) > 1e-3 * abs(left), f"{misprint} as printed"


class AtPoints:
    """The same at the Gauss points of both histories, one below the other: products over them are integrals."""

    def __init__(self, o: Drawn) -> None:
        def blocks(parts: Any) -> Matrix:
            return np.block([[parts[i, j] for j in (0, 1)] for i in (0, 1)])

        each = [(i, s) for i in (0, 1) for s in o.s[i]]
        self.n, self.tau, self.P, self.Z_0 = o.n, o.tau, o.P, o.Z_0
        self.Z, self.slope, Y = (
            scipy.linalg.block_diag(*(np.vstack([o.Z(s, size, slope).T for s in o.s[i]]) for i in (0, 1)))
            for size, slope in ((o.n, 0), (o.n, 1), (o.q, 0))
        )
        self.w, self.v = (np.repeat(np.concatenate(o.w), size) for size in (o.n, o.q))
        self.S = scipy.linalg.block_diag(*(o.S(i, s) for i, s in each))
        self.Z_2, self.Z_3 = np.hstack(list(o.Z_2)), np.hstack([o.Z_3(i, s) for i, s in each])
        self.Z_6 = scipy.linalg.block_diag(*(o.Z(s).T @ o.W_6[i] for i, s in each))
        self.H, self.G = np.hstack(list(o.H)), blocks(o.G)
        self.W_4, self.W_5, self.W_7 = np.vstack(list(o.W_4)), blocks(o.W_5), blocks(o.W_7) @ Y.T


def operator(o: AtPoints, P: Matrix, Q: Matrix, S: Matrix, R: Matrix) -> Matrix:
    """(8) as a matrix on x and the values of the histories."""
    return np.block([[P, Q * o.w], [o.tau * Q.T, o.tau * S + R * o.w]])


def forward(o: AtPoints) -> Matrix:
    return operator(o, o.P, o.H @ o.Z.T, o.S, o.Z @ o.G @ o.Z.T)


def hats(o: AtPoints, *, printed: bool = False) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """P^, H^ and Gamma^ of Theorem 4, and K = diag T_i."""
    K, back = (o.Z.T * o.w) @ np.linalg.solve(o.S, o.Z), np.linalg.inv(o.P)
    G, one = o.G if printed else o.G / o.tau * FACTORS["Theorem 4"], np.eye(len(K))
    H_hat = back @ o.H @ np.linalg.inv(K @ o.H.T @ back @ o.H - one - K @ G)
    return (np.eye(o.n) - H_hat @ K @ o.H.T) @ back, H_hat, -(H_hat.T @ o.H + G) @ np.linalg.inv(one + K @ G), K


def inverse(o: AtPoints, *, printed: bool = False) -> Matrix:
    """The operator of Theorem 4: {P^, Q^/tau_K, S^-1/tau_K^2, R^/tau_K}; printed: S^-1/tau_K, and Gamma for G."""
    (P, H, G, _), back, power = hats(o, printed=printed), np.linalg.inv(o.S), 1 if printed else 2
    X = back @ o.Z
    return operator(o, P, H @ X.T / o.tau, back / o.tau**power, X @ G @ X.T / o.tau)


def injection(o: AtPoints, gains: tuple[Matrix, ...], factor: float) -> Matrix:
    """(9) or (10), its second row times a factor: a matrix on y_0, y_i(-tau_i) and the values of y_i."""
    L_0, L_2, L_3, L_4, L_5, L_6, L_7 = gains
    return np.block([[L_0, L_2, L_3 * o.v], [factor * L_4, factor * L_5, factor * (L_6 + L_7 * o.v)]])


def of_10(o: AtPoints) -> tuple[Matrix, ...]:
    return o.Z_0, o.Z_2, o.Z_3, o.Z @ o.W_4, o.Z @ o.W_5, o.Z_6, o.Z @ o.W_7


def of_lemma_5(o: AtPoints, *, printed: bool = False) -> tuple[Matrix, ...]:
    (P, H, G, K), X = hats(o, printed=printed), np.linalg.solve(o.S, o.Z)
    return (
        P @ o.Z_0 * FACTORS["Lemma 5"] + H @ K @ o.W_4,
        P @ o.Z_2 + H @ K @ o.W_5,
        P @ o.Z_3 + H @ X.T @ o.Z_6 + H @ K @ o.W_7,
        X @ (H.T @ o.Z_0 + o.W_4 + G @ K @ o.W_4),
        X @ (H.T @ o.Z_2 + o.W_5 + G @ K @ o.W_5),
        np.linalg.solve(o.S, o.Z_6),
        X @ (H.T @ o.Z_3 + o.W_7 + G @ X.T @ o.Z_6 + G @ K @ o.W_7),
    )


def operator_identity(told: Data) -> None:
    o = AtPoints(Drawn())
    P = forward(o)
    for printed in (False, True):
        if told["parameters"]["part"] == "theorem-4":
            whole, expected = inverse(o, printed=printed) @ P, np.eye(len(P))
        else:
            factor = 1.0 if printed else o.tau
            whole = inverse(o, printed=printed) @ injection(o, of_10(o), factor)
            expected = injection(o, of_lemma_5(o, printed=printed), 1.0)
        assert np.allclose(whole, expected, rtol=1e-8, atol=1e-9) is not printed


def present_only(_: Data) -> None:
    """L = P^-1 Z solved for at the Gauss points, with P as it is where Q_i = 0."""
    drawn = Drawn()
    for name in ("H", "W_3", "W_4", "W_5", "W_6", "W_7"):
        setattr(drawn, name, 0 * getattr(drawn, name))
    o = AtPoints(drawn)
    gains = np.linalg.solve(forward(o), injection(o, of_10(o), o.tau))
    expected = np.linalg.inv(o.P) @ np.hstack([o.Z_0, o.Z_2]) * FACTORS["Lemma 5"]
    assert np.allclose(gains[: o.n, : expected.shape[1]], expected)
    gains[: o.n, : expected.shape[1]] = 0
    assert np.abs(gains).max() < 1e-12


CHECKS = checks(globals(), gain_upper=stored("each"), narrow_upper=stored("each"), total_upper=stored("total"))
