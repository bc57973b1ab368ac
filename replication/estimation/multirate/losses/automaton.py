"""All that may happen to the samples, as a finite automaton; mean square errors under random losses.

An edge is one instant: which samples came, and what is known afterwards. Every pattern of losses is a walk.

Mean square errors under random losses: linear equations between the covariances of each node (Costa, Fragoso and
Marques, Discrete-Time Markov Jump Linear Systems, 2005), and the gains that make them least.

X_s is the mean of e e' where the walk is at node s, zero elsewhere. An edge s -> t of probability p adds
p (A X_s A' + pi_s B B') to X_t: the error is stable in mean square iff that map, over a period, shrinks.
"""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Self

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.linear.periodic import PeriodicSystem
from replication.estimation.linear.riccati import symmetric
from replication.estimation.multirate.kalman import Correction, corrected, sensing
from replication.estimation.multirate.losses.models import LossModel, Memory
from replication.estimation.multirate.problem import MultirateProblem, closed_loop, error_under, unseen_mode
from replication.estimation.validation import Array

MOST_EDGES = 4000
"""Of an automaton; each is a matrix inequality, or a gain of its own."""
CYCLES = 300
"""Periodic patterns that are tried, the shortest first."""
LONGEST = 12
"""Periods of the schedule over which a pattern that is tried may go."""
WALKS = 20_000
"""Walks that are followed in the search for them."""

Word = tuple[int, ...]
"""A periodic pattern: edges from phase 0 on, over whole periods of the schedule."""


@dataclass(frozen=True)
class Edge:
    """One instant between two nodes; origin: the same edge where less of the past is told apart."""

    source: int
    target: int
    phase: int
    arrived: tuple[bool, ...]
    probability: float
    origin: int


@dataclass(frozen=True)
class Automaton:
    """phases: of the nodes; node 0 is the start, with no loss so far."""

    phases: tuple[int, ...]
    edges: tuple[Edge, ...]
    memories: tuple[Memory, ...] = ()

    @cached_property
    def out(self) -> tuple[tuple[int, ...], ...]:
        """The edges that leave each node."""
        leaving: list[list[int]] = [[] for _ in self.phases]
        for i, edge in enumerate(self.edges):
            leaving[edge.source].append(i)
        return tuple(tuple(part) for part in leaving)

    @property
    def period(self) -> int:
        """Instants after which the phases begin anew."""
        return max(self.phases) + 1

    @cached_property
    def nodes(self) -> list[list[int]]:
        """The nodes of each phase."""
        return [[i for i, node_phase in enumerate(self.phases) if node_phase == phase] for phase in range(self.period)]

    @cached_property
    def by_phase(self) -> list[list[int]]:
        """The edges of each phase."""
        return [[i for i, edge in enumerate(self.edges) if edge.phase == phase] for phase in range(self.period)]

    def split(self, chosen: set[int]) -> Self:
        """The same walks, with the chosen nodes told apart by the edge that leads to them."""
        copies: dict[tuple[int, int], int] = {}
        for node in range(len(self.phases)):
            ways = [i for i, edge in enumerate(self.edges) if edge.target == node] if node in chosen else [-1]
            for way in ways:
                copies[node, way] = len(copies)
        of_node: dict[int, list[int]] = {}
        for (node, _), copy in copies.items():
            of_node.setdefault(node, []).append(copy)
        edges = [
            replace(edge, source=source, target=copies[edge.target, i if edge.target in chosen else -1])
            for i, edge in enumerate(self.edges)
            for source in of_node[edge.source]
        ]
        return type(self)(tuple(self.phases[node] for node, _ in copies), tuple(edges))

    def without_losses(self) -> Word:
        """The pattern in which every sample comes, from the start on."""
        word, node = list[int](), 0
        while not word or self.phases[node]:
            word.append(max(self.out[node], key=lambda i: sum(self.edges[i].arrived)))
            node = self.edges[word[-1]].target
        return tuple(word)

    def followed(self, flux: Array) -> list[Word]:
        """The periodic patterns, as edges of the origin, that take the edge of largest flux at each node."""
        words = {}
        best = [max(leaving, key=lambda i: flux[i]) for leaving in self.out]
        for start in range(len(self.phases)):
            path, places, node = list[int](), dict[int, int](), start
            while node not in places:
                places[node] = len(path)
                path.append(best[node])
                node = self.edges[best[node]].target
            cycle = path[places[node] :]
            turn = next(k for k, i in enumerate(cycle) if self.edges[i].phase == 0)
            word = _once(tuple(self.edges[i].origin for i in (*cycle[turn:], *cycle[:turn])), self.period)
            words[min(word[k:] + word[:k] for k in range(0, len(word), self.period))] = word
        return list(words.values())

    def cycles(self) -> list[Word]:
        """Periodic patterns, the shortest first; each once, wherever it begins."""
        period, words = self.period, dict[Word, Word]()
        queue: deque[tuple[int, int, Word]] = deque((start, start, ()) for start in self.nodes[0])
        for _ in range(WALKS):
            if not queue or len(words) >= CYCLES:
                break
            start, node, word = queue.popleft()
            if node == start and word and self.phases[node] == 0:
                once = _once(word, period)
                turns = [once[k:] + once[:k] for k in range(0, len(once), period)]
                words.setdefault(min(turns), once)
            if len(word) == LONGEST * period:
                continue
            queue.extend((start, self.edges[i].target, (*word, i)) for i in self.out[node])
        return list(words.values())


