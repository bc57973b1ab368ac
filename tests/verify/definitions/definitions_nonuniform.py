"""The sentences on filters under nonuniform sampling against numerics from their definitions.

A gain over sequences is compared with that of concrete ones, by the worst energy of a finite motion from rest. "Every
sequence" is sampled: by patterns of long and short periods, seeded draws, and an opponent who chooses each period.
Conditions, lemmas and identities are tried on seeded plants. A sample can contradict a sentence only.
"""

import re
from collections.abc import Sequence
from math import log, sqrt
from typing import Any

import numpy as np
import scipy.linalg
from definition import (
    Data,
    Matrix,
    array,
    checks,
    held,
    largest,
    lifted_gain,
    norms,
    number,
    on_circle,
    smallest,
    spectral_radius,
    spoken,
    within,
)

PAPER = "mustafa"
FACTORS = {"(6)": 1.0, "(10)": 1.0, "(11)": 1.0, "(7)": 1.0, "(9)": 1.0, "Lemma 2": 1.0, "Lemma 3": 1.0}
"""Of one term of an equation that has no data of its own: one, unless a test alters it."""
Step = tuple[Matrix, Matrix, Matrix, float]
"""x+ = F x + G w, e = H x, and the weight of both squares."""
SHORT = 8
"""Longest pattern whose gain is found by lifting."""
SLACK = 1e-4
"""By how much, relative, a level is missed for the energy over a longer one to grow without bound soon."""


def written(pattern: str, text: str) -> list[float]:
    (groups,) = re.findall(pattern, text)
    return [float(group) for group in (groups if isinstance(groups, tuple) else (groups,))]


class Sampled:
    """Plant (1) sampled at a period, and the error system (5) with a filter (4)."""

    def __init__(self, plant: Data, filter_: Data | None = None) -> None:
        self.A, self.B, self.C, self.D, self.L = (array(plant[name]) for name in "ABCDL")
        self.low, self.high = (number(a) + number(b) * np.pi for a, b in (plant["h_l"], plant["h_u"]))
        self.middle, self.n = (self.low + self.high) / 2, len(self.A)
        self.filter = plant.get("filter") if filter_ is None else filter_

    def period(self, name: str) -> float:
        return float({"h_l": self.low, "middle": self.middle, "h_u": self.high}[name])

    def along(self, share: float) -> float:
        return self.low + share * (self.high - self.low)

    def held(self, h: float) -> tuple[Matrix, Matrix]:
        return held(self.A, self.B, h)

    def steps(self, periods: Sequence[float], weight: str = "samples") -> list[Step]:
        assert self.filter is not None
        if "G" in self.filter:
            return self.stamped(periods)
        A, B, C = (array(self.filter[name]) for name in "ABC")
        known = {}
        for h in {*periods}:
            Phi, Gamma = self.held(h)
            F = np.block([[Phi, np.zeros((self.n, len(A)))], [B @ self.C, A]])
            known[h] = F, np.vstack([Gamma, B @ self.D]), np.hstack([self.L, -C]), h if weight == "duration" else 1.0
        return [known[h] for h in periods]

    def stamped(self, periods: Sequence[float]) -> list[Step]:
        """The estimate corrected by G v, v = y - C x^, then carried over the period; G by the period before."""
        assert self.filter is not None
        edges, gains = array(self.filter["cells"]), array(self.filter["G"])
        found = []
        for before, h in zip([periods[-1], *periods[:-1]], periods, strict=True):
            Phi, Gamma = self.held(h)
            share = (before - self.low) / (self.high - self.low)
            G = gains[min(int(np.searchsorted(edges, share + 1e-12, side="right")) - 1, len(gains) - 1)]
            state, disturbance = G[: self.n], G[self.n :]
            F = Phi - (Phi @ state + Gamma @ disturbance) @ self.C
            found.append((F, Gamma - (Phi @ state + Gamma @ disturbance) @ self.D, self.L, 1.0))
        return found


