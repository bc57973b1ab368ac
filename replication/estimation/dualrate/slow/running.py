"""Observer and controller in one, as they run at the fast instants."""

from __future__ import annotations

import numpy as np

from replication.estimation.api.phase import Phase
from replication.estimation.api.running import PeriodicObserver
from replication.estimation.dualrate.slow.controller import Controller
from replication.estimation.dualrate.slow.problem import SlowProblem
from replication.estimation.validation import Array


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
        super().__init__(phases, np.hstack([problem.plant.output, np.zeros((len(problem.plant.output), m))]))

    @property
    def command(self) -> Array:
        """u(k), (m,): what the inputs are set to at the present instant."""
        return self.estimate[-self._count :]


def observer(problem: SlowProblem, controller: Controller) -> PeriodicObserver:
    """The observer alone, which is told the inputs."""
    n, B = problem.plant.size, problem.sampled.input
    phases = [
        Phase(A, B, L, np.eye(n), due) for A, L, due in zip(controller.A, controller.L, _due(problem), strict=True)
    ]
    return PeriodicObserver(phases, problem.plant.output)


def _due(problem: SlowProblem) -> Array:
    return np.asarray(np.tile(problem.sensors.mask, (problem.instants // problem.sensors.period, 1)))
