"""A late sensor on the common plant in continuous time: the least gain of Theorem 3 where the measurement is delayed.

The paper has no delay in the output and no sensor noise. Here the sensor is a fast lag behind the delay, ours, so that
y is a state and its noise acts on it, as the theorem wants.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from papers.peet2019.method import riccati_gain, without_noise
from replication.estimation.delay.plant import delay_system

LATE = "late, in continuous time: by m − 1 base periods, modelled by an added state"
LAG = 0.25
"""Time constant of the sensor in base periods."""


def levels(plant: dict[str, Any], multiples: list[int], degree: int) -> list[list[float]]:
    """Bracket of the least gain from force and noise to the position's error, for each delay (m - 1) h."""
    from replication.estimation.conic.sdpa import one_process  # both slow to load
    from replication.estimation.delay.sos.certificate import minimum_gain

    A, B, C, h = (np.array(plant[name]) for name in ("A", "B", "C", "h"))
    n, lag = len(A), LAG * float(h)
    a0 = np.block([[A, np.zeros((n, 1))], [np.zeros((1, n)), np.array([[-1 / lag]])]])
    seen = np.block([[np.zeros((n, n + 1))], [C / lag, np.zeros((1, 1))]])
    b = np.block([[B, np.zeros((n, 1))], [np.zeros((1, 1)), np.array([[plant["noise"] / lag]])]])
    c1, c2 = np.hstack([C, [[0.0]]]), np.hstack([np.zeros((1, n)), [[1.0]]])
    found = []
    with one_process():
        for m in multiples:
            if m == 1:
                level = riccati_gain(without_noise(a0 + seen, b, c1, c2))
                found.append([level, level])
            else:
                least = minimum_gain(delay_system(a0, [seen], [(m - 1) * float(h)], b, c1, c2), degree)
                found.append([least.lower, least.gamma])
    return found
