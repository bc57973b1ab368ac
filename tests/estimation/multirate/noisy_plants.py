"""Plants with correlated noise, and the estimates of a filter by conditioning all at once: no recursion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg

from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array


def correlated(problem: MultirateProblem, seed: int, share: float = 0.5) -> MultirateProblem:
    """The same problem, whose sensor noise also drives the state."""
    plant = problem.plant
    size = share * np.linalg.norm(plant.B_d) / np.sqrt(plant.D.shape[1])
    B_w = size * np.random.default_rng(seed).normal(size=(plant.order, plant.D.shape[1])) / np.sqrt(plant.order)
    return MultirateProblem(replace(plant, B_w=B_w), problem.schedule)


def lifted(problem: MultirateProblem) -> Stage:
    """From all noise (d, w) of a period to the measurements of a period."""
    plant, stages = problem.plant, []
    B_w = plant.B_w if plant.correlated else np.zeros((plant.order, plant.D.shape[1]))
    drive = np.hstack([plant.B_d, B_w])
    for rows in problem.measured_rows():
        noise = np.hstack([np.zeros((len(rows), plant.B_d.shape[1])), plant.D[rows]])
        stages.append(Stage(plant.A, drive, plant.C[rows], noise))
    return PeriodicSystem(tuple(stages)).lift()


def by_lifted_equation(problem: MultirateProblem) -> Array:
    """The stationary covariance at phase 0 from the Riccati equation of the lifted plant, by scipy."""
    A, B, C, D = lifted(problem)
    return np.asarray(scipy.linalg.solve_discrete_are(A.T, C.T, B @ B.T, D @ D.T, s=B @ D.T))


def by_plain_recursion(problem: MultirateProblem, P: Array, steps: int) -> list[Array]:
    """P(0), P(1), ... by the formulas of the textbook, with inverses."""
    plant, found = problem.plant, [P]
    Q = plant.drive @ plant.drive.T
    for k in range(steps):
        rows = list(problem.schedule.measured(k))
        C, D = plant.C[rows], plant.D[rows]
        S = plant.B_w @ D.T if plant.correlated else np.zeros((plant.order, len(rows)))
        L = (plant.A @ P @ C.T + S) @ np.linalg.inv(C @ P @ C.T + D @ D.T)
        P = plant.A @ P @ plant.A.T + Q - L @ (C @ P @ plant.A.T + S.T)
        found.append(P)
    return found


def with_noise_as_state(problem: MultirateProblem, own: Array) -> MultirateProblem:
    """The same estimation with the noise w as states that are driven anew each instant; `own` (q, r): further noise.

    `problem` has D = [D_1, own] and B_w = [B_1, 0]: D_1 w_1 is seen by C then, and only `own` is left as noise.
    """
    plant = problem.plant
    common = plant.D.shape[1] - own.shape[1]
    n, m = plant.order, plant.B_d.shape[1]
    A = np.zeros((n + common, n + common))
    A[:n, :n], A[:n, n:] = plant.A, plant.B_w[:, :common]
    B = scipy.linalg.block_diag(plant.B_d, np.eye(common))
    assert B.shape == (n + common, m + common)
    W = np.hstack([plant.W, np.zeros((len(plant.W), common))])
    more = MultiratePlant(A=A, B_d=B, C=np.hstack([plant.C, plant.D[:, :common]]), D=own, W=W)
    return MultirateProblem(more, problem.schedule)


class Conditioned:
    """Mean and covariance of the states x(0) ... x(T) given measurements y(0) ... y(k), by one joint covariance."""

    def __init__(self, problem: MultirateProblem, start: Array, P0: Array, known: Array) -> None:
        plant = problem.plant
        self.n, self.q, T = plant.order, plant.sensors, len(known)
        B_w = plant.B_w if plant.correlated else np.zeros((plant.order, plant.D.shape[1]))
        m, w = plant.B_d.shape[1], plant.D.shape[1]
        basis = self.n + T * (m + w)
        state = np.hstack([np.linalg.cholesky(P0), np.zeros((self.n, basis - self.n))])
        mean, self.states, self.outputs, self.means, self.expected = start, [], [], [], []
        for k in range(T):
            noise = np.zeros((self.q, basis))
            at = self.n + k * (m + w)
            noise[:, at + m : at + m + w] = plant.D
            self.states.append(state)
            self.means.append(mean)
            self.outputs.append(plant.C @ state + noise)
            self.expected.append(plant.C @ mean)
            state = plant.A @ state
            state[:, at : at + m] += plant.B_d
            state[:, at + m : at + m + w] += B_w
            mean = plant.A @ mean + plant.B_u @ known[k]
        self.states.append(state)
        self.means.append(mean)

    def __call__(self, i: int, came: Array, y: Array) -> tuple[Array, Array]:
        """Of x(i), given the measurements y (k + 1, q) of the first instants as far as they came (k + 1, q)."""
        seen = came.astype(bool)
        H = np.vstack([output[used] for output, used in zip(self.outputs, seen, strict=False)])
        expected = np.concatenate([mean[used] for mean, used in zip(self.expected, seen, strict=False)])
        x, rest = self.states[i], y[seen] - expected
        gain = np.linalg.solve(H @ H.T, H @ x.T).T if len(H) else np.zeros((self.n, 0))
        return self.means[i] + gain @ rest, x @ x.T - gain @ H @ x.T
