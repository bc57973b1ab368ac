"""The sentences on the dual-rate loops of the motor against simulated loops.

One slow period is simulated from columns of the identity, the steady state solved for, and its error sampled densely
in time. Statements for all loops, states and periods are sampled at seeded ones: a sample can contradict them only.
"""

import re
from collections.abc import Callable

import numpy as np
import scipy.linalg
from definition import Data, Matrix, array, checks, held, largest, number, smallest, spectral_radius, spoken, within

PAPER = "shao"
Command = Callable[[int], complex]
FACTORS = {"(7)": 1.0, "(10)": 1.0, "(17)": 1.0, "(22)": 1.0}
"""Of one term of an equation that has no data of its own: one, unless a test alters it."""
WORDS = {
    "single_rate": "the single-rate loop",
    "single_rate_correction": "the single-rate loop with one correction in a slow period",
    "model_interpolation": "model interpolation",
    "held_measurement": "the measurement held over the slow period",
    "single_correction": "one correction in a slow period",
    "alternating_predictive": "the alternating predictive observer",
}


class Loop:
    """Plant (1) with the feedback (8) and an observer, T and M."""

    def __init__(self, plant: Data, **changed: float) -> None:
        self.A, self.B, self.C, self.K, self.L = (array(plant[name]) for name in "ABCKL")
        self.T, self.M = changed.get("T", number(plant["T"])), int(changed.get("M", number(plant["M"])))
        self.n = len(self.A)
        self.held, self.carried = held(self.A, self.B, self.T), self.A - self.L @ self.C
        both = held(self.carried, np.hstack([self.B, self.L]), self.T)
        self.F, self.G, self.H = both[0], both[1][:, : self.B.shape[1]], both[1][:, self.B.shape[1] :]

    def period(
        self, observer: str, z: Matrix, command: Command = lambda _: 0
    ) -> tuple[Matrix, list[tuple[Matrix, ...]]]:
        """z = (x, zeta) after a slow period; at each fast instant x, the estimate in use, and u."""
        x, zeta = z[: self.n], z[self.n :]
        Phi, Gamma = self.held
        y, used, seen = self.C @ x, zeta, []
        u = first = self.K @ used + command(0)
        for k in range(self.M):
            seen.append((x, used, u))
            model = Phi @ zeta + Gamma @ u
            running = Phi @ used + Gamma @ u
            following = self.F @ zeta + self.G @ (first if observer == "slow_input_interpolation" else u) + self.H @ y
            if observer in ("single_correction", "single_rate_correction") and k > 0:
                following = model
            virtual = self.C @ model
            if observer == "running_prediction":  # a step on from the last measurement, true or virtual
                virtual = y + virtual - self.C @ zeta
            x, zeta = Phi @ x + Gamma @ u, following
            if observer in ("alternating_predictive", "running_prediction"):
                y = virtual
            elif observer == "fast_sensor":
                y = self.C @ x
            interpolated = observer in ("model_interpolation", "slow_input_interpolation")
            used = running if interpolated else zeta
            if observer not in ("single_rate", "single_rate_correction"):
                u = self.K @ used + command(k + 1)
        return np.vstack([x, zeta]), seen

    def monodromy(self, observer: str) -> Matrix:
        return self.period(observer, np.eye(2 * self.n))[0]

    def command(self, sigma: float, form: str) -> complex:
        """Amplitude of the feedforward less K (y_d, y_d', y_d''), for y_d = Im e^{st}."""
        s, a2, a3, b = 1j * sigma, -self.A[2, 1], -self.A[2, 2], self.B[2, 0]
        orders = {"printed": (2, 1, 0), "corrected": (3, 1, 2)}[form]
        pushed = sum(c * s**order for c, order in zip((1, a2, a3), orders, strict=True)) / b
        return complex(pushed - self.K[0] @ s ** np.arange(3))

    def steady(self, observer: str, sigma: float, form: str) -> list[tuple[Matrix, ...]]:
        """Amplitudes of x, the estimate in use, and u at the fast instants of a slow period."""
        s, r = 1j * sigma, self.command(sigma, form)
        pushed = self.period(observer, np.zeros((2 * self.n, 1)), lambda k: r * np.exp(s * k * self.T))[0]
        slow = np.exp(s * self.M * self.T) * np.eye(2 * self.n)
        start = np.linalg.solve(slow - self.monodromy(observer), pushed)
        return self.period(observer, start, lambda k: r * np.exp(s * k * self.T))[1]


