"""The Kalman recursion over known times: update by a sample of some of the sensors, prediction over any h >= 0.

Where the process noise is held, what a sample tells of it is kept until the next one: the state of the filter is then
[x; w]. Sources: B. D. O. Anderson and J. B. Moore, Optimal Filtering (1979), ch. 5; G. J. Bierman, Automatica 9 (1973),
for the smoother, which inverts no covariance of the state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from replication.estimation.linear.riccati import symmetric
from replication.estimation.nonuniform.stamped.kalman.noisy_plant import NoisyPlant
from replication.estimation.nonuniform.stamped.transition import Transition
from replication.estimation.validation import Array


@dataclass(frozen=True, eq=False)
class Estimate:
    """An estimate x (n,) of the state at time t (s), and the covariance P (n, n) of its error."""

    t: float
    x: Array
    P: Array


@dataclass(frozen=True, eq=False)
class Instant:
    """What the filter knows at the time t of a sample.

    y (q,): the sample, NaN where a sensor did not measure; u (m,): the input from t on; prior: x^(k|k-1); mean and
    covariance: those after the sample, of x or [x; w]; used (q,): the sensors that measured, within the gate;
    innovation and spread: of these.
    """

    t: float
    y: Array
    u: Array
    prior: Estimate
    mean: Array
    covariance: Array
    innovation: Array
    spread: Array
    used: npt.NDArray[np.bool_]

    @property
    def gated(self) -> int:
        """How many of the numbers were beyond the gate."""
        return int(np.sum(~np.isnan(self.y) & ~self.used))


@dataclass(frozen=True, eq=False)
class Recursion:
    """The plant, its transitions with [B_u, I] as inputs, the known ones and held noise, and the gate (0 for none)."""

    plant: NoisyPlant
    transition: Transition
    gate: float = 0.0

    @classmethod
    def of(cls, plant: NoisyPlant, gate: float = 0.0) -> Recursion:
        """The recursion of a plant."""
        n = plant.order
        white = np.zeros((n, n)) if plant.S is not None else plant.Q
        return cls(plant, Transition.of(plant.A, np.hstack([plant.B_u, np.eye(n)]), white), gate)

    def update(self, prior: Estimate, y: Array, u: Array) -> Instant:
        """Take the entries of y (q,) that are numbers within the gate; with held noise all must be."""
        plant, n = self.plant, self.plant.order
        seen = ~np.isnan(y)
        if self.gate and np.any(seen):
            variances = np.einsum("qa,ab,qb->q", plant.C, prior.P, plant.C) + np.diag(plant.R)
            seen &= np.abs(np.where(seen, y - plant.C @ prior.x, 0.0)) <= self.gate * np.sqrt(variances)
        C, R = plant.C[seen], plant.R[np.ix_(seen, seen)]
        mean, covariance = prior.x, prior.P
        output, crossed = C, np.zeros((n, len(C)))
        if plant.S is not None:
            mean, covariance = np.concatenate([mean, np.zeros(n)]), scipy.linalg.block_diag(covariance, plant.Q)
            output, crossed = np.hstack([C, np.zeros_like(C)]), np.vstack([crossed, plant.S[:, seen]])
        innovation = y[seen] - C @ prior.x
        spread = symmetric(C @ prior.P @ C.T + R)
        if len(C):
            gain = np.linalg.solve(spread, (covariance @ output.T + crossed).T).T
            kept = np.eye(len(mean)) - gain @ output
            # Joseph's form: a sum of squares, as long as the noise is one.
            covariance = symmetric(
                kept @ covariance @ kept.T + gain @ R @ gain.T - kept @ crossed @ gain.T - gain @ crossed.T @ kept.T
            )
            mean = mean + gain @ innovation
        return Instant(prior.t, y, u, prior, mean, covariance, innovation, spread, seen)

    def predict(self, known: Instant, t: float) -> Estimate:
        """x^ and its covariance at t, not before `known.t`, under the input that is held."""
        m = len(known.u)
        Phi, Gamma, spread = self.transition.at(t - known.t)
        whole = np.hstack([Phi, Gamma[:, m:]])[:, : len(known.mean)]
        x = whole @ known.mean + Gamma[:, :m] @ known.u
        return Estimate(t, x, symmetric(whole @ known.covariance @ whole.T) + spread)

    def smooth(self, instants: Sequence[Instant]) -> list[Estimate]:
        """The estimate at each instant from all samples of all of them, for white noise."""
        n = self.plant.order
        pull, weight = np.zeros(n), np.zeros((n, n))
        found: list[Estimate] = []
        following: Instant | None = None
        for one in reversed(instants):
            if following is not None:
                Phi = self.transition.at(following.t - one.t)[0]
                pull, weight = Phi.T @ pull, Phi.T @ weight @ Phi
            x, P = one.mean[:n], one.covariance[:n, :n]
            found.append(Estimate(one.t, x + P @ pull, symmetric(P - P @ weight @ P)))
            C = self.plant.C[one.used]
            told = np.linalg.solve(one.spread, np.column_stack([one.innovation, C])) if len(C) else np.zeros((0, n + 1))
            kept = np.eye(n) - one.prior.P @ C.T @ told[:, 1:]
            pull = C.T @ told[:, 0] + kept.T @ pull
            weight = symmetric(C.T @ told[:, 1:] + kept.T @ weight @ kept)
            following = one
        return found[::-1]
