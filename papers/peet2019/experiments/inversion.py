"""Theorem 4 and Lemma 5 on random coercive operators, in the paper's own units, as printed and as corrected.

Functions are values at Gauss points of [-τ_i, 0] and integrals are their sums: an operator (8) is then a matrix, and
its inverse that of a matrix. How near the sums are to integrals is measured on K_i, with twice the points.
"""

from typing import Any

import numpy as np
import scipy

from papers.peet2019.experiments.identities import DELAYS, EACH, LAST, NODES, POINTS, K, summaries
from replication.estimation.validation import Array

N, DEGREE = 2, 1
WIDTH = N * (DEGREE + 1)
Z = [np.kron(np.vander(points, DEGREE + 1, increasing=True)[:, :, None], np.eye(N)) for points, _ in NODES]
"""Z(s) = (1, s, ..)⊗I at the Gauss points of each history."""
COERCIVE = 0.1
"""Least eigenvalue of the operators that are drawn."""
ALONE = {"factor alone": (True, False), "square alone": (False, True)}
"""Of the two corrections of Theorem 4 one."""
PART = [slice(i * WIDTH, (i + 1) * WIDTH) for i in EACH]
"""Rows of H_i and Γ_ij in H and Γ."""


def inverse_identities(trials: int, seed: int) -> dict[str, Any]:
    """Largest and median residuals over random operators, as corrected, and with misprints.

    theorem_4: ‖P̂P - I‖∞, with one of its two corrections alone too; `squared`: of P̂P̂, the product that is printed.
    lemma_5: ‖ℒy - 𝒫⁻¹𝒵y‖∞; `x-index`: with X_j of another delay for the X(s) that is printed without an index.
    printed: without the factors of τ_K. quadrature: of K_i, against twice the points. present_only: with Q_i = 0 and
    Z_3i = Z_4i = Z_5ij = Z_6i = Z_7ij = 0, all gains of Lemma 5 but L_0 and L_2i, and L_0 - P⁻¹Z_0; `injected` with
    Q_i as drawn. least: the least eigenvalue of all operators. jump: how far each takes constants out of X.
    """
    rng = np.random.default_rng(seed)
    cases = [_case(rng) for _ in range(trials)]
    parts = cases[0][1]
    return {"trials": trials, "points": POINTS, "least": min(least for least, _ in cases)} | {
        part: summaries([residuals[part] for _, residuals in cases]) for part in parts
    }


def _case(rng: np.random.Generator) -> tuple[float, dict[str, dict[str, float]]]:
    """The least eigenvalue of a random operator, and the residuals by part and name."""
    case, lemma_5 = _coercive(rng), {}
    eye = np.eye(case["operator"].shape[0])
    inverses = {"printed": _inverse(case, False, False), "corrected": _inverse(case, True, True)}
    for reading, inverse in inverses.items():
        state = rng.bit_generator.state
        lemma_5[reading] = _lemma_5(case, inverse, rng, reading == "corrected")
    rng.bit_generator.state = state
    lemma_5["x-index"] = _lemma_5(case, inverse, rng, True, other=True)
    inverses |= {name: _inverse(case, *factors) for name, factors in ALONE.items()}
    theorem_4 = {name: each["operator"] @ case["operator"] - eye for name, each in inverses.items()}
    z0, z2 = rng.standard_normal((N, 1)), rng.standard_normal((K, N, 1))
    alone = _inverse({**case, "h": np.zeros_like(case["h"])}, True, True)
    residuals = {
        "theorem_4": {**theorem_4, "squared": inverse["operator"] @ inverse["operator"] - eye},
        "lemma_5": lemma_5,
        "present_only": {
            "corrected": _history_gains(alone, z0, z2),
            "l0": alone["p"] @ z0 - np.linalg.solve(case["p"], z0),
            "injected": _history_gains(inverse, z0, z2),
        },
        "quadrature": {"corrected": inverse["moment"] - _moment(case["slope"], 2 * POINTS)},
        "jump": {"constants": _jump(case)},
    }
    sizes = {part: {name: float(np.abs(r).max()) for name, r in each.items()} for part, each in residuals.items()}
    return case["least"], sizes