def radius(told: Data) -> None:
    value = spectral_radius(Loop(told["plant"]).monodromy(told["parameters"]["observer"]))
    within(number(told["bound"]["lower"]), value, number(told["bound"]["upper"]))


def stable(told: Data) -> None:
    value = spectral_radius(Loop(told["plant"]).monodromy(told["parameters"]["observer"]))
    within(0, value, number(told["named"]["radius"]))
    assert number(told["named"]["radius"]) < 1


def tracking_errors(told: Data) -> None:
    loop, chosen = Loop(told["plant"]), told["parameters"]
    assert spectral_radius(loop.monodromy(chosen["observer"])) < 1
    for frequency, error in zip(chosen["frequencies"], told["named"]["errors"], strict=True):
        s = 1j * number(frequency)
        peak = 0.0
        for k, (x, _, u) in enumerate(loop.steady(chosen["observer"], number(frequency), chosen["feedforward"])):

            def size(t: float, k: int = k, x: Matrix = x, u: Matrix = u, s: complex = s) -> float:
                Phi, Gamma = held(loop.A, loop.B, t)
                return float(abs((loop.C @ (Phi @ x + Gamma @ u))[0, 0] - np.exp(s * (k * loop.T + t))))

            between = chosen["instants"] == "all"
            peak = max(peak, largest(np.vectorize(size), np.linspace(0, loop.T, 31), 5) if between else size(0.0))
        within(number(error["lower"]), 100 * peak, number(error["upper"]), 1e-8)


def estimates_ordered(told: Data) -> None:
    loop, chosen = Loop(told["plant"]), told["parameters"]
    sizes = []
    for observer in (chosen["observer"], chosen["than"]):
        steady = loop.steady(observer, number(chosen["frequency"]), "printed")
        sizes.append(100 * max(float(abs((loop.C @ (x - used))[0, 0])) for x, used, _ in steady))
        low, high = re.findall(
            rf"(\S+) to (\S+) percent of the amplitude in the loop with {WORDS[observer]}", spoken(told)
        )[0]
        within(float(low), sizes[-1], float(high))
    assert sizes[0] < sizes[1]


def no_bounded_error(told: Data) -> None:
    """Over twelve slow periods the error at the slow instants grows at the rate stated."""
    loop, chosen = Loop(told["plant"]), told["parameters"]
    x, sigma = array(told["plant"]["start"]), number(chosen["frequency"])
    s, r = 1j * sigma, loop.command(sigma, "printed")
    estimates = {"zero": 0 * x, "output": np.vstack([loop.C @ x, np.zeros((2, 1))]), "true": x}
    listed = ", ".join("(" + ", ".join(map(fraction, estimates[name][:, 0])) + ")" for name in chosen["starts"])
    assert f"ζ(0) = {listed}:" in spoken(told)
    rate = float(re.findall(r"of modulus (\S+) or more", spoken(told))[0].rstrip("."))
    for name in chosen["starts"]:
        z, errors = np.vstack([x, estimates[name]]), []
        for period in range(12):
            t = period * loop.M * loop.T
            z, _ = loop.period(chosen["observer"], z, lambda k, t=t: (r * np.exp(s * (t + k * loop.T))).imag)
            errors.append(abs((loop.C @ z[:3])[0, 0] - np.sin(sigma * (t + loop.M * loop.T))))
        assert min(errors[-1] / errors[-2], errors[-2] / errors[-3]) >= rate * (1 - 1e-3)
    assert rate > 1
    within(rate, spectral_radius(loop.monodromy(chosen["observer"])), rate + 1e-3)


def fraction(value: float) -> str:
    top, bottom = value.as_integer_ratio()
    return f"{top}/{bottom}" if bottom > 1 else str(top)


def hurwitz(told: Data) -> None:
    loop = Loop(told["plant"])
    M = loop.A + loop.B @ loop.K if told["parameters"]["matrix"] == "feedback" else loop.carried
    assert np.linalg.eigvals(M).real.max() < 0


