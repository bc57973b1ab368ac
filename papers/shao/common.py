"""A slow sensor in a loop around the common plant: from sensor noise to position, by the exact dual-rate analysis."""

from __future__ import annotations

from typing import Any

from papers._common import MULTIPLES
from papers.shao.problem import APO, RESTARTED
from replication.audit.model import Results
from replication.audit.parts import CommonLevel
from replication.errors import InfeasibleError
from replication.estimation import dualrate

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


def common(results: Results) -> tuple[CommonLevel, ...]:
    """The rows of the report; an unstable loop has none."""
    return tuple(
        CommonLevel(sensor=sensor, multiple=m, lower=value, upper=value, measure="noise to position in closed loop")
        for name, sensor in COLUMNS.items()
        for m, value in zip(MULTIPLES, results["common"][name], strict=True)
        if value is not None
    )
