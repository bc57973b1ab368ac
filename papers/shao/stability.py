"""Experiments on stability: the motor's model, the theorem and its counter-example, slow rates, stable sets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from papers.shao.method.lyapunov import (
    hurwitz_margins,
    prediction_gap,
    slow_rate_gap,
    slow_rates,
    theorem_constants,
)
from papers.shao.method.motor import Feedforward, feedforward
from papers.shao.method.sweeps import radii_over_ratios, stable_periods
from papers.shao.problem import APO, COUNTEREXAMPLE, DESIGN, FAST, MOTOR, PMI, REPAIRED
from replication.estimation.dualrate.loop import close_loop, monodromy, stability_radius
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign


def motor_model(seed: int) -> dict[str, Any]:
    """(23) against A and B in position coordinates; Hurwitz margins; what the feedforwards leave of the inverse.

    transfer_gap: largest relative difference of the two transfer functions at random points, which draw from `seed`.
    inverse_gap: |P(jσ) ȳ_d/y_d − 1| for each feedforward over the frequencies of Table I, at its largest.
    equation_gap: residual of (9) against (10) at random states.
    """
    rng = np.random.default_rng(seed)
    points = rng.normal(size=8) + 1j * rng.normal(size=8) * 100
    feedback, observer = hurwitz_margins(DESIGN)
    sigma = 1j * np.linspace(0.5, 3.0, 26)
    return {
        "torque_constant": 1.5 * MOTOR.pole_pairs * MOTOR.flux,
        "transfer_gap": float(max(abs(_physical(s) / _position(s) - 1) for s in points)),
        "feedback_margin": feedback,
        "observer_margin": observer,
        "inverse_gap": {
            form: float(max(abs(_position(s) * feedforward(MOTOR, s, form) - 1) for s in sigma)) for form in Feedforward
        },
        "equation_gap": _equation_gap(rng),
        "slow_period": DESIGN.slow_period,
    }


def theorem(periods: Sequence[float], ratios: Sequence[int]) -> dict[str, Any]:
    """Condition (18) for the motor, both sides of (15) at small T, the counter-example, and the slow rates.

    periods: decreasing T in s for the limits. ratios: M of the counter-example.
    """
    motor = theorem_constants(DESIGN)
    scalar = theorem_constants(COUNTEREXAMPLE)
    return {
        "motor": {"condition": motor.condition, "smallest": motor.smallest, "alpha4": motor.alpha[3]},
        "scalar": {
            "condition": scalar.condition,
            "period": COUNTEREXAMPLE.period,
            "allowed_period": COUNTEREXAMPLE.period / scalar.condition,
            "radii": {
                str(ratio): stability_radius(close_loop(replace(COUNTEREXAMPLE, ratio=ratio), OBSERVERS[APO]))
                for ratio in ratios
            },
        },
        "factor_margin": _factor_margin(),
        "periods": list(periods),
        "gap": {
            "motor": [prediction_gap(replace(DESIGN, period=T)) for T in periods],
            "scalar": [prediction_gap(replace(COUNTEREXAMPLE, period=T)) for T in periods],
        },
        "radius": {
            name: stability_radius(close_loop(COUNTEREXAMPLE, OBSERVERS[name])) for name in (APO, REPAIRED, FAST)
        },
        "rate_gap": {
            "printed": [slow_rate_gap(DESIGN, OBSERVERS[APO], period=T, share=1 / DESIGN.ratio) for T in periods],
            "printed_full_gain": [slow_rate_gap(DESIGN, OBSERVERS[APO], period=T, share=1) for T in periods],
            "repaired": [slow_rate_gap(DESIGN, OBSERVERS[REPAIRED], period=T, share=1) for T in periods],
        },
    }


def slowest_rates(periods: Sequence[float]) -> dict[str, Any]:
    """Largest real part of the loop's rates (1/s) of the counter-example against T, for (6), the repair, a sensor."""
    names = (APO, REPAIRED, FAST)
    rates = {name: [_slowest(replace(COUNTEREXAMPLE, period=T), name) for T in periods] for name in names}
    return {"periods": list(periods), "rates": rates}