def slow_period(told: Data) -> None:
    value = number(told["plant"]["M"]) * number(told["plant"]["T"])
    within(number(told["bound"]["lower"]), value, number(told["bound"]["upper"]))


def torque_constant(told: Data) -> None:
    value = 1.5 * number(told["plant"]["p"]) * number(told["plant"]["Psi"])
    within(number(told["bound"]["lower"]), value, number(told["bound"]["upper"]))


def coordinates(told: Data) -> None:
    """The rates of (23) at seeded currents, speeds, positions and voltages are those of A and B at (θ, ω, ω')."""
    plant = told["plant"]
    R, Psi, Lq, p, Bw, J, KT = (number(plant[name]) for name in ("R", "Psi", "Lq", "p", "Bw", "J", "KT"))
    A, B, C = (array(plant[name]) for name in "ABC")
    for i, omega, theta, u in np.random.default_rng(3).normal(size=(5, 4)):
        rate = -R / Lq * i - p * Psi / Lq * omega + u / Lq
        turning = KT / J * i - Bw / J * omega
        expected = [omega, turning, KT / J * rate - Bw / J * turning]
        x = np.array([theta, omega, turning])
        assert np.allclose(A @ x + B[:, 0] * u, expected, rtol=1e-9)
        assert np.allclose(C @ x, theta)


def feedforward(told: Data) -> None:
    """Plant times feedforward at seeded complex s, where it is one or is stated not to be."""
    loop = Loop(told["plant"])
    s = np.random.default_rng(4).normal(size=(5, 2)) @ [10, 10j]
    factors = (1, -loop.A[2, 1], -loop.A[2, 2])
    ahead = sum(c * s**k for c, k in zip(factors, told["parameters"]["orders"], strict=True)) / loop.B[2, 0]
    plant = np.array([(loop.C @ np.linalg.solve(p * np.eye(3) - loop.A, loop.B))[0, 0] for p in s])
    assert f"of orders {told['parameters']['orders']} is " in spoken(told)
    assert np.allclose(ahead * plant, 1, rtol=1e-9) is (" is not the inverse" not in spoken(told))


def lyapunov_of(loop: Loop) -> Matrix:
    pushed = loop.B @ loop.K
    joint = np.block([[loop.A + pushed, -pushed], [np.zeros_like(loop.A), loop.carried]])
    assert np.linalg.eigvals(joint).real.max() < 0
    P = scipy.linalg.solve_continuous_lyapunov(joint.T, -np.eye(2 * loop.n))
    assert np.abs(joint.T @ P + P @ joint + np.eye(2 * loop.n)).max() < 1e-10 * np.abs(P).max() * np.abs(joint).max()
    return np.array((P + P.T) / 2)


def constants(loop: Loop, P: Matrix) -> tuple[float, float, float, float]:
    """alpha_1 to alpha_4, below (13), (14), (15) and (17)."""
    A, B, C, K, L, hat = loop.A, loop.B, loop.C, loop.K, loop.L, loop.carried

    def norm(M: Matrix) -> float:
        return float(np.linalg.norm(M, 2))

    root, high = np.sqrt(smallest(P)), norm(P)
    a1 = (norm(C @ A) + 2 * norm(C @ B @ K)) / root
    a2 = (2 * norm(K @ hat) + 2 * norm(K @ B @ K) + norm(K @ L @ C)) / root
    a3 = norm(C @ A) / root
    a4 = 2 * (a2 * norm(B) + norm(L) * a1 + norm(B) * a3 * norm(K @ L) + a3 * norm(L)) * high / root
    return a1, a2, a3, a4


def lyapunov(told: Data) -> None:
    assert smallest(lyapunov_of(Loop(told["plant"]))) > 0


def condition(told: Data) -> None:
    loop = Loop(told["plant"])
    P = lyapunov_of(loop)
    side = constants(loop, P)[3] * np.linalg.norm(P, 2) * loop.T
    low, high = re.findall(r"left side is (\S+) to (\S+)\.$", spoken(told))[0]
    within(float(low), side, float(high), 1e-6)
    assert bool(side < 1) is (" meets (18)" in spoken(told))


