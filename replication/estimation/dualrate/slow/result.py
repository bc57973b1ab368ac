"""What a design at the slow rate guarantees: closed loops and their levels by one measure, and the result to run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import isfinite
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.design import Design, Solution
from replication.estimation.api.export import Phase, Recursion
from replication.estimation.api.plants import each_instant
from replication.estimation.api.results import Evidence, baselines
from replication.estimation.api.running import PeriodicObserver, statespace
from replication.estimation.api.shown import Goal, Measures, Traded, balanced
from replication.estimation.dualrate.loop import DualRateLoop, LoopStep, close_loop, driven, loop_step
from replication.estimation.dualrate.observers import OBSERVERS, ObserverStep
from replication.estimation.dualrate.problem import DualRateDesign
from replication.estimation.dualrate.result import DualRateResult, Weights, steady_error
from replication.estimation.dualrate.slow.problem import Controller, Equations, SlowProblem, central, in_natural_units
from replication.estimation.linear.norms import GainBracket, l2_gain, white_noise_variance
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.multirate.optimum import noncausal_bound
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array, StateSpace, root

SILENT = 1e-60
"""A mean square below it is zero."""


def closed(problem: SlowProblem, controller: Controller) -> PeriodicSystem:
    """State (x, x^, u before); inputs d and the noise of the readings, in units of their weights; outputs T^(1/2) z.

    With loads, x and u less what holds them, and x - x^: the loads, which stand still, are left out.
    """
    system, steady = joint(problem, controller), problem.steady
    if steady is None or not steady.loads:
        return system
    (n, m), off, back = problem.plant.B_u.shape, steady.deviation, steady.back
    held = steady.inputs[:, : steady.loads] @ steady.load
    to = np.block(
        [
            [off, np.zeros((len(off), n + m))],
            [np.eye(n), -np.eye(n), np.zeros((n, m))],
            [-held, np.zeros((m, n)), np.eye(m)],
        ]
    )
    rest = np.zeros((n, m))
    of = np.block([[back, np.zeros((n, n)), rest], [back, -np.eye(n), rest], [np.zeros((m, len(off) + n)), np.eye(m)]])
    return PeriodicSystem(tuple(Stage(to @ A @ of, to @ B, C @ of, D) for A, B, C, D in system.stages))


def joint(problem: SlowProblem, controller: Controller) -> PeriodicSystem:
    """`closed` with the loads among its states."""
    return _weighed(problem, loop_steps(problem, controller), problem.mask)


def loop_steps(problem: SlowProblem, controller: Controller) -> list[LoopStep]:
    """The loop of (x, x^, u before), instant by instant."""
    step, C, n = problem.sampled, problem.plant.C, problem.plant.order
    rest = np.zeros(n, complex), np.eye(n), np.zeros((n, len(C)))
    return [
        loop_step(K, ObserverStep(A, step.input, L, *rest), step, C)
        for A, L, K in zip(controller.A, controller.L, controller.K, strict=True)
    ]


def of_gains(problem: SlowProblem, loop: DualRateLoop) -> PeriodicSystem:
    """The same of a loop with gains that were designed in continuous time and one slow sensor period."""
    read = [np.full(len(problem.plant.C), np.any(step.noise)) for step in loop.steps]
    return _weighed(problem, loop.steps, read)


def _weighed(problem: SlowProblem, steps: Sequence[LoopStep], read: Iterable[NDArray[np.bool_]]) -> PeriodicSystem:
    """The loop in units of the weights; read: the sensors whose noise counts at each instant."""
    pairs = zip(steps, read, strict=True)
    return PeriodicSystem(tuple(_stage(problem, s.state, s.noise[:, due], due, s.input_state) for s, due in pairs))


def alone(problem: SlowProblem) -> PeriodicSystem:
    """The plant with the input zero."""
    (n, m), none = problem.sampled.input.shape, np.zeros(len(problem.plant.C), dtype=bool)
    return PeriodicSystem((_stage(problem, problem.sampled.state, np.zeros((n, 0)), none, np.zeros((m, n))),))


def noise_to_output(problem: SlowProblem, loop: PeriodicSystem) -> PeriodicSystem:
    """From readings' noise of unit size to the plant outputs, weighted so that the gain is one of root mean squares."""
    plant, skipped = problem.unloaded.plant, problem.noise.shape[1]
    rows, mask = len(plant.C), problem.mask
    output = np.zeros((rows, loop.order))
    output[:, : plant.order] = np.sqrt(np.mean(mask)) * plant.C
    stages = []
    for stage, due in zip(loop.stages, mask, strict=True):
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


