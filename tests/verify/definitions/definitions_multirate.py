"""The sentences on the multi-rate observer against numerics from their definitions.

Bounds are compared with lifted gains, disturbances that no sensor sees and a game Riccati recursion; counts by
enumeration; identities at seeded points. "For all patterns of losses", "for every N and all sizes" and "no P" are
sampled: by seeded patterns, by seeded plants with storage functions, and by a search for a better P. The samples can
contradict these sentences and cannot prove them.
"""

import re
from itertools import product
from math import lcm
from typing import Any

import numpy as np
from definition import (
    Check,
    Data,
    Matrix,
    array,
    chain,
    checks,
    largest,
    lifted_gain,
    number,
    smallest,
    spectral_radius,
    spoken,
    transfer,
    within,
)

PAPER = "okajima2023"
SLACK = 1e-4
"""By how much, relative, a level is missed on either side for the game Riccati recursion to decide it soon."""
Steps = list[tuple[Matrix, Matrix, Matrix, Matrix]]


def schedule(parameters: Data) -> list[list[int]]:
    """The sensors that measure at each instant, eq. (4): i where (k - offset_i) mod period_i = 0."""
    timed = list(enumerate(zip(parameters["periods"], parameters["offsets"], strict=True)))
    return [[i for i, (N, at) in timed if (k - at) % N == 0] for k in range(lcm(*parameters["periods"]))]


def matrices(told: Data) -> tuple[Matrix, Matrix, Matrix, Matrix, Matrix]:
    """A, B_d, W, and the chosen rows of C and D."""
    plant, chosen = told["plant"], told["parameters"].get("sensors", [0, 1])
    A, B, C, D, W = (array(plant[name]) for name in ("A", "B_d", "C", "D", "W"))
    return A, B, W, C[chosen], D[chosen][:, chosen]


def error_steps(told: Data, gains: list[Matrix], measured: list[list[int]]) -> Steps:
    """e+ = (A - L S C) e + [B_d, -L S D] (d, w), z = W e, eq. (16)."""
    A, B, W, C, D = matrices(told)
    J = np.zeros((len(W), B.shape[1] + len(D)))
    S = [np.diag([float(i in rows) for i in range(len(C))]) for rows in measured]
    return [(A - L @ s @ C, np.hstack([B, -L @ s @ D]), W, J) for L, s in zip(gains, S, strict=True)]


