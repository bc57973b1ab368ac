"""The observer as a periodic system, and any periodic system over one period as a `control.StateSpace`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.multirate.problem import MultirateProblem, require_problem
from replication.estimation.validation import as_array, positive_scalar

if TYPE_CHECKING:
    import control


def observer_system(problem: MultirateProblem, gains: npt.ArrayLike) -> PeriodicSystem:
    """The observer, eq. (15): x^+ = A x^ + B_u u + L_k S_k (y - C x^), from (u, y) to z^ = W x^; gains (N, n, q).

    y has all q sensors at every instant; entries of those that do not measure have no effect. Raises InvalidInputError
    for what is not a problem, or gains of another shape.
    """
    require_problem(problem)
    plant, N = problem.plant, problem.schedule.period
    gains = as_array("gains", gains, (N, plant.order, plant.sensors), axes="(N, n, q)")
    stages = []
    for k, L in enumerate(gains):
        used = L @ problem.schedule.selection(k)
        inputs = np.hstack([plant.B_u, used])
        stages.append(Stage(plant.A - used @ plant.C, inputs, plant.W, np.zeros((len(plant.W), inputs.shape[1]))))
    return PeriodicSystem(tuple(stages))


def lifted_statespace(system: PeriodicSystem, *, dt: float = 1.0) -> control.StateSpace:
    """The time-invariant system over one period, from the inputs of all N phases, stacked, to their outputs.

    dt: the base period in seconds; the sampling period of the result is N dt. The state is that at phase 0. Its
    H-infinity norm is the l2-induced norm of `system` (an error system, say, or an observer).
    """
    import control

    A, B, C, D = system.lift()
    return control.ss(A, B, C, D, positive_scalar("dt", dt, unit="seconds") * system.period)