def worst(P: Matrix, step: Step, level: float) -> Matrix | None:
    """x'P'x, the most that e of this step and P of the next state can be above level^2 |w|^2; None if unbounded."""
    F, G, H, weight = step
    price = weight * level**2 * np.eye(G.shape[1]) - G.T @ P @ G
    if smallest(price) <= 0:
        return None
    cross = G.T @ P @ F
    return F.T @ P @ F + weight * H.T @ H + cross.T @ np.linalg.solve(price, cross)


def exceeded(steps: Sequence[Step], level: float, repeats: int = 1) -> bool:
    """Whether some disturbance over these steps, repeated from rest, gives more than level^2 times its energy."""
    P = np.zeros((len(steps[0][0]),) * 2)
    for _ in range(repeats):
        start = P
        for step in reversed(steps):
            following = worst(P, step, level)
            if following is None:
                return True
            P = following
        if np.abs(P - start).max() <= 1e-12 * np.abs(P).max():
            return False
    return False


def gain_of(steps: Sequence[Step]) -> float:
    """The gain of a pattern that repeats, both norms weighted."""
    plain = [(F, G / sqrt(weight), sqrt(weight) * H, np.zeros((len(H), G.shape[1]))) for F, G, H, weight in steps]
    return lifted_gain(plain, 91)


def keeps(sampled: Sampled, level: float, first: float, last: float, weight: str = "samples") -> None:
    """No sequence of the sample gives more than the level."""
    if first == last:
        assert gain_of(sampled.steps([first], weight)) <= level * (1 + 1e-9)
        return
    blocks = [(1, 1), (1, 2), (2, 1), (3, 6), (6, 1), (3, 50), (15, 188), (38, 800)]
    sequences = [[last] * a + [first] * b for a, b in blocks] + [[last, first, *[last] * 3, *[first] * 50]]
    rng = np.random.default_rng(61)
    sequences += [[*rng.choice([first, (first + last) / 2, last], 60)] for _ in range(4)]
    for periods in sequences:
        assert not exceeded(sampled.steps(periods, weight), level, 3), f"a sequence of {len(periods)} periods"
    if "G" not in (sampled.filter or {}):
        assert not opposed(sampled, level, first, last, weight)


def opposed(sampled: Sampled, level: float, first: float, last: float, weight: str, instants: int = 400) -> bool:
    """Whether an opponent gains more, who takes at each instant the period that makes the most of what follows."""
    choices = sampled.steps([*np.linspace(first, last, 5)], weight)
    P = np.zeros((len(choices[0][0]),) * 2)
    for _ in range(instants):
        following = [worst(P, step, level) for step in choices]
        if any(found is None for found in following):
            return True
        P = max((found for found in following if found is not None), key=lambda found: float(np.trace(found)))
    return False


def pattern_of(told: Data, first: float, last: float) -> list[float]:
    return [first + number(share) * (last - first) for share, count in told["named"]["pattern"] for _ in range(count)]


def attains(sampled: Sampled, periods: Sequence[float], level: float, weight: str = "samples") -> None:
    steps = sampled.steps(periods, weight)
    assert gain_of(steps) > level if len(steps) <= SHORT else exceeded(steps, level * (1 - SLACK), 200)


def case(told: Data) -> tuple[Sampled, float, float, str]:
    chosen = told["parameters"]
    sampled = Sampled(told["plant"], told["named"].get("filter", chosen.get("filter")))
    return sampled, sampled.period(chosen["from"]), sampled.period(chosen["to"]), chosen["weight"]


def gain_upper(told: Data) -> None:
    sampled, first, last, weight = case(told)
    keeps(sampled, number(told["bound"]["upper"]), first, last, weight)


def keeps_level(told: Data) -> None:
    gain_upper(told)
    assert number(told["bound"]["upper"]) <= number(told["parameters"]["level"])


def gain_lower(told: Data) -> None:
    sampled, first, last, weight = case(told)
    attains(sampled, pattern_of(told, first, last), number(told["bound"]["lower"]), weight)


def breaks_level(told: Data) -> None:
    gain_lower(told)
    assert number(told["parameters"]["level"]) <= number(told["bound"]["lower"])