def game(told: Data, measured: list[list[int]], level: float, instants: int = 6000) -> list[Matrix] | None:
    """Gains of the central one-step predictor at a level, from an error of zero; None when there is none.

    X+ = A (X^-1 + C'(DD')^-1 C - W'W/level^2)^-1 A' + B_d B_d'; a predictor exists on a horizon only if every X W'W has
    its eigenvalues below level^2.
    """
    A, B, W, C, D = matrices(told)
    n, X = len(A), np.zeros_like(A)
    gains = [np.zeros((n, len(C))) for _ in measured]
    seen = [C[rows].T @ np.linalg.inv(D[rows] @ D[rows].T) for rows in measured]
    known = [part @ C[rows] - W.T @ W / level**2 for part, rows in zip(seen, measured, strict=True)]
    for _ in range(instants // len(measured)):
        before = X
        for k, rows in enumerate(measured):
            if np.linalg.eigvalsh(W @ X @ W.T)[-1] >= level**2:
                return None
            M = A @ np.linalg.solve(np.eye(n) + X @ known[k], X)
            gains[k][:, rows] = M @ seen[k]
            X = M @ A.T + B @ B.T
            X = (X + X.T) / 2
        if np.abs(X - before).max() <= 1e-13 * np.abs(X).max():
            break
    return gains


def hidden_gain(told: Data, measured: list[list[int]]) -> float:
    """The largest gain to z of signals (d, w) that all measurements show as zero: no estimator tells them from none."""
    A, B, W, C, D = matrices(told)
    m, q = B.shape[1], len(C)
    drive = np.hstack([B, np.zeros((len(A), q))])
    z = chain([(A, drive, W, np.zeros((len(W), m + q))) for _ in measured])
    y = chain([(A, drive, C[rows], np.hstack([np.zeros((len(rows), m)), D[rows]])) for rows in measured])

    def gain(angle: float) -> float:
        _, s, Vh = np.linalg.svd(transfer(y, angle))
        unseen = Vh[np.count_nonzero(s > 1e-9 * s[0]) :].conj().T
        return float(np.linalg.norm(transfer(z, angle) @ unseen, 2))

    return largest(np.vectorize(gain), np.linspace(0, np.pi, 121))


def designed(told: Data, measured: list[list[int]], upper: float) -> None:
    """Some predictor keeps the upper bound: the central one does, of a level a little above it."""
    gains = game(told, measured, upper * (1 + SLACK))
    assert gains is not None, "no predictor keeps the level"
    within(0, lifted_gain(error_steps(told, gains, measured)), upper, 2 * SLACK)


def gain(told: Data) -> None:
    measured = schedule(told["parameters"])
    value = lifted_gain(error_steps(told, list(array(told["plant"]["L"])), measured))
    within(number(told["bound"]["lower"]), value, number(told["bound"]["upper"]))


def optimum_noncausal(told: Data) -> None:
    measured = schedule(told["parameters"])
    within(number(told["bound"]["lower"]), hidden_gain(told, measured), number(told["bound"]["upper"]))
    designed(told, measured, number(told["bound"]["upper"]))


def optimum_causal(told: Data) -> None:
    measured = schedule(told["parameters"])
    assert game(told, measured, number(told["bound"]["lower"]) * (1 - SLACK)) is None
    designed(told, measured, number(told["bound"]["upper"]))


def shorter_periods(told: Data) -> None:
    level, chosen = number(told["named"]["level"]), told["parameters"]
    assert game(told, schedule({"periods": chosen["shorter"], "offsets": [0, 0]}), level) is None
    designed(told, schedule({"periods": chosen["longer"], "offsets": [0, 0]}), level)


def one_matrix(told: Data) -> None:
    """The least level with one P by an ellipsoid method over (P, level^2), in which (20) is linear; infinite if none.

    The bounds that are stated lie well below it, so an altered one is told from a few times its size on.
    """
    measured = schedule(told["parameters"])
    steps = [(F, G, W) for F, G, W, _ in error_steps(told, list(array(told["plant"]["L"])), measured)]
    n, m = steps[0][1].shape
    pairs = [(i, j) for i in range(n) for j in range(i + 1)]
    basis = np.zeros((len(pairs) + 1, n, n))
    for b, (i, j) in enumerate(pairs):
        basis[b, i, j] = basis[b, j, i] = 1
    loss = []
    for F, G, _ in steps:
        blocks = np.zeros((len(basis), n + m, n + m))
        FG = np.hstack([F, G])
        blocks[:, :n, :n] = basis
        blocks -= np.einsum("ai,bac,cj->bij", FG, basis, FG)
        blocks[-1, n:, n:] = np.eye(m)
        loss.append(blocks)
    fixed = np.zeros((n + m, n + m))
    fixed[:n, :n] = steps[0][2].T @ steps[0][2]
    size, best = len(basis), np.inf
    centre, root = np.zeros(size), np.eye(size) * 1e4  # the ellipsoid centre + root (unit ball)
    for _ in range(4000):
        cut = np.zeros(size)
        values = [np.linalg.eigh(np.tensordot(centre, L, 1) - fixed) for L in loss]
        eigenvalues, vectors = min(values, key=lambda pair: pair[0][0])
        if eigenvalues[0] < 0:
            x, excess = vectors[:, 0], -eigenvalues[0]
            cut = -np.einsum("i,bij,j->b", x, np.array(loss)[np.argmin([v[0][0] for v in values])], x)
        else:
            best, cut[-1], excess = min(best, centre[-1]), 1, 0
        if cut[-1] != 1 and centre[-1] > best:
            cut, excess = np.eye(size)[-1], centre[-1] - best
        ahead = root.T @ cut
        length = np.linalg.norm(ahead)
        if excess >= length:  # nothing better is left
            break
        depth = excess / length
        ahead /= length
        centre = centre - (1 + size * depth) / (size + 1) * root @ ahead
        squeeze = 1 - np.sqrt((size - 1) * (1 - depth) / ((size + 1) * (1 + depth)))
        root = np.sqrt(size**2 * (1 - depth**2) / (size**2 - 1)) * (root - squeeze * np.outer(root @ ahead, ahead))
    within(number(told["bound"]["lower"]), float(np.sqrt(best)), np.inf)


def cases_of_losses(told: Data) -> list[tuple[Any, Any, list[int]]]:
    """(node, next node, samples that came), nodes in the order in which they are reached from phase 0 without loss."""
    chosen = told["parameters"]
    measured = schedule(chosen)
    sensors = range(len(chosen["sensors"]))
    channels = [list(sensors)] if chosen["together"] else [[i] for i in sensors]
    nodes = [(0, (0,) * len(channels))]
    cases = []
    for phase, lost in nodes:
        due = [[i for i in channel if i in measured[phase]] for channel in channels]
        ways = [
            [True, False] if rows and count < most else [True]
            for rows, count, most in zip(due, lost, chosen["misses"], strict=True)
        ]
        for came in product(*ways):
            outcome = list(zip(came, due, lost, strict=True))
            counts = tuple(count if not rows else 0 if ok else count + 1 for ok, rows, count in outcome)
            after = ((phase + 1) % len(measured), counts)
            if after not in nodes:
                nodes.append(after)
            cases.append(((phase, lost), after, sorted(i for ok, rows, _ in outcome if ok for i in rows)))
    return cases


def gain_under_losses(told: Data) -> None:
    """The named pattern attains the lower bound; no seeded pattern that repeats exceeds the upper one."""
    cases = cases_of_losses(told)
    steps = error_steps(told, list(array(told["named"]["L"])), [came for _, _, came in cases])
    lower, upper = number(told["bound"]["lower"]), number(told["bound"]["upper"])
    word = told["named"]["word"]
    assert all(cases[i][1] == cases[j][0] for i, j in zip(word, word[1:] + word[:1], strict=True))
    within(lower, lifted_gain([steps[i] for i in word]), upper)
    rng, closed = np.random.default_rng(29), 0
    for _ in range(40):
        walk: list[int] = []
        node = start = cases[rng.integers(len(cases))][0]
        while len(walk) < 60 and (not walk or node != start):
            i = rng.choice([i for i, case in enumerate(cases) if case[0] == node])
            walk, node = [*walk, i], cases[i][1]
        if node == start:
            within(0, lifted_gain([steps[i] for i in walk], 25, 3), upper)
            closed += 1
    assert closed >= 10, "too few patterns repeat"


def selection(told: Data) -> None:
    measured = schedule(told["parameters"])
    assert f" are {measured}, and again from instant {len(measured)} on" in spoken(told)


def common_period(told: Data) -> None:
    timed = list(zip(told["parameters"]["periods"], told["parameters"]["offsets"], strict=True))
    seen = [[(k - at) % N == 0 for N, at in timed] for k in range(200)]
    first = next(p for p in range(1, 100) if all(seen[k] == seen[k + p] for k in range(100)))
    assert f"repeats after {first} instant" in spoken(told)


def idle_instants(told: Data) -> None:
    came = "".join("x" if rows else "-" for rows in schedule(told["parameters"]) * 3)
    assert f"is {max(map(len, came.split('x')))} instant" in spoken(told)


def dual_rate(told: Data) -> None:
    first, *others = schedule(told["parameters"])
    assert first == list(range(len(told["parameters"]["periods"])))
    assert others
    assert not any(others)


def sizes(told: Data) -> tuple[int, int, int]:
    return len(told["plant"]["A"]), len(told["plant"]["B_d"][0]), len(told["plant"]["C"])


def rows(told: Data) -> None:
    """(30) has blocks P, P_(k-1) - W'W, gamma^2 I of d and of w on its diagonal."""
    n, m, q = sizes(told)
    assert f" has {len(inequality(*random_phase(n, q, m))[1])} rows" in spoken(told)


def cyclic_rows(told: Data) -> None:
    N = len(schedule(told["parameters"]))
    n, m, q = sizes(told)
    count = len(inequality(*random_phase(N * n, N * q, N * m))[1])
    assert f"with {N} times" in spoken(told)
    assert f" has {count} rows" in spoken(told)


def variables(told: Data) -> None:
    n, _, q = sizes(told)
    free = sum(1 for i in range(n) for j in range(n) if i <= j) + sum(1 for _ in product(range(n), range(q)))
    assert f" has {free * len(schedule(told['parameters'])) + 1} unknown" in spoken(told)


def observable(told: Data) -> None:
    A, C = array(told["plant"]["A"]), array(told["plant"]["C"])
    rank = np.linalg.matrix_rank(np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(len(A))]))
    assert f" has rank {rank}, of {len(A)}" in spoken(told)
    assert rank == len(A)


