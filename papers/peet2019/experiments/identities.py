"""What the text derives, on random data: LMI (3) with Theorem 1 in finite dimensions; Theorem 3 and eq. (10).

In finite dimensions X = Z = R^n, all operators are matrices, and there is a D. For random plants a P and a Z near the
best are found without a solver, by a Riccati equation. The least γ at which (3) holds for them is then compared with
the gain of the error dynamics (6), computed by the Hamiltonian test.

Theorem 3 is taken on random polynomials, in the paper's own units and from its definitions: functions are values at
Gauss points of [-τ_i, 0], integrals are weighted sums, derivatives are those of the polynomials, and nothing is shared
with the synthesis. The identity is evaluated as corrected, and with one group of terms as printed.
"""

from dataclasses import dataclass
from types import SimpleNamespace as Sample
from typing import Any

import numpy as np
import scipy
from numpy.polynomial.polynomial import polyder

from replication.estimation.linear.norms import continuous_norm
from replication.estimation.validation import Array

POINTS = 24
DELAYS = (0.7, 2.6)
"""Two delays with τ_K ≠ 1, so that factors of τ_K show."""
K, LAST = len(DELAYS), DELAYS[-1]
EACH = range(K)

MISPRINTS = (
    "none",
    "d-sign",
    "d-transposes",
    "f-sign",
    "e-transposes",
    "eq10-factor",
    "g2-factor",
    "z0-name",
    "theorem-1-sign",
)
"""Groups of terms of Theorem 3 and its proof, each as printed; none: all corrected.

d-sign: S_i(-τ_i) in D. d-transposes: T_0i in D. f-sign: dS_i/ds in F_i. e-transposes: those in E_i. eq10-factor: the
second row of (10). g2-factor: G_2ij of the proof. z0-name: Z_1 in T_00, which stands for no matrix of the theorem.
theorem-1-sign: the square of C_1e on the left of the identity, where v stands on the right.
"""


@dataclass(frozen=True)
class Poly:
    """Matrix polynomials Σ c_k s^k, or Σ c_kl s^k θ^l: coefficients (degrees.., rows, columns)."""

    c: Array

    def at(self, s: Array | float) -> Array:
        """Values (len(s), rows, columns) of a polynomial of one variable; of two, its coefficients in the second."""
        return np.tensordot(np.vander(np.atleast_1d(s), len(self.c), increasing=True), self.c, 1)

    def slope(self, s: Array | float) -> Array:
        """Derivative of a polynomial of one variable."""
        return Poly(np.asarray(polyder(self.c), float)).at(s)

    def at2(self, s: Array | float, theta: Array | float, slope: tuple[int, int] = (0, 0)) -> Array:
        """Values (len(s), len(θ), rows, columns), differentiated `slope` times in s and θ (0 or 1 each)."""
        c = np.asarray(polyder(polyder(self.c, slope[0]), slope[1], axis=1), float)
        return Poly(Poly(c).at(s).swapaxes(0, 1)).at(theta).swapaxes(0, 1)


GAUSS = np.polynomial.legendre.leggauss(POINTS)
NODES = [((GAUSS[0] - 1.0) / 2.0 * delay, GAUSS[1] / 2.0 * delay) for delay in DELAYS]
"""Points and weights of each [-τ_i, 0]."""


