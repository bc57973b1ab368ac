"""Plants and problems shared by the tests of the multi-rate room."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st

from replication.errors import InvalidInputError
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