def unmeasured(told: Data) -> None:
    L, measured = array(told["plant"]["L"]), schedule(told["parameters"])
    idle = [L[k][:, i] for k, rows in enumerate(measured) for i in range(L.shape[2]) if i not in rows]
    assert f" are zero in all {len(idle)} columns" in spoken(told)
    assert not np.any(idle)


def monodromy(A: Matrix, C: Matrix, L: Matrix, measured: list[list[int]], first: int = 0) -> Matrix:
    """A_e of one period from an instant on, later factors to the left."""
    M = np.eye(len(A))
    for k in range(first, first + len(measured)):
        i = measured[k % len(measured)]
        M = (A - L[k % len(L)][:, i] @ C[i]) @ M
    return M


def order_of_factors(told: Data) -> None:
    A, C, L = (array(told["plant"][name]) for name in "ACL")
    measured = schedule(told["parameters"])
    one, next_one = (np.poly(monodromy(A, C, L, measured, first)) for first in (0, 1))
    reverse = np.poly(monodromy(A, C, L[::-1], measured[::-1]))
    assert np.allclose(one, next_one, rtol=1e-9, atol=1e-12)
    assert not np.allclose(one, reverse, rtol=1e-3, atol=1e-6)


def stated_poles(told: Data) -> tuple[Matrix, Matrix, Matrix]:
    """A as recovered, C and L; A must have the stated poles, each part within half a unit of the last place."""
    plant, chosen = told["plant"], told["parameters"]
    A, C = array(chosen.get("A", plant["A"])), array(chosen.get("C", plant["C"]))
    if "diagonal" in chosen:
        np.fill_diagonal(A, array(chosen["diagonal"]))
    poles = sorted((p for p in np.linalg.eigvals(A) if p.imag >= 0), key=lambda p: p.real)
    wanted = sorted(array(plant["poles"]).tolist())
    off = np.array([[p.real, p.imag] for p in poles]) - wanted
    assert np.abs(off).max() <= number(plant["half_unit"])
    return A, C, array(plant["L"])