def optimum_lower(told: Data) -> None:
    sampled, lower = Sampled(told["plant"]), number(told["bound"]["lower"])
    h = sampled.period(told["parameters"]["period"])
    assert hidden_gain(sampled, h) > lower


def no_filter_keeps_level(told: Data) -> None:
    optimum_lower(told)
    assert number(told["parameters"]["level"]) <= number(told["bound"]["lower"])


def hidden_gain(sampled: Sampled, h: float, instants: int = 300) -> float:
    """The largest |e|/|w| over motions from rest whose measurements are zero up to the last disturbance.

    D = 0: y_k shows w_{k-1}, so that one impulse alone is unseen. Else w_k = -D^-1 C x_k hides a motion, followed back
    from its end; its start decays where the motion forward grows.
    """
    Phi, Gamma = sampled.held(h)
    if not np.any(sampled.D):
        return float(np.linalg.norm(sampled.L @ Gamma, 2))
    hide = -np.linalg.solve(sampled.D, sampled.C)
    back = np.linalg.inv(Phi + Gamma @ hide)
    assert spectral_radius(back) < 1
    end = np.eye(sampled.n)
    seen, supplied = np.zeros((2, sampled.n, sampled.n))
    for _ in range(instants):
        seen += end.T @ sampled.L.T @ sampled.L @ end
        end = back @ end
        supplied += end.T @ hide.T @ hide @ end
    return sqrt(float(np.max(scipy.linalg.eigh(seen, supplied, eigvals_only=True))))


def stable(told: Data) -> None:
    sampled, first, last, _ = case(told)
    assert sampled.filter is not None
    assert np.linalg.eigvals(sampled.A).real.max() < 0
    assert spectral_radius(array(sampled.filter["A"])) < 1
    rng, moved = np.random.default_rng(8), np.eye(sampled.n + len(array(sampled.filter["A"])))
    for F, _, _, _ in sampled.steps([*rng.choice([first, last, 3 * last], 900)]):
        moved = F @ moved
    assert np.abs(moved).max() < 1e-3


def stamped_gain(told: Data) -> None:
    sampled = Sampled(told["plant"], told["named"]["filter"])
    attains(sampled, pattern_of(told, sampled.low, sampled.high), number(told["bound"]["lower"]))
    keeps(sampled, number(told["bound"]["upper"]), sampled.low, sampled.high)
    assert gain_of(sampled.steps([sampled.high])) <= number(told["bound"]["upper"])
    moved = np.eye(sampled.n)
    for F, _, _, _ in sampled.steps([*np.random.default_rng(9).uniform(sampled.low, sampled.high, 600)]):
        moved = F @ moved
    assert np.abs(moved).max() < 1e-3


# Theorem 1, the intervals (9) and Algorithm 1.


def growth(A: Matrix) -> float:
    """mu(A), the logarithmic norm."""
    return float(np.linalg.eigvalsh((A + A.T) / 2)[-1])


def alpha(A: Matrix, h: float) -> float:
    """The H-infinity norm of A Phi (zI - Phi)^-1."""
    Phi = scipy.linalg.expm(A * h)
    return largest(lambda angles: norms(A @ Phi @ np.linalg.inv(on_circle(angles, Phi))), np.linspace(0, np.pi, 61))


def interval(sampled: Sampled, h: float, gain: float, *, printed: bool = False) -> tuple[float, float]:
    """(9) in the cases L3 and U3."""
    below, above = growth(-sampled.A), growth(sampled.A)
    last = log(1 + (below if printed else above) / gain) / above
    return h - log(1 + below / gain) / below * FACTORS["(9)"], h + last


def algorithm(sampled: Sampled) -> tuple[list[float], int]:
    """Algorithm 1 with U3 corrected, alpha in both steps and a set-minus in step 4: the grid, and its passes."""
    new, grid, covered, passes = [sampled.middle], list[float](), list[tuple[float, float]](), 0
    while new:
        covered += [interval(sampled, h, alpha(sampled.A, h)) for h in new]
        grid, passes, reached, new = [*grid, *new], passes + 1, sampled.low, []
        for start, stop in [*sorted(covered), (sampled.high, sampled.high)]:
            if start > reached:
                new.append((reached + start) / 2)
            reached = max(reached, stop)
        assert passes < 20
    return grid, passes


