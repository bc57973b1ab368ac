"""The common plant with a slow sensor in a loop, and how far Table I moves with the rounding of inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from papers.shao.method.motor import Motor
from papers.shao.printed import APO, DATA, PARAMETERS, RESTARTED, literal_loop
from replication.audit.judge.printed import Parameters, spread
from replication.errors import InfeasibleError
from replication.estimation import dualrate
from replication.estimation.dualrate.problem import dual_rate_design
from replication.estimation.dualrate.response import tracking_error_ratio

COLUMNS = {
    APO: "in a loop, every m-th instant, predictor as printed",
    RESTARTED: "in a loop, every m-th instant, restarted predictor",
}


def levels(plant: dict[str, Any], multiples: list[int]) -> dict[str, list[float | None]]:
    """Noise to output of the linear-quadratic loop with each predictor and ratio m; None where it is unstable."""
    model = dualrate.make_plant(plant["A"], plant["B"], plant["C"])
    return {name: [_noise(model, plant, name, m) for m in multiples] for name in COLUMNS}


def _noise(model: Any, plant: dict[str, Any], observer: str, ratio: int) -> float | None:
    try:
        found = dualrate.design(
            model, period=plant["h"], ratio=ratio, observer=observer, sensor_noise=[[plant["noise"] ** 2]]
        )
    except InfeasibleError:
        return None
    return float(found.fact("noise to output").value)


PRINTS = {
    **{name: DATA[name] for name in PARAMETERS},
    "K": f"[{' '.join(DATA['feedback'])}]",
    "L": f"[{'; '.join(DATA['injection'])}]",
}
"""What Table I was computed from, as printed; T and M are settings, exact as printed."""


def table(
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
