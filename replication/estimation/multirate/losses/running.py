"""Mean square errors under random losses, exact and drawn, the gains that make them least, and the observer that runs.

The exact ones solve linear equations between the covariances of the nodes (Costa, Fragoso and Marques, Discrete-Time
Markov Jump Linear Systems, 2005). X_s is the mean of e e' where the walk is at node s, zero elsewhere. An edge s -> t
of probability p adds p (A X_s A' + pi_s B B') to X_t: the error is stable in mean square iff that map shrinks over a
period.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replication.drawing.panels import Panel
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.export import INSTANTS, c_file, source
from replication.estimation.api.running import RunningObserver
from replication.estimation.api.shown import Shown
from replication.estimation.linear.riccati import symmetric
from replication.estimation.multirate.kalman import filtering
from replication.estimation.multirate.losses.models import Automaton, Edge
from replication.estimation.multirate.problem import MultirateProblem, closed_loop, unseen_mode
from replication.estimation.validation import Array

MOST_UNKNOWNS = 1500
"""Entries of the covariances of one phase."""
RARE = 1e-13
"""A node of a smaller probability is never visited."""
ROUNDS, SETTLED, LOST = 20_000, 1e-13, 1e14
"""Periods of the recursion for the gains; change at which it has settled, and growth beyond which it never will."""
MARGIN = 1e-9


@dataclass(frozen=True, eq=False)
class MeanSquare:
    """visited: probability of each node at its phase; X (nodes, n, n): mean of e e' there; rms: of W e over a period;
    radius: growth of the mean square over a period, without noise."""

    visited: Array
    X: Array
    rms: float
    radius: float


def visits(cases: Automaton) -> Array:
    """The stationary probability of each node at its phase, (nodes,).

    From the start and one period on: the least-squares solution of pi T = pi, sum 1, of the chain at phase 0.
    """
    steps = _steps(cases, [np.array([[edge.probability]]) for edge in cases.edges])
    system = np.vstack([np.eye(len(cases.nodes[0])) - _product(steps), np.ones(len(cases.nodes[0]))])
    state, pi = np.linalg.lstsq(system, np.eye(len(system))[-1], rcond=None)[0], np.zeros(len(cases.phases))
    for nodes, step in zip(cases.nodes, steps, strict=True):
        pi[nodes], state = state, step @ state
    return np.where(pi > RARE, pi, 0.0)


def require_seen(problem: MultirateProblem, cases: Automaton) -> None:
    """Raise InvalidInputError if an unstable mode is hidden from all samples that ever come."""
    pi = visits(cases)
    came = np.zeros((problem.schedule.period, problem.plant.sensors), dtype=bool)
    for edge in cases.edges:
        if pi[edge.source] > 0:
            came[edge.phase] |= np.array(edge.arrived)
    if (mode := unseen_mode(problem.plant, came.tolist())) is not None:
        raise InvalidInputError(
            f"the plant is not detectable under losses: the mode with multiplier {mode:.6g} over one period is seen by "
            "no sample that ever comes; lower the probability of a loss, or add a sensor"
        )


def mean_square(problem: MultirateProblem, cases: Automaton, gains: Array) -> MeanSquare:
    """The stationary mean square error of gains (edges, n, q); raises InfeasibleError if there is none."""
    n, pi = problem.plant.order, visits(cases)
    unknowns = max(map(len, cases.nodes)) * n * (n + 1) // 2
    if unknowns > MOST_UNKNOWNS:
        raise InvalidInputError(
            f"the covariances of one instant have {unknowns} entries, more than {MOST_UNKNOWNS}; send the samples "
            "together, or use a smaller plant"
        )
    loops = [closed_loop(problem.plant, gain) for gain in gains]
    short, long = _halves(n)
    maps = [edge.probability * short @ np.kron(A, A) @ long for edge, (A, _) in zip(cases.edges, loops, strict=True)]
    steps = _steps(cases, maps)
    period = _product(steps)
    radius = float(np.max(np.abs(np.linalg.eigvals(period))))
    if radius >= 1 - MARGIN:
        raise InfeasibleError(
            f"the mean square error grows by {radius:.6g} over each period of the schedule, so it has no stationary "
            "value under these losses; design the gains for them, measure more often, or lose less"
        )
    added = np.zeros((len(cases.phases), len(short)))
    for edge, (_, B) in zip(cases.edges, loops, strict=True):
        added[edge.target] += edge.probability * pi[edge.source] * (short @ (B @ B.T).ravel())

    def along(start: Array) -> list[Array]:
        """The states of the nodes of each phase, and those of phase 0 after the period."""
        states = [start]
        for step, nodes in zip(steps, (*cases.nodes[1:], cases.nodes[0]), strict=True):
            states.append(step @ states[-1] + added[nodes].ravel())
        return states

    start = np.asarray(np.linalg.solve(np.eye(len(period)) - period, along(np.zeros(len(period)))[-1]), dtype=float)
    X = np.zeros((len(cases.phases), n, n))
    for nodes, state in zip((*cases.nodes, cases.nodes[0]), along(start), strict=True):
        X[nodes] = (state.reshape(len(nodes), -1) @ long.T).reshape(-1, n, n)
    total = np.einsum("za,kab,zb->", problem.plant.W, X, problem.plant.W)
    return MeanSquare(pi, X, float(np.sqrt(total / problem.schedule.period)), radius)


def mean_square_gains(problem: MultirateProblem, cases: Automaton) -> Array:
    """The gains (edges, n, q) with the least mean square error of all that know phase, memory and what came.

    The coupled Riccati recursion from X = 0. Raises InfeasibleError if it grows without end: no gains keep the mean
    square finite then; SolverError if it does not settle.
    """
    pi, n = visits(cases), problem.plant.order
    X, mean = np.zeros((len(cases.phases), n, n)), np.where(pi > 0, pi, 1.0)[:, None, None]
    visited = np.array([edge.probability * pi[edge.source] for edge in cases.edges])
    arrived = np.array([edge.arrived for edge in cases.edges])
    sources, targets = np.array([(edge.source, edge.target) for edge in cases.edges]).T
    scale = float(np.trace(problem.plant.drive @ problem.plant.drive.T)) or 1.0
    for _ in range(ROUNDS):
        before = X
        for ways in cases.by_phase:
            following = filtering(problem, arrived[ways], (X / mean)[sources[ways]]).following
            X = X.copy()
            X[targets[ways]] = 0.0
            np.add.at(X, targets[ways], visited[ways, None, None] * symmetric(following))
        size = float(np.abs(X).max())
        if not np.isfinite(size) or size > LOST * scale:
            raise InfeasibleError(
                "too many samples are lost: no gains keep the mean square error finite; lose less, or measure more "
                "often"
            )
        if np.abs(X - before).max() <= SETTLED * size:
            return filtering(problem, arrived, (X / mean)[sources]).L * (visited > 0)[:, None, None]
    raise SolverError(
        f"the gains under losses did not settle in {ROUNDS} periods: the losses are next to those at which the mean "
        "square error becomes infinite; lose less, or measure more often"
    )


def _halves(n: int) -> tuple[Array, Array]:
    """Matrices that take the upper triangle of a symmetric (n, n) matrix, and give it back whole."""
    rows, columns = np.triu_indices(n)
    count = np.arange(len(rows))
    short, long = np.zeros((len(rows), n * n)), np.zeros((n * n, len(rows)))
    short[count, rows * n + columns] = 1.0
    long[rows * n + columns, count] = long[columns * n + rows, count] = 1.0
    return short, long


def _steps(cases: Automaton, maps: list[Array]) -> list[Array]:
    """The maps of the edges as one of the stacked states of all nodes of a phase to those of the next."""
    size, place, steps = len(maps[0]), {node: i for nodes in cases.nodes for i, node in enumerate(nodes)}, list[Array]()
    for ways, nodes, after in zip(cases.by_phase, cases.nodes, (*cases.nodes[1:], cases.nodes[0]), strict=True):
        step = np.zeros((len(after), size, len(nodes), size))
        for i in ways:
            step[place[cases.edges[i].target], :, place[cases.edges[i].source]] += maps[i]
        steps.append(step.reshape(len(after) * size, len(nodes) * size))
    return steps


def _product(steps: list[Array]) -> Array:
    """The map over all steps, the first one first."""
    return reduce(lambda total, step: step @ total, steps)


USAGE = f"""{INSTANTS} s.unforeseen counts instants with more of them than the gains were
   made for, after which nothing is guaranteed."""


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
        plant, cases = self._problem.plant, self._given
        tables = {
            "transition": plant.A, "output": plant.C, "gain": self._gains, "input": plant.B_u, "direct": plant.D_u,
            # The edges of each node follow each other, as they were found.
            "first": [0, *np.cumsum([len(leaving) for leaving in cases.out])],
            "target": [edge.target for edge in cases.edges],
            "phase": cases.phases,
            "memory": cases.memories,
            "arrived": [edge.arrived for edge in cases.edges],
            "due": self._problem.schedule.mask,
        }  # fmt: skip
        sizes = {"order": plant.order, "starts": self.states, "estimates": self.states, "inputs": self.inputs}
        sizes |= {"measurements": self.measurements, "nodes": len(cases.phases), "channels": len(cases.memories[0])}
        return c_file(name, comment, USAGE, source("losses.c"), sizes, tables)

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


SHARE = 10
"""The covariance of the Kalman filter counts after this part of the steps: it has forgotten its start then."""


def drawn_losses(
    problem: MultirateProblem, cases: Automaton, gains: Array, time: Array, runs: int, rng: np.random.Generator
) -> DrawnLosses:
    """Runs from the stationary distribution at phase 0 on, over the instants of `time` (s)."""
    exact, steps = mean_square(problem, cases, gains), len(time)
    shares = exact.visited[cases.nodes[0]] / exact.visited[cases.nodes[0]].sum()
    nodes = np.asarray(rng.choice(cases.nodes[0], size=runs, p=shares), dtype=np.intp)
    walks = list(drawn_walks(cases, nodes, steps, rng))
    start = exact.X[nodes] / exact.visited[nodes][:, None, None]
    whole = steps - steps % problem.schedule.period or steps  # each phase counts alike
    squares = drawn_errors(problem, gains, walks, start, rng)
    mean, error = mean_and_error(squares[:whole])
    kalman, kalman_error = mean_and_error(kalman_errors(problem, cases, walks, start)[whole // SHARE :])
    return DrawnLosses(
        mean_square=mean,
        standard_error=error,
        exact=exact.rms**2,
        kalman=kalman,
        kalman_standard_error=kalman_error,
        time=time,
        course=squares.mean(axis=1),
    )


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
    A, B = (np.stack(parts) for parts in zip(*(closed_loop(plant, gain) for gain in gains), strict=True))
    squares = []
    for taken in walks:
        squares.append(np.sum((e @ plant.W.T) ** 2, axis=1))
        noise = rng.standard_normal((runs, B.shape[2]))
        e = np.einsum("rab,rb->ra", A[taken], e) + np.einsum("rab,rb->ra", B[taken], noise)
    return np.stack(squares)


def kalman_errors(problem: MultirateProblem, cases: Automaton, walks: list[NDArray[np.intp]], start: Array) -> Array:
    """tr W P W' (steps, runs) of the Kalman filter that knows which samples came, from P = `start` on."""
    plant, P, traces = problem.plant, start, list[Array]()
    arrived = np.array([edge.arrived for edge in cases.edges])
    for taken in walks:
        traces.append(np.einsum("za,rab,zb->r", plant.W, P, plant.W))
        P = filtering(problem, arrived[taken], P).following
    return np.stack(traces)


def mean_and_error(values: Array) -> tuple[float, float]:
    """The mean of values (steps, runs) and its standard error over the runs."""
    of_run = values.mean(axis=0)
    return float(of_run.mean()), float(of_run.std(ddof=1) / np.sqrt(len(of_run)))