def _stage(problem: SlowProblem, transition: Array, read: Array, due: NDArray[np.bool_], u: Array) -> Stage:
    """One instant; read: effect of the noise of the readings that are due, u: the input by the state."""
    n, size = problem.plant.order, len(transition)
    drive = np.zeros((size, n))
    drive[:n] = problem.noise
    noise = np.hstack([drive, read @ root(problem.sensor_noise[np.ix_(due, due)])])
    rows = np.hstack([root(problem.state_weight).T, np.zeros((n, size - n))])
    z = np.sqrt(problem.period) * np.vstack([rows, root(problem.input_weight).T @ u])
    return Stage(transition, noise, z, np.zeros((len(z), noise.shape[1])))


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


def measures(problem: SlowProblem, level: float) -> Measures:
    """Exact gain and root mean square of `central`."""
    loop = closed(problem, central(problem, level))
    return gain(problem, loop).upper, root_mean_square(problem, loop)


def least_level(problem: SlowProblem, reached: float) -> tuple[float, float]:
    """Bracket of the least level of any controller at these rates; reached: a level that some controller has.

    Raises InvalidInputError if the least level is zero, SolverError if rounding hides it.
    """
    if problem.loads:
        raise InvalidInputError(
            'under constant loads the gains are those of goal="h2"; leave the loads out, or take that'
        )
    if problem.decays and not (np.any(problem.state_weight) and np.any(problem.process_noise)):
        raise InvalidInputError(
            "the least worst-case gain is zero: no noise reaches a weighted state; give state_weight and process_noise"
        )
    equations = Equations(*in_natural_units(problem))
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
    if problem.loads:
        return None
    A, B = problem.sampled.state, problem.sampled.input
    output = np.sqrt(problem.period) * root(problem.state_weight).T
    effort = np.sqrt(problem.period) * root(problem.input_weight)
    sensors, always = problem.sensors, SensingSchedule((1,) * B.shape[1])
    sensor = MultiratePlant(A=A, B_d=problem.noise, C=problem.plant.C, D=root(problem.sensor_noise), W=output)
    dual = MultiratePlant(A=A.T, B_d=output.T, C=B.T, D=effort, W=problem.noise.T)
    limits = []
    for plant, schedule in ((sensor, sensors), (dual, always)):
        try:
            limits.append(noncausal_bound(MultirateProblem(plant, schedule)).lower)
        except (InvalidInputError, SolverError):
            continue
    return max(limits, default=None)


def of_continuous_gains(problem: SlowProblem, observer: str) -> float | None:
    """The level of K and L that are designed in continuous time for the same noise; None if that loop is unstable.

    A reading of covariance V every h seconds is noise of intensity h V.
    """
    slow = problem.period * problem.sensors.periods[0]
    weights = Weights(problem.state_weight, problem.input_weight, problem.process_noise, slow * problem.sensor_noise)
    try:
        gains = DualRateResult.solve(problem.plant, weights).gains
    except InfeasibleError:
        return None
    design = DualRateDesign(problem.plant, gains["K"], gains["L"], problem.period, problem.sensors.periods[0])
    loop = of_gains(problem, close_loop(design, OBSERVERS[observer]))
    return gain(problem, loop).upper if loop.spectral_radius() < 1 else None


def beside(problem: SlowProblem, level: float, of_kalman: float) -> tuple[Evidence, ...]:
    """What a level is worth: without sensors, of the Kalman filter, of the non-causal limit; advice."""
    without = gain(problem, alone(problem)).upper if problem.decays else None
    compared = 0.0 if without == 0.0 else level  # what is left of a level then is rounding
    return baselines(compared, MEASURE, without=without, kalman=of_kalman, limit=limit(problem))


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
            t = step.command.shape[1]
            size = n + m + t
            transition, readout = np.zeros((size, size)), np.eye(n + m, size)
            transition[: n + m] = np.hstack([step.state[n:, n:], step.command[n:]])
            readout[n:] = np.hstack([step.input_state[:, n:], step.input_command])
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
    def driven(self) -> list[LoopStep]:
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


def driven_by(problem: SlowProblem, controller: Controller) -> list[LoopStep]:
    """The loop of (x, x^, u before) with its set-points, instant by instant."""
    return driven(loop_steps(problem, controller), list(set_points(problem, controller)))
