"""Experiment on the steps of the stability proof: inequalities (12) to (14) for random loops, exact in time."""

from __future__ import annotations

from typing import Any

import numpy as np

from papers.shao.method.lyapunov import theorem_constants
from replication.errors import InfeasibleError
from replication.estimation.dualrate.problem import DualRateDesign, make_plant
from replication.estimation.dualrate.sampled import held
from replication.estimation.validation import Array

POINTS = 40
"""Times looked at within a fast period."""


def step_bounds(trials: int, seed: int) -> dict[str, Any]:
    """Largest left over right side of (12), (13), (14) over `trials` random loops with Hurwitz A + B K and A − L C.

    Order two; T between 1 ms and 1 s; random x, ζ and prediction error e_p at t_k.
    """
    rng = np.random.default_rng(seed)
    worst = {"12": 0.0, "13": 0.0, "14": 0.0}
    done = 0
    while done < trials:
        design = _random_design(rng)
        try:
            constants = theorem_constants(design)
        except InfeasibleError:  # not Hurwitz: the theorem does not speak of it
            continue
        done += 1
        start, error = rng.normal(size=4), rng.normal(size=1)
        found = _ratios(design, constants.P, constants.alpha, start, error)
        worst = {name: max(worst[name], found[name]) for name in worst}
    return {"trials": trials, "worst": worst}


def _random_design(rng: np.random.Generator) -> DualRateDesign:
    plant = make_plant(rng.normal(size=(2, 2)), rng.normal(size=(2, 1)), rng.normal(size=(1, 2)))
    gains = 2 * rng.normal(size=(1, 2)), 2 * rng.normal(size=(2, 1))
    return DualRateDesign(plant, *gains, period=float(10 ** rng.uniform(-3, 0)), ratio=2)


def _ratios(
    design: DualRateDesign, P: Array, alpha: tuple[float, float, float, float], start: Array, error: Array
) -> dict[str, float]:
    """Left over right side, the largest over the times of one fast period, from (x, ζ) at t_k and e_p(t_k)."""
    A, B, C = design.model.state, design.model.input, design.model.output
    K, L = design.feedback, design.injection
    n = len(A)
    zero = np.zeros_like(A)
    joint = np.block([[A, zero], [zero, A - L @ C]])
    u = K @ start[n:]
    drive = np.concatenate([B @ u, B @ u + L @ (C @ start[:n] + error)])
    width = design.period / POINTS
    step = held(joint, drive[:, None], width)
    states = [start]
    for _ in range(POINTS):
        states.append(step.state @ states[-1] + step.input[:, 0])
    z = np.array(states)
    x, zeta = z[:, :n], z[:, n:]
    chi = np.hstack([x, x - zeta])
    root_v = np.sqrt(np.sum(chi @ P * chi, axis=1))
    root = np.sqrt(np.linalg.eigvalsh(P)[0])
    rate = np.abs(x @ (C @ A).T + C @ B @ u)[:, 0]
    bound12 = (_norm(C @ A) * root_v + 2 * _norm(C @ B @ K) * root_v[0]) / root
    # The largest V so far on the grid is below the true one, which makes the test stricter.
    moved = np.maximum.accumulate(root_v)[1:] * width * np.arange(1, POINTS + 1)
    change_y = np.abs((x[1:] - x[0]) @ C.T)[:, 0]
    change_u = np.abs((zeta[1:] - zeta[0]) @ K.T)[:, 0]
    bound14 = alpha[1] * moved + _norm(K @ L) * np.abs(error[0])
    return {
        "12": float(np.max(rate / bound12)),
        "13": float(np.max(change_y / (alpha[0] * moved))),
        "14": float(np.max(change_u / bound14)),
    }


def _norm(matrix: Array) -> float:
    return float(np.linalg.norm(matrix, 2))
