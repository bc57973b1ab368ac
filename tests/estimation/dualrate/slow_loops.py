"""Designs shared by the tests of dual-rate loops."""

from typing import Any

import numpy as np
import scipy.integrate
import scipy.linalg
import scipy.signal

from papers.shao.method.motor import Feedforward, Motor, ReferenceTiming, tracking_command
from replication.estimation.dualrate.loop import DualRateLoop, close_loop
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign, dual_rate_design
from replication.estimation.dualrate.slow.result import SlowRateResult

PMSM = Motor(
    resistance=0.54, flux=0.61, inductance=0.0096, pole_pairs=4, friction=1e-4, inertia=0.016, torque_constant=3.66
)
MOTOR = PMSM.system()
MOTOR_DESIGN = dual_rate_design(
    MOTOR, feedback=[[-20, -0.1, -0.01]], injection=[[0.45], [0.9], [0.9]], period=0.2, ratio=5
)
START = np.array([-0.5, 1.0, -1.0])


def motor_loop(
    name: str,
    frequency: float,
    *,
    design: DualRateDesign = MOTOR_DESIGN,
    form: Feedforward = Feedforward.PRINTED,
    timing: ReferenceTiming = ReferenceTiming.HELD,
) -> DualRateLoop:
    harmonic = tracking_command(PMSM, design, frequency, form, timing)
    return close_loop(design, OBSERVERS[name], harmonic=harmonic)


def textbook_loop(period: float, factor: float = 1.0) -> Any:
    """Of the motor and its single-rate observer, whose sensor reads `factor` times y, from scipy's zero-order hold."""
    A, B, C, K, L = MOTOR.A, MOTOR.B_u, MOTOR.C, MOTOR_DESIGN.feedback, MOTOR_DESIGN.injection
    Ad, Bd = scipy.signal.cont2discrete((A, B, C, [[0]]), period)[:2]
    F, GH = scipy.signal.cont2discrete((A - L @ C, np.hstack([B, L]), C, np.zeros((1, 2))), period)[:2]
    return np.block([[Ad, Bd @ K], [factor * GH[:, 1:] @ C, F + GH[:, :1] @ K]])


LEVITATION: tuple[Any, Any, Any] = ([[0.0, 1.0], [22.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]])
"""Time constant 0.21 s: over 0.4 s an error grows sixfold."""
TWO = (
    np.array([[0.3, 1.0, 0.0], [-1.0, -0.2, 0.5], [0.2, 0.0, 0.1]]),
    np.array([[0.0, 1.0], [1.0, 0.2], [0.3, -1.0]]),
    np.array([[1.0, 0.0, 0.0], [0.3, 0.0, 1.0]]),
)
RATES: dict[str, Any] = {"period": 0.1, "ratio": [2, 3], "hold": [1, 2]}
"""Sensors and inputs at four rates, which repeat after six periods."""
WEIGHTS = {
    "state_weight": np.diag([1.0, 0.5, 2.0]),
    "input_weight": np.array([[1.0, 0.3], [0.3, 0.5]]),
    "process_noise": np.diag([0.2, 1.0, 0.4]),
    "sensor_noise": np.array([[0.4, 0.1], [0.1, 0.2]]),
}


def factor(matrix: Any) -> Any:
    return np.linalg.cholesky(np.asarray(matrix) + 1e-14 * np.eye(len(matrix)))


class ByHand:
    """The closed loop, driven through `running()`; `lifted` feeds unit starts and unit noises one by one."""

    def __init__(self, result: SlowRateResult, plant: Any, weights: dict[str, Any], ticks: int) -> None:
        A, self.B, self.C = (np.asarray(matrix, dtype=float) for matrix in plant)
        self.result, self.period, self.weights, self.ticks = result, result.problem.period, weights, ticks
        self.controller = result.running()
        self.n, self.m = self.B.shape
        wide = np.zeros((self.n + self.m, self.n + self.m))
        wide[: self.n, : self.n], wide[: self.n, self.n :] = A, self.B
        power = scipy.linalg.expm(wide * self.period)
        self.step, self.drive = power[: self.n, : self.n], power[: self.n, self.n :]

        def spread(t: float) -> Any:
            exponential = scipy.linalg.expm(A * t)
            return exponential @ weights["process_noise"] @ exponential.T

        self.noise = factor(scipy.integrate.quad_vec(spread, 0, self.period, epsabs=1e-14, epsrel=1e-12)[0])
        self.read = factor(weights["sensor_noise"])

    def outputs(self, start: Any, d: Any, w: Any) -> tuple[Any, Any]:
        """z at each tick, and the state at the end, from a state (x, x^, u before) and noises for each tick."""
        x, before = start[: self.n], start[self.n :]
        self.controller.reset(before)
        outputs = []
        for k in range(self.ticks):
            u = self.controller.command
            outputs.append(
                np.sqrt(self.period)
                * np.concatenate(
                    [factor(self.weights["state_weight"]).T @ x, factor(self.weights["input_weight"]).T @ u]
                )
            )
            y = self.C @ x + self.noise_of(k, w[k])
            x = self.step @ x + self.drive @ u + self.noise @ d[k]
            after = self.controller.step(None, y)[: self.n]
        return np.concatenate(outputs), np.concatenate([x, after, u])

    def noise_of(self, k: int, w: Any) -> Any:
        """Sensors that measure together share their covariance; one that measures alone has its own variance."""
        due = [i for i, ratio in enumerate(self.result.problem.sensors.periods) if k % ratio == 0]
        added = np.zeros(len(self.C))
        if due:
            added[due] = factor(self.weights["sensor_noise"][np.ix_(due, due)]) @ w[: len(due)]
        return added

    def lifted(self) -> tuple[Any, Any, Any, Any]:
        """(A, B, C, D) over one period, column by column; noises that reach nothing have columns of zeros."""
        n, m, p = self.n, self.m, len(self.C)
        size, quiet_d, quiet_w = 2 * n + m, np.zeros((self.ticks, n)), np.zeros((self.ticks, p))
        starts = [self.outputs(column, quiet_d, quiet_w) for column in np.eye(size)]
        driven = []
        for k in range(self.ticks):
            for i in range(n):
                d = quiet_d.copy()
                d[k, i] = 1.0
                driven.append(self.outputs(np.zeros(size), d, quiet_w))
            for i in range(p):
                w = quiet_w.copy()
                w[k, i] = 1.0
                driven.append(self.outputs(np.zeros(size), quiet_d, w))
        C, A = (np.array(part).T for part in zip(*starts, strict=True))
        D, B = (np.array(part).T for part in zip(*driven, strict=True))
        return A, B, C, D


def largest(A: Any, B: Any, C: Any, D: Any) -> float:
    """The H-infinity norm by a scan of the circle, refined around its maximum."""
    from scipy.optimize import minimize_scalar

    def at(angle: float) -> float:
        response = C @ np.linalg.solve(np.exp(1j * angle) * np.eye(len(A)) - A, B) + D
        return float(np.linalg.norm(response, 2))

    angles = np.linspace(0, np.pi, 400)
    best = angles[int(np.argmax([at(angle) for angle in angles]))]
    near = (max(best - angles[1], 0), min(best + angles[1], np.pi))
    found = minimize_scalar(lambda angle: -at(angle), bounds=near, options={"xatol": 1e-12})
    return max(at(0.0), at(np.pi), -float(found.fun))
