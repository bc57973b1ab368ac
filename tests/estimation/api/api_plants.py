"""One small design of each method, made once; plants as `control.StateSpace` objects with names of their own."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import control
import numpy as np

from replication.estimation import delay, dualrate, multirate, nonuniform
from replication.estimation.api.shown import Simulation

CART = control.ss(
    [[1.0, 0.1], [0.0, 0.98]],
    [[0.0, 0.0], [0.1, 0.2]],
    [[0.0, 1.0], [1.0, 0.0]],
    np.zeros((2, 2)),
    0.1,
    states=["position", "speed"],
    inputs=["wind", "force"],
    outputs=["encoder", "camera"],
)
SPRING = control.ss(
    [[0, 1], [-4, -1.2]],
    [[0, 0], [1, 0]],
    [[1, 0], [0, 1]],
    [[0, 0.1], [0, 0]],
    states=["position", "speed"],
    inputs=["push", "noise"],
    outputs=["gauge", "velocity"],
)
SERVO = control.ss(
    [[0, 1], [0, -1]], [[0], [1]], [[1, 0]], 0, states=["angle", "rate"], inputs=["volt"], outputs=["camera"]
)
TANKS = control.ss(
    [[-1, 0.2], [0.5, -2]],
    np.eye(2),
    np.eye(2),
    0,
    states=["upper", "lower"],
    inputs=["rain", "leak"],
    outputs=["float", "deep"],
)
PIPE = [[[0, 0], [0.5, 0.2]]]
TIMES = np.linspace(0.0, 4.0, 401)
WAVES = np.stack([np.sin(TIMES), np.cos(2 * TIMES)], axis=1)


@dataclass(frozen=True)
class Case:
    """How a method is called; `names` of states, inputs, measurements, outputs that the result must carry."""

    design: Callable[[], Any]
    simulate: Callable[[Any], Simulation]
    names: tuple[tuple[str, ...], ...]


CASES = {
    "multirate": Case(
        lambda: multirate.design(CART, periods=(1, 4), offsets=(0, 2), noise=[0.5, 0.1], disturbances=["wind"]),
        lambda result: multirate.simulate(result, 40, disturbance="worst"),
        (("position", "speed"), ("force",), ("encoder", "camera"), ("position", "speed")),
    ),
    "nonuniform": Case(
        lambda: nonuniform.design(SPRING, periods=(0.05, 0.2), measured=["gauge"], leaves=2, horizon=50),
        nonuniform.simulate,
        (("position", "speed"), (), ("gauge",), ("velocity",)),
    ),
    "dualrate": Case(
        lambda: dualrate.design(SERVO, period=0.02, ratio=10),
        lambda result: dualrate.simulate(result, [1.0, 0.0], slow_periods=5),
        (("angle", "rate"), ("volt",), ("camera",), ("angle", "rate")),
    ),
    "delay": Case(
        lambda: delay.design(TANKS, delayed=PIPE, delays=[0.4], measured=["float"], order=12),
        lambda result: delay.simulate(result, TIMES, WAVES),
        (("upper", "lower"), (), ("float",), ("deep",)),
    ),
}
METHODS = tuple(CASES)


@cache
def result_of(method: str) -> Any:
    """The design of the method, computed once."""
    return CASES[method].design()