def counterexample(told: Data) -> None:
    """Unstable at forty periods up to the longest; the periods that (18) allows end where stated."""
    longest = number(told["parameters"]["longest"])
    for ratio in told["parameters"]["ratios"]:
        for T in np.geomspace(longest / 1000, longest, 40):
            assert spectral_radius(Loop(told["plant"], T=T, M=ratio).monodromy("alternating_predictive")) > 1
    P = lyapunov_of(loop := Loop(told["plant"]))
    allowed = 1 / (constants(loop, P)[3] * np.linalg.norm(P, 2))
    low, high = re.findall(r"below (\S+) s and for none from (\S+) s", spoken(told))[0]
    within(float(low), float(allowed), float(high))
    assert allowed < longest


def prediction_bound(told: Data) -> None:
    """From the state that V weighs least for C xi, the first virtual measurement misses (15) at seeded periods."""
    loop, longest = Loop(told["plant"]), number(told["parameters"]["longest"])
    P = lyapunov_of(loop)
    start = np.linalg.solve(P, np.vstack([np.zeros((loop.n, 1)), loop.C.T]))
    ratios = []
    for T in longest * np.append(np.random.default_rng(15).random(5), 1.0):
        one = Loop(told["plant"], T=T, M=2)
        z = np.vstack([start[: loop.n], start[: loop.n] - start[loop.n :]])
        after, seen = one.period("alternating_predictive", z)
        states = [
            np.vstack([x, x - zeta])
            for x, zeta in (*((x, used) for x, used, _ in seen), (after[: loop.n], after[loop.n :]))
        ]
        most = max(float((chi.T @ P @ chi)[0, 0]) for chi in states)
        gap = abs((loop.C @ one.held[0] @ start[loop.n :])[0, 0])
        ratios.append(gap / (constants(loop, P)[2] * T * np.sqrt(most)))
    assert min(ratios) > 1
    gap, side = map(float, re.findall(r"at least (\S+), its bound at most (\S+)\.$", spoken(told))[0])
    assert gap > side
    within(0, gap / side, ratios[-1], 1e-2)


def random_loop(rng: np.random.Generator) -> Loop:
    """Drawn until A + B K and A - L C are Hurwitz."""
    while True:
        n = int(rng.integers(1, 4))
        plant = {
            name: rng.normal(size=size).tolist()
            for name, size in zip("ABCKL", ((n, n), (n, 1), (1, n), (1, n), (n, 1)), strict=True)
        }
        loop = Loop({**plant, "T": 0.3, "M": 3})
        if (
            max(np.linalg.eigvals(loop.A + loop.B @ loop.K).real.max(), np.linalg.eigvals(loop.carried).real.max())
            < -0.05
        ):
            return loop


def step_bound(told: Data) -> None:
    """Of seeded loops: each term of the rates at the worst (x, xi), and the bound of the integral along the loop."""
    weights, output = (
        {k: number(v) for k, v in told["parameters"]["weights"].items()},
        told["parameters"]["quantity"] == "output",
    )
    for seed in range(20):
        loop = random_loop(rng := np.random.default_rng(seed))
        A, B, C, K, L = loop.A, loop.B, loop.C, loop.K, loop.L
        maps = {"CA": (C @ A, 1), "CBK": (C @ B @ K, 2)} if output else {}
        maps |= {} if output else {"KÂ": (K @ loop.carried, 2), "KBK": (K @ B @ K, 2), "KLC": (K @ L @ C, 1)}
        assert maps.keys() == weights.keys()
        for name, (M, parts) in maps.items():  # of x, or of the estimate x - xi
            assert (
                np.linalg.norm(M @ np.hstack([np.eye(loop.n), -np.eye(loop.n)][:parts]), 2)
                <= weights[name] * np.linalg.norm(M, 2) + 1e-12
            )
        P = lyapunov_of(loop)
        factor = sum(weights[name] * np.linalg.norm(M, 2) for name, (M, _) in maps.items()) / np.sqrt(smallest(P))
        x, zeta = rng.normal(size=(2, loop.n, 1))
        u, gap = K @ zeta, rng.normal()
        moved, most = [], 0.0
        for t in np.linspace(0, 1, 101):
            Phi, Gamma = held(A, B, t)
            E, D = held(loop.carried, np.hstack([B, L]), t)
            state, estimate = Phi @ x + Gamma @ u, E @ zeta + D @ np.vstack([u, C @ x + gap])
            chi = np.vstack([state, state - estimate])
            most = max(most, float((chi.T @ P @ chi)[0, 0]))
            moved = [C @ (state - x), K @ (estimate - zeta)]
            bound = factor * np.sqrt(most) * t + (0 if output else float(abs(K @ L)[0, 0]) * abs(gap) * t)
            assert abs(moved[0 if output else 1][0, 0]) <= bound * (1 + 1e-3) + 1e-12


