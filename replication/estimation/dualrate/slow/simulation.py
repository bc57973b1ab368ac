"""The closed loop of a slow-rate controller from given starts, between the fast instants too."""

from __future__ import annotations

from typing import Any

import numpy as np

from replication.estimation.api.signals import Signals
from replication.estimation.api.simulation import Simulation, simulated
from replication.estimation.dualrate.problem import row_of_output
from replication.estimation.dualrate.sampled import held
from replication.estimation.dualrate.slow.result import SlowRateResult
from replication.estimation.validation import Array, finite_vector, positive_integer


def simulate_slow(
    result: SlowRateResult, start: Any, *, periods: int, estimate: Any, output: int, substeps: int
) -> Simulation:
    """Without noise, over `periods` of the schedules; raises InvalidInputError for bad starts, counts or outputs."""
    problem, plant = result.problem, result.problem.plant
    n, m = plant.B_u.shape
    row = plant.C[row_of_output(plant, output)]
    count = positive_integer("number of slow periods", periods) * problem.instants
    state = np.zeros(2 * n + m)
    state[:n], state[n : 2 * n] = finite_vector("x(0)", start, n), finite_vector("ζ(0)", estimate, n)
    stages, K = result.loop.stages, result.controller.K
    states, inputs = np.empty((count, 2 * n + m)), np.empty((count, m))
    for k in range(count):
        states[k], inputs[k] = state, K[k % problem.instants] @ state[n:]
        state = stages[k % problem.instants].A @ state
    width = problem.period / substeps
    between = [held(plant.A, plant.B_u, i * width) for i in range(substeps)]
    outputs = [states[:, :n] @ part.state.T @ row + inputs @ part.input.T @ row for part in between]
    time = problem.period * np.arange(count)[:, None] + width * np.arange(substeps)
    errors = np.repeat(states[:, :n] - states[:, n : 2 * n], substeps, axis=0)
    shown = np.stack(outputs, axis=1).reshape(-1, 1)
    signals = closed_loop_signals(result.signals, output, shown, np.repeat(inputs, substeps, axis=0), errors)
    return simulated(result.method, time.ravel(), signals, ratio=None, steps=False)


def closed_loop_signals(
    names: Signals, output: int, shown: Array, inputs: Array, errors: Array
) -> dict[str, tuple[Array, tuple[str, ...]]]:
    """The signals of a closed loop and the names of their columns: an output, the inputs, the errors of the states."""
    return {
        "output": (shown, names.called([names.measurements[output]])),
        "input": (inputs, names.called(names.inputs)),
        "estimation error": (errors, names.called(names.states)),
    }
