"""From JSON values to an estimation problem: what all experiments of the paper start from."""

from __future__ import annotations

from typing import Any

import numpy as np

from replication.estimation.linear.norms import GainBracket
from replication.estimation.multirate.optimum import Optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule

Json = dict[str, Any]
Matrix = list[list[float]]


def build(plant: dict[str, Matrix], periods: list[int], offsets: list[int], sensors: list[int]) -> MultirateProblem:
    """The problem of `plant` seen by some of its sensors; noise of sensors that are left out is left out too."""
    C, D = np.array(plant["C"])[sensors], np.array(plant["D"])[np.ix_(sensors, sensors)]
    system = MultiratePlant(A=np.array(plant["A"]), B_d=np.array(plant["B_d"]), C=C, D=D)
    return MultirateProblem(system, SensingSchedule(tuple(periods), tuple(offsets)))


def optimum_json(best: Optimum) -> Json:
    """The optimum with its bracket and the non-causal bound."""
    return {
        "optimum": best.value,
        "lower": best.lower,
        "upper": best.upper,
        "limited_by": best.limited_by,
        "noncausal": bracket_json(best.noncausal),
    }


def bracket_json(gain: GainBracket) -> Json:
    """A gain with its bracket and the angle of the peak."""
    return {"value": gain.value, "lower": gain.lower, "upper": gain.upper, "angle": gain.angle}
