"""LMI (3), and with it Theorem 1, in finite dimensions: X = Z = R^n, all operators matrices, with D; and how far levels
by it on Padé models move with their parameters.

For random plants a P and a Z near the best are found without a solver, by a Riccati equation. The least γ at which
(3) holds for them is then compared with the gain of the error dynamics (6), computed by the Hamiltonian test.
"""

from typing import Any

import numpy as np
import scipy

from papers.peet2019.method import pade_model, riccati_gain
from replication.audit.judge.numerals import layout
from replication.audit.judge.printed import Parameters, spread
from replication.estimation.delay.plant import delay_system
from replication.estimation.linear.norms import continuous_norm
from replication.estimation.validation import Array

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
    ratios, storage, form, reverse = [], [], [], 0
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
        storage.append(float(np.linalg.eigvalsh(p)[0]))
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
        "storage": min(storage),
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


def pade_level(plant: dict[str, Any], order: int, claim: str) -> dict[str, Any]:
    """The Riccati gain of the Padé model of `plant`; moved are A_0, A_i and the delays."""
    delays = {f"tau_{i + 1}": f"{tau:g}" for i, tau in enumerate(plant["delays"])}
    blocks = {
        f"A_{i}": layout(tuple(map(tuple, block)), "{:g}".format) for i, block in enumerate([plant["a0"], *plant["a"]])
    }

    def compute(numbers: Parameters) -> dict[str, float]:
        a0, *delayed = (numbers[name] for name in blocks)
        taus = [numbers[name] for name in delays]
        moved = delay_system(a0, delayed, taus, plant["b"], plant["c10"], plant["c2"])
        return {claim: float(riccati_gain(pade_model(moved, order)))}

    return spread({**blocks, **delays}, compute)