def grid_size(told: Data) -> None:
    grid, passes = algorithm(Sampled(told["plant"]))
    assert number(told["bound"]["lower"]) == len(grid) == number(told["bound"]["upper"])
    assert written(r"ends with (\d+) elements after (\d+) passes", spoken(told)) == [len(grid), passes]


def one_interval(told: Data) -> None:
    sampled = Sampled(told["plant"])
    start, stop = interval(sampled, sampled.middle, alpha(sampled.A, sampled.middle))
    assert start > sampled.low or stop < sampled.high
    assert np.linalg.eigvals(sampled.A).real.max() < 0
    assert written(r"; (\d+) elements cover", spoken(told)) == [len(algorithm(sampled)[0])]


def stalls(told: Data) -> None:
    sampled = Sampled(told["plant"])
    gain = alpha(sampled.A, sampled.middle)
    (start, stop), (first, last) = (
        interval(sampled, sampled.middle, used, printed=True) for used in (gain, sqrt(gain))
    )
    assert start > sampled.low or stop < sampled.high
    empty, covers = last < first, first < sampled.low and sampled.high < last
    assert ("by the root of alpha is empty" in spoken(told), "covers the range" in spoken(told)) == (empty, covers)
    assert empty or covers


def grid_solution_fails(told: Data) -> None:
    sampled, level = Sampled(told["plant"], told["named"]["filter"]), number(told["named"]["level"])
    grid, _ = algorithm(sampled)
    P = np.linalg.inv(array(told["named"]["P"]))
    assert smallest(P) > 0
    assert all(smallest(-inequality(P, step, level)) > 0 for step in sampled.steps(grid))
    attains(sampled, pattern_of(told, sampled.low, sampled.high), level)
    assert written(r"with the level (\S+) at all (\d+) elements", spoken(told))[1] == len(grid)


def upper_end(told: Data) -> None:
    sampled = Sampled(told["plant"])
    gain, mu = alpha(sampled.A, sampled.middle), growth(sampled.A)
    end = interval(sampled, sampled.middle, gain)[1] - sampled.middle
    printed = interval(sampled, sampled.middle, gain, printed=True)[1] - sampled.middle
    assert abs(gain * grown(mu, end) - FACTORS["Lemma 3"]) < 1e-9
    assert gain * grown(mu, 0.999 * end) < 1
    if "below the centre" in spoken(told):
        assert printed < 0
    else:
        middle, radius = written(r"factor in \[(\S+) \+/- (\S+)\]", spoken(told))
        assert abs(gain * grown(mu, printed) - middle) <= radius + 1e-9


def lower_end(told: Data) -> None:
    sampled = Sampled(told["plant"])
    gain, mu = alpha(sampled.A, sampled.middle), growth(-sampled.A)
    end = sampled.middle - interval(sampled, sampled.middle, gain)[0]
    assert abs(gain * grown(mu, end) - 1) < 1e-9
    assert gain * grown(mu, 0.999 * end) < 1


def grown(mu: float, theta: float) -> float:
    """The integral of the bound of Lemma 3 from 0 to theta."""
    points, weights = np.polynomial.legendre.leggauss(30)
    return float(weights @ np.exp(mu * theta * (points + 1) / 2)) * theta / 2


def changed_norm(sampled: Sampled, h: float, *, coordinates: Matrix | None = None, modulus: bool = False) -> float:
    """Over the circle the largest norm, or eigenvalue, of A Phi (zI - Phi)^-1 Delta(theta) for a change to h."""
    T = np.eye(sampled.n) if coordinates is None else coordinates
    A = np.linalg.solve(T, sampled.A @ T)
    Phi, theta = scipy.linalg.expm(A * sampled.middle), h - sampled.middle
    Delta = np.sign(theta) * held(np.sign(theta) * A, np.eye(sampled.n), abs(theta))[1]

    def size(angles: Matrix) -> Matrix:
        M = A @ Phi @ np.linalg.inv(on_circle(angles, Phi)) @ Delta
        return np.abs(np.linalg.eigvals(M)).max(axis=-1) if modulus else norms(M)

    return largest(size, np.linspace(0, np.pi, 61))


