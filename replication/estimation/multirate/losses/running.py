"""An observer that counts what was lost, in Python and in C; and simulations under losses."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replication.drawing.panels import Panel
from replication.estimation.api.export import INSTANTS, c_file, source
from replication.estimation.api.running import RunningObserver
from replication.estimation.api.shown import Shown
from replication.estimation.multirate.kalman import corrected, sensing
from replication.estimation.multirate.losses.automaton import Automaton, Edge
from replication.estimation.multirate.problem import MultirateProblem, closed_loop
from replication.estimation.validation import Array

USAGE = f"""{INSTANTS} s.unforeseen counts instants with more of them than the gains were
   made for, after which nothing is guaranteed."""


def c_form(name: str, comment: str, problem: MultirateProblem, cases: Automaton, gains: Array) -> str:
    """The C99 source for gains (edges, n, q); raises InvalidInputError if `name` is no C identifier."""
    plant, starts = problem.plant, problem.plant.order - problem.plant.under_way
    tables = {
        "transition": plant.A, "output": plant.C, "gain": gains, "input": plant.B_u, "direct": plant.D_u,
        # The edges of each node follow each other, as they were found.
        "first": [0, *np.cumsum([len(leaving) for leaving in cases.out])],
        "target": [edge.target for edge in cases.edges],
        "phase": cases.phases,
        "memory": cases.memories,
        "arrived": [edge.arrived for edge in cases.edges],
        "due": problem.schedule.mask,
    }  # fmt: skip
    sizes = {"order": plant.order, "starts": starts, "estimates": starts, "inputs": plant.B_u.shape[1]}
    sizes |= {"measurements": plant.sensors, "nodes": len(cases.phases), "channels": len(cases.memories[0])}
    return c_file(name, comment, USAGE, source("losses.c"), sizes, tables)


class LossObserver(RunningObserver):
    """x^(k+1) = A x^ + B_u u + L (y - C x^ - D_u u) with the gain L of what came now and of what is known of before.

    A loss that the automaton `cases` does not foresee is left out like the others; `unforeseen` counts such instants,
    after which nothing is guaranteed. gains (edges, n, q): one for each edge.
    """

    def __init__(self, problem: MultirateProblem, cases: Automaton, gains: Array) -> None:
        self._problem, self._given, self._gains = problem, cases, gains
        self._nodes = {pair: i for i, pair in enumerate(zip(cases.phases, cases.memories, strict=True))}
        plant = problem.plant
        super().__init__(plant.order - plant.under_way, plant.B_u.shape[1], plant.sensors)

    @property
    def estimate(self) -> Array:
        """x^(k), (n,)."""
        return np.array(self._state[: self.states])

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """As in `RunningObserver`; `missed` and `unforeseen` are counted there, too."""
        return c_form(name, comment, self._problem, self._given, self._gains)

    def _begin(self, start: Array) -> None:
        self._state = np.zeros(self._problem.plant.order)
        self._state[: self.states] = start
        self._node, self.unforeseen = 0, 0

    def _advance(self, u: Array, y: Array) -> None:
        plant, phase = self._problem.plant, self._given.phases[self._node]
        due = self._problem.schedule.mask[phase]
        self._arrived(~np.isnan(y), due)
        came = due & ~np.isnan(y)
        number = min(self._given.out[self._node], key=lambda i: int(np.sum(came != self._given.edges[i].arrived)))
        edge = self._given.edges[number]
        innovation = np.where(came, y, 0.0) - came * (plant.C @ self._state + plant.D_u @ u)
        self._state = plant.A @ self._state + plant.B_u @ u + self._gains[number] @ innovation
        self._node = edge.target
        if not np.array_equal(came, edge.arrived):
            self.unforeseen += 1
            self._node = self._after(edge, came)

    def _after(self, edge: Edge, came: Array) -> int:
        """The node that knows of as many losses as the model allows where there were more."""
        before, after = self._given.memories[edge.source], self._given.memories[edge.target]
        lost = np.array(edge.arrived) & ~came.astype(bool)
        channels = [bool(lost.any())] if len(before) == 1 else lost.tolist()
        memory = tuple(b if gone else a for gone, b, a in zip(channels, before, after, strict=True))
        return self._nodes.get((self._given.phases[edge.target], memory), edge.target)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DrawnLosses(Shown):
    """Mean square errors over runs with drawn losses and noise.

    Attributes
    ----------
    mean_square : float
        Of W e, over runs and instants.
    standard_error : float
        Of that mean; runs are independent.
    exact : float
        What the covariances say.
    kalman, kalman_standard_error : float
        Mean square error, and its standard error, of the time-varying Kalman filter that knows the whole pattern, over
        the same losses: by its covariance, without drawn noise. No filter has less.
    time : array (steps,)
        In s.
    course : array (steps,)
        Mean square over the runs at each instant.
    """

    mean_square: float
    standard_error: float
    exact: float
    kalman: float
    kalman_standard_error: float
    time: Array
    course: Array

    def rows(self) -> list[tuple[str, str, str]]:
        """Means with their standard errors."""
        return [
            ("mean square error", f"{self.mean_square:.6g} ± {self.standard_error:.2g}", "drawn; standard error"),
            ("exact", f"{self.exact:.6g}", "covariances of all cases"),
            (
                "Kalman filter that knows all losses",
                f"{self.kalman:.6g} ± {self.kalman_standard_error:.2g}",
                "its covariance along the same losses; standard error",
            ),
        ]

    def panels(self) -> tuple[Panel, ...]:
        """The mean square error over time."""
        levels = {"exact": self.exact, "Kalman filter that knows all losses": self.kalman}
        return (Panel(self.time, "time (s)", "mean square error", {"drawn": self.course}, levels),)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values."""
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in vars(self).items()}


