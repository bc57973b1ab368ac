"""What a design at the slow rate guarantees, as a result: observer, running controller, state space, plot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from math import isfinite
from typing import Any, ClassVar

import numpy as np

from replication.errors import InfeasibleError
from replication.estimation.api.design import Design, Solution
from replication.estimation.api.export import Phase, Recursion
from replication.estimation.api.plants import Signals, each_instant
from replication.estimation.api.results import Evidence
from replication.estimation.api.running import PeriodicObserver, statespace
from replication.estimation.api.shown import Goal, Measures, Traded, balanced
from replication.estimation.dualrate.loop import Driven, driven
from replication.estimation.dualrate.result import steady_error
from replication.estimation.dualrate.slow.controller import (
    MARGIN,
    Controller,
    beside,
    central,
    closed,
    gain,
    kalman,
    least_level,
    loop_steps,
    measures,
    noise_to_output,
    of_continuous_gains,
    root_mean_square,
)
from replication.estimation.dualrate.slow.problem import SlowProblem
from replication.estimation.linear.norms import GainBracket
from replication.estimation.linear.periodic import PeriodicSystem
from replication.estimation.validation import Array, StateSpace

GOALS = {Goal.H2: "linear-quadratic-Gaussian", Goal.HINF: "H-infinity", Goal.MIXED: "least entropy at a level"}


class RunningController(PeriodicObserver):
    """`command` is u(k); `step(None, y)` takes the readings of instant k and goes on, so that `command` is u(k+1).

    `estimate`, which `step` returns too, is (x^(k), u(k)). A reading that does not come is replaced by C x^. With
    set-points `step(r, y)` takes those of the next command.

    Parameters
    ----------
    problem : SlowProblem
        Plant, rates and weights.
    controller : Controller
        Its matrices, instant by instant.
    """

    def __init__(self, problem: SlowProblem, controller: Controller) -> None:
        self.problem, self.controller = problem, controller
        (n, m), p = problem.plant.B_u.shape, len(problem.plant.C)
        phases: list[Phase] = []
        for due, step in zip(problem.mask, driven_by(problem, controller), strict=True):
            t = step.ahead.shape[1]
            size = n + m + t
            transition, readout = np.zeros((size, size)), np.eye(n + m, size)
            transition[: n + m] = np.hstack([step.state[n:, n:], step.drive[n:]])
            readout[n:] = np.hstack([step.input[:, n:], step.ahead])
            drive, injection = np.eye(size)[:, n + m :], np.zeros((size, p))
            injection[:n] = controller.L[len(phases)]
            phases.append(Phase(transition, drive, injection, readout, due))
        self._count = m
        output = np.hstack([problem.plant.C, np.zeros((p, m))])
        super().__init__(phases, [output @ phase.readout for phase in phases])

    @property
    def command(self) -> Array:
        """u(k), (m,): what the inputs are set to at the present instant."""
        return self.estimate[-self._count :]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SlowRateResult(Design, Traded):
    """A controller with its observer, periodic at the fast instants: u = K (x^, u before), x^+ = A x^ + B u + L y.

    Attributes
    ----------
    problem : SlowProblem
        Plant, rates and weights.
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
    repeats: ClassVar[str] = "the period of the schedules"
    target: ClassVar[str] = "state and input"
    mean: ClassVar[str] = "rms of (x, u)"
    problem: SlowProblem

    @classmethod
    def solve(cls, problem: SlowProblem, *, goal: Goal, level: float | None, observer: str) -> Solution:
        """The central controller at an infinite level (h2), at `level`, or at that of the goal.

        observer: that of the continuous gains which are set beside it. Raises InfeasibleError if no controller at these
        rates keeps the level.
        """
        best, exact = kalman(problem)
        reached, rates = exact.upper, {"reached": exact.upper, "observer": observer}
        told = (Evidence("goal", str(goal), GOALS[goal]),)
        if goal is Goal.H2:
            return Solution(vars(best), told, rates)
        low, high = least_level(problem, reached)
        if level is not None and level <= low:
            raise InfeasibleError(
                f"no controller at these rates keeps the level {level!r}: the least is from {low:.7g} to {high:.7g}"
            )
        aim = (1 + MARGIN) * high if level is None else max(level, high)
        if goal is Goal.MIXED and level is None:
            aim = balanced(aim, high, partial(measures, problem))
        evidence = (
            *told,
            Evidence("level of the design", aim if isfinite(aim) else "infinite", "central solution, of least entropy"),
            Evidence("optimum", high, "least level of any controller at these rates; two coupled Riccati equations"),
            Evidence("optimum lies above", low, "the equations have no solution there"),
        )
        return Solution(vars(central(problem, aim)), evidence, rates)

    def facts(self, error: PeriodicSystem, solution: Solution) -> tuple[Evidence, ...]:
        """Beside the gains that are designed in continuous time, where there are such."""
        problem, rest = self.problem, self.problem.steady
        noise, mean = gain(problem, noise_to_output(problem, error)).upper, root_mean_square(problem, error)
        rates = f"sensors {problem.sensors.periods}, inputs {problem.actuators.periods}"
        continuous: tuple[Evidence, ...] = ()
        if not (problem.loads or problem.actuators.period > 1 or len(set(problem.sensors.periods)) > 1):
            level = of_continuous_gains(problem, solution.own["observer"])
            how = f"K and L designed in continuous time, observer {solution.own['observer']}; same measure"
            value = "infinite: unstable" if level is None else level
            continuous = (Evidence("level of the continuous gains", value, how),)
        goal, *designed = solution.evidence
        return (
            goal,
            Evidence("monodromy radius", error.spectral_radius(), "largest eigenvalue over one period; stable below 1"),
            *designed,
            Evidence("root mean square", mean, "of (x, u), white noise, periodic Lyapunov equation"),
            Evidence(
                "gain from sensor noise to output", noise, "root mean squares, exact; the measure of continuous gains"
            ),
            *continuous,
            Evidence("fast period T", problem.period, "as given", "s"),
            Evidence("ratios", rates, "as given"),
            *(() if rest is None else (steady_error(rest, problem.plant, self.driven),)),
            *beside(problem, self.value, solution.own["reached"]),
        )

    @property
    def driven(self) -> list[Driven]:
        """The loop of (x, x^, u before) with its set-points, instant by instant."""
        return driven_by(self.problem, self.controller)

    @property
    def controller(self) -> Controller:
        """The matrices of `gains` under their names."""
        return Controller(**self.gains)

    @property
    def loop(self) -> PeriodicSystem:
        """The closed loop, whose gain the bracket holds."""
        return closed(self.problem, self.controller)

    def error_system(self) -> PeriodicSystem:
        """The closed loop."""
        return self.loop

    def norm(self, error: PeriodicSystem) -> GainBracket:
        """Of a loop that was designed to be stable."""
        return gain(self.problem, error)

    def phases(self) -> Recursion:
        """The observer alone, which is told the inputs, to run where something else may set them."""
        plant, B, mask = self.problem.plant, self.problem.sampled.input, self.problem.mask
        shown, arrays = np.eye(plant.order), zip(self.controller.A, self.controller.L, mask, strict=True)
        phases = [Phase(A, B, L, shown, due) for A, L, due in arrays]
        return Recursion(phases, plant.order, [plant.C] * len(phases))

    def running(self) -> RunningController:
        """Observer and controller in one.

        Returns
        -------
        RunningController
            Its `command` is u at the present instant; `step(None, y)` takes the readings and goes on, `step(r, y)` the
            set-points of the tracked outputs too. It has a C form.
        """
        observer = RunningController(self.problem, self.controller)
        return observer.named(replace(self.signals, inputs=self._references()))

    def _references(self) -> tuple[str, ...]:
        steady = self.problem.steady
        asked = steady is not None and steady.asked
        return tuple(f"set-point of {self.signals.measurements[i]}" for i in steady.tracked) if steady and asked else ()

    def to_statespace(self) -> StateSpace:
        """The controller over a period of the schedules, from set-points and readings to inputs; `@k` for instant k."""
        running, n = self.running(), self.problem.plant.order
        phases = [replace(phase, readout=phase.readout[n:]) for phase in running.phases]
        lifted = statespace(phases, running.signals)
        lifted.set_inputs(each_instant((*self._references(), *self.signals.measurements), len(phases)))
        lifted.set_outputs(each_instant(self.signals.inputs, len(phases)))
        return lifted

    def designs(self) -> tuple[float, Callable[[float], Measures]]:
        """The central controllers at these rates, with these weights."""
        least = least_level(self.problem, kalman(self.problem)[1].upper)[1]
        return (1 + MARGIN) * least, partial(measures, self.problem)


