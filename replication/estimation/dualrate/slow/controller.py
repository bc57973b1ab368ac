"""The controller of a slow-rate problem at a level: two periodic Riccati equations and the condition that couples them.

At an infinite level it is the linear-quadratic-Gaussian one. The command at an instant uses the readings before it, so
that one fast period is left to compute. Source: Basar and Bernhard, H-infinity-Optimal Control (2nd ed., 1995), ch. 3
and 6: the discrete-time game with delayed measurements; here all is periodic, and inputs may be held.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from replication.estimation.dualrate.slow.problem import SlowProblem, in_natural_units
from replication.estimation.linear.periodic import block_diagonal, monodromy
from replication.estimation.linear.riccati import RiccatiMap, reversed_in_time, stacked
from replication.estimation.multirate.kalman import semidefinite, stationary
from replication.estimation.validation import Array

STABLE = 1 - 1e-12


@dataclass(frozen=True, eq=False)
class Controller:
    """At each instant of the period: u = K o, o = (x^, u before); x^+ = A x^ + B u + L y.

    Attributes
    ----------
    A : array (N, n, n)
        Of the observer; L (N, n, p) is zero for sensors that do not deliver.
    L : array (N, n, p)
        Gain on the readings.
    K : array (N, m, n + m)
        Rows of inputs that do not change repeat the input before.
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
        return stacked(RiccatiMap(A, seen - lost, G @ G.T) for _, seen in self.information)

    def regulating(self, level: float) -> list[tuple[RiccatiMap, Array, Array]]:
        """Of the cost to go on (x, u before), one map for each instant; then R^-1 B' and the part of v that is fixed.

        v = fixed (x, u before) - R^-1 B' (..) is what the inputs that change are set to.
        """
        p, step = self.problem, self.problem.sampled
        (n, m), Q, R = step.input.shape, p.period * p.state_weight, p.period * p.input_weight
        worst = np.zeros((n + m, n + m))
        worst[:n, :n] = p.noise @ p.noise.T / level**2
        made = {}
        for S in p.changed():
            kept = np.eye(m) - S
            weight = S @ R @ S + kept
            fixed = np.zeros((m, n + m))
            fixed[:, n:] = -np.linalg.solve(weight, S @ R @ kept)
            drive = np.vstack([step.input @ S, S])
            free = np.block([[step.state, step.input @ kept], [np.zeros((m, n)), kept]]) + drive @ fixed
            cost = block_diagonal([Q, kept @ R @ kept])
            cost[n:, n:] -= fixed[:, n:].T @ weight @ fixed[:, n:]
            moves = np.asarray(np.linalg.solve(weight, drive.T), dtype=float)
            made[S.tobytes()] = (RiccatiMap(free.T, drive @ moves - worst, cost), moves, fixed)
        return [made[S.tobytes()] for S in p.changed()]

    def margin(self, level: float) -> float:
        """How far the conditions of the level are met; some controller keeps the level iff it is positive."""
        return self._solved(level)[1]

    def at(self, level: float) -> Controller | None:
        """The controller for the level; None if there is none."""
        solved, margin = self._solved(level)
        if solved is None or margin <= 0:
            return None
        (sigma, cost), p = solved, self.problem
        n, m = p.plant.B_u.shape
        observed = []
        for X, A, G, (weighed, _) in zip(sigma, *self.filtering(level)[:2], self.information, strict=True):
            gain = A @ np.linalg.solve(np.eye(n) + X @ G, X)
            observed.append((A - gain @ G, gain @ weighed))
        laws = []
        for k, ((stage, moves, fixed), S) in enumerate(zip(self.regulating(level), p.changed(), strict=True)):
            following = cost[(k + 1) % len(cost)]
            after = following @ np.linalg.solve(np.eye(n + m) + stage.G @ following, stage.A.T)
            worst = np.eye(n + m)  # x^ is not what the command acts on, but the state that is worst for it
            worst[:n] -= sigma[k] @ cost[k][:n] / level**2
            law = np.linalg.solve(worst.T, (fixed - moves @ after).T).T
            law[:, n:] += np.eye(m) - S
            laws.append(law)
        _, t, r = self._scaled
        A, L = (np.stack(parts) for parts in zip(*observed, strict=True))
        return Controller(A * t[:, None] / t, L * t[:, None], np.stack(laws) * r[:, None] / np.concatenate([t, r]))

    def _solved(self, level: float) -> tuple[tuple[Array, Array] | None, float]:
        """Covariance and cost at each instant, or None, and the margin."""
        n, m = self.problem.plant.B_u.shape
        # The cost runs backwards in time.
        sigma = _solution(self.filtering(level), n)
        back = _solution(reversed_in_time(stacked(stage for stage, *_ in self.regulating(level))), n + m)
        if sigma is None or back is None:
            return None, -1.0
        cost = np.roll(back[::-1], 1, axis=0)
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
