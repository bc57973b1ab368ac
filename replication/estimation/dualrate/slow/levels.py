"""Levels by the one measure of slow-rate designs, from process and sensor noise to z: least, beside, limits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.results import Evidence, baselines
from replication.estimation.api.tradeoff import Measures
from replication.estimation.dualrate.gains import Weights, continuous_gains
from replication.estimation.dualrate.loop import close_loop
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign
from replication.estimation.dualrate.slow.controller import Controller, Equations
from replication.estimation.dualrate.slow.loop import alone, closed, gain, of_gains, root_mean_square
from replication.estimation.dualrate.slow.problem import SlowProblem, root
from replication.estimation.linear.norms import GainBracket
from replication.estimation.multirate.optimum import noncausal_bound
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule

MEASURE = "exact gain of the closed loop from process and sensor noise to (x, u)"
SEARCH_WIDTH = 1e-6
"""Relative width of the bracket of the least level."""
DOUBLINGS = 60
MARGIN = 0.01
"""Relative distance above the least level at which gains are computed: nearer to it they grow without bound."""


def kalman(problem: SlowProblem) -> tuple[Controller, GainBracket]:
    """The linear-quadratic-Gaussian controller and its level; raises SolverError if rounding spoils it."""
    controller = central(problem, np.inf)
    return controller, gain(problem, closed(problem, controller))


def central(problem: SlowProblem, level: float) -> Controller:
    """The controller of least entropy that keeps a level above the least; raises SolverError if rounding spoils it."""
    controller = Equations(problem).at(level)
    if controller is None:
        raise SolverError(problem.lost())
    return controller


def measures(problem: SlowProblem, level: float) -> Measures:
    """Exact gain and root mean square of `central`."""
    loop = closed(problem, central(problem, level))
    return gain(problem, loop).upper, root_mean_square(problem, loop)


def least_level(problem: SlowProblem, reached: float) -> tuple[float, float]:
    """Bracket of the least level of any controller at these rates; reached: a level that some controller has.

    Raises InvalidInputError if the least level is zero, SolverError if rounding hides it.
    """
    if problem.decays and not (np.any(problem.state_weight) and np.any(problem.process_noise)):
        raise InvalidInputError(
            "the least worst-case gain is zero: no noise reaches a weighted state; give state_weight and process_noise"
        )
    equations = Equations(problem)
    high = next((level for level in _doubled(reached, 2.0) if equations.margin(level) > 0), None)
    low = None if high is None else next((level for level in _doubled(high, 0.5) if equations.margin(level) <= 0), None)
    if high is None or low is None:
        raise SolverError(problem.lost())
    while high - low > SEARCH_WIDTH * high:
        middle = (low + high) / 2
        low, high = (low, middle) if equations.margin(middle) > 0 else (middle, high)
    return low, high


def _doubled(level: float, factor: float) -> Iterator[float]:
    return (level * factor**power for power in range(DOUBLINGS))


def limit(problem: SlowProblem) -> float | None:
    """A bound for those who know all measurements, past and future, and set every input at each instant.

    By Parrott's theorem the least gain of T11 + T12 Q T21 over all, also non-causal, Q is the larger of those of T11
    off the range of T12 and of T11 off the row space of T21: the bound of a smoother, and that of its dual. None if
    rounding spoils both.
    """
    A, B = problem.sampled.state, problem.sampled.input
    seen = np.sqrt(problem.period) * root(problem.state_weight).T
    effort = np.sqrt(problem.period) * root(problem.input_weight)
    sensors, always = problem.sensors, SensingSchedule((1,) * B.shape[1])
    sensor = MultiratePlant(A=A, B_d=problem.noise, C=problem.plant.C, D=root(problem.sensor_noise), W=seen)
    dual = MultiratePlant(A=A.T, B_d=seen.T, C=B.T, D=effort, W=problem.noise.T)
    found = []
    for plant, schedule in ((sensor, sensors), (dual, always)):
        try:
            found.append(noncausal_bound(MultirateProblem(plant, schedule)).lower)
        except (InvalidInputError, SolverError):
            continue
    return max(found, default=None)


def of_continuous_gains(problem: SlowProblem, observer: str) -> float | None:
    """The level of K and L that are designed in continuous time for the same noise; None if that loop is unstable.

    A reading of covariance V every h seconds is noise of intensity h V.
    """
    slow = problem.period * problem.sensors.periods[0]
    weights = Weights(problem.state_weight, problem.input_weight, problem.process_noise, slow * problem.sensor_noise)
    try:
        K, L = continuous_gains(problem.plant, weights)
    except InfeasibleError:
        return None
    design = DualRateDesign(problem.plant, K, L, problem.period, problem.sensors.periods[0])
    loop = of_gains(problem, close_loop(design, OBSERVERS[observer]))
    return gain(problem, loop).upper if loop.spectral_radius() < 1 else None


def beside(problem: SlowProblem, level: float, of_kalman: float) -> tuple[Evidence, ...]:
    """What a level is worth: without sensors, of the Kalman filter, of the non-causal limit; advice."""
    without = gain(problem, alone(problem)).upper if problem.decays else None
    compared = 0.0 if without == 0.0 else level  # what is left of a level then is rounding
    return baselines(compared, MEASURE, without=without, kalman=of_kalman, limit=limit(problem))
