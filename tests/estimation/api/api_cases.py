"""One small design of each kind, made once, with its running observers; plants with names of their own."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import control
import numpy as np

from replication.estimation import delay, dualrate, multirate, nonuniform
from replication.estimation.api.shown import Simulation
from replication.estimation.multirate import losses
from replication.estimation.nonuniform.plant import PeriodRange
from replication.estimation.nonuniform.stamped.design import StampedFilter, stamped_design
from replication.estimation.nonuniform.stamped.observer import StampedObserver

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


PUMPED = delay.DelayPlant(
    TANKS.A,
    [0.4],
    np.eye(2, 3),
    [[0, 1]],
    [[1, 0]],
    a=PIPE,
    d21=[[0, 0, 0.1]],
    b_u=[[1], [0]],  # type: ignore[arg-type]
)
"""The tanks with a known inflow and a noisy float: a delay plant of the general form."""
CARTS: dict[str, Any] = {"periods": (1, 4), "noise": [0.5, 0.1], "disturbances": ["wind"]}
SPRINGS: dict[str, Any] = {"periods": (0.05, 0.2), "measured": ["gauge"]}
UNITS = {"position": "m", "velocity": "m/s", "angle": "rad", "deep": "mm", "camera": "px", "volt": "V", "speed": "m/s"}
DT = 0.01


@dataclass(frozen=True)
class Case:
    """How a design is made and simulated.

    `names` of states, inputs, measurements, outputs that the result must carry; `columns` of its simulation in `UNITS`.
    """

    design: Callable[[], Any]
    simulate: Callable[[Any], Simulation]
    names: tuple[tuple[str, ...], ...]
    columns: dict[str, tuple[str, ...]]

    def named(self) -> Any:
        """The result with the units that it has a signal for."""
        result = self.design()
        known = {name for kind in result.signals.to_dict().values() if isinstance(kind, list) for name in kind}
        return result.named(units={name: unit for name, unit in UNITS.items() if name in known})


CART_NAMES = (("position", "speed"), ("force",), ("encoder", "camera"), ("position", "speed"))
CART_COLUMNS = {
    "error": ("position (m)", "speed (m/s)"),
    "disturbance": ("wind", "noise of encoder", "noise of camera"),
}
SPRING_NAMES = (("position", "speed"), (), ("gauge",), ("velocity",))
SPRING_COLUMNS = {"error": ("velocity (m/s)",), "disturbance": ("push", "noise")}
SERVO_NAMES = (("angle", "rate"), ("volt",), ("camera",), ("angle", "rate"))
SERVO_COLUMNS = {"output": ("camera (px)",), "input": ("volt (V)",), "estimation error": ("angle (rad)", "rate")}


def attacked(result: Any) -> Simulation:
    """By the worst disturbance."""
    return multirate.simulate(result, 40, disturbance="worst")


def released(result: Any) -> Simulation:
    """From another state than the estimate."""
    return dualrate.simulate(result, [1.0, 0.0], slow_periods=5)


CASES = {
    "multirate": Case(lambda: multirate.design(CART, offsets=(0, 2), **CARTS), attacked, CART_NAMES, CART_COLUMNS),
    "kalman": Case(lambda: multirate.design(CART, goal="h2", **CARTS), attacked, CART_NAMES, CART_COLUMNS),
    "losses": Case(
        lambda: losses.design(result_of("multirate"), losses.InARow(1)),
        lambda result: losses.simulate(result, 40),  # type: ignore[arg-type, return-value]
        CART_NAMES,
        {**CART_COLUMNS, "arrived": ("encoder", "camera")},
    ),
    "nonuniform": Case(
        lambda: nonuniform.design(SPRING, leaves=2, horizon=50, **SPRINGS),
        nonuniform.simulate,
        SPRING_NAMES,
        SPRING_COLUMNS,
    ),
    "stamped": Case(
        lambda: nonuniform.design_stamped(SPRING, horizon=40, **SPRINGS),
        nonuniform.simulate,
        SPRING_NAMES,
        SPRING_COLUMNS,
    ),
    "dualrate": Case(lambda: dualrate.design(SERVO, period=0.02, ratio=10), released, SERVO_NAMES, SERVO_COLUMNS),
    "slow rate": Case(
        lambda: dualrate.design(SERVO, period=0.02, ratio=10, at="slow"), released, SERVO_NAMES, SERVO_COLUMNS
    ),
    "delay": Case(
        lambda: delay.design(TANKS, delayed=PIPE, delays=[0.4], measured=["float"], order=12),
        lambda result: delay.simulate(result, TIMES, WAVES),
        (("upper", "lower"), (), ("float",), ("deep",)),
        {"error of z": ("deep (mm)",), "error of x": ("upper", "lower"), "disturbance": ("rain", "leak")},
    ),
    "innovations": Case(
        lambda: delay.design(PUMPED).named(states=["upper", "lower"], inputs=["pump"], outputs=["deep"]),
        lambda result: delay.simulate(result, TIMES, WAVES @ np.eye(2, 3)),
        (("upper", "lower"), ("pump",), ("y[0]",), ("deep",)),
        {"error of z": ("deep (mm)",), "error of x": ("upper", "lower"), "disturbance": ("w[0]", "w[1]", "w[2]")},
    ),
}
METHODS = ("multirate", "nonuniform", "dualrate", "delay")
"""The rooms of the library."""


@cache
def result_of(case: str) -> Any:
    """The design, computed once."""
    return CASES[case].design()


def running(case: str) -> Any:
    """The observer of the design, made anew."""
    result = result_of(case)
    return result.observer(DT) if result.method == "delay" else result.observer()


RUNNING: dict[str, Callable[[], Any]] = {
    **{case: partial(running, case) for case in CASES if case not in ("stamped", "kalman", "slow rate")},
    "kalman": lambda: result_of("kalman").filter(lag=2),
    "starting": lambda: result_of("kalman").filter(P0=np.eye(2)),
    "slow rate": lambda: result_of("slow rate").running(),
}
"""Observers that run from instant to instant."""


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


STAMPED = ("filter", "kalman", "kalman without inputs")
STAMPS = (0.02, 0.4)
"""Kinds of estimators with time stamps, and the range of the sampling periods of the filter."""
A, C = [[0.4, 2.0, 0.0], [-1.0, 0.2, 1.0], [0.0, 0.0, -30.0]], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]
UNSTABLE = nonuniform.StampedPlant(A, [[0, 0, 0], [1, 0, 0], [5, 0, 0]], C, [[0, 0.1, 0], [0, 0.02, 0.2]], np.eye(3))


@cache
def stamped_filter() -> StampedFilter:
    return stamped_design(UNSTABLE, PeriodRange(*STAMPS)).filter


def stamped(kind: str, factor: float = 1.0) -> Any:
    """An estimator of the unstable plant with two sensors, made anew; factor: a fault in the gain."""
    known = np.array([[0.0], [1.0], [2.0]])
    if kind == "filter":
        faulty = StampedFilter(factor * stamped_filter().G, stamped_filter().edges)
        return StampedObserver(UNSTABLE, faulty, PeriodRange(*STAMPS), known, ("a", "b"))
    Q, R = np.diag([0.1, 1.0, 25.0]), factor * np.array([[0.04, 0.01], [0.01, 0.09]])
    return nonuniform.StampedKalman(
        nonuniform.NoisyPlant(A, C, Q, R, known if kind == "kalman" else None, P0=2 * np.eye(3))
    )
