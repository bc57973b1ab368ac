"""A plant with slow sensors and inputs, sampled at the fast period T, and its controller at a level.

Sensor i delivers y_i = C_i x + noise at every ratio_i-th instant; input j changes at every ratio_j-th and is held. The
process noise w acts in continuous time; over one period it is G d with G G' = int e^{As} W e^{A's} ds, which has the
same covariance and, as a map from square-integrable w, the same gain.

At an infinite level the controller is the linear-quadratic-Gaussian one. The command at an instant uses the readings
before it, so that one fast period is left to compute. Source: Basar and Bernhard, H-infinity-Optimal Control (2nd ed.,
1995), ch. 3 and 6: the discrete-time game with delayed measurements; here all is periodic, and inputs may be held.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import lcm
from typing import Any, Self

import numpy as np
import scipy
from numpy.typing import NDArray

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.dualrate.observers import Held, held
from replication.estimation.dualrate.problem import MAX_RATIO, Plant, Steady, folded_mode, steady_of
from replication.estimation.linear.periodic import balanced_units, monodromy
from replication.estimation.linear.riccati import RiccatiMap
from replication.estimation.multirate.kalman import semidefinite, stationary
from replication.estimation.multirate.problem import SensingSchedule
from replication.estimation.nonuniform.stamped.kalman import Transition
from replication.estimation.validation import (
    Array,
    hidden_modes,
    positive_integer,
    positive_scalar,
    root,
    undetectable_mode,
)

BOUNDARY = 1e-9
"""Real parts up to so much, in 1/s or of the largest eigenvalue, count as zero."""
LONGEST = 10_000
"""Fast periods after which the rates must repeat: a design takes minutes then."""
CANCELLED = 1e-12
"""The effect of a held input, as a share of what it could be, below which it is rounding."""


@dataclass(frozen=True, eq=False)
class SlowProblem:
    """Plant, fast period (s), schedules, and the weights of z = (Q^(1/2) x, R^(1/2) u) and of the noise.

    state_weight: Q (n, n). input_weight: R (m, m). process_noise: intensity W (n, n). sensor_noise: covariance V (p, p)
    of one reading. Sizes and definiteness of the weights are checked by whoever makes one. steady: loads and
    set-points; x and u of z are then without what holds the loads.
    """

    plant: Plant
    period: float
    sensors: SensingSchedule
    actuators: SensingSchedule
    state_weight: Array
    input_weight: Array
    process_noise: Array
    sensor_noise: Array
    steady: Steady | None = None

    @property
    def loads(self) -> int:
        """Number of constant loads."""
        return 0 if self.steady is None else self.steady.loads

    @cached_property
    def unloaded(self) -> Self:
        """The problem of what feedback can move; itself without loads."""
        if self.steady is None or not self.steady.loads:
            return self
        back, off = self.steady.back, self.steady.deviation
        Q, W = back.T @ self.state_weight @ back, off @ self.process_noise @ off.T
        return replace(self, plant=self.steady.inner, state_weight=Q, process_noise=W, steady=None)

    @property
    def instants(self) -> int:
        """N, after which everything repeats, in fast periods."""
        return lcm(self.sensors.period, self.actuators.period)

    @cached_property
    def sampled(self) -> Held:
        """The plant over one fast period."""
        return held(self.plant.A, self.plant.B_u, self.period)

    @cached_property
    def noise(self) -> Array:
        """G (n, n) of the process noise over one fast period."""
        A = self.plant.A
        return root(Transition.of(A, np.zeros((len(A), 0)), self.process_noise).at(self.period)[2])

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Which sensors deliver at each instant of the period (N, p)."""
        return np.tile(self.sensors.mask, (self.instants // self.sensors.period, 1))

    @property
    def changed(self) -> Array:
        """At each instant of the period the matrix (N, m, m) with ones for the inputs that change."""
        return np.stack([self.actuators.selection(k) for k in range(self.instants)])

    @property
    def decays(self) -> bool:
        """Whether the plant is stable when it is left alone."""
        return bool(np.max(np.linalg.eigvals(self.plant.A).real) < -BOUNDARY)

    def lost(self) -> str:
        """What to say where rounding spoils a design."""
        whole = self.period * self.instants
        growth = max(0.0, float(np.max(np.linalg.eigvals(self.plant.A).real))) * whole
        return (
            "the design at the slow rate was lost in rounding: the fastest mode grows by a factor of "
            f"exp({growth:.3g}) over the {whole:g} s after which the rates repeat; measure more often, or bring the "
            "weights nearer to each other"
        )


def slow_problem(
    plant: Plant, *, period: Any, ratio: Any, hold: Any, weights: tuple[Array, ...], tracked: Any = None
) -> SlowProblem:
    """Check and assemble; weights: Q, R, W, V. tracked: outputs at set-points.

    Raises InvalidInputError: a period or ratio that does not fit, a mode on the boundary of stability that the weights
    leave out. InfeasibleError: no controller stabilises the plant at these rates, with the mode that it leaves alone.
    """
    T = positive_scalar("period T", period, unit="seconds")
    sensors = _schedule("ratio", ratio, len(plant.C), "sensor")
    actuators = _schedule("hold", hold, plant.B_u.shape[1], "input")
    if (instants := lcm(sensors.period, actuators.period)) > LONGEST:
        raise InvalidInputError(
            f"ratio and hold repeat together only after {instants} fast periods, more than {LONGEST}; choose ratios "
            "with common factors, or a longer fast period"
        )
    Q, R, W, V = weights
    problem = SlowProblem(plant, T, sensors, actuators, Q, R, W, V, steady_of(plant, tracked))
    whole, moved = (in_natural_units(part)[0] for part in (problem, problem.unloaded))
    _require_stabilisable(whole, moved)
    weighed = (
        ("state_weight", moved.plant.A, moved.state_weight),
        ("process_noise", whole.plant.A.T, whole.process_noise),
    )
    for name, A, weight in weighed:
        scale = 1.0 + float(np.linalg.norm(A, 2))
        for mode in hidden_modes(A, weight, tolerance=BOUNDARY):
            # Gains tend to zero there, and never settle.
            if abs(mode.real) <= BOUNDARY * scale:
                raise InvalidInputError(
                    f"{name} leaves out the mode {mode:.6g} on the boundary of stability, so no optimal gain settles; "
                    "add a little weight on it"
                )
    return problem


def in_natural_units(problem: SlowProblem) -> tuple[SlowProblem, Array, Array]:
    """The same problem with x = t x~ and u = r u~, and the units t (n,) and r (m,), which keep rounding small.

    Inputs are in units of their weights, states in those in which A, what drives it and what looks at it are balanced.
    """
    plant = problem.plant
    r = np.diag(problem.input_weight) ** -0.5
    drive = np.hstack([plant.B_u * r, root(problem.process_noise)])
    whitened = np.linalg.solve(np.linalg.cholesky(problem.sensor_noise), plant.C)
    sight = np.vstack([root(problem.state_weight).T, whitened])
    t = balanced_units(plant.A, drive, sight)
    scaled = replace(
        problem,
        plant=Plant(plant.A * t / t[:, None], plant.B_u * r / t[:, None], plant.C * t),
        state_weight=problem.state_weight * np.outer(t, t),
        input_weight=problem.input_weight * np.outer(r, r),
        process_noise=problem.process_noise / np.outer(t, t),
    )
    return scaled, t, r


def _schedule(name: str, value: Any, count: int, what: str) -> SensingSchedule:
    """One ratio for all, or one for each."""
    entries = [value] * count if np.ndim(value) == 0 else list(value)
    if len(entries) == 1:
        entries = entries * count
    if len(entries) != count:
        raise InvalidInputError(f"{name} must be one number, or one for each of the {count} {what}s, got {value!r}")
    ratios = tuple(positive_integer(f"{name}[{i}]" if np.ndim(value) else name, M) for i, M in enumerate(entries))
    if (largest := max(ratios)) > MAX_RATIO:
        raise InvalidInputError(f"{name} must be at most {MAX_RATIO}, got {largest}; choose a longer fast period T")
    return SensingSchedule(ratios)


def _require_stabilisable(problem: SlowProblem, unloaded: SlowProblem) -> None:
    """Popov, Belevitch and Hautus, in continuous time and over a whole period of the schedules."""
    A, C, moved = problem.plant.A, problem.plant.C, unloaded.plant
    if (mode := undetectable_mode(moved.A.T, moved.B_u.T, discrete=False)) is not None:
        raise InfeasibleError(_proof(f"no input moves the unstable mode {mode:.6g}", "[A - s I, B] loses rank there"))
    if (mode := undetectable_mode(A, C, discrete=False)) is not None:
        raise InfeasibleError(_proof(f"no sensor sees the unstable mode {mode:.6g}", "[A - s I; C] loses rank there"))
    whole = problem.period * problem.instants
    if (mode := folded_mode(A, np.vstack(list(_seen(problem))), whole)) is not None:
        proof = f"the lifted pair over {whole:g} s fails the rank test there; change a ratio or the period"
        raise InfeasibleError(_proof(f"the sensors, at their instants, do not see the unstable mode {mode:.6g}", proof))
    if (mode := folded_mode(moved.A.T, np.vstack(list(_moved(unloaded))), whole)) is not None:
        proof = f"the lifted pair over {whole:g} s fails the rank test there; change hold or the period"
        raise InfeasibleError(_proof(f"the inputs, as they are held, do not move the unstable mode {mode:.6g}", proof))


def _proof(what: str, why: str) -> str:
    return f"no controller stabilises the loop: {what} ({why})"


def _seen(problem: SlowProblem) -> Iterator[Array]:
    """C_i e^{(A - s I) t} for each reading of a period; the shift s keeps growing modes from hiding the slow ones."""
    for row, ratio in zip(problem.plant.C, problem.sensors.periods, strict=True):
        yield from _powers(row[None, :], _still(problem, ratio), problem.instants // ratio)


def _moved(problem: SlowProblem) -> Iterator[Array]:
    """The same of the inputs, from the last one of a period back; each row is transposed."""
    for j, ratio in enumerate(problem.actuators.periods):
        column, time = problem.plant.B_u[:, [j]], ratio * problem.period
        effect = held(problem.plant.A, column, time).input
        # Over whole turns of an oscillation nothing is left but rounding.
        effect = effect * (np.linalg.norm(effect) > CANCELLED * time * np.linalg.norm(column))
        yield from _powers(effect.T, _still(problem, ratio).T, problem.instants // ratio)


def _powers(row: Array, transition: Array, count: int) -> Iterator[Array]:
    """The row over so many transitions, of which the first n^2 tell all."""
    for _ in range(min(count, len(transition) ** 2 + 1)):
        yield row
        row = row @ transition


def _still(problem: SlowProblem, ratio: int) -> Array:
    """The transition over so many fast periods, shifted so that nothing grows."""
    A = problem.plant.A
    shifted = A - max(0.0, float(np.max(np.linalg.eigvals(A).real))) * np.eye(len(A))
    return np.asarray(scipy.linalg.expm(shifted * ratio * problem.period))


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
    """The Riccati equations of a problem `in_natural_units`, t and r; z and the noise are in units of their weights."""

    problem: SlowProblem
    t: Array
    r: Array

    @cached_property
    def information(self) -> tuple[Array, Array]:
        """At each instant C'V^-1 (N, n, p) with zero columns for sensors that do not deliver, and C'V^-1 C."""
        C, due = self.problem.plant.C, self.problem.mask[:, :, None]
        V = np.where(due & due.mT, self.problem.sensor_noise, np.eye(len(C)))
        weighed = np.asarray(np.linalg.solve(V, due * C)).mT
        return weighed, weighed @ C

    def filtering(self, level: float) -> RiccatiMap:
        """Of the error covariance, forwards in time."""
        A, drive = self.problem.sampled.state, self.problem.noise
        G = self.information[1] - self.problem.period * self.problem.state_weight / level**2
        return RiccatiMap(np.broadcast_to(A, G.shape), G, np.broadcast_to(drive @ drive.T, G.shape))

    def regulating(self, level: float) -> tuple[RiccatiMap, Array, Array]:
        """Of the cost to go on (x, u before), forwards in time; R^-1 B' and the fixed part of what changes."""
        p, step, S = self.problem, self.problem.sampled, self.problem.changed
        (n, m), Q, R = step.input.shape, p.period * p.state_weight, p.period * p.input_weight
        fixed, free, cost = (np.zeros((len(S), rows, n + m)) for rows in (m, n + m, n + m))
        hold = np.eye(m) - S
        weight = S @ R @ S + hold
        fixed[..., n:] = -np.linalg.solve(weight, S @ R @ hold)
        drive = np.concatenate([step.input @ S, S], axis=1)
        free[:, :n, :n], free[:, :n, n:], free[:, n:, n:] = step.state, step.input @ hold, hold
        cost[:, :n, :n], cost[:, n:, n:] = Q, hold @ R @ hold - fixed[..., n:].mT @ weight @ fixed[..., n:]
        moves = np.asarray(np.linalg.solve(weight, drive.mT), dtype=float)
        G = drive @ moves
        G[:, :n, :n] -= p.noise @ p.noise.T / level**2
        return RiccatiMap((free + drive @ fixed).mT, G, cost), moves, fixed

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
        maps = self.filtering(level)
        gain = maps.A @ np.linalg.solve(np.eye(len(self.t)) + sigma @ maps.G, sigma)
        return (maps.A - gain @ maps.G) * self.t[:, None] / self.t, gain @ self.information[0] * self.t[:, None]

    def commanding(self, sigma: Array, cost: Array, level: float) -> Array:
        """K (N, m, n + m), in the given units; cost: to go on, at each instant."""
        (n, m), (maps, moves, fixed) = self.problem.plant.B_u.shape, self.regulating(level)
        following = np.roll(cost, -1, axis=0)
        after = following @ np.linalg.solve(np.eye(n + m) + maps.G @ following, maps.A.mT)
        worst = np.tile(np.eye(n + m), (len(cost), 1, 1))
        worst[:, :n] -= sigma @ cost[:, :n] / level**2  # x^ is not what the command acts on, but its worst state
        laws = np.linalg.solve(worst.mT, (fixed - moves @ after).mT).mT
        laws[..., n:] += np.eye(m) - self.problem.changed
        return np.asarray(laws * self.r[:, None] / np.concatenate([self.t, self.r]))

    def covariance(self, level: float) -> Array | None:
        """Of the error at each instant."""
        return _solution(self.filtering(level), self.problem.plant.order)

    def cost(self, level: float) -> Array | None:
        """To go on, at each instant; it runs backwards in time."""
        back = _solution(self.regulating(level)[0].at(np.s_[::-1]), sum(self.problem.plant.B_u.shape))
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


def central(problem: SlowProblem, level: float) -> Controller:
    """The controller of least entropy that keeps a level above the least; raises SolverError if rounding spoils it."""
    controller = Equations(*in_natural_units(problem)).at(level) if not problem.loads else _under_loads(problem)
    if controller is None:
        raise SolverError(problem.lost())
    return controller


def _under_loads(problem: SlowProblem) -> Controller | None:
    """The linear-quadratic-Gaussian controller that estimates the loads and takes x and u to where they hold them."""
    observer, regulator = (Equations(*in_natural_units(part)) for part in (problem, problem.unloaded))
    sigma, cost, steady = observer.covariance(np.inf), regulator.cost(np.inf), problem.steady
    if steady is None or sigma is None or cost is None:
        return None
    size, m = steady.inner.B_u.shape
    K = regulator.commanding(np.zeros((len(cost), size, size)), cost, np.inf)
    held = steady.inputs[:, : steady.loads] @ steady.load
    inner = np.block([[steady.deviation, np.zeros((size, m))], [-held, np.eye(m)]])
    return Controller(*observer.observing(sigma, np.inf), K @ inner + np.hstack([held, np.zeros((m, m))]))


def covariances(problem: SlowProblem) -> Array:
    """Of the error of the Kalman filter before each reading (N, n, n); raises SolverError if rounding spoils it."""
    equations = Equations(*in_natural_units(problem))
    sigma = equations.covariance(np.inf)
    if sigma is None:
        raise SolverError(problem.lost())
    return sigma * np.outer(equations.t, equations.t)
