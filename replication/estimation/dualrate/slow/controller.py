"""The controller of a slow-rate problem at a level, its closed loops, and their levels by one measure.

At an infinite level it is the linear-quadratic-Gaussian one. The command at an instant uses the readings before it, so
that one fast period is left to compute. Source: Basar and Bernhard, H-infinity-Optimal Control (2nd ed., 1995), ch. 3
and 6: the discrete-time game with delayed measurements; here all is periodic, and inputs may be held.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.results import Evidence, baselines
from replication.estimation.api.shown import Measures
from replication.estimation.dualrate.loop import DualRateLoop, LoopStep, close_loop, loop_step
from replication.estimation.dualrate.observers import OBSERVERS, ObserverStep
from replication.estimation.dualrate.problem import DualRateDesign
from replication.estimation.dualrate.result import DualRateResult, Weights
from replication.estimation.dualrate.slow.problem import SlowProblem, in_natural_units
from replication.estimation.linear.norms import GainBracket, l2_gain, white_noise_variance
from replication.estimation.linear.periodic import PeriodicSystem, Stage, block_diagonal, monodromy
from replication.estimation.linear.riccati import RiccatiMap, reversed_in_time, stacked
from replication.estimation.multirate.kalman import semidefinite, stationary
from replication.estimation.multirate.optimum import noncausal_bound
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array, root

STABLE = 1 - 1e-12


@dataclass(frozen=True, eq=False)
class Controller:
    """At each instant of the period: u = K o, o = (x^, u before); x^+ = A x^ + B u + L y.

    A (N, n, n); L (N, n, p), zero for sensors that do not deliver; K (N, m, n + m), of which rows of inputs that do not
    change repeat the input before.
    """

    A: Array
    L: Array
    K: Array


@dataclass(frozen=True, eq=False)
class Equations:
    """The Riccati equations of one problem, in its natural units; z and the noise are in units of their weights."""

    given: SlowProblem

    @cached_property
    def _scaled(self) -> tuple[SlowProblem, Array, Array]:
        return in_natural_units(self.given)

    @property
    def problem(self) -> SlowProblem:
        """The given one in natural units."""
        return self._scaled[0]

    @cached_property
    def information(self) -> list[tuple[Array, Array]]:
        """For each instant C'V^-1 with zero columns for sensors that do not deliver, and C'V^-1 C."""
        C, V = self.problem.plant.C, self.problem.sensor_noise
        known: dict[tuple[int, ...], tuple[Array, Array]] = {}
        for rows in map(tuple, self.problem.measured()):
            if rows not in known:
                weighed, due = np.zeros(C.T.shape), list(rows)
                weighed[:, due] = np.linalg.solve(V[np.ix_(due, due)], C[due]).T
                known[rows] = (weighed, weighed @ C)
        return [known[tuple(rows)] for rows in self.problem.measured()]

    def filtering(self, level: float) -> RiccatiMap:
        """Of the error covariance, forwards in time."""
        A, G = self.problem.sampled.state, self.problem.noise
        lost = self.problem.period * self.problem.state_weight / level**2
        return stacked(RiccatiMap(A, information - lost, G @ G.T) for _, information in self.information)

    def regulating(self, level: float) -> list[tuple[RiccatiMap, Array, Array]]:
        """Of the cost to go on (x, u before), for each instant; then R^-1 B' and the fixed part of what changes."""
        p, step = self.problem, self.problem.sampled
        (n, m), Q, R = step.input.shape, p.period * p.state_weight, p.period * p.input_weight
        worst = np.zeros((n + m, n + m))
        worst[:n, :n] = p.noise @ p.noise.T / level**2
        stages = {}
        for S in p.changed():
            hold = np.eye(m) - S
            weight = S @ R @ S + hold
            fixed = np.zeros((m, n + m))
            fixed[:, n:] = -np.linalg.solve(weight, S @ R @ hold)
            drive = np.vstack([step.input @ S, S])
            free = np.block([[step.state, step.input @ hold], [np.zeros((m, n)), hold]]) + drive @ fixed
            cost = block_diagonal([Q, hold @ R @ hold])
            cost[n:, n:] -= fixed[:, n:].T @ weight @ fixed[:, n:]
            moves = np.asarray(np.linalg.solve(weight, drive.T), dtype=float)
            stages[S.tobytes()] = (RiccatiMap(free.T, drive @ moves - worst, cost), moves, fixed)
        return [stages[S.tobytes()] for S in p.changed()]

    def margin(self, level: float) -> float:
        """How far the conditions of the level are met; some controller keeps the level iff it is positive."""
        return self._solved(level)[1]

    def at(self, level: float) -> Controller | None:
        """The controller for the level; None if there is none."""
        solved, margin = self._solved(level)
        if solved is None or margin <= 0:
            return None
        A, L = self.observing(solved[0], level)
        return Controller(A, L, self.commanding(*solved, level))

    def observing(self, sigma: Array, level: float) -> tuple[Array, Array]:
        """A (N, n, n) and L (N, n, p) of the observer, in the given units; sigma: the covariance at each instant."""
        n, observed = self.problem.plant.order, []
        for X, A, G, (weighed, _) in zip(sigma, *self.filtering(level)[:2], self.information, strict=True):
            gain = A @ np.linalg.solve(np.eye(n) + X @ G, X)
            observed.append((A - gain @ G, gain @ weighed))
        t, (A, L) = self._scaled[1], (np.stack(parts) for parts in zip(*observed, strict=True))
        return A * t[:, None] / t, L * t[:, None]

    def commanding(self, sigma: Array, cost: Array, level: float) -> Array:
        """K (N, m, n + m), in the given units; cost: to go on, at each instant."""
        p, laws = self.problem, []
        n, m = p.plant.B_u.shape
        for k, ((stage, moves, fixed), S) in enumerate(zip(self.regulating(level), p.changed(), strict=True)):
            following = cost[(k + 1) % len(cost)]
            after = following @ np.linalg.solve(np.eye(n + m) + stage.G @ following, stage.A.T)
            worst = np.eye(n + m)  # x^ is not what the command acts on, but the state that is worst for it
            worst[:n] -= sigma[k] @ cost[k][:n] / level**2
            law = np.linalg.solve(worst.T, (fixed - moves @ after).T).T
            law[:, n:] += np.eye(m) - S
            laws.append(law)
        _, t, r = self._scaled
        return np.asarray(np.stack(laws) * r[:, None] / np.concatenate([t, r]))

    def covariance(self, level: float) -> Array | None:
        """Of the error at each instant."""
        return _solution(self.filtering(level), self.problem.plant.order)

    def cost(self, level: float) -> Array | None:
        """To go on, at each instant; it runs backwards in time."""
        back = _solution(
            reversed_in_time(stacked(stage for stage, *_ in self.regulating(level))), sum(self.problem.plant.B_u.shape)
        )
        return None if back is None else np.roll(back[::-1], 1, axis=0)

    def _solved(self, level: float) -> tuple[tuple[Array, Array] | None, float]:
        """Covariance and cost at each instant, or None, and the margin."""
        sigma, cost = self.covariance(level), self.cost(level)
        if sigma is None or cost is None:
            return None, -1.0
        return (sigma, cost), _margin(self.problem, sigma, cost, level)


