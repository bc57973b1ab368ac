"""Experiments on the motor: its model, gains and feedforward, and the eigenvalues of its loop against the period."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from papers.shao.experiments.theorem import hurwitz_margins, slow_eigenvalues
from papers.shao.method.motor import Feedforward, Motor, feedforward
from papers.shao.printed import APO, DATA, DESIGN, FAST, MOTOR, PARAMETERS, PMI, RESTARTED, literal_loop
from replication.audit.judge.printed import Parameters, spread
from replication.errors import InfeasibleError
from replication.estimation import dualrate
from replication.estimation.dualrate.loop import tracking_error_ratio
from replication.estimation.dualrate.problem import dual_rate_design


def motor_model(seed: int) -> dict[str, Any]:
    """(23) against A and B in position coordinates; Hurwitz margins; what the feedforwards leave of the inverse.

    transfer_gap: largest relative difference of the two transfer functions at random points, which draw from `seed`.
    inverse_gap: |P(jσ) ȳ_d/y_d − 1| for each feedforward over the frequencies of Table I, at its largest.
    equation_gap: residual of (9) against (10) at random states; case_gap: of Case 2, with ȳ(t_k) = y(t_k) in (9), and
    (10) without its last term.
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
        "case_gap": _equation_gap(rng, measured=True),
        "slow_period": DESIGN.slow_period,
    }


def motor_eigenvalues(periods: Sequence[float]) -> dict[str, Any]:
    """Moduli of the 2n largest eigenvalues of the motor's monodromy matrix against T at the printed M, decreasing."""
    designs = [replace(DESIGN, period=period) for period in periods]
    moduli = {
        name: [np.abs(slow_eigenvalues(design, name)).tolist() for design in designs]
        for name in (PMI, APO, RESTARTED, FAST)
    }
    return {"periods": list(periods), "moduli": moduli}


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
    return complex((model.C @ np.linalg.solve(s * np.eye(3) - model.A, model.B_u))[0, 0])


def _equation_gap(rng: np.random.Generator, *, measured: bool = False) -> float:
    """(9) minus (10) for random x, ξ, ζ(t_k), y(t_k) and y_p(t_k), relative to the size of (9).

    measured: Case 2, with y(t_k) for ȳ(t_k) in (9), and (10) without its last term.
    """
    A, B, C = DESIGN.model.A, DESIGN.model.B_u, DESIGN.model.C
    K, L = DESIGN.feedback, DESIGN.injection
    x, xi, held = (rng.normal(size=3) for _ in range(3))
    measured_output, predicted = rng.normal(size=1), rng.normal(size=1)
    zeta, last = x - xi, predicted - measured_output
    if measured:
        predicted, last = measured_output, 0 * last
    first = np.concatenate([A @ x + B @ (K @ held), A @ xi - L @ (predicted - C @ zeta)])
    joint = np.block([[A + B @ K, -B @ K], [np.zeros((3, 3)), A - L @ C]])
    extra = np.concatenate([B @ (K @ (held - zeta)), -L @ (measured_output - C @ x) - L @ last])
    second = joint @ np.concatenate([x, xi]) + extra
    return float(np.linalg.norm(first - second) / np.linalg.norm(first))


# The common plant with a slow sensor in a loop, and how far Table I moves with the rounding of inputs


PREDICTORS = {
    APO: "in a loop, every m-th instant, predictor as printed",
    RESTARTED: "in a loop, every m-th instant, restarted predictor",
}


def on_common_plant(plant: dict[str, Any], multiples: list[int]) -> dict[str, list[float | None]]:
    """Noise to output of the linear-quadratic loop with each predictor and ratio m; None where it is unstable."""
    model = dualrate.make_plant(plant["A"], plant["B"], plant["C"])
    return {name: [_noise(model, plant, name, m) for m in multiples] for name in PREDICTORS}


def _noise(model: Any, plant: dict[str, Any], observer: str, ratio: int) -> float | None:
    try:
        result = dualrate.design(
            model, period=plant["h"], ratio=ratio, observer=observer, sensor_noise=[[plant["noise"] ** 2]]
        )
    except InfeasibleError:
        return None
    return float(result.fact("noise to output").value)


PRINTS = {
    **{name: DATA[name] for name in PARAMETERS},
    "K": f"[{' '.join(DATA['feedback'])}]",
    "L": f"[{'; '.join(DATA['injection'])}]",
}
"""What Table I was computed from, as printed; T and M are settings, exact as printed."""


def sensitivity(
    prints: Mapping[str, str], pole_pairs: int, period: float, ratio: int, cells: list[dict[str, Any]]
) -> dict[str, Any]:
    """Percent errors of `cells` (observer, frequency, claim); prints: the motor's parameters, K and L."""

    def compute(numbers: Parameters) -> dict[str, float]:
        motor = Motor(pole_pairs=pole_pairs, **{name: numbers[name] for name in PARAMETERS})
        gains = {"feedback": numbers["K"], "injection": numbers["L"]}
        design = dual_rate_design(motor.system(), **gains, period=period, ratio=ratio)
        loops = {cell["claim"]: literal_loop(cell["observer"], cell["frequency"], design, motor) for cell in cells}
        return {claim: 100 * tracking_error_ratio(loop) for claim, loop in loops.items()}

    return spread(prints, compute)