def _jump(case: dict[str, Any]) -> Array:
    """(𝒫x)_i(0) less the first entry of 𝒫x for constant x, which lies in X: zero if 𝒫 maps X into X."""
    means = [np.einsum("t,twi->wi", NODES[i][1], Z[i]) for i in EACH]
    head = case["p"] + sum(case["h"][:, PART[i]] @ means[i] for i in EACH)
    tails = [LAST * (case["h"][:, PART[i]][:, :N].T + _multiplier(case["slope"][i], np.zeros(1))[0]) for i in EACH]
    tails = [
        tail + sum(case["gamma"][PART[i], PART[j]][:N] @ means[j] for j in EACH)
        for i, tail in zip(EACH, tails, strict=True)
    ]
    return np.array([tail - head for tail in tails])


def _history_gains(inverse: dict[str, Any], z0: Array, z2: Array) -> Array:
    """L_4i and L_5ij of Lemma 5 at the Gauss points where only Z_0 and Z_2i are not zero; L_3, L_6 and L_7 then are."""
    heads = np.concatenate([z0, *z2], axis=1)
    gains = [
        np.einsum("tij,twj,wq->tiq", inverse["s"][i], Z[i], inverse["h"][:, PART[i]].T @ heads).ravel() for i in EACH
    ]
    return np.concatenate(gains)


def _moment(slope: Array, count: int) -> Array:
    """K of Theorem 4, by a Gauss rule of `count` points on each [-τ_i, 0]."""
    moment = np.zeros((K * WIDTH, K * WIDTH))
    points, weights = np.polynomial.legendre.leggauss(count)
    for i in EACH:
        s = (points - 1.0) / 2.0 * DELAYS[i]
        z = np.kron(np.vander(s, DEGREE + 1, increasing=True)[:, :, None], np.eye(N))
        inverse = np.linalg.inv(_multiplier(slope[i], s))
        moment[PART[i], PART[i]] = np.einsum("t,twi,tij,tvj->wv", weights / 2.0 * DELAYS[i], z, inverse, z)
    return moment


def _multiplier(slope: Array, s: Array) -> Array:
    """S_i at the points s: symmetric, of degree one."""
    return np.asarray(2.0 * np.eye(N) + s[:, None, None] * (slope + slope.T))


def _coercive(rng: np.random.Generator) -> dict[str, Any]:
    """An operator (8) with Q_i = H_iZ, R_ij = ZᵀΓ_ijZ, and its matrix on the Gauss points.

    S_i is at least the identity on [-τ_i, 0]; Q and R are halved until the operator is coercive.
    """
    root = rng.standard_normal((N, N))
    p = 3.0 * np.eye(N) + 0.1 * (root + root.T)
    h = rng.standard_normal((N, K * WIDTH))
    g = rng.standard_normal((K * WIDTH, K * WIDTH))
    gamma = 0.5 * (g + g.T)
    slope = rng.standard_normal((K, N, N))
    slope /= 2.0 * LAST * np.linalg.norm(slope, 2, axis=(1, 2))[:, None, None]
    s = [_multiplier(slope[i], points) for i, (points, _) in enumerate(NODES)]
    while (least := _least_eigenvalue(operator := _matrix(p, h, s, gamma))) < COERCIVE:
        h, gamma = h / 2.0, gamma / 2.0
    return {"p": p, "h": h, "gamma": gamma, "s": s, "slope": slope, "operator": operator, "least": least}


def _least_eigenvalue(operator: Array) -> float:
    """Of (8), in the inner product of Sec. IV: ⟨x, 𝒫x⟩ is at least this times ‖x‖²."""
    weights = np.sqrt(np.concatenate([np.full(N, LAST), *(np.repeat(pair[1], N) for pair in NODES)]))
    return float(np.linalg.eigvalsh(operator * weights[:, None] / weights)[0])


def _matrix(p: Array, h: Array, s: list[Array], gamma: Array, right: list[Array] | None = None) -> Array:
    """Matrix of (8) on (x; values at the Gauss points), weights in the columns; `right` multiplies Z (for Ŝ)."""
    z = Z if right is None else [np.einsum("twi,tij->twj", Z[i], right[i]) for i in EACH]
    size = N + K * N * POINTS
    out = np.zeros((size, size))
    out[:N, :N] = p
    for i in EACH:
        rows = slice(N + i * N * POINTS, N + (i + 1) * N * POINTS)
        q = np.einsum("mw,twi->mti", h[:, PART[i]], z[i])
        out[:N, rows] = (q * NODES[i][1][None, :, None]).reshape(N, -1)
        out[rows, :N] = LAST * np.einsum("mti->tim", q).reshape(-1, N)
        out[rows, rows] += LAST * scipy.linalg.block_diag(*s[i])
        for j in EACH:
            columns = slice(N + j * N * POINTS, N + (j + 1) * N * POINTS)
            kernel = np.einsum("twi,wv,uvj,u->tiuj", z[i], gamma[PART[i], PART[j]], z[j], NODES[j][1])
            out[rows, columns] += kernel.reshape(N * POINTS, N * POINTS)
    return out


