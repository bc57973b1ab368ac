"""A levitated ball: the longer its sensor is away, the more is lost by gains that know nothing of it."""

import numpy as np

from replication.drawing.panels import Panel, draw
from replication.estimation import dualrate

PERIOD = 0.01
ball = dualrate.make_plant([[0, 1], [22, 0]], [[0], [1]], [[1, 0]])
ratios = np.array([1, 5, 10, 15, 20, 25, 30, 40])
found = [dualrate.design(ball, period=PERIOD, ratio=int(ratio), at="slow", goal="hinf") for ratio in ratios]


def share(what: str) -> np.ndarray:
    """How much of the best is reached: the least level of all over that of one; of an unstable loop nothing."""
    levels = [result.fact(what).value for result in found]
    return np.array(
        [0 if isinstance(v, str) else r.fact("optimum").value / v for r, v in zip(found, levels, strict=True)]
    )


lines = {
    "H-infinity": np.array([result.fact("optimum").value / result.value for result in found]),
    "Kalman": share("level of the Kalman filter"),
    "continuous gains": share("level of the continuous gains"),
}
assert lines["continuous gains"][-1] == 0 < lines["continuous gains"][0]  # the loop that the text calls unstable
figure = draw([Panel(ratios * PERIOD, "between two measurements (s)", "least level over level", lines, {})])
