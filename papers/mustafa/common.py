"""An irregular sensor on the common plant: what a filter guarantees that does not know the next sampling period."""

from __future__ import annotations

from typing import Any

import numpy as np

from replication.audit.model import CommonLevel
from replication.estimation.nonuniform.exchange import robust_design
from replication.estimation.nonuniform.nominal import riccati_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant

IRREGULAR = "irregular: after 1 to m instants"
LARGEST = 4
"""The largest multiple tried: beyond, a fixed filter promises next to nothing here."""


def levels(plant: dict[str, Any], multiples: list[int], horizon: int, leaves: int) -> dict[str, Any]:
    """Bracket of the gain of the robust design over all sequences of periods in [h, m h], for each multiple m."""
    A, B, C = (np.array(plant[name]) for name in "ABC")
    system = SampledPlant(A, np.hstack([B, 0 * B]), C, np.array([[0.0, plant["noise"]]]), C)
    h = plant["h"]
    brackets = []
    for m in multiples:
        if m == 1:
            level = riccati_level(system, h).level
            brackets.append([level, level])
        else:
            brackets.append(_robust(system, PeriodRange(h, m * h), horizon, leaves))
    return {"irregular": brackets}