def motor_eigenvalues(periods: Sequence[float]) -> dict[str, Any]:
    """Moduli of the 2n largest eigenvalues of the motor's monodromy matrix against T at the printed M, decreasing."""
    found = {name: [_moduli(replace(DESIGN, period=T), name) for T in periods] for name in (PMI, APO, REPAIRED, FAST)}
    return {"periods": list(periods), "moduli": found}


def stable_sets(ratios: Sequence[int], periods: Sequence[float], largest_ratio: int) -> dict[str, Any]:
    """Intervals of T (s) with a stable motor loop for each M; and the stable M at the printed T."""
    names = (PMI, APO, REPAIRED)
    sets: dict[str, Any] = {}
    for name in names:
        sets[name] = [
            [list(interval) for interval in stable_periods(replace(DESIGN, ratio=M), OBSERVERS[name], periods)]
            for M in ratios
        ]
    counts = list(range(1, largest_ratio + 1))
    radii = {name: radii_over_ratios(DESIGN, OBSERVERS[name], counts).tolist() for name in names}
    return {"ratios": list(ratios), "intervals": sets, "counts": counts, "radii": radii}


def _physical(s: complex) -> complex:
    """θ/u_q of (23) by solving its three equations for i_q, ω and θ."""
    m = MOTOR
    matrix = np.array(
        [
            [s + m.resistance / m.inductance, m.pole_pairs * m.flux / m.inductance, 0],
            [-m.torque_constant / m.inertia, s + m.friction / m.inertia, 0],
            [0, -1, s],
        ]
    )
    return complex(np.linalg.solve(matrix, [1 / m.inductance, 0, 0])[2])


def _position(s: complex) -> complex:
    """θ/u_q from the printed A, B and C."""
    model = DESIGN.model
    return complex((model.output @ np.linalg.solve(s * np.eye(3) - model.state, model.input))[0, 0])


def _equation_gap(rng: np.random.Generator) -> float:
    """(9) minus (10) for random x, ξ, ζ(t_k), y(t_k) and y_p(t_k), relative to the size of (9)."""
    A, B, C = DESIGN.model.state, DESIGN.model.input, DESIGN.model.output
    K, L = DESIGN.feedback, DESIGN.injection
    x, xi, held = (rng.normal(size=3) for _ in range(3))
    measured, predicted = rng.normal(size=1), rng.normal(size=1)
    zeta = x - xi
    first = np.concatenate([A @ x + B @ (K @ held), A @ xi - L @ (predicted - C @ zeta)])
    joint = np.block([[A + B @ K, -B @ K], [np.zeros((3, 3)), A - L @ C]])
    extra = np.concatenate([B @ (K @ (held - zeta)), -L @ (measured - C @ x) - L @ (predicted - measured)])
    second = joint @ np.concatenate([x, xi]) + extra
    return float(np.linalg.norm(first - second) / np.linalg.norm(first))


def _factor_margin() -> float:
    """Smallest 1 − φ of (22), relative to its size at α₄ = 0, where (18) is below one; it must be positive."""
    conditions = np.linspace(0.0, 1.0, 101)[:-1]
    decays = np.exp(-np.geomspace(1e-6, 10, 40))[:, None]
    return float(np.min((1 - (decays + (1 - decays) * conditions)) / (1 - decays)))


def _moduli(design: DualRateDesign, name: str) -> list[float]:
    values = np.abs(np.linalg.eigvals(monodromy(close_loop(design, OBSERVERS[name]))))
    return [float(value) for value in np.sort(values)[::-1][: 2 * design.model.size]]


def _slowest(design: DualRateDesign, name: str) -> float:
    return float(np.max(slow_rates(design, OBSERVERS[name]).real))