def sample(rng: np.random.Generator, n: int = 2, p: int = 1, q: int = 1) -> Sample:
    """Random data of Theorem 3 for n states, p outputs and q measurements, under the names of the theorem.

    P and S are symmetric, R_ij(s, θ) = R_ji(θ, s)ᵀ; e is a history with e_i(0) = e_0, late its values at -τ_i, output
    C_1 e. z1: a matrix other than Z_0, for the symbol Z_1 in T_00.
    """

    def poly(rows: int, columns: int) -> Poly:
        return Poly(rng.standard_normal((3, rows, columns)))

    def symmetric() -> Poly:
        c = rng.standard_normal((3, n, n))
        return Poly(c + c.swapaxes(1, 2))

    kernels = [[Poly(rng.standard_normal((3, 3, n, n))) for _ in EACH] for _ in EACH]
    kernels = [[Poly(kernels[i][j].c + np.einsum("klij->lkji", kernels[j][i].c)) for j in EACH] for i in EACH]
    storage, e0 = rng.standard_normal((n, n)), rng.standard_normal(n)
    histories = []
    for _ in EACH:
        c = rng.standard_normal((4, n, 1))
        c[0, :, 0] = e0
        histories.append(Poly(c))
    x = Sample(
        a=[rng.standard_normal((n, n)) for _ in range(K + 1)],
        b=rng.standard_normal((n, 2)),
        c1=[rng.standard_normal((p, n)) for _ in range(K + 1)],
        c2=rng.standard_normal((q, n)),
        gamma=1.7,
        p=storage + storage.T,
        q=[poly(n, n) for _ in EACH],
        s=[symmetric() for _ in EACH],
        r=kernels,
        z0=rng.standard_normal((n, q)),
        z2=[rng.standard_normal((n, q)) for _ in EACH],
        z3=[poly(n, q) for _ in EACH],
        z4=[poly(n, q) for _ in EACH],
        z5=[[poly(n, q) for _ in EACH] for _ in EACH],
        z6=[poly(n, q) for _ in EACH],
        z7=[[Poly(rng.standard_normal((3, 3, n, q))) for _ in EACH] for _ in EACH],
        e0=e0,
        e=histories,
        w=rng.standard_normal(2),
        v=rng.standard_normal(p),
        z1=rng.standard_normal((n, q)),
    )
    x.late = [history.at(-delay)[0, :, 0] for history, delay in zip(x.e, DELAYS, strict=True)]
    x.output = x.c1[0] @ x.e0 + sum(x.c1[i + 1] @ x.late[i] for i in EACH)
    return x


def dissipation(x: Sample, misprint: str) -> float:
    """Left side of the identity in Sec. VI, 2⟨e, 𝒫𝒜e + 𝒵C_2e - 𝒫Bw⟩ - γ|w|² - γ|v|² + 2⟨v, C_1e⟩, from (8) and (10).

    As printed the terms in v are |C_1e|²/γ (theorem-1-sign), and the second row of (10) lacks τ_K (eq10-factor).
    """
    factor = 1.0 if misprint == "eq10-factor" else LAST
    values = [x.e[i].at(NODES[i][0])[..., 0] for i in EACH]
    slopes = [x.e[i].slope(NODES[i][0])[..., 0] for i in EACH]
    rate = x.a[0] @ x.e0 + sum(x.a[i + 1] @ x.late[i] for i in EACH) - x.b @ x.w
    head, tails = _apply_storage(x, rate, slopes)
    y0, ends = x.c2 @ x.e0, [x.c2 @ value for value in x.late]
    measured = [value @ x.c2.T for value in values]
    head = head + x.z0 @ y0 + sum(x.z2[i] @ ends[i] for i in EACH)
    head = head + sum(np.einsum("t,tij,tj->i", NODES[i][1], x.z3[i].at(NODES[i][0]), measured[i]) for i in EACH)
    for i in EACH:
        s = NODES[i][0]
        tails[i] = tails[i] + factor * (
            x.z4[i].at(s) @ y0
            + sum(x.z5[i][j].at(s) @ ends[j] for j in EACH)
            + np.einsum("tij,tj->ti", x.z6[i].at(s), measured[i])
            + sum(np.einsum("u,tuij,uj->ti", NODES[j][1], x.z7[i][j].at2(s, NODES[j][0]), measured[j]) for j in EACH)
        )
    total = 2.0 * LAST * float(x.e0 @ head)
    total += 2.0 * _sizes(values, tails)
    total -= x.gamma * float(x.w @ x.w)
    if misprint == "theorem-1-sign":
        return float(total + x.output @ x.output / x.gamma)
    return float(total - x.gamma * float(x.v @ x.v) + 2.0 * float(x.v @ x.output))


def storage(x: Sample) -> float:
    """⟨e, 𝒫e⟩ by (8)."""
    values = [x.e[i].at(NODES[i][0])[..., 0] for i in EACH]
    head, tails = _apply_storage(x, x.e0, values)
    return LAST * float(x.e0 @ head) + _sizes(values, tails)


def _sizes(first: list[Array], second: list[Array]) -> float:
    """Σᵢ ∫ first_iᵀ second_i ds of histories at the nodes."""
    return sum(float(np.einsum("t,ti,ti->", NODES[i][1], first[i], second[i])) for i in EACH)