def set_points(problem: SlowProblem, controller: Controller) -> Array:
    """N (N, m, t) of u = K (x^, u before) + N r: what leaves u where it holds the plant at r, x^ at its own rest."""
    if problem.steady is None:
        return np.zeros((*controller.K.shape[:2], 0))
    n, references = problem.plant.order, problem.steady.references
    x, u = references[:n], references[n:]
    drives = problem.sampled.input @ u + controller.L @ problem.plant.C @ x
    total, moved = np.eye(n), np.zeros(x.shape)
    for A, drive in zip(controller.A, drives, strict=True):
        total, moved = A @ total, A @ moved + drive
    guess, ahead = np.linalg.solve(np.eye(n) - total, moved), []
    for A, drive, K in zip(controller.A, drives, controller.K, strict=True):
        ahead.append(u - K @ np.vstack([guess, u]))
        guess = A @ guess + drive
    return np.stack(ahead)


def driven_by(problem: SlowProblem, controller: Controller) -> list[Driven]:
    """The loop of (x, x^, u before) with its set-points, instant by instant."""
    return driven(loop_steps(problem, controller), list(set_points(problem, controller)))


def slow_design(problem: SlowProblem, signals: Signals, **aims: Any) -> SlowRateResult:
    """The controller that `SlowRateResult.solve` finds, analysed."""
    solution = SlowRateResult.solve(problem, **aims)
    quantity = SlowRateResult.quantity + ("; x and u less what holds the loads" if problem.loads else "")
    return SlowRateResult.analysed(signals, solution, problem=problem, quantity=quantity)
