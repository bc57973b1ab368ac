"""What dual-rate gains guarantee in a closed loop, as a result: observer, state space, plot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np
import scipy

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.design import Design, Solution
from replication.estimation.api.export import Phase, Recursion
from replication.estimation.api.plants import each_instant
from replication.estimation.api.results import Evidence
from replication.estimation.dualrate.loop import (
    DualRateLoop,
    LoopStep,
    close_loop,
    driven,
    noise_gain,
    noise_system,
    stability_radius,
)
from replication.estimation.dualrate.observers import OBSERVERS, sampled_model
from replication.estimation.dualrate.problem import Plant, Steady, solved
from replication.estimation.linear.periodic import PeriodicSystem
from replication.estimation.validation import Array, StateSpace, as_matrix

SEMIDEFINITE = 1e-12
"""Negative eigenvalues of a weight up to so much of the largest are rounding."""


class Weights(NamedTuple):
    """Q (n, n) and R (m, m) of x'Qx + u'Ru; W (n, n) and V (p, p) of the process and the sensor noise."""

    state: Array
    input: Array
    process: Array
    sensor: Array


def checked_weights(plant: Plant, *, state: Any, input: Any, process: Any, sensor: Any) -> Weights:
    """The given weights, or C'C, the identity, BB' and the identity; raises InvalidInputError."""
    B, C = plant.B_u, plant.C
    return Weights(
        _weight("state_weight", state, C.T @ C),
        _weight("input_weight", input, np.eye(B.shape[1]), definite=True),
        _weight("process_noise", process, B @ B.T),
        _weight("sensor_noise", sensor, np.eye(len(C)), definite=True),
    )


def _weight(name: str, value: Any, default: Array, *, definite: bool = False) -> Array:
    """The symmetric weight, positive semidefinite, or definite if asked; or `default`. A vector is its diagonal."""
    if value is None:
        return default
    size = len(default)
    matrix = as_matrix(name, np.diag(value) if np.ndim(value) == 1 else value, rows=size, columns=size)
    least, largest = np.linalg.eigvalsh(matrix)[[0, -1]]
    good = least > 0 if definite else least >= -SEMIDEFINITE * max(largest, 0.0)
    if not np.array_equal(matrix, matrix.T) or not good:
        word = "definite" if definite else "semidefinite"
        raise InvalidInputError(f"{name} must be symmetric and positive {word}, got {matrix.tolist()}")
    return matrix


def _riccati(A: Any, B: Any, Q: Any, R: Any, weights: str) -> Any:
    units = np.exp2(np.round(-np.log2(np.diag(R)) / 2))
    try:
        return scipy.linalg.solve_continuous_are(A, B * units, Q, R * np.outer(units, units))
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InfeasibleError(
            f"the Riccati equation for {weights} has no stabilising solution ({error}): every unstable mode must be "
            "moved by the input and seen by the sensor, and no mode on the imaginary axis may be left out of the weight"
        ) from None


def steady_error(steady: Steady, plant: Plant, loop: Sequence[LoopStep]) -> Evidence:
    """The largest error at rest of a loop at any instant, one of loads and set-points being one."""
    (size, references), count = loop[0].command.shape, steady.loads
    readout = np.vstack([steady.load, plant.C[list(steady.tracked)]])
    rows = np.hstack([readout, np.zeros((len(readout), size - plant.order))])
    total = np.eye(size + references)
    steps = []
    for instant in loop:
        steps.append(total)
        joint = np.eye(size + references)
        joint[:size] = np.hstack([instant.state, instant.command])
        total = joint @ total
    conditions = np.vstack([np.hstack([rows[:count], np.zeros((count, references))]), np.eye(size + references)[size:]])
    moved = (total - np.eye(len(total)))[:size]
    rest = solved(np.vstack([moved, conditions]), np.eye(size + count + references)[:, size:])
    how = "of a tracked output at rest, for one of each load and set-point; exact, all fast instants"
    if rest is None:
        return Evidence("steady error", "none: no rest", how)
    output = np.hstack([rows[count:], np.zeros((len(rows) - count, references))])
    aims = np.zeros((len(output), count + references))
    aims[:, count:] = np.eye(len(output), references)
    return Evidence("steady error", max(float(np.abs(output @ step @ rest - aims).max()) for step in steps), how)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DualRateResult(Design):
    """Gains K (input, state) and L (state, output) in a closed loop with one observer.

    Attributes
    ----------
    loop : DualRateLoop
        The closed loop, instant by instant.
    observer_name : str
        Which of `OBSERVERS` fills the instants between the measurements.
    discrete_gain : bool
        Whether L corrects by steps instead of in the observer's differential equation.
    steady : Steady or None
        Loads and set-points; the loop is then that of the plant without loads.
    """

    method: str = "dualrate"
    quantity: str = (
        "root-mean-square gain of the closed loop from sensor noise to the plant output at the fast instants"
    )
    axes: Mapping[str, str] = field(
        default_factory=lambda: {"K": "(input, state)", "L": "(state, output)", "N": "(input, set-point)"}
    )
    repeats: ClassVar[str] = "the slow period"
    target: ClassVar[str] = "the output"
    loop: DualRateLoop
    observer_name: str
    discrete_gain: bool
    steady: Steady | None = None

    @classmethod
    def solve(cls, model: Plant, weights: Weights, steady: Steady | None = None) -> Solution:
        """The linear-quadratic K and the stationary Kalman gain L, in continuous time; raises InfeasibleError.

        steady: the loads, which K takes to rest.
        """
        (A, C), (Q, R, W, V) = (model.A, model.C), weights
        inner, to = (model, np.eye(len(A))) if steady is None else (steady.inner, steady.back)
        cost = _riccati(inner.A, inner.B_u, to.T @ Q @ to, R, "state_weight, input_weight")
        K = -np.linalg.solve(R, inner.B_u.T @ cost)
        L = np.linalg.solve(V, C @ _riccati(A.T, C.T, W, V, "process_noise, sensor_noise")).T
        return Solution({"K": K if steady is None else steady.feedback(K), "L": L})

    def facts(self, error: PeriodicSystem, solution: Solution) -> tuple[Evidence, ...]:
        """Of the loop, with the error at rest under loads and set-points."""
        problem, steady = self.loop.design, self.steady
        gain = "discrete gain" if self.discrete_gain else "gain in the differential equation"
        radius, noise = stability_radius(self.loop), noise_gain(self.loop)
        return (
            Evidence("monodromy radius", radius, "largest eigenvalue over one slow period; stable below 1"),
            Evidence("noise to output", noise, "standard deviations, white noise, periodic Lyapunov equation"),
            Evidence("observer", self.observer_name, gain),
            Evidence("fast period T", problem.period, "as given", "s"),
            Evidence("ratio M", problem.ratio, "as given"),
            *(() if steady is None else (steady_error(steady, problem.model, self.driven),)),
        )

    @property
    def driven(self) -> list[LoopStep]:
        """The loop with its set-points and loads, instant by instant."""
        problem = self.loop.design
        steps = close_loop(problem, OBSERVERS[self.observer_name], discrete_gain=self.discrete_gain).steps
        none = np.zeros((len(problem.feedback), 0))
        return driven(steps, [self.gains.get("N", none)] * len(steps))

    def error_system(self) -> PeriodicSystem:
        """From the noise of the readings to the plant output."""
        # Weighted so that the mean square over M fast instants is set beside that over the readings.
        steps = self.loop.steps
        readings = sum(bool(np.any(step.noise)) for step in steps)
        return noise_system(self.loop, np.sqrt(max(readings, 1) / len(steps)))

    def phases(self) -> Recursion:
        """The observer at the fast instants, to run with u(k) = K x^(k); it looks at every M-th measurement."""
        problem = self.loop.design
        steps = OBSERVERS[self.observer_name](sampled_model(problem, discrete_gain=self.discrete_gain)).steps
        every, count = self.observer_name == "fast_sensor", len(problem.model.C)
        due = [np.full(count, every or k == 0) for k in range(len(steps))]
        phases = [
            Phase(step.transition, step.input, step.injection, step.readout, now)
            for step, now in zip(steps, due, strict=True)
        ]
        return Recursion(phases, len(steps[0].readout), [problem.model.C @ phase.readout for phase in phases])

    def disturbances(self) -> tuple[str, ...]:
        """The noise of each reading."""
        return tuple(f"noise of {name}" for name in self.signals.measurements)

    def to_statespace(self) -> StateSpace:
        """The closed loop over a slow period M T, from the sensor noises to the plant outputs; `@k` for instant k."""
        import control

        problem, noise = self.loop.design, self.disturbances()
        lifted = control.StateSpace(*noise_system(self.loop).lift(), problem.slow_period)
        lifted.set_inputs(list(noise) if lifted.ninputs == len(noise) else each_instant(noise, problem.ratio))
        lifted.set_outputs(each_instant(self.signals.measurements, problem.ratio))
        return lifted
