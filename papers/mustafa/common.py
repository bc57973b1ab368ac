"""The common plant under irregular sampling, and how far levels move with the rounding of printed inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from replication.audit.judge.printed import Parameters, spread
from replication.estimation import nonuniform
from replication.estimation.nonuniform.filters import Filter, periodic_gain
from replication.estimation.nonuniform.nominal import closed_form, riccati_level
from replication.estimation.nonuniform.plant import SampledPlant

IRREGULAR = (
    "irregular, not optimal: gaps of 1 to m steps between measurements, our design by (10) with one Lyapunov "
    "function, not by Algorithm 1"
)


def levels(plant: dict[str, Any], multiples: list[int], leaves: int, horizon: int) -> list[list[float]]:
    """Bracket of the gain of the robust design over all sequences of periods in [h, m h], for each multiple m."""
    A, B, C = (np.array(plant[name]) for name in "ABC")
    system = nonuniform.SampledPlant(A, np.hstack([B, 0 * B]), C, np.array([[0.0, plant["noise"]]]), C)
    h, brackets = plant["h"], []
    for m in multiples:
        if m == 1:
            brackets.append([riccati_level(system, h).level] * 2)
        else:
            found = nonuniform.design(system, periods=(h, m * h), leaves=leaves, horizon=horizon).bracket
            brackets.append([found.lower, found.upper])
    return brackets


# Sensitivity of the nominal levels to printed parameters within their rounding


def nominal_level(prints: Mapping[str, str], h_u: float, claim: str) -> dict[str, Any]:
    """The nominal optimum at the middle of [h_l, h_u]; prints: A, B, C, D, L and h_l."""

    def compute(numbers: Parameters) -> dict[str, float]:
        plant = SampledPlant(*(np.atleast_2d(numbers[name]) for name in "ABCDL"))
        return {claim: closed_form(plant, (numbers["h_l"] + h_u) / 2)}

    return spread(prints, compute)


def filter_norm(prints: Mapping[str, str], plant: dict[str, Any], claim: str) -> dict[str, Any]:
    """The norm of the printed filter at the printed period; prints: A_f, B_f, C_f and h."""
    sampled = SampledPlant(*(np.array(plant[name]) for name in "ABCDL"))

    def compute(numbers: Parameters) -> dict[str, float]:
        printed = Filter(*(np.array(numbers[name]) for name in ("A_f", "B_f", "C_f")))
        return {claim: periodic_gain(sampled, printed, [numbers["h"]]).value}

    return spread(prints, compute)