def breaks_condition_8(told: Data) -> None:
    sampled = Sampled(told["plant"])
    value = changed_norm(sampled, sampled.period(told["parameters"]["period"]), modulus=True)
    (least,) = written(r"the norm is at least (\S+)\.$", spoken(told))
    within(least, value, least + 1e-6)
    assert least > 1


def meets_condition_8(told: Data) -> None:
    sampled = Sampled(told["plant"])
    changes = sampled.along(0), sampled.along(0.1), sampled.along(0.6), sampled.along(0.9), sampled.along(1)
    assert max(changed_norm(sampled, h) for h in changes) < 1
    values, T = np.linalg.eig(sampled.A)
    (most,) = written(r"the norm is at most (\S+)\.$", spoken(told))
    value = max(changed_norm(sampled, h, coordinates=T) for h in changes)
    within(most - 1e-6, value, most)
    Phi, drawn = np.exp(values * sampled.middle), np.random.default_rng(4).choice([sampled.low, sampled.high], 80)
    moved = [(np.exp(values * h) - Phi) / values for h in drawn]
    assert not exceeded([(np.diag(Phi), np.diag(D), np.diag(values * Phi), 1.0) for D in moved], most)


def same_level(told: Data) -> None:
    sampled, cells = Sampled(told["plant"], told["named"]["filter"]), told["parameters"]["cells"]
    values = np.linalg.eigvals(sampled.A)
    a, b = values[0].real, abs(values[0].imag)
    modal, half = np.array([[a, b], [-b, a]]), (sampled.high - sampled.low) / (2 * cells)
    size = float(np.linalg.norm(held(modal, np.eye(2), half)[1], 2))
    gains = [alpha(modal, sampled.along((2 * k + 1) / (2 * cells))) for k in range(cells)]
    forced = max(min(gain, gain * size) for gain in gains)
    least, level = written(r"channels is at least (\S+), whether.* has the level (\S+) for every", spoken(told))
    within(least, forced, least * (1 + 1e-5))
    assert least > level
    keeps(sampled, number(told["named"]["level"]), sampled.low, sampled.high)
    within(level - 1e-8, number(told["named"]["level"]), level)


def observer_column(told: Data) -> None:
    sampled = Sampled(told["plant"])
    assert sampled.filter is not None
    whole = scipy.linalg.expm(sampled.A * sampled.middle) - array(sampled.filter["B"]) @ sampled.C
    printed = re.findall(r"\[(\S+) \+/- (\S+)\]", spoken(told))
    for value, (middle, radius) in zip(whole[:, told["parameters"]["column"]], printed, strict=True):
        assert abs(value - float(middle)) <= float(radius) + 1e-12


def output_matrix(told: Data) -> None:
    """Outside the box no output matrix keeps the level; a tenth of its width inside each side some one does."""
    sampled, level = Sampled(told["plant"]), number(told["parameters"]["level"])
    assert sampled.filter is not None
    ends = re.findall(r"\[(\S+), (\S+)\]", spoken(told).rstrip("."))
    box = [[float(end) for end in pair] for pair in ends]
    Phi, Gamma = sampled.held(sampled.middle)
    A, B = array(sampled.filter["A"]), array(sampled.filter["B"])
    z = np.exp(1j * np.linspace(0, np.pi, 181))
    x = np.array([np.linalg.solve(point * np.eye(2) - Phi, Gamma)[:, 0] for point in z])
    y = x @ sampled.C[0] + sampled.D[0, 0]
    f = np.array([np.linalg.solve(point * np.eye(2) - A, B[:, 0] * v) for point, v in zip(z, y, strict=True)])

    def least(entry: int, value: float) -> float:
        """The smallest gain with this entry, over the other one: a convex function of it."""
        low, high = box[1 - entry][0] - 0.1, box[1 - entry][1] + 0.1
        for _ in range(80):
            a, b = (2 * low + high) / 3, (low + 2 * high) / 3
            sizes = [np.abs(x @ sampled.L[0] - f[:, entry] * value - f[:, 1 - entry] * other).max() for other in (a, b)]
            low, high = (low, b) if sizes[0] < sizes[1] else (a, high)
        return float(min(sizes))

    for entry, (low, high) in enumerate(box):
        unit = 1e-4
        assert least(entry, low) > level and least(entry, high) > level
        assert least(entry, low + unit + 0.02 * (high - low)) <= level
        assert least(entry, high - unit - 0.02 * (high - low)) <= level