def recovered_poles(told: Data) -> None:
    A, _, _ = stated_poles(told)
    assert spectral_radius(A) > 1


def recovered_error_poles(told: Data) -> None:
    A, C, L = stated_poles(told)
    poles = np.linalg.eigvals(monodromy(A, C, L, schedule(told["parameters"])))
    printed = re.findall(r"\[(\S+) \+/- (\S+)\]", spoken(told))
    assert len(printed) == len(poles)
    for pole, (middle, radius) in zip(sorted(abs(poles)), sorted(printed, key=lambda p: abs(float(p[0]))), strict=True):
        assert abs(abs(float(middle)) - pole) <= float(radius) + 1e-12
    assert abs(poles).max() < 1


def same_setting(told: Data) -> None:
    A, C, L = stated_poles(told)
    radius = spectral_radius(monodromy(A, C, L, schedule(told["parameters"])))
    ((middle, width),) = re.findall(r"modulus \[(\S+) \+/- (\S+)\]", spoken(told))
    assert abs(radius - float(middle)) <= float(width) + 1e-8 * radius
    assert radius > 1


def free_setting(told: Data) -> None:
    A, C, L = stated_poles(told)
    assert spectral_radius(monodromy(A, C, L, schedule(told["parameters"]))) < 1


def stated_design(told: Data) -> None:
    A, C, _ = stated_poles(told)
    chosen = told["parameters"]
    plant = {"A": A, "C": C, "B_d": array(chosen["B_d"]), "D": array(chosen["D"]), "W": np.eye(len(A))}
    exact = {name: [[float(x).as_integer_ratio() for x in row] for row in M] for name, M in plant.items()}
    plain = {name: [[f"{a}/{b}" for a, b in row] for row in M] for name, M in exact.items()}
    assert spectral_radius(A) > 1
    designed({"plant": plain, "parameters": {}}, schedule(chosen), number(told["bound"]["upper"]))


def random_phase(n: int, q: int, m: int, seed: int = 30) -> tuple[Any, ...]:
    """A, B_d, C, D, L, S, W, P, P_(k-1), level of one phase, drawn."""
    rng = np.random.default_rng(seed)
    P, Q = (M @ M.T for M in rng.normal(size=(2, n, n)))
    shapes = ((n, n), (n, m), (q, n), (q, q), (n, q))
    S = np.diag((rng.random(q) < 0.5).astype(float))
    return (*(rng.normal(size=shape) for shape in shapes), S, rng.normal(size=(n, n)), P, Q, 1.7)