def _once(word: Word, period: int) -> Word:
    """A word that is another one several times over, as that one."""
    lengths = range(period, len(word) + 1, period)
    return next(word[:k] for k in lengths if len(word) % k == 0 and word[:k] * (len(word) // k) == word)


def automaton(problem: MultirateProblem, model: LossModel) -> Automaton:
    """All that may happen under `model`; raises InvalidInputError if that is too much, or the model does not fit."""
    mask, period = problem.schedule.mask, problem.schedule.period
    model.require(problem.plant.sensors)
    start: tuple[int, Memory] = (0, (0,) * model.channels(problem.plant.sensors))
    numbers, queue, edges = {start: 0}, deque([start]), list[Edge]()
    while queue:
        phase, memory = node = queue.popleft()
        for arrived, after, probability in model.following(memory, mask[phase].tolist()):
            following = ((phase + 1) % period, after)
            if following not in numbers:
                numbers[following] = len(numbers)
                queue.append(following)
            edges.append(Edge(numbers[node], numbers[following], phase, arrived, probability, len(edges)))
        if len(edges) > MOST_EDGES:
            raise InvalidInputError(
                f"{model}, over {period} instants, has more than {MOST_EDGES} cases; allow fewer losses in a row, send "
                "the samples together, or choose periods with common factors"
            )
    return Automaton(tuple(phase for phase, _ in numbers), tuple(edges), tuple(memory for _, memory in numbers))


def patterns(edges: Sequence[Edge], word: Word) -> str:
    """Which samples come, instant by instant: 1 for one that comes, 0 for one that does not."""
    return " ".join("".join(str(int(came)) for came in edges[i].arrived) for i in word)


def require_detectable(problem: MultirateProblem, cases: Automaton) -> list[Word]:
    """The periodic patterns; raises InvalidInputError if one hides an unstable mode."""
    words = cases.cycles()
    for word in words:
        if (mode := unseen_mode(problem.plant, [cases.edges[i].arrived for i in word])) is not None:
            raise InvalidInputError(
                f"the plant is not detectable under losses: where the samples come as {patterns(cases.edges, word)} "
                f"(1: comes), again and again, the mode with multiplier {mode:.6g} is never seen; allow fewer losses "
                "in a row, change the periods, or add a sensor"
            )
    return words


def along(problem: MultirateProblem, gains: Array, edges: Iterable[int]) -> PeriodicSystem:
    """The error system along a periodic pattern; gains (edges, n, q)."""
    return error_under(problem.plant, [gains[i] for i in edges])


def gains_by_edge(cases: Automaton, gains: Array) -> Array:
    """Gains (N, n, q) of the schedule for each edge: no correction by a sample that does not come."""
    return np.stack([gains[edge.phase] * np.array(edge.arrived, dtype=float) for edge in cases.edges])


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
    _require_size(cases, n)
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
    X = np.zeros((len(cases.phases), n, n))
    visited = np.array([edge.probability * pi[edge.source] for edge in cases.edges])
    scale = float(np.trace(problem.plant.drive @ problem.plant.drive.T)) or 1.0
    for _ in range(ROUNDS):
        before = X
        for ways in cases.by_phase:
            step, targets = _corrected(problem, cases, pi, X, ways), [cases.edges[i].target for i in ways]
            X = X.copy()
            X[targets] = 0.0
            np.add.at(X, targets, visited[ways, None, None] * symmetric(step.following))
        size = float(np.abs(X).max())
        if not np.isfinite(size) or size > LOST * scale:
            raise InfeasibleError(
                "too many samples are lost: no gains keep the mean square error finite; lose less, or measure more "
                "often"
            )
        if np.abs(X - before).max() <= SETTLED * size:
            return _corrected(problem, cases, pi, X, range(len(cases.edges))).L * (visited > 0)[:, None, None]
    raise SolverError(
        f"the gains under losses did not settle in {ROUNDS} periods: the losses are next to those at which the mean "
        "square error becomes infinite; lose less, or measure more often"
    )


def _corrected(problem: MultirateProblem, cases: Automaton, pi: Array, X: Array, ways: Sequence[int]) -> Correction:
    """Kalman filters at the mean errors X / pi of the nodes that these edges leave."""
    plant, edges = problem.plant, [cases.edges[i] for i in ways]
    sources = [edge.source for edge in edges]
    P = X[sources] / np.where(pi > 0, pi, 1.0)[sources, None, None]
    sensors = sensing(problem, np.array([edge.arrived for edge in edges]))
    return corrected(plant.A, plant.drive @ plant.drive.T, sensors, P)


def _require_size(cases: Automaton, n: int) -> None:
    unknowns = max(map(len, cases.nodes)) * n * (n + 1) // 2
    if unknowns > MOST_UNKNOWNS:
        raise InvalidInputError(
            f"the covariances of one instant have {unknowns} entries, more than {MOST_UNKNOWNS}; send the samples "
            "together, or use a smaller plant"
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