# Lemmas and theorems for all plants, at seeded ones.


def plants(count: int, seed: int = 5) -> list[Sampled]:
    """Stable plants with filters whose poles lie in the circle, of two states each."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(count):
        A = rng.normal(size=(2, 2))
        A -= (np.linalg.eigvals(A).real.max() + 0.3 + rng.random()) * np.eye(2)
        A_f = rng.normal(size=(2, 2))
        A_f *= (0.2 + 0.7 * rng.random()) / spectral_radius(A_f)
        shapes = {"B": (2, 1), "C": (1, 2), "D": (1, 1), "L": (1, 2)}
        plain = {name: rng.normal(size=shape).tolist() for name, shape in shapes.items()} | {"A": A.tolist()}
        filter_ = {"A": A_f.tolist(), "B": rng.normal(size=(2, 1)).tolist(), "C": rng.normal(size=(1, 2)).tolist()}
        found.append(Sampled({**plain, "h_l": [0.3, 0], "h_u": [0.32, 0]}, filter_))
    return found


def inequality(P: Matrix, step: Step, level: float) -> Matrix:
    """The matrix (6) as printed."""
    A, B, C, _ = step
    n, s, m = len(A), len(C), B.shape[1]
    AP = A @ P * FACTORS["(6)"]
    return np.block(
        [
            [-P, np.zeros((n, s)), AP, B],
            [np.zeros((s, n)), -np.eye(s), C @ P, np.zeros((s, m))],
            [AP.T, (C @ P).T, -P, np.zeros((n, m))],
            [B.T, np.zeros((m, s)), np.zeros((m, n)), -(level**2) * np.eye(m)],
        ]
    )


def solution(step: Step, level: float) -> Matrix | None:
    """P-bar of (6) at one period, if the recursion for its inverse settles."""
    F, G, H, _ = step
    moved, P = (F * FACTORS["(6)"], G, H, 1.0), np.zeros((len(F),) * 2)
    for _ in range(400):
        following = worst(P, moved, level)
        if following is None:
            return None
        P = following + 0.02 * np.trace(following) * np.eye(len(F))
    return np.linalg.inv(P)


def solved(sampled: Sampled, shares: Sequence[float] = (0.0, 0.25, 0.5, 0.75, 1.0)) -> list[tuple[float, Matrix]]:
    """Levels at which one P-bar meets (6) at these periods of the range, with it."""
    middle, steps = sampled.steps([sampled.middle])[0], sampled.steps([sampled.along(share) for share in shares])
    found = []
    for factor in (0.7, 0.9, 1.2, 2.0, 4.0):
        level = factor * (gain_of([middle]) if spectral_radius(middle[0]) < 1 else 1.0)
        P = solution(middle, level)
        if P is not None and smallest(P) > 0 and all(smallest(-inequality(P, step, level)) > 0 for step in steps):
            found.append((level, P))
    return found


def lemma_1(_: Data) -> None:
    met = 0
    for sampled in plants(12):
        periods = np.random.default_rng(2).uniform(sampled.low, sampled.high, 100)
        for level, _ in solved(sampled):
            assert not exceeded(sampled.steps([*periods]), level)
            assert gain_of(sampled.steps([sampled.high])) < level
            met += 1
    assert met >= 12


def stability(_: Data) -> None:
    met = 0
    for sampled in plants(10, seed=6):
        assert sampled.filter is not None
        sampled.filter["A"] = (array(sampled.filter["A"]) * 1.4).tolist()
        if solved(sampled, (0.5,)):
            periods = np.random.default_rng(3).choice([0.05, sampled.low, 2.0], 1500)
            moved = np.eye(4)
            for F, _, _, _ in sampled.steps([*periods]):
                moved = F @ moved
            assert np.abs(moved).max() < 1e-6
            met += 1
    assert 4 <= met < 10


def level_of_theorem_3(_: Data) -> None:
    met = 0
    for sampled in plants(8):
        for level, P in solved(sampled):
            unknowns = unknown(P, sampled.filter)
            steps = sampled.steps([sampled.along(share) for share in (0, 0.5, 1)])
            whole = [conditions(sampled, unknowns, h, level) for h in (sampled.low, sampled.middle, sampled.high)]
            assert all(smallest(-M) > 0 for M in whole)
            own = Sampled.__new__(Sampled)
            own.__dict__ = {**sampled.__dict__, "filter": recovered(unknowns)}
            elements = own.steps([sampled.low, sampled.middle, sampled.high, sampled.high])
            assert not exceeded(elements, level, 40)
            assert gain_of(elements[:1]) < level
            assert len(steps) == 3
            met += 1
    assert met >= 8


def unknown(P: Matrix, filter_: Any) -> dict[str, Matrix]:
    """Z, Y, F, G, Q of Theorem 3 from P-bar, with its parts and those of its inverse."""
    n = len(P) // 2
    inverse = np.linalg.inv(P)
    U, Y, V, Z = P[:n, n:], inverse[:n, :n], inverse[:n, n:], np.linalg.inv(P[:n, :n])
    A, B, C = (array(filter_[name]) for name in "ABC")
    return {"Z": Z, "Y": Y, "U": U, "V": V, "F": V @ B, "Q": V @ A @ U.T @ Z, "G": C @ U.T @ Z}


def conditions(sampled: Sampled, u: dict[str, Matrix], h: float, level: float) -> Matrix:
    """The matrix (10) without its repeated row."""
    Phi, Gamma = sampled.held(h)
    Z, Y, F, G, Q = (u[name] for name in "ZYFGQ")
    C, D, L = sampled.C, sampled.D, sampled.L
    n, s, m = len(Z), len(L), Gamma.shape[1]
    upper = np.block(
        [
            [Z @ Phi, Z @ Phi, Z @ Gamma],
            [Y @ Phi + F @ C + Q * FACTORS["(10)"], Y @ Phi + F @ C, Y @ Gamma + F @ D],
            [L - G, L, np.zeros((s, m))],
        ]
    )
    same, none = np.block([[Z, Z], [Z, Y]]), np.zeros((2 * n, s))
    left = np.block([[-same, none], [none.T, -np.eye(s)]])
    right = np.block([[-same, np.zeros((2 * n, m))], [np.zeros((m, 2 * n)), -(level**2) * np.eye(m)]])
    return np.block([[left, upper], [upper.T, right]])


def recovered(u: dict[str, Matrix]) -> Data:
    """The filter (11)."""
    Z, Y, F, G, Q = (u[name] for name in "ZYFGQ")
    back = np.linalg.inv(np.eye(len(Z)) - np.linalg.solve(Y, Z))
    A, B = -np.linalg.solve(Y, Q) @ back * FACTORS["(11)"], -np.linalg.solve(Y, F)
    return {"A": A.tolist(), "B": B.tolist(), "C": (G @ back).tolist()}


def some_storage(sampled: Sampled, seed: int) -> Matrix:
    root = np.random.default_rng(seed).normal(size=(2 * sampled.n,) * 2)
    return np.asarray(root @ root.T)


def congruence(_: Data) -> None:
    for seed, sampled in enumerate(plants(4)):
        P = some_storage(sampled, seed)
        u, zero = unknown(P, sampled.filter), np.zeros((2, 2))
        J_1 = np.block([[u["Z"], u["Y"]], [zero, u["V"].T]])
        J = scipy.linalg.block_diag(J_1, np.eye(1), J_1, np.eye(1))
        whole = inequality(P, sampled.steps([sampled.middle])[0], 1.7)
        assert np.allclose(J.T @ whole @ J, conditions(sampled, u, sampled.middle, 1.7), rtol=1e-6, atol=1e-7)


def recovery(_: Data) -> None:
    for seed, sampled in enumerate(plants(4)):
        own = recovered(unknown(some_storage(sampled, seed), sampled.filter))
        assert sampled.filter is not None
        responses = [
            [array(one["C"]) @ np.linalg.matrix_power(array(one["A"]), k) @ array(one["B"]) for k in range(6)]
            for one in (own, sampled.filter)
        ]
        assert np.allclose(*responses, rtol=1e-6, atol=1e-8)


def lemma_2(_: Data) -> None:
    for seed, theta in enumerate((0.2, -0.15, 1.0)):
        rng = np.random.default_rng(seed)
        A, B, h = rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), 0.7
        A[:, 0] = A[:, 1] if seed == 2 else A[:, 0]  # without an inverse
        (Phi, Gamma), (moved, driven) = held(A, B, h), held(A, B, h + theta)
        Delta = np.sign(theta) * held(np.sign(theta) * A, np.eye(3), abs(theta))[1] * FACTORS["Lemma 2"]
        assert np.allclose(moved, Phi + Delta @ A @ Phi)
        assert np.allclose(driven, Gamma + Delta @ (A @ Gamma + B))


def lemma_3(told: Data) -> None:
    sampled = Sampled(told["plant"])
    middle, radius = written(r"mu\(A\) lies in \[(\S+) \+/- (\S+)\]", spoken(told))
    assert abs(growth(sampled.A) - middle) <= radius + 1e-12
    drawn = [np.random.default_rng(seed).normal(size=(n, n)) for seed, n in enumerate((1, 2, 3, 5))]
    for A in (sampled.A, *drawn):
        for t in (0.001, 0.1, 1.0, 3.0):
            bound = np.exp(FACTORS["Lemma 3"] * growth(A) * t)
            assert np.linalg.norm(scipy.linalg.expm(A * t), 2) <= bound * (1 + 1e-9)


def loop_map(told: Data) -> None:
    """The loop of Fig. 1 closed at points z, against the map; the sizes of the printed factors."""
    A, B, L = (array(told["plant"][name]) for name in "ABL")
    sizes = f"Sigma_12 ({len(A)} x {B.shape[1]})", f"Sigma_21 ({len(L)} x {len(A)})"
    assert all(size in spoken(told) for size in sizes)
    assert B.shape[1] != len(A) != len(L)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        n, k, m, s = rng.integers(1, 4, 4)
        shapes = ((n, n), (n, k), (n, m), (k, n), (k, m), (s, n), (k, k))
        A_bar, B_1, B_bar, C_1, D_12, C_bar, Delta = (0.4 * rng.normal(size=shape) for shape in shapes)
        z = np.exp(1j * rng.random())
        closed = C_bar @ np.linalg.solve(z * np.eye(n) - A_bar - B_1 @ Delta @ C_1, B_bar + B_1 @ Delta @ D_12)
        R = np.linalg.inv(z * np.eye(n) - A_bar)
        S_11, S_12 = C_1 @ R @ B_1, D_12 + C_1 @ R @ B_bar
        S_21, S_22 = C_bar @ R @ B_1, C_bar @ R @ B_bar
        inner = np.linalg.solve(np.eye(k) - FACTORS["(7)"] * S_11 @ Delta, S_12)
        assert np.allclose(closed, S_22 + S_21 @ Delta @ inner)


def sizes(told: Data) -> None:
    n, r = len(told["plant"]["A"]), len(told["plant"]["C"])
    B = array(told["plant"]["filter"]["B"])
    assert B.shape == (n, r) and n != r
    assert f"by C ({r} x {n}) and added to a block of size {n} x {n}, is {n} x {r}, not {r} x {n}." in spoken(told)


CHECKS = checks(globals(), level=level_of_theorem_3, map=loop_map, optimum_upper=gain_upper)