def _solution(maps: RiccatiMap, size: int) -> Array | None:
    """The stabilising periodic solution (N, size, size), or None."""
    states = stationary(maps, np.broadcast_to(np.eye(size), maps.A.shape))
    if states is None or not np.all(np.isfinite(states)) or not semidefinite(states):
        return None
    try:
        closed = np.linalg.solve((np.eye(size) + states @ maps.G).mT, maps.A.mT).mT
    except np.linalg.LinAlgError:
        return None
    return states if np.max(np.abs(np.linalg.eigvals(monodromy(np.asarray(closed, dtype=float))))) < STABLE else None


def _margin(problem: SlowProblem, sigma: Array, cost: Array, level: float) -> float:
    """1 - (largest eigenvalue of G'M G, Sigma Q and Sigma~ M)/level^2; one at an infinite level.

    Sigma~ is the covariance at the next instant without the reading of this one, which the command does not know yet.
    """
    A, G, Q = problem.sampled.state, problem.noise, problem.period * problem.state_weight
    n = len(A)
    after = np.roll(cost, -1, axis=0)[:, :n, :n]
    largest = max(np.linalg.eigvalsh(G.T @ after @ G).max(), np.abs(np.linalg.eigvals(sigma @ Q)).max())
    if largest >= level**2:
        return 1.0 - float(largest) / level**2
    unseen = A @ np.linalg.solve(np.eye(n) - sigma @ Q / level**2, sigma) @ A.T + G @ G.T
    return 1.0 - float(max(largest, np.abs(np.linalg.eigvals(unseen @ after)).max())) / level**2


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
    return _weighed(problem, loop_steps(problem, controller), problem.measured())


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
    every = list(range(len(problem.plant.C)))
    return _weighed(problem, loop.steps, [every if np.any(step.noise) else [] for step in loop.steps])