def errors_of_states(told: Data) -> None:
    """(9) is (10) at seeded matrices and signals; in Case 2, with the true measurement, its last term is zero."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        n, m, q = (int(k) for k in rng.integers(1, 5, size=3))
        A, B, C, K, L = (rng.normal(size=size) for size in ((n, n), (n, m), (q, n), (m, n), (n, q)))
        x, xi, zeta_k, y_k, y_p = (rng.normal(size=k) for k in (n, n, n, q, q))
        case_2, zeta, y = told["statement"] == "dualrate.second-case", x - xi, C @ x
        used = y_k if case_2 else y_p
        nine = np.hstack([A @ x + B @ K @ zeta_k, A @ xi - L @ (used - C @ zeta)])
        joint = np.block([[A + B @ K, -B @ K], [np.zeros((n, n)), A - L @ C]])
        ten = joint @ np.hstack([x, xi]) + np.hstack([B @ K @ (zeta_k - zeta), -L @ (y_k - y)])
        ten[n:] -= 0 if case_2 else L @ (y_p - y_k)
        ten *= FACTORS["(10)"]
        assert np.allclose(nine, ten, rtol=1e-10)


def collected_constant(_: Data) -> None:
    """The last four terms of (16) against alpha_4 sqrt(V) V_m, at seeded loops and states."""
    for seed in range(50):
        loop = random_loop(rng := np.random.default_rng(seed))
        P, n = lyapunov_of(loop), loop.n
        a1, a2, a3, a4 = constants(loop, P)
        chi, V_m = rng.normal(size=2 * n), rng.random()
        PB, PL = np.linalg.norm(P[:, :n] @ loop.B), np.linalg.norm(P[:, n:] @ loop.L)
        KL = float(abs(loop.K @ loop.L)[0, 0])
        terms = 2 * np.linalg.norm(chi) * V_m * (a2 * PB + a1 * PL + a3 * PB * KL + a3 * PL)
        assert terms <= FACTORS["(17)"] * a4 * np.sqrt(chi @ P @ chi) * V_m * (1 + 1e-9)


def contraction(_: Data) -> None:
    for T, high, c in np.random.default_rng(22).random((200, 3)) * [5, 5, 1]:
        E = np.exp(-T / (2 * high))
        phi = E + FACTORS["(22)"] * (1 - E) * c
        assert phi < 1
        assert np.isclose(1 - phi, (1 - E) * (1 - c), rtol=1e-9)


def sampled_observer(_: Data) -> None:
    """(3) by Runge and Kutta's steps over a period against (7) with its integrals by Simpson's rule."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        n, m, q = (int(k) for k in rng.integers(1, 4, size=3))
        hat, B, L, zeta, u, y = (rng.normal(size=k) for k in ((n, n), (n, m), (n, q), n, m, q))
        T, steps = 0.5, 200
        h, z, pushed = T / steps, zeta, B @ u + L @ y
        for _ in range(steps):
            k1 = hat @ z + pushed
            k2 = hat @ (z + h / 2 * k1) + pushed
            k3 = hat @ (z + h / 2 * k2) + pushed
            z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + hat @ (z + h * k3) + pushed)
        weights = np.array([1, *[4, 2] * (steps // 2 - 1), 4, 1]) * h / 3
        integral = FACTORS["(7)"] * sum(w * scipy.linalg.expm(hat * h * k) for k, w in enumerate(weights))
        assert np.allclose(z, scipy.linalg.expm(hat * T) @ zeta + integral @ B @ u + integral @ L @ y, rtol=1e-8)


CHECKS = checks(globals(), error_equations=errors_of_states, second_case=errors_of_states)