def drawn_nodes(cases: Automaton, visited: Array, runs: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """The node at which each run begins, from the stationary distribution at phase 0."""
    shares = visited[cases.nodes[0]] / visited[cases.nodes[0]].sum()
    return np.asarray(rng.choice(cases.nodes[0], size=runs, p=shares), dtype=np.intp)


def drawn_walks(
    cases: Automaton, nodes: NDArray[np.intp], steps: int, rng: np.random.Generator
) -> Iterator[NDArray[np.intp]]:
    """The edge that each run takes from its node on, (runs,), instant by instant."""
    runs = len(nodes)
    targets = np.array([edge.target for edge in cases.edges])
    choices = [np.array(out) for out in cases.out]
    shares = [np.cumsum([cases.edges[i].probability for i in out]) for out in cases.out]
    for _ in range(steps):
        taken = np.zeros(runs, dtype=np.intp)
        numbers = rng.random(runs)
        for node in np.unique(nodes):
            here = nodes == node
            place = np.searchsorted(shares[node], numbers[here] * shares[node][-1], side="right")
            taken[here] = choices[node][np.minimum(place, len(choices[node]) - 1)]
        yield taken
        nodes = targets[taken]


def drawn_errors(
    problem: MultirateProblem, gains: Array, walks: list[NDArray[np.intp]], start: Array, rng: np.random.Generator
) -> Array:
    """Squares of W e (steps, runs), from errors of covariances `start` (runs, n, n) on."""
    plant, runs = problem.plant, len(walks[0])
    values, vectors = np.linalg.eigh(start)
    roots = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    e = np.einsum("rab,rb->ra", roots, rng.standard_normal((runs, plant.order)))
    loops = [closed_loop(problem.plant, gain) for gain in gains]
    squares = []
    for taken in walks:
        squares.append(np.sum((e @ plant.W.T) ** 2, axis=1))
        noise = rng.standard_normal((runs, loops[0][1].shape[1]))
        following = np.empty_like(e)
        for edge in np.unique(taken):
            A, B = loops[edge]
            here = taken == edge
            following[here] = e[here] @ A.T + noise[here] @ B.T
        e = following
    return np.stack(squares)


def kalman_errors(problem: MultirateProblem, cases: Automaton, walks: list[NDArray[np.intp]], start: Array) -> Array:
    """tr W P W' (steps, runs) of the Kalman filter that knows which samples came, from P = `start` on."""
    plant, P, traces = problem.plant, start, list[Array]()
    Q = plant.drive @ plant.drive.T
    arrived = np.array([edge.arrived for edge in cases.edges])
    for taken in walks:
        traces.append(np.einsum("za,rab,zb->r", plant.W, P, plant.W))
        P = corrected(plant.A, Q, sensing(problem, arrived[taken]), P).following
    return np.stack(traces)


def mean_and_error(values: Array) -> tuple[float, float]:
    """The mean of values (steps, runs) and its standard error over the runs."""
    of_run = values.mean(axis=0)
    return float(of_run.mean()), float(of_run.std(ddof=1) / np.sqrt(len(of_run)))