def _inverse(case: dict[str, Any], divided: bool, squared: bool) -> dict[str, Any]:
    """Theorem 4, as printed or corrected; divided: Γ/τ_K in its formulas; squared: Ŝ/τ_K² in its result."""
    s_hat, moment = [np.linalg.inv(value) for value in case["s"]], _moment(case["slope"], POINTS)
    gamma = case["gamma"] / LAST if divided else case["gamma"]
    h, eye, p_inv = case["h"], np.eye(K * WIDTH), np.linalg.inv(case["p"])
    h_hat = p_inv @ h @ np.linalg.inv(moment @ h.T @ p_inv @ h - eye - moment @ gamma)
    gamma_hat = -(h_hat.T @ h + gamma) @ np.linalg.inv(eye + moment @ gamma)
    p_hat = (np.eye(N) - h_hat @ moment @ h.T) @ p_inv
    scale = LAST**2 if squared else LAST
    operator = _matrix(p_hat, h_hat / LAST, [value / scale for value in s_hat], gamma_hat / LAST, s_hat)
    return {"p": p_hat, "h": h_hat, "gamma": gamma_hat, "s": s_hat, "moment": moment, "operator": operator}


def _lemma_5(
    case: dict[str, Any], inverse: dict[str, Any], rng: np.random.Generator, corrected: bool, other: bool = False
) -> Array:
    """ℒy by Lemma 5 less P⁻¹𝒵y, for random 𝒵 and y; P⁻¹ numerically. other: X_j of another delay in L_6i."""
    q = 1
    z0, z2 = rng.standard_normal((N, q)), rng.standard_normal((K, N, q))
    z3 = rng.standard_normal((K, N, WIDTH // N * q))  # Z_3i(θ) = z3_i (Z(θ)⊗I_q)
    w4, w6 = rng.standard_normal((K, WIDTH, q)), rng.standard_normal((K, WIDTH, q))
    w5, w7 = rng.standard_normal((K, K, WIDTH, q)), rng.standard_normal((K, K, WIDTH, WIDTH // N * q))
    y0, ends = rng.standard_normal(q), rng.standard_normal((K, q))
    basis = [np.vander(points, WIDTH // N, increasing=True) for points, _ in NODES]
    y = [rng.standard_normal((POINTS, q)) for _ in EACH]
    weights = [pair[1] for pair in NODES]
    tested = [np.einsum("t,td,tq->dq", weights[j], basis[j], y[j]).ravel() for j in EACH]  # ∫Z(θ)y_j
    injected = [
        w4[i] @ y0 + sum(w5[i, j] @ ends[j] for j in EACH) + sum(w7[i, j] @ tested[j] for j in EACH) for i in EACH
    ]
    local = [np.einsum("wq,tq->tw", w6[i], y[i]) for i in EACH]
    head = z0 @ y0 + sum(z2[j] @ ends[j] + z3[j] @ tested[j] for j in EACH)
    factor = LAST if corrected else 1.0
    tails = [factor * np.einsum("twi,tw->ti", Z[i], injected[i] + local[i]) for i in EACH]
    exact = np.linalg.solve(case["operator"], np.concatenate([head, *[tail.ravel() for tail in tails]]))
    v = [np.einsum("twi,tij,tvj->twv", Z[i], inverse["s"][i], Z[i]) for i in EACH]
    pulled = [
        inverse["moment"][PART[i], PART[i]] @ injected[i] + np.einsum("t,twv,tv->w", weights[i], v[i], local[i])
        for i in EACH
    ]
    result = [inverse["p"] @ head + sum(inverse["h"][:, PART[i]] @ pulled[i] for i in EACH)]
    for i in EACH:
        inside = inverse["h"][:, PART[i]].T @ head + injected[i]
        inside = inside + sum(inverse["gamma"][PART[i], PART[j]] @ pulled[j] for j in EACH)
        x = np.einsum("tij,twj->tiw", inverse["s"][i], Z[i])
        shift = np.linalg.inv(_multiplier(case["slope"][i - 1], NODES[i][0])) if other else inverse["s"][i]
        sixth = np.einsum("tij,twj->tiw", shift, Z[i])
        result.append((np.einsum("tiw,w->ti", x, inside) + np.einsum("tiw,tw->ti", sixth, local[i])).ravel())
    return np.asarray(np.concatenate(result) - exact)