def inequality(*phase: Any) -> tuple[Matrix, Matrix]:
    """The matrices (20) and, with Y = P L, (30), as printed."""
    A, B, C, D, L, S, W, P, Q, level = phase
    Ae, M, Y, g2 = A - L @ S @ C, L @ S @ D, P @ L, level**2
    d, w, n = np.eye(B.shape[1]), np.eye(len(D)), len(A)
    theta = [
        [Q - Ae.T @ P @ Ae - W.T @ W, -Ae.T @ P @ B, Ae.T @ P @ M],
        [-B.T @ P @ Ae, g2 * d - B.T @ P @ B, B.T @ P @ M],
        [M.T @ P @ Ae, M.T @ P @ B, g2 * w - M.T @ P @ M],
    ]
    first = np.hstack([P @ A - Y @ S @ C, P @ B, -Y @ S @ D])
    rest = np.zeros((first.shape[1],) * 2)
    rest[:n, :n] = Q - W.T @ W
    rest[n:, n:] = g2 * np.eye(len(rest) - n)
    return np.block(theta), np.block([[P, first], [first.T, rest]])


def points(told: Data) -> list[tuple[Any, ...]]:
    p = told["parameters"]
    return [random_phase(p["states"], p["sensors"], p["disturbances"], seed) for seed in range(3)]


def error_system(told: Data) -> None:
    for seed, (A, B, C, D, L, S, *_) in enumerate(points(told)):
        rng = np.random.default_rng(seed)
        x, o, d, w = (rng.normal(size=k) for k in (len(A), len(A), B.shape[1], len(C)))
        forced = rng.normal(size=(len(A), told["parameters"]["inputs"])) @ rng.normal(size=told["parameters"]["inputs"])
        y = S @ (C @ x + D @ w)
        error = (A @ x + forced + B @ d) - (A @ o + forced + L @ (y - S @ C @ o))
        assert np.allclose(error, (A - L @ S @ C) @ (x - o) + B @ d - L @ S @ D @ w, rtol=1e-10)


def dissipation(told: Data) -> None:
    for seed, phase in enumerate(points(told)):
        A, B, C, D, L, S, W, P, Q, level = phase
        rng = np.random.default_rng(seed)
        e, d, w = (rng.normal(size=k) for k in (len(A), B.shape[1], len(C)))
        xi, after = np.hstack([e, d, w]), (A - L @ S @ C) @ e + B @ d - L @ S @ D @ w
        loss = e @ Q @ e - after @ P @ after + level**2 * (d @ d + w @ w) - (W @ e) @ (W @ e)
        assert np.isclose(xi @ inequality(*phase)[0] @ xi, loss, rtol=1e-9)


def schur(told: Data) -> None:
    for phase in points(told):
        theta, whole = inequality(*phase)
        n = len(phase[0])
        assert np.allclose(whole[n:, n:] - whole[n:, :n] @ np.linalg.solve(whole[:n, :n], whole[:n, n:]), theta)


def sufficient(which: int) -> Check:
    """Where P_k make (20), or (30), positive definite, A_e is Schur and the gain is below the level: seeded draws."""

    def check(_: Data) -> None:
        met = 0
        for seed in range(40):
            rng = np.random.default_rng(seed)
            n, q, m, N = (int(k) for k in rng.integers(1, (4, 3, 3, 5)))
            A, L = rng.normal(size=(n, n)) * 0.5, rng.normal(size=(N, n, q)) * 0.3
            phases = [random_phase(n, q, m, 100 * seed + k) for k in range(N)]
            _, B, C, D, _, _, W, *_ = phases[0]
            S = [phase[5] for phase in phases]
            F = [A - L[k] @ S[k] @ C for k in range(N)]
            P = [np.eye(n)] * N
            for k in list(range(N - 1, -1, -1)) * 30:  # P_(k-1) of the error's Lyapunov recursion
                P[k - 1] = F[k].T @ P[k] @ F[k] + W.T @ W + (0.5 + rng.random()) * np.eye(n)
            for level in (1.0, 2.0, 4.0, 8.0, 16.0):
                told = [inequality(A, B, C, D, L[k], S[k], W, P[k], P[k - 1], level)[which] for k in range(N)]
                if min(map(smallest, told)) > 0 and min(map(smallest, P)) > 0:
                    steps = [(F[k], np.hstack([B, -L[k] @ S[k] @ D]), W, np.zeros((n, m + q))) for k in range(N)]
                    assert lifted_gain(steps, 61, 4) < level
                    met += 1
        assert met >= 20

    return check


CHECKS = checks(globals(), product=order_of_factors, theorem_1=sufficient(0), theorem_2=sufficient(1))
