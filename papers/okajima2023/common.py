"""A slow and a late sensor on the common plant: the optimum over all observers, by the multi-rate design."""

from __future__ import annotations

from typing import Any

import numpy as np

from replication.estimation.multirate.optimum import optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.nonuniform.plant import SampledPlant

SLOW = "slow: one measurement every m steps"
LATE = "late, in discrete time: each measurement arrives m − 1 steps late, modelled by added states"


def levels(plant: dict[str, Any], multiples: list[int]) -> dict[str, Any]:
    """Brackets of the least l2 gain from force and noise to the position's error, for each multiple m."""
    sampled = _sampled(plant)
    return {
        "slow": [_bracket(sampled, period) for period in multiples],
        "late": [_bracket(_delayed(sampled, m - 1), 1) for m in multiples],
    }


def _bracket(plant: MultiratePlant, period: int) -> list[float]:
    best = optimum(MultirateProblem(plant, SensingSchedule((period,))))
    return [best.lower, best.upper]


def _sampled(plant: dict[str, Any]) -> MultiratePlant:
    """The plant at the base period, the force held in between; the error of the position counts."""
    A, B, C = (np.array(plant[name]) for name in "ABC")
    held = SampledPlant(A, B, C, np.zeros((1, 1)), C)
    Phi, Gamma = held.discretise(plant["h"])
    return MultiratePlant(A=Phi, B_d=Gamma, C=C, D=np.array([[plant["noise"]]]), W=C)


def _delayed(plant: MultiratePlant, instants: int) -> MultiratePlant:
    """`plant` with a chain of states that hands each position over to the sensor after `instants`."""
    if instants == 0:
        return plant
    n = plant.order
    A = np.zeros((n + instants, n + instants))
    A[:n, :n] = plant.A
    A[n : n + 1, :n] = plant.C
    A[n + 1 :, n:-1] = np.eye(instants - 1)
    B_d = np.vstack([plant.B_d, np.zeros((instants, 1))])
    C = np.zeros((1, n + instants))
    C[0, -1] = 1.0
    W = np.hstack([plant.W, np.zeros((1, instants))])
    return MultiratePlant(A=A, B_d=B_d, C=C, D=plant.D, W=W)
