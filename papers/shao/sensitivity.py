"""How far Table I moves, under its literal reading, while printed parameters move within their rounding."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from papers.shao.method.motor import Motor
from papers.shao.printed import DATA, PARAMETERS
from papers.shao.problem import literal_loop
from replication.audit.judge.printed import Parameters, spread
from replication.estimation.dualrate.problem import dual_rate_design
from replication.estimation.dualrate.response import tracking_error_ratio

PRINTS = {
    **{name: DATA[name] for name in PARAMETERS},
    "K": f"[{' '.join(DATA['feedback'])}]",
    "L": f"[{'; '.join(DATA['injection'])}]",
    "T": DATA["period"],
}
"""What Table I was computed from, as printed."""


def table(prints: Mapping[str, str], pole_pairs: int, ratio: int, cells: list[dict[str, Any]]) -> dict[str, Any]:
    """Percent errors of `cells` (observer, frequency, claim); prints: the motor's parameters, K, L and T."""

    def compute(numbers: Parameters) -> dict[str, float]:
        motor = Motor(pole_pairs=pole_pairs, **{name: numbers[name] for name in PARAMETERS})
        gains = {"feedback": numbers["K"], "injection": numbers["L"]}
        design = dual_rate_design(motor.system(), **gains, period=numbers["T"], ratio=ratio)
        loops = {cell["claim"]: literal_loop(cell["observer"], cell["frequency"], design, motor) for cell in cells}
        return {claim: 100 * tracking_error_ratio(loop) for claim, loop in loops.items()}

    return spread(prints, compute)
