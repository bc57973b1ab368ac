"""What dual-rate gains guarantee in a closed loop, as a result: observer, state space, plot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from replication.drawing.panel import Panel
from replication.estimation.api.phase import Phase
from replication.estimation.api.results import GainResult
from replication.estimation.api.running import PeriodicObserver
from replication.estimation.api.signals import each_instant
from replication.estimation.dualrate.loop import (
    DualRateLoop,
    lifted_system,
    noise_system,
)
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.sampled import sampled_model
from replication.estimation.linear.norms import gain_curve
from replication.estimation.linear.periodic import PeriodicSystem

if TYPE_CHECKING:
    import control


QUANTITY = "root-mean-square gain of the closed loop from sensor noise to the plant output at the fast instants"


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DualRateResult(GainResult):
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
    loop: DualRateLoop
    observer_name: str
    discrete_gain: bool

    def observer(self) -> PeriodicObserver:
        """The observer at the fast instants, to run in a loop with u(k) = K x^(k).

        Returns
        -------
        PeriodicObserver
            Its `step` looks at the measurement at every M-th instant only.
        """
        problem = self.loop.design
        built = OBSERVERS[self.observer_name](sampled_model(problem, discrete_gain=self.discrete_gain))
        every = self.observer_name == "fast_sensor"
        count = len(problem.model.output)
        phases = [
            Phase(s.transition, s.input, s.injection, s.readout, np.full(count, every or k == 0))
            for k, s in enumerate(built.steps)
        ]
        return PeriodicObserver(phases, [problem.model.output @ phase.readout for phase in phases])

    def to_statespace(self) -> control.StateSpace:
        """The closed loop over one slow period M T.

        Returns
        -------
        control.StateSpace
            Inputs are the sensor noises, outputs the plant outputs at the M fast instants, `@k` for instant k.
        """
        lifted, ratio = lifted_system(self.loop), self.loop.design.ratio
        noise = [f"noise of {name}" for name in self.signals.measurements]
        lifted.set_inputs(noise if lifted.ninputs == len(noise) else each_instant(noise, ratio))
        lifted.set_outputs(each_instant(self.signals.measurements, ratio))
        return lifted

    def panels(self) -> tuple[Panel, ...]:
        """The gain from noise to output over the frequency, with its supremum."""
        frequencies, gains = gain_curve(noise_to_output(self.loop), self.loop.design.slow_period)
        label = "frequency (rad/s, folded at the slow period)"
        return self._panel(frequencies, label, "largest gain to the output", {"gain": gains})


def noise_to_output(loop: DualRateLoop) -> PeriodicSystem:
    """Outputs are weighted so that the mean square over M fast instants is set beside that over the readings."""
    readings = sum(bool(np.any(step.noise)) for step in loop.steps)
    return noise_system(loop, np.sqrt(max(readings, 1) / len(loop.steps)))
