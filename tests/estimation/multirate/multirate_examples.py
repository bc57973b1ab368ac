"""Plants and problems shared by the tests of the multi-rate room."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from hypothesis import strategies as st

from benchmarks.bench_kalman import lifted
from replication.errors import InvalidInputError
from replication.estimation.multirate.latency import ContinuousPlant
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array

PAPER = MultiratePlant(
    A=[[0.95, 0.5, 0.2], [-0.1, 0.9, -0.2], [0, 0.1, 0.85]],
    B_d=[[0.1], [0.3], [0.2]],
    C=[[1, 0.5, 0], [1, 2.5, 0.2]],
    D=[[1, 0], [0, 0.5]],
)
"""The plant of Okajima et al. (2023), Sec. IV-A."""

CART = MultiratePlant(
    A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], B_u=[[0], [0.2]], C=[[0, 1], [1, 0]], D=np.diag([0.5, 0.1]),
    D_u=[[0.3], [-0.2]], dt=0.1,
)  # fmt: skip
MOVING = ContinuousPlant(
    A=[[0, 1], [-4, -0.3]], B_d=[[0], [1]], B_u=[[0.5], [2]], C=[[1, 0], [0, 1]], D=np.diag([0.1, 0.2]),
    D_u=[[0.0], [0.7]], dt=0.2,
)  # fmt: skip


def only_sensor(plant: MultiratePlant, i: int) -> MultiratePlant:
    return replace(plant, C=plant.C[[i]], D=plant.D[[i]])


def problem(plant: MultiratePlant, periods: tuple[int, ...], offsets: tuple[int, ...] = ()) -> MultirateProblem:
    return MultirateProblem(plant, SensingSchedule(periods, offsets))


TABLE = [(1, 1), (1, 2), (1, 3), (2, 1), (3, 1), (3, 2), (2, 3), (3, 3)]
PUBLISHED = {
    **{f"table {periods}": problem(PAPER, periods) for periods in TABLE},
    "case A": problem(only_sensor(PAPER, 0), (2,)),
    "case B": problem(only_sensor(PAPER, 1), (3,)),
    "case C": problem(PAPER, (6, 6)),
    "case 2": problem(PAPER, (3, 3), (0, 1)),
    "case 3": problem(PAPER, (3, 3), (0, 2)),
}
"""The problems that the paper solves; its Case 1 is the last column of its table."""


def drawn_plant(rng: np.random.Generator, n: int, q: int, drives: int, weights: int | None = None) -> MultiratePlant:
    """An unstable plant; weights: rows of W, the identity unless given."""
    A = rng.normal(size=(n, n))
    return MultiratePlant(
        A=1.1 * A / np.max(np.abs(np.linalg.eigvals(A))),
        B_d=rng.normal(size=(n, drives)),
        C=rng.normal(size=(q, n)),
        D=np.diag(rng.uniform(0.5, 1.5, q)),
        W=None if weights is None else rng.normal(size=(weights, n)),
    )


KINDS = ("stable", "unstable", "circle", "rotation", "singular", "repeated", "undisturbed", "undisturbed unstable")


@dataclass(frozen=True)
class Recipe:
    """What a generated problem is made of; two recipes that are equal make the same problem."""

    seed: int
    kind: str
    n: int
    q: int
    n_z: int
    columns: int
    correlated: bool
    decades: float
    periods: tuple[int, ...]
    offsets: tuple[int, ...]

    def build(self) -> MultirateProblem:
        """The problem; raises InvalidInputError if its schedule happens to hide a mode."""
        rng = np.random.default_rng(self.seed)
        modes, V = self._modes(rng), rng.normal(size=(self.n, self.n))
        B = rng.normal(size=(self.n, self.columns))
        if self.kind.startswith("undisturbed"):
            B[0] = 0.0
            B = V @ B
        D = rng.normal(size=(self.q, self.q + 1)) if self.correlated else np.diag(rng.uniform(0.1, 2.0, self.q))
        units = 10.0 ** rng.uniform(-self.decades, self.decades, self.n)
        plant = MultiratePlant(
            A=units[:, None] * (V @ modes @ np.linalg.inv(V)) / units,
            B_d=units[:, None] * B,
            C=rng.normal(size=(self.q, self.n)) / units,
            D=D,
            W=(np.eye(self.n) if self.n_z == self.n else rng.normal(size=(self.n_z, self.n))) / units,
        )
        return MultirateProblem(plant, SensingSchedule(self.periods, self.offsets))

    def _modes(self, rng: np.random.Generator) -> Array:
        modes = np.diag(rng.uniform(0.3, 0.99, self.n) * rng.choice([-1.0, 1.0], self.n))
        if self.kind in ("unstable", "undisturbed unstable"):
            modes[0, 0] = rng.uniform(1.05, 1.5)
        elif self.kind == "circle":
            modes[0, 0] = rng.choice([-1.0, 1.0])
        elif self.kind == "singular":
            modes[: (self.n + 1) // 2] = 0.0
        elif self.kind == "repeated":
            modes = 0.8 * np.eye(self.n) + 0.5 * np.eye(self.n, k=1)
        elif self.kind == "rotation" and self.n > 1:
            angle = rng.uniform(0.1, 3.0)
            modes[:2, :2] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        return modes


@st.composite
def problems(draw: st.DrawFn, *, max_n: int = 5, max_period: int = 6, decades: float = 0.0) -> MultirateProblem:
    """Problems of every kind, detectable or redrawn; decades: states in units of up to ten to this power, both ways."""
    n, q = draw(st.integers(1, max_n)), draw(st.integers(1, 3))
    periods = tuple(draw(st.integers(1, max_period)) for _ in range(q))
    recipe = Recipe(
        seed=draw(st.integers(0, 2**32 - 1)),
        kind=draw(st.sampled_from(KINDS)),
        n=n,
        q=q,
        n_z=draw(st.integers(1, n)),
        columns=draw(st.integers(1, 3)),
        correlated=draw(st.booleans()),
        decades=decades,
        periods=periods,
        offsets=tuple(draw(st.integers(0, N - 1)) for N in periods),
    )
    try:
        return recipe.build()
    except InvalidInputError:
        return replace(recipe, periods=(1,) * q, offsets=(0,) * q).build()


def correlated(problem: MultirateProblem, seed: int, share: float = 0.5) -> MultirateProblem:
    """The same problem, whose sensor noise also drives the state."""
    plant = problem.plant
    size = share * np.linalg.norm(plant.B_d) / np.sqrt(plant.D.shape[1])
    B_w = size * np.random.default_rng(seed).normal(size=(plant.order, plant.D.shape[1])) / np.sqrt(plant.order)
    return MultirateProblem(replace(plant, B_w=B_w), problem.schedule)


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
        S = plant.B_w @ D.T
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
            state[:, at + m : at + m + w] += plant.B_w
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
