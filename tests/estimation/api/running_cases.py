"""One running observer of each kind, made anew at each call, and something for it to measure."""

from functools import cache
from typing import Any

import numpy as np

from replication.estimation import delay, dualrate, multirate
from replication.estimation.multirate import losses
from tests.estimation.api.api_plants import CART, SERVO, TANKS, result_of

DT = 0.01


@cache
def kalman() -> Any:
    given: dict[str, Any] = {"periods": (1, 4), "noise": [0.5, 0.1], "disturbances": ["wind"]}
    return multirate.design(CART, goal="h2", **given)


@cache
def innovations() -> Any:
    """A pipe that ends at the sensor: a delay plant of the general form."""
    plant = delay.DelayPlant(
        TANKS.A,
        [0.4],
        np.hstack([np.eye(2), np.zeros((2, 1))]),
        [[0, 1]],
        [[1, 0]],
        a=[[[0, 0], [0.5, 0.2]]],
        d21=[[0, 0, 0.1]],
        b_u=[[1], [0]],
    )
    return delay.design(plant)


OBSERVERS = {
    "multirate": lambda: result_of("multirate").observer(),
    "kalman": lambda: kalman().filter(lag=2),
    "starting": lambda: kalman().filter(P0=np.eye(2)),
    "nonuniform": lambda: result_of("nonuniform").observer(),
    "dualrate": lambda: result_of("dualrate").observer(),
    "delay": lambda: result_of("delay").observer(DT),
    "innovations": lambda: innovations().observer(DT),
    "losses": lambda: losses.design(result_of("multirate"), losses.InARow(1)).observer(),
    "slow rate": lambda: dualrate.design(SERVO, period=0.02, ratio=10, at="slow").running(),
}


def sizes(observer: Any) -> tuple[int, int]:
    """Numbers of inputs and measurements."""
    return len(observer.signals.inputs), len(observer.signals.measurements)


def estimate(step: Any) -> Any:
    """All numbers that a step gave, one after the other."""
    return np.concatenate([np.ravel(part) for part in step]) if isinstance(step, tuple) else step


def steps(observer: Any, count: int, *, lost: float = 0.1) -> Any:
    """What the observer gives for noise of which whole samples are lost."""
    rng, (inputs, measurements) = np.random.default_rng(4), sizes(observer)
    found = []
    for _ in range(count):
        u, y = rng.standard_normal(inputs), rng.standard_normal(measurements)
        found.append(estimate(observer.step(u if inputs else None, None if rng.random() < lost else y)))
    return np.array(found)
