"""Theorem 4 and Lemma 5 on random coercive operators, in the paper's own units, as printed and as corrected.

Functions are values at Gauss points of [-τ_i, 0]: an operator (8) is then a matrix, and its inverse that of a matrix.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from papers.peet2019.experiments.identities import EACH, LAST, NODES, POINTS, Array, K, summaries

N, DEGREE = 2, 1
WIDTH = N * (DEGREE + 1)
Z = [np.kron(np.vander(points, DEGREE + 1, increasing=True)[:, :, None], np.eye(N)) for points, _ in NODES]
"""Z(s) = (1, s, ..)⊗I at the Gauss points of each history."""
PART = [slice(i * WIDTH, (i + 1) * WIDTH) for i in EACH]
"""Rows of H_i and Γ_ij in H and Γ."""


def inverse_identities(trials: int, seed: int) -> dict[str, Any]:
    """Residuals of Theorem 4 (‖P̂P - I‖∞) and of Lemma 5 (‖ℒ - P̂𝒵‖∞), as printed and as corrected."""
    rng = np.random.default_rng(seed)
    found: dict[str, dict[str, list[float]]] = {
        part: {"printed": [], "corrected": []} for part in ("theorem_4", "lemma_5")
    }
    for _ in range(trials):
        case = _coercive(rng)
        for reading in ("printed", "corrected"):
            inverse = _inverse(case, reading == "corrected")
            eye = np.eye(case["operator"].shape[0])
            found["theorem_4"][reading].append(float(np.abs(inverse["operator"] @ case["operator"] - eye).max()))
            found["lemma_5"][reading].append(_lemma_5(case, inverse, rng, reading == "corrected"))
    return {part: summaries(residuals) for part, residuals in found.items()}


def _coercive(rng: np.random.Generator) -> dict[str, Any]:
    """A coercive operator (8) with Q_i = H_iZ, R_ij = ZᵀΓ_ijZ, and its matrix on the Gauss points."""
    root = rng.standard_normal((N, N))
    p = 3.0 * np.eye(N) + 0.1 * (root + root.T)
    h = 0.2 * rng.standard_normal((N, K * WIDTH))
    g = rng.standard_normal((K * WIDTH, K * WIDTH))
    gamma = 0.1 * (g + g.T)
    slope = 0.2 * rng.standard_normal((K, N, N))
    s = [2.0 * np.eye(N) + points[:, None, None] * (slope[i] + slope[i].T) for i, (points, _) in enumerate(NODES)]
    return {"p": p, "h": h, "gamma": gamma, "s": s, "operator": _matrix(p, h, s, gamma)}


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
        for t in range(POINTS):
            at = slice(rows.start + t * N, rows.start + (t + 1) * N)
            out[at, at] += LAST * s[i][t]
        for j in EACH:
            columns = slice(N + j * N * POINTS, N + (j + 1) * N * POINTS)
            kernel = np.einsum("twi,wv,uvj,u->tiuj", z[i], gamma[PART[i], PART[j]], z[j], NODES[j][1])
            out[rows, columns] += kernel.reshape(N * POINTS, N * POINTS)
    return out


def _inverse(case: dict[str, Any], corrected: bool) -> dict[str, Any]:
    """Theorem 4: as printed, or with Γ/τ_K in its formulas and Ŝ/τ_K² in its result."""
    s_hat = [np.linalg.inv(value) for value in case["s"]]
    moment = np.zeros((K * WIDTH, K * WIDTH))
    for i in EACH:
        moment[PART[i], PART[i]] = np.einsum("t,twi,tij,tvj->wv", NODES[i][1], Z[i], s_hat[i], Z[i])
    gamma = case["gamma"] / LAST if corrected else case["gamma"]
    h, eye, p_inv = case["h"], np.eye(K * WIDTH), np.linalg.inv(case["p"])
    h_hat = p_inv @ h @ np.linalg.inv(moment @ h.T @ p_inv @ h - eye - moment @ gamma)
    gamma_hat = -(h_hat.T @ h + gamma) @ np.linalg.inv(eye + moment @ gamma)
    p_hat = (np.eye(N) - h_hat @ moment @ h.T) @ p_inv
    scale = LAST**2 if corrected else LAST
    operator = _matrix(p_hat, h_hat / LAST, [value / scale for value in s_hat], gamma_hat / LAST, s_hat)
    return {"p": p_hat, "h": h_hat, "gamma": gamma_hat, "s": s_hat, "moment": moment, "operator": operator}


def _lemma_5(case: dict[str, Any], inverse: dict[str, Any], rng: np.random.Generator, corrected: bool) -> float:
    """Largest difference between ℒy by the formulas of Lemma 5 and P⁻¹𝒵y, for random 𝒵 and y; P⁻¹ numerically."""
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
        result.append((np.einsum("tiw,w->ti", x, inside) + np.einsum("tiw,tw->ti", x, local[i])).ravel())
    return float(np.abs(np.concatenate(result) - exact).max())
