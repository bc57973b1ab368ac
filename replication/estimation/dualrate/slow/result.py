"""What a design at the slow rate guarantees, as a result: observer, running controller, state space, plot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from replication.drawing.panel import Panel
from replication.estimation.api.phase import Phase
from replication.estimation.api.results import GainResult
from replication.estimation.api.running import PeriodicObserver
from replication.estimation.api.signals import each_instant
from replication.estimation.api.tradeoff import TradeOff, tradeoff
from replication.estimation.dualrate.slow.controller import Controller
from replication.estimation.dualrate.slow.levels import MARGIN, kalman, least_level, measures
from replication.estimation.dualrate.slow.loop import closed
from replication.estimation.dualrate.slow.problem import SlowProblem
from replication.estimation.linear.norms import gain_curve
from replication.estimation.linear.periodic import PeriodicSystem, Stage, lifted_statespace
from replication.estimation.validation import Array

if TYPE_CHECKING:
    import control


class RunningController(PeriodicObserver):
    """`command` is u(k); `step(None, y)` takes the readings of instant k and goes on, so that `command` is u(k+1).

    `estimate`, which `step` returns too, is (x^(k), u(k)). A reading that does not come is replaced by C x^.

    Parameters
    ----------
    problem : SlowProblem
        Plant, rates and weights.
    controller : Controller
        Its matrices, instant by instant.
    """

    def __init__(self, problem: SlowProblem, controller: Controller) -> None:
        n, m = problem.plant.input.shape
        phases = []
        mask = _due(problem)
        for due, A, L, K in zip(mask, controller.A, controller.L, controller.K, strict=True):
            transition = np.vstack([problem.sampled.input @ K, K])
            transition[:n, :n] += A
            readout = np.vstack([np.eye(n, n + m), K])
            phases.append(
                Phase(transition, np.zeros((n + m, 0)), np.vstack([L, np.zeros((m, len(due)))]), readout, due)
            )
        self._count = m
        output = np.hstack([problem.plant.output, np.zeros((len(problem.plant.output), m))])
        super().__init__(phases, [output @ phase.readout for phase in phases])

    @property
    def command(self) -> Array:
        """u(k), (m,): what the inputs are set to at the present instant."""
        return self.estimate[-self._count :]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SlowRateResult(GainResult):
    """A controller with its observer, periodic at the fast instants: u = K (x^, u before), x^+ = A x^ + B u + L y.

    Attributes
    ----------
    problem : SlowProblem
        Plant, rates and weights.
    controller : Controller
        The matrices of `gains` under their names.
    """

    method: str = "dualrate"
    quantity: str = (
        "l2 gain of the closed loop from process and sensor noise, as sequences, to (x, u) held over each fast period, "
        "all in units of their weights"
    )
    axes: Mapping[str, str] = field(
        default_factory=lambda: {
            "A": "(phase, state, state)",
            "L": "(phase, state, sensor)",
            "K": "(phase, input, state and input before)",
        }
    )
    problem: SlowProblem
    controller: Controller

    @property
    def loop(self) -> PeriodicSystem:
        """The closed loop, whose gain the bracket holds."""
        return closed(self.problem, self.controller)

    def observer(self) -> PeriodicObserver:
        """The observer alone, to run where something else may set the inputs.

        Returns
        -------
        PeriodicObserver
            Its `step` takes the inputs as they are, and looks at the sensors that deliver.
        """
        return _observer(self.problem, self.controller).named(self.signals)

    def running(self) -> RunningController:
        """Observer and controller in one.

        Returns
        -------
        RunningController
            Its `command` is u at the present instant; `step(None, y)` takes the readings and goes on. It has a C form.
        """
        return RunningController(self.problem, self.controller).named(replace(self.signals, inputs=()))

    def to_statespace(self) -> control.StateSpace:
        """The controller over one period of the schedules.

        Returns
        -------
        control.StateSpace
            From the readings to the inputs of all instants, `@k` for instant k.
        """
        phases = self.running().phases
        n = self.problem.plant.size
        stages = tuple(
            Stage(p.transition, p.injection, p.readout[n:], np.zeros((len(p.readout) - n, p.injection.shape[1])))
            for p in phases
        )
        lifted = lifted_statespace(PeriodicSystem(stages), dt=self.problem.period)
        lifted.set_inputs(each_instant(self.signals.measurements, len(phases)))
        lifted.set_outputs(each_instant(self.signals.inputs, len(phases)))
        return lifted

    def estimator(self) -> control.StateSpace:
        """The observer over one period of the schedules, from the inputs and the readings of all instants to x^.

        Returns
        -------
        control.StateSpace
            `@k` is added to the names for instant k. It is what `observer()` does.
        """
        return self.observer().to_statespace()

    def tradeoff(self, points: int = 12) -> TradeOff:
        """What a smaller guaranteed gain costs in mean square, for this plant, these rates and weights.

        Parameters
        ----------
        points : int
            Number of designs, from one per cent above the least level to the Kalman design; at least 2.

        Returns
        -------
        TradeOff
            Level, exact gain and exact root mean square of (x, u) of each; it prints and plots itself.

        Raises
        ------
        InvalidInputError
            `points` is no whole number from 2 to 1000, or the least level is zero.
        SolverError
            Rounding spoils the equations at a level.
        """
        least = (1 + MARGIN) * least_level(self.problem, kalman(self.problem)[1].upper)[1]
        return tradeoff(self.method, "rms of (x, u)", points, least, partial(measures, self.problem))

    def panels(self) -> tuple[Panel, ...]:
        """The gain over the frequency, with the guaranteed level."""
        frequencies, gains = gain_curve(self.loop, self.problem.period * self.problem.instants)
        label = "frequency (rad/s, folded at the period of the schedules)"
        return self._panel(frequencies, label, "largest gain to state and input", {"gain": gains})


def _observer(problem: SlowProblem, controller: Controller) -> PeriodicObserver:
    """The observer alone, which is told the inputs."""
    n, B = problem.plant.size, problem.sampled.input
    phases = [
        Phase(A, B, L, np.eye(n), due) for A, L, due in zip(controller.A, controller.L, _due(problem), strict=True)
    ]
    return PeriodicObserver(phases, [problem.plant.output] * len(phases))


def _due(problem: SlowProblem) -> Array:
    return np.asarray(np.tile(problem.sensors.mask, (problem.instants // problem.sensors.period, 1)))
