"""How far the levels by LMI (3) on Padé models move while printed parameters move within their rounding."""

from __future__ import annotations

from typing import Any

from replication.audit.judge.perturb import Parameters, spread
from replication.estimation.delay.lmi import riccati_gain
from replication.estimation.delay.models import pade_model
from replication.estimation.delay.system import delay_system

Matrix = list[list[float]]


def pade_level(plant: dict[str, Any], order: int, claim: str) -> dict[str, Any]:
    """The Riccati gain of the Padé model of `plant`; moved are A_0, A_i and the delays."""
    delays = {f"tau_{i + 1}": f"{tau:g}" for i, tau in enumerate(plant["delays"])}
    blocks = {f"A_{i}": _printed(block) for i, block in enumerate([plant["a0"], *plant["a"]])}

    def compute(numbers: Parameters) -> dict[str, float]:
        a0, *delayed = (numbers[name] for name in blocks)
        taus = [numbers[name] for name in delays]
        moved = delay_system(a0, delayed, taus, plant["b"], plant["c10"], plant["c2"])
        return {claim: float(riccati_gain(pade_model(moved, order)))}

    return spread({**blocks, **delays}, compute)


def _printed(block: Matrix) -> str:
    """A matrix as it is printed: whole numbers without a point."""
    return "[" + "; ".join(" ".join(f"{entry:g}" for entry in row) for row in block) + "]"