def _weighed(problem: SlowProblem, steps: Sequence[LoopStep], read: Sequence[list[int]]) -> PeriodicSystem:
    """The loop in units of the weights; read: the sensors whose noise counts at each instant."""
    pairs = zip(steps, read, strict=True)
    return PeriodicSystem(tuple(_stage(problem, s.state, s.noise[:, due], due, s.input_state) for s, due in pairs))


def alone(problem: SlowProblem) -> PeriodicSystem:
    """The plant with the input zero."""
    n, m = problem.sampled.input.shape
    return PeriodicSystem((_stage(problem, problem.sampled.state, np.zeros((n, 0)), [], np.zeros((m, n))),))


def noise_to_output(problem: SlowProblem, loop: PeriodicSystem) -> PeriodicSystem:
    """From readings' noise of unit size to the plant outputs, weighted so that the gain is one of root mean squares."""
    plant, skipped = problem.unloaded.plant, problem.noise.shape[1]
    rows = len(plant.C)
    measured = problem.measured()
    readings = sum(len(due) for due in measured) / rows
    output = np.zeros((rows, loop.order))
    output[:, : plant.order] = np.sqrt(readings / len(measured)) * plant.C
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


def central(problem: SlowProblem, level: float) -> Controller:
    """The controller of least entropy that keeps a level above the least; raises SolverError if rounding spoils it."""
    controller = Equations(problem).at(level) if not problem.loads else _under_loads(problem)
    if controller is None:
        raise SolverError(problem.lost())
    return controller


def _under_loads(problem: SlowProblem) -> Controller | None:
    """The linear-quadratic-Gaussian controller that estimates the loads and takes x and u to where they hold them."""
    observer, regulator, steady = Equations(problem), Equations(problem.unloaded), problem.steady
    sigma, cost = observer.covariance(np.inf), regulator.cost(np.inf)
    if steady is None or sigma is None or cost is None:
        return None
    size, m = steady.inner.B_u.shape
    K = regulator.commanding(np.zeros((len(cost), size, size)), cost, np.inf)
    held = steady.inputs[:, : steady.loads] @ steady.load
    inner = np.block([[steady.deviation, np.zeros((size, m))], [-held, np.eye(m)]])
    return Controller(*observer.observing(sigma, np.inf), K @ inner + np.hstack([held, np.zeros((m, m))]))


def covariances(problem: SlowProblem) -> Array:
    """Of the error of the Kalman filter before each reading (N, n, n); raises SolverError if rounding spoils it."""
    units = (equations := Equations(problem))._scaled[1]
    sigma = equations.covariance(np.inf)
    if sigma is None:
        raise SolverError(problem.lost())
    return sigma * np.outer(units, units)


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
