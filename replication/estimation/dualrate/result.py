"""What dual-rate gains guarantee in a closed loop, as a result: observer, state space, plot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from replication.estimation.api.design import Design, Solution
from replication.estimation.api.phase import Phase, Recursion
from replication.estimation.api.signals import each_instant
from replication.estimation.dualrate.gains import Weights, continuous_gains
from replication.estimation.dualrate.loop import (
    DualRateLoop,
    lifted_system,
    noise_system,
)
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import Plant
from replication.estimation.dualrate.sampled import sampled_model
from replication.estimation.linear.periodic import PeriodicSystem

if TYPE_CHECKING:
    import control


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
    """

    method: str = "dualrate"
    quantity: str = (
        "root-mean-square gain of the closed loop from sensor noise to the plant output at the fast instants"
    )
    axes: Mapping[str, str] = field(default_factory=lambda: {"K": "(input, state)", "L": "(state, output)"})
    repeats: ClassVar[str] = "the slow period"
    target: ClassVar[str] = "the output"
    loop: DualRateLoop
    observer_name: str
    discrete_gain: bool

    @classmethod
    def solve(cls, model: Plant, weights: Weights) -> Solution:
        """The linear-quadratic K and the stationary Kalman gain L, in continuous time."""
        K, L = continuous_gains(model, weights)
        return Solution({"K": K, "L": L})

    def error_system(self) -> PeriodicSystem:
        """From the noise of the readings to the plant output."""
        return noise_to_output(self.loop)

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

    def to_statespace(self) -> control.StateSpace:
        """The closed loop over one slow period M T.

        Returns
        -------
        control.StateSpace
            Inputs are the sensor noises, outputs the plant outputs at the M fast instants, `@k` for instant k.
        """
        lifted, ratio = lifted_system(self.loop), self.loop.design.ratio
        noise = self.disturbances()
        lifted.set_inputs(list(noise) if lifted.ninputs == len(noise) else each_instant(noise, ratio))
        lifted.set_outputs(each_instant(self.signals.measurements, ratio))
        return lifted


def noise_to_output(loop: DualRateLoop) -> PeriodicSystem:
    """Outputs are weighted so that the mean square over M fast instants is set beside that over the readings."""
    readings = sum(bool(np.any(step.noise)) for step in loop.steps)
    return noise_system(loop, np.sqrt(max(readings, 1) / len(loop.steps)))
