"""Theorem 4 and Lemma 5 on random coercive operators, in the paper's own units, as printed and as corrected.

Functions are values at Gauss points of [-τ_i, 0]: an operator (8) is then a matrix, and its inverse that of a matrix.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from papers.peet2019.experiments.identities import DELAYS, POINTS, Array, gauss_nodes


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
    return {
        part: {
            reading: {"largest": max(values), "median": float(np.median(values))} for reading, values in sets.items()
        }
        for part, sets in found.items()
    }


def _coercive(rng: np.random.Generator, n: int = 2, degree: int = 1) -> dict[str, Any]:
    """A coercive operator (8) with Q_i = H_iZ, R_ij = ZᵀΓ_ijZ, Z = (1, s, ..)⊗I, and its matrix on the Gauss points."""
    nodes = [gauss_nodes(delay) for delay in DELAYS]
    k, width = len(DELAYS), n * (degree + 1)
    z = [np.vander(points, degree + 1, increasing=True)[:, :, None, None] * np.eye(n) for points, _ in nodes]
    z = [value.reshape(POINTS, width, n) for value in z]
    root = rng.standard_normal((n, n))
    p = 3.0 * np.eye(n) + 0.1 * (root + root.T)
    h = 0.2 * rng.standard_normal((n, k * width))
    g = rng.standard_normal((k * width, k * width))
    gamma = 0.1 * (g + g.T)
    slope = 0.2 * rng.standard_normal((k, n, n))
    s = [2.0 * np.eye(n) + points[:, None, None] * (slope[i] + slope[i].T) for i, (points, _) in enumerate(nodes)]
    case = {"nodes": nodes, "z": z, "p": p, "h": h, "gamma": gamma, "s": s, "n": n, "width": width}
    return {**case, "operator": _matrix(case, p, h, s, gamma)}


def _matrix(
    case: dict[str, Any], p: Array, h: Array, s: list[Array], gamma: Array, right: list[Array] | None = None
) -> Array:
    """Matrix of (8) on (x; values at the Gauss points), weights in the columns; `right` multiplies Z (for Ŝ)."""
    n, width, k, last = case["n"], case["width"], len(DELAYS), DELAYS[-1]
    z = case["z"] if right is None else [np.einsum("twi,tij->twj", case["z"][i], right[i]) for i in range(k)]
    size = n + k * n * POINTS
    out = np.zeros((size, size))
    out[:n, :n] = p
    for i in range(k):
        rows = slice(n + i * n * POINTS, n + (i + 1) * n * POINTS)
        hi = h[:, i * width : (i + 1) * width]
        q = np.einsum("mw,twi->mti", hi, z[i])
        out[:n, rows] = (q * case["nodes"][i][1][None, :, None]).reshape(n, -1)
        out[rows, :n] = last * np.einsum("mti->tim", q).reshape(-1, n)
        for t in range(POINTS):
            at = slice(rows.start + t * n, rows.start + (t + 1) * n)
            out[at, at] += last * s[i][t]
        for j in range(k):
            columns = slice(n + j * n * POINTS, n + (j + 1) * n * POINTS)
            block = gamma[i * width : (i + 1) * width, j * width : (j + 1) * width]
            kernel = np.einsum("twi,wv,uvj,u->tiuj", z[i], block, z[j], case["nodes"][j][1])
            out[rows, columns] += kernel.reshape(n * POINTS, n * POINTS)
    return out


def _inverse(case: dict[str, Any], corrected: bool) -> dict[str, Any]:
    """Theorem 4: as printed, or with Γ/τ_K in its formulas and Ŝ/τ_K² in its result."""
    k, width, last = len(DELAYS), case["width"], DELAYS[-1]
    s_hat = [np.linalg.inv(value) for value in case["s"]]
    moment = np.zeros((k * width, k * width))
    for i in range(k):
        part = slice(i * width, (i + 1) * width)
        z = case["z"][i]
        moment[part, part] = np.einsum("t,twi,tij,tvj->wv", case["nodes"][i][1], z, s_hat[i], z)
    gamma = case["gamma"] / last if corrected else case["gamma"]
    h, eye, p_inv = case["h"], np.eye(k * width), np.linalg.inv(case["p"])
    h_hat = p_inv @ h @ np.linalg.inv(moment @ h.T @ p_inv @ h - eye - moment @ gamma)
    gamma_hat = -(h_hat.T @ h + gamma) @ np.linalg.inv(eye + moment @ gamma)
    p_hat = (np.eye(case["n"]) - h_hat @ moment @ h.T) @ p_inv
    scale = last**2 if corrected else last
    operator = _matrix(case, p_hat, h_hat / last, [value / scale for value in s_hat], gamma_hat / last, s_hat)
    return {"p": p_hat, "h": h_hat, "gamma": gamma_hat, "s": s_hat, "moment": moment, "operator": operator}


def _lemma_5(case: dict[str, Any], inverse: dict[str, Any], rng: np.random.Generator, corrected: bool) -> float:
    """Largest difference between ℒy by the formulas of Lemma 5 and P⁻¹𝒵y, for random 𝒵 and y; P⁻¹ numerically."""
    n, k, width, q, last = case["n"], len(DELAYS), case["width"], 1, DELAYS[-1]
    z0, z2 = rng.standard_normal((n, q)), rng.standard_normal((k, n, q))
    z3 = rng.standard_normal((k, n, width // n * q))  # Z_3i(θ) = z3_i (Z(θ)⊗I_q)
    w4, w6 = rng.standard_normal((k, width, q)), rng.standard_normal((k, width, q))
    w5, w7 = rng.standard_normal((k, k, width, q)), rng.standard_normal((k, k, width, width // n * q))
    y0, ends = rng.standard_normal(q), rng.standard_normal((k, q))
    basis = [np.vander(points, width // n, increasing=True) for points, _ in case["nodes"]]
    y = [rng.standard_normal((POINTS, q)) for _ in range(k)]
    weights = [pair[1] for pair in case["nodes"]]
    tested = [np.einsum("t,td,tq->dq", weights[j], basis[j], y[j]).ravel() for j in range(k)]  # ∫Z(θ)y_j
    injected = [
        w4[i] @ y0 + sum(w5[i, j] @ ends[j] for j in range(k)) + sum(w7[i, j] @ tested[j] for j in range(k))
        for i in range(k)
    ]
    local = [np.einsum("wq,tq->tw", w6[i], y[i]) for i in range(k)]
    head = z0 @ y0 + sum(z2[j] @ ends[j] + z3[j] @ tested[j] for j in range(k))
    factor = last if corrected else 1.0
    tails = [factor * np.einsum("twi,tw->ti", case["z"][i], injected[i] + local[i]) for i in range(k)]
    exact = np.linalg.solve(case["operator"], np.concatenate([head, *[tail.ravel() for tail in tails]]))
    part = [slice(i * width, (i + 1) * width) for i in range(k)]
    v = [np.einsum("twi,tij,tvj->twv", case["z"][i], inverse["s"][i], case["z"][i]) for i in range(k)]
    pulled = [
        inverse["moment"][part[i], part[i]] @ injected[i] + np.einsum("t,twv,tv->w", weights[i], v[i], local[i])
        for i in range(k)
    ]
    first = inverse["p"] @ head + sum(inverse["h"][:, part[i]] @ pulled[i] for i in range(k))
    result = [first]
    for i in range(k):
        inside = inverse["h"][:, part[i]].T @ head + injected[i]
        inside = inside + sum(inverse["gamma"][part[i], part[j]] @ pulled[j] for j in range(k))
        x = np.einsum("tij,twj->tiw", inverse["s"][i], case["z"][i])
        result.append((np.einsum("tiw,w->ti", x, inside) + np.einsum("tiw,tw->ti", x, local[i])).ravel())
    return float(np.abs(np.concatenate(result) - exact).max())
