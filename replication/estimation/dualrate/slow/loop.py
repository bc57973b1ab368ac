"""Closed loops at the fast instants, from process and sensor noise to z = (Q^(1/2) x, R^(1/2) u), for exact norms."""

from __future__ import annotations

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.dualrate.loop import DualRateLoop
from replication.estimation.dualrate.slow.controller import Controller
from replication.estimation.dualrate.slow.problem import SlowProblem, root
from replication.estimation.linear.norms import GainBracket, l2_gain, white_noise_variance
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.validation import Array

SILENT = 1e-60
"""A mean square below it is zero."""


def closed(problem: SlowProblem, controller: Controller) -> PeriodicSystem:
    """State (x, x^, u before); inputs d and the noise of the readings, in units of their weights; outputs T^(1/2) z."""
    step, C = problem.sampled, problem.plant.C
    n, m = step.input.shape
    stages = []
    for due, A, L, K in zip(problem.measured(), controller.A, controller.L, controller.K, strict=True):
        u = np.hstack([np.zeros((m, n)), K])
        transition = np.zeros((2 * n + m, 2 * n + m))
        transition[:n, :n], transition[n : 2 * n, :n], transition[n : 2 * n, n : 2 * n] = step.state, L @ C, A
        transition += np.vstack([step.input, step.input, np.eye(m)]) @ u
        read = np.vstack([np.zeros((n, len(due))), L[:, due], np.zeros((m, len(due)))])
        stages.append(_stage(problem, transition, read, due, u))
    return PeriodicSystem(tuple(stages))


def of_gains(problem: SlowProblem, loop: DualRateLoop) -> PeriodicSystem:
    """The same of a loop with gains that were designed in continuous time and one slow sensor period."""
    stages = []
    for step in loop.steps:
        due = list(range(len(problem.plant.C))) if np.any(step.noise) else []
        stages.append(_stage(problem, step.state, step.noise[:, due], due, step.input_state))
    return PeriodicSystem(tuple(stages))


def alone(problem: SlowProblem) -> PeriodicSystem:
    """The plant with the input zero."""
    n, m = problem.sampled.input.shape
    return PeriodicSystem((_stage(problem, problem.sampled.state, np.zeros((n, 0)), [], np.zeros((m, n))),))


def noise_to_output(problem: SlowProblem, loop: PeriodicSystem) -> PeriodicSystem:
    """From readings' noise of unit size to the plant outputs, weighted so that the gain is one of root mean squares."""
    rows, skipped = len(problem.plant.C), problem.noise.shape[1]
    measured = problem.measured()
    readings = sum(len(due) for due in measured) / rows
    output = np.zeros((rows, loop.order))
    output[:, : problem.plant.order] = np.sqrt(readings / len(measured)) * problem.plant.C
    stages = []
    for stage, due in zip(loop.stages, measured, strict=True):
        units = root(problem.sensor_noise[np.ix_(due, due)])
        noise = np.asarray(np.linalg.solve(units.T, stage.B[:, skipped:].T).T, dtype=float)
        stages.append(Stage(stage.A, noise, output, np.zeros((rows, noise.shape[1]))))
    return PeriodicSystem(tuple(stages))


def gain(problem: SlowProblem, loop: PeriodicSystem) -> GainBracket:
    """The l2 gain of a loop that was designed to be stable; raises SolverError where it is not, by rounding."""
    try:
        # The norm is searched for around levels whose squares must be numbers.
        return l2_gain(loop) if white_noise_variance(loop) > SILENT else GainBracket(0.0, 0.0, 0.0)
    except InfeasibleError:
        raise SolverError(problem.lost()) from None


def root_mean_square(problem: SlowProblem, loop: PeriodicSystem) -> float:
    """Of z at the fast instants, for white noise of the given intensities; raises as `gain`."""
    try:
        return float(np.sqrt(white_noise_variance(loop) / problem.period))
    except InfeasibleError:
        raise SolverError(problem.lost()) from None


def _stage(problem: SlowProblem, transition: Array, read: Array, due: list[int], u: Array) -> Stage:
    """One instant; read: effect of the noise of the readings that are due, u: the input by the state."""
    n, size = problem.plant.order, len(transition)
    drive = np.zeros((size, n))
    drive[:n] = problem.noise
    noise = np.hstack([drive, read @ root(problem.sensor_noise[np.ix_(due, due)])])
    seen = np.hstack([root(problem.state_weight).T, np.zeros((n, size - n))])
    z = np.sqrt(problem.period) * np.vstack([seen, root(problem.input_weight).T @ u])
    return Stage(transition, noise, z, np.zeros((len(z), noise.shape[1])))
