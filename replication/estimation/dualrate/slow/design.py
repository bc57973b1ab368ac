"""A controller for the rates as they are: linear-quadratic-Gaussian, or with the least worst-case gain."""

from __future__ import annotations

from functools import partial
from math import isfinite
from typing import Any

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.results import EXACT_GAIN, Bracket, Evidence
from replication.estimation.api.shown import frozen
from replication.estimation.api.signals import Signals
from replication.estimation.api.tradeoff import Goal, balanced
from replication.estimation.dualrate.slow.controller import Controller
from replication.estimation.dualrate.slow.levels import (
    MARGIN,
    beside,
    central,
    kalman,
    least_level,
    measures,
    of_continuous_gains,
)
from replication.estimation.dualrate.slow.loop import closed, gain, noise_to_output, root_mean_square
from replication.estimation.dualrate.slow.problem import SlowProblem
from replication.estimation.dualrate.slow.result import SlowRateResult
from replication.estimation.validation import positive_scalar

GOALS = {Goal.H2: "linear-quadratic-Gaussian", Goal.HINF: "H-infinity", Goal.MIXED: "least entropy at a level"}


def require_level(goal: Goal, level: Any) -> float | None:
    """The level as a number; raises InvalidInputError."""
    if level is not None and goal is Goal.H2:
        raise InvalidInputError('level belongs to goal="hinf" or "mixed"; the other is linear-quadratic-Gaussian')
    return None if level is None else positive_scalar("level", level)


def slow_design(
    problem: SlowProblem, signals: Signals, *, goal: Goal, level: float | None, observer: str
) -> SlowRateResult:
    """The controller for `goal`; observer: that of the continuous gains which are set beside it.

    Raises InfeasibleError: no controller at these rates keeps the level. SolverError: rounding spoils the equations.
    """
    controller, exact = kalman(problem)
    reached = exact.upper
    found: tuple[Evidence, ...] = ()
    if goal is not Goal.H2:
        controller, found = _worst_case(problem, reached, level, goal)
        exact = gain(problem, closed(problem, controller))
    loop = closed(problem, controller)
    noise = gain(problem, noise_to_output(problem, loop)).upper
    rates = f"sensors {problem.sensors.periods}, inputs {problem.actuators.periods}"
    evidence = (
        Evidence("goal", str(goal), GOALS[goal]),
        Evidence("monodromy radius", loop.spectral_radius(), "largest eigenvalue over one period; stable below 1"),
        *found,
        Evidence(
            "root mean square", root_mean_square(problem, loop), "of (x, u), white noise, periodic Lyapunov equation"
        ),
        Evidence(
            "gain from sensor noise to output", noise, "root mean squares, exact; the measure of continuous gains"
        ),
        *_continuous(problem, observer),
        Evidence("fast period T", problem.period, "as given", "s"),
        Evidence("ratios", rates, "as given"),
        *beside(problem, exact.upper, reached),
    )
    return SlowRateResult(
        bracket=Bracket(exact.lower, exact.upper, EXACT_GAIN),
        gains=frozen({"A": controller.A, "L": controller.L, "K": controller.K}),
        evidence=evidence,
        signals=signals,
        problem=problem,
        controller=controller,
    )


def _worst_case(
    problem: SlowProblem, reached: float, level: float | None, goal: Goal
) -> tuple[Controller, tuple[Evidence, ...]]:
    """The controller for `level`, or for that of the goal, and what is known of the least level."""
    low, high = least_level(problem, reached)
    if level is not None and level <= low:
        raise InfeasibleError(
            f"no controller at these rates keeps the level {level!r}: the least is from {low:.7g} to {high:.7g}"
        )
    aim = (1 + MARGIN) * high if level is None else max(level, high)
    if goal is Goal.MIXED and level is None:
        aim = balanced(aim, high, partial(measures, problem))
    return central(problem, aim), (
        Evidence("level of the design", aim if isfinite(aim) else "infinite", "central solution, of least entropy"),
        Evidence("optimum", high, "least level of any controller at these rates; two coupled Riccati equations"),
        Evidence("optimum lies above", low, "the equations have no solution there"),
    )


def _continuous(problem: SlowProblem, observer: str) -> tuple[Evidence, ...]:
    """The gains of the paper, designed for one ratio of all sensors and inputs that change at each instant."""
    if problem.actuators.period > 1 or len(set(problem.sensors.periods)) > 1:
        return ()
    level = of_continuous_gains(problem, observer)
    how = f"K and L designed in continuous time, observer {observer}; same measure"
    return (Evidence("level of the continuous gains", "infinite: unstable" if level is None else level, how),)
