"""How far the nominal levels move while printed parameters move within their rounding."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from replication.audit.judge.printed import Parameters, spread
from replication.estimation.nonuniform.filters import Filter, periodic_gain
from replication.estimation.nonuniform.nominal import closed_form
from replication.estimation.nonuniform.plant import SampledPlant


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