def coercive(x: Sample, epsilon: float) -> dict[str, float]:
    """What ⟨e, 𝒫e⟩ − ⟨e, 𝒫_{P−εI, Q, S−εI, R}e⟩ leaves of ετ_K(|e_0|² + Σ∫|e_i|²), and of ε‖e‖² as printed."""
    less = Sample(**vars(x))
    less.p = x.p - epsilon * np.eye(len(x.p))
    less.s = [Poly(np.concatenate([s.c[:1] - epsilon * np.eye(len(x.p)), s.c[1:]])) for s in x.s]
    point = float(x.e0 @ x.e0)
    histories = [history.at(NODES[i][0])[..., 0] for i, history in enumerate(x.e)]
    past = _sizes(histories, histories)
    difference = storage(x) - storage(less)
    corrected = epsilon * LAST * (point + past)
    return {
        "corrected": abs(difference - corrected) / (1.0 + abs(storage(x))),
        "printed": abs(difference - epsilon * (LAST * point + past)),
    }


def _apply_storage(x: Sample, point: Array, histories: list[Array]) -> tuple[Array, list[Array]]:
    """(8) applied to (point, histories at the nodes)."""
    head = x.p @ point
    for i in EACH:
        head = head + np.einsum("t,tij,tj->i", NODES[i][1], x.q[i].at(NODES[i][0]), histories[i])
    tails = []
    for i in EACH:
        s = NODES[i][0]
        tail = LAST * np.einsum("tji,j->ti", x.q[i].at(s), point)
        tail = tail + LAST * np.einsum("tij,tj->ti", x.s[i].at(s), histories[i])
        for j in EACH:
            tail = tail + np.einsum("u,tuij,uj->ti", NODES[j][1], x.r[i][j].at2(s, NODES[j][0]), histories[j])
        tails.append(tail)
    return head, tails


def theorem_3(x: Sample, misprint: str) -> float:
    """Right side ⟨h, P_{D,E,F,G}h⟩; `misprint` leaves one group of terms as printed."""
    late = x.late
    end_sign = 1.0 if misprint == "d-sign" else -1.0
    d = (-x.gamma * float(x.w @ x.w) - x.gamma * float(x.v @ x.v) + 2.0 * float(x.v @ x.output)) / LAST
    t00 = x.p @ x.a[0] + (x.z1 if misprint == "z0-name" else x.z0) @ x.c2
    t00 = t00 + sum(x.q[i].at(0.0)[0] + x.s[i].at(0.0)[0] / 2.0 for i in EACH)
    d += float(x.e0 @ (t00 + t00.T) @ x.e0) - 2.0 * float(x.w @ x.b.T @ x.p @ x.e0)
    for i in EACH:
        t0i = x.p @ x.a[i + 1] - x.q[i].at(-DELAYS[i])[0] + x.z2[i] @ x.c2
        t0i = t0i.T if misprint == "d-transposes" else t0i
        d += 2.0 * float(x.e0 @ t0i @ late[i]) + end_sign * float(late[i] @ x.s[i].at(-DELAYS[i])[0] @ late[i])
    total = LAST * d
    slope_sign = 1.0 if misprint == "f-sign" else -1.0
    for i in EACH:
        s, weights = NODES[i]
        phi = x.e[i].at(s)[..., 0]
        zero = _phi_0(x, i, s, misprint == "e-transposes")
        row = -np.einsum("r,kr,tkj->tj", x.w, x.b, x.q[i].at(s))
        row = row + np.einsum("i,tij->tj", x.e0, zero)
        for j in EACH:
            row = row + np.einsum("i,tij->tj", late[j], _phi_j(x, i, j, s, misprint == "e-transposes"))
        total += 2.0 * LAST * float(np.einsum("t,tj,tj->", weights, row, phi))
        injected = x.z6[i].at(s) @ x.c2
        f = slope_sign * x.s[i].slope(s) + (injected + injected.swapaxes(-1, -2))
        total += LAST * float(np.einsum("t,ti,tij,tj->", weights, phi, f, phi))
        for j in EACH:
            theta, weights_j = NODES[j]
            g = -x.r[i][j].at2(s, theta, (1, 0)) - x.r[i][j].at2(s, theta, (0, 1))
            factor = 1.0 if misprint == "g2-factor" else LAST
            g = g + factor * (x.z7[i][j].at2(s, theta) @ x.c2)
            g = g + factor * np.einsum("qi,utjq->tuij", x.c2, x.z7[j][i].at2(theta, s))
            total += float(np.einsum("t,u,ti,tuij,uj->", weights, weights_j, phi, g, x.e[j].at(theta)[..., 0]))
    return float(total)


