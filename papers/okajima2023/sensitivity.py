"""How far the optimal levels move while printed entries of the plant move within their rounding."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from papers.okajima2023.problem import Json, build
from replication.audit.judge.perturb import Parameters, spread
from replication.estimation.multirate.optimum import optimum


def levels(plant: Mapping[str, str], designs: list[dict[str, Any]]) -> Json:
    """The optimum of each of `designs` (periods, offsets, sensors, ids of its claims), as `spread` returns it."""

    def compute(parameters: Parameters) -> dict[str, float]:
        numbers = dict(parameters)
        return {
            claim: value
            for entry in designs
            for value in (optimum(build(numbers, entry["periods"], entry["offsets"], entry["sensors"])).value,)
            for claim in entry["claims"]
        }

    return spread(plant, compute)