def _phi_0(x: Sample, i: int, s: Array, printed: bool) -> Array:
    """Φ_0i: the block of e_0 against e_i. Printed inside an outer transpose, with Z_3 and Z_4 the other way round."""
    base = np.einsum("ji,tjk->tik", x.a[0], x.q[i].at(s)) - x.q[i].slope(s)
    base = base + sum(x.r[i][j].at2(s, 0.0)[:, 0].swapaxes(1, 2) for j in EACH) / LAST
    first, second = (x.z4[i], x.z3[i]) if printed else (x.z3[i], x.z4[i])
    block = base + first.at(s) @ x.c2 + (second.at(s) @ x.c2).swapaxes(1, 2)
    return np.asarray(block.swapaxes(1, 2) if printed else block)


def _phi_j(x: Sample, i: int, j: int, s: Array, printed: bool) -> Array:
    """Φ_ji: the block of e_j(-τ_j) against e_i."""
    base = np.einsum("ji,tjk->tik", x.a[j + 1], x.q[i].at(s))
    base = base - x.r[i][j].at2(s, -DELAYS[j])[:, 0].swapaxes(1, 2) / LAST
    injection = x.z5[i][j].at(s) @ x.c2
    return np.asarray((base + injection).swapaxes(1, 2) if printed else base + injection.swapaxes(1, 2))


def identities(trials: int, seed: int) -> dict[str, Any]:
    """Residual of the identity of Sec. VI by misprint: the largest and the median over the trials.

    That of no misprint is relative to one plus the size of the left side. coercive: `coercive` for ε = 1.
    """
    rng = np.random.default_rng(seed)
    residuals, margins = [], []
    for _ in range(trials):
        x = sample(rng)
        margins.append(coercive(x, 1.0))
        left = {name: dissipation(x, name) for name in MISPRINTS}
        sizes = {name: 1.0 + abs(value) if name == "none" else 1.0 for name, value in left.items()}
        residuals.append({name: abs(value - theorem_3(x, name)) / sizes[name] for name, value in left.items()})
    return {"trials": trials, "delays": list(DELAYS), "theorem_3": summaries(residuals), "coercive": summaries(margins)}


def summaries(cases: list[dict[str, float]]) -> dict[str, dict[str, float]]:
    """Largest and median residual by name."""
    by_name = {name: [case[name] for case in cases] for name in cases[0]}
    return {name: {"largest": max(values), "median": float(np.median(values))} for name, values in by_name.items()}


N, INPUTS, OUTPUTS, MEASURED = 3, 2, 2, 1
ABOVE = 1.02
"""Level, over the gain of the error dynamics, for which P is made."""
SLACK = 1e-4
"""Weight of |e|² in the Riccati equation, which makes the inequality strict."""


def matrix_3(p: Array, z: Array, plant: dict[str, Array], gamma: float) -> Array:
    """The matrix of LMI (3), in the order (e, w, v)."""
    half = p @ plant["a"] + z @ plant["c2"]
    cross, c1 = -(p @ plant["b"] + z @ plant["d"]), plant["c1"]
    return np.block(
        [
            [half + half.T, cross, c1.T],
            [cross.T, -gamma * np.eye(INPUTS), np.zeros((INPUTS, OUTPUTS))],
            [c1, np.zeros((OUTPUTS, INPUTS)), -gamma * np.eye(OUTPUTS)],
        ]
    )


def least_level(p: Array, z: Array, plant: dict[str, Array]) -> float:
    """The least γ at which (3) holds for P and Z, by its Schur complement."""
    matrix = matrix_3(p, z, plant, 0.0)
    cross = matrix[:N, N:]
    return float(scipy.linalg.eigh(cross @ cross.T, -matrix[:N, :N], eigvals_only=True)[-1])


def lmi_3(trials: int, seed: int) -> dict[str, Any]:
    """Gain of (6) over the least γ of (3), over random plants, with L = P⁻¹Z, and as a control with -P⁻¹Z.

    largest, smallest: of the ratio. storage: least eigenvalue of all P. form: by how much the quadratic form of (3)
    differs from that of Theorem 1, V' - γ|w|² - γ|v|² + 2⟨v, C_1e⟩ along (6), relatively. reversed: how many of the
    control's error dynamics are unstable or have a gain above the level.
    """
    rng = np.random.default_rng(seed)
    ratios, eigenvalues, form, reverse = [], [], [], 0
    for _ in range(trials):
        plant, gain = _drawn(rng)
        norm = _gain(plant, gain)
        a, b = plant["a"] + gain @ plant["c2"], -(plant["b"] + gain @ plant["d"])
        level = ABOVE * norm
        weight = plant["c1"].T @ plant["c1"] / level + SLACK * np.eye(N)
        p = np.asarray(scipy.linalg.solve_continuous_are(a, b, weight, -level * np.eye(INPUTS)))
        z = p @ gain
        least = least_level(p, z, plant)
        injection = np.linalg.solve(p, z)
        ratios.append(_gain(plant, injection) / least)
        eigenvalues.append(float(np.linalg.eigvalsh(p)[0]))
        reverse += not _gain(plant, -injection) <= least
        e, w, v = (rng.standard_normal(size) for size in (N, INPUTS, OUTPUTS))
        h = np.concatenate([e, w, v])
        rate = (plant["a"] + injection @ plant["c2"]) @ e - (plant["b"] + injection @ plant["d"]) @ w
        supply = 2.0 * e @ p @ rate - least * (w @ w + v @ v) + 2.0 * v @ plant["c1"] @ e
        form.append(abs(h @ matrix_3(p, z, plant, least) @ h - supply) / (1.0 + abs(supply)))
    return {
        "trials": trials,
        "largest": max(ratios),
        "smallest": min(ratios),
        "storage": min(eigenvalues),
        "form": float(max(form)),
        "reversed": reverse,
    }


def self_adjoint() -> dict[str, float]:
    """A case of Theorem 1 as printed, 𝒫 ≠ 𝒫*: 𝒫 = I + J, J the rotation by a right angle, 𝒵 = 0, B = C_1 = I, γ = 2.

    coercive: least eigenvalue of ⟨e, 𝒫e⟩. largest: of the inequality, in (e, w, v). abscissa: of the error.
    """
    identity, level = np.eye(2), 2.0
    rotation = np.array([[0.0, 1.0], [-1.0, 0.0]])
    p = identity + rotation
    a = np.linalg.solve(p, 2.0 * rotation - identity)
    plant = {"a": a, "b": identity, "c1": identity, "c2": identity, "d": 0.0 * identity}
    inequality = matrix_3(p, 0.0 * identity, plant, level)
    return {
        "coercive": float(np.linalg.eigvalsh((p + p.T) / 2.0)[0]),
        "largest": float(np.linalg.eigvalsh(inequality)[-1]),
        "abscissa": float(np.linalg.eigvals(a).real.max()),
    }


def value_over_norm(widths: list[float]) -> dict[str, float]:
    """By width d: the value at -τ over the norm in L₂ of the history that falls linearly from 1 to 0 within d of it."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    squares = ((1.0 - nodes) / 2.0) ** 2
    return {f"{width:g}": float(1.0 / np.sqrt(width / 2.0 * weights @ squares)) for width in widths}


def _drawn(rng: np.random.Generator) -> tuple[dict[str, Array], Array]:
    """A plant, and a gain that makes its error dynamics stable."""
    stable = rng.standard_normal((N, N))
    stable -= (np.linalg.eigvals(stable).real.max() + rng.uniform(0.2, 1.0)) * np.eye(N)
    gain, c2 = rng.standard_normal((N, MEASURED)), rng.standard_normal((MEASURED, N))
    plant = {
        "a": stable - gain @ c2,
        "b": rng.standard_normal((N, INPUTS)),
        "c1": rng.standard_normal((OUTPUTS, N)),
        "c2": c2,
        "d": rng.standard_normal((MEASURED, INPUTS)),
    }
    return plant, gain


def _gain(plant: dict[str, Array], gain: Array) -> float:
    """H∞ norm of the error dynamics (6), infinite if they are unstable."""
    a = plant["a"] + gain @ plant["c2"]
    if np.linalg.eigvals(a).real.max() >= 0.0:
        return float("inf")
    return continuous_norm(a, -(plant["b"] + gain @ plant["d"]), plant["c1"], np.zeros((OUTPUTS, INPUTS))).upper
