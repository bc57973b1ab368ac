"""All that may happen to the samples, as a finite automaton: phases of the schedule, and what is known of the past.

An edge is one instant: which samples came, and what is known afterwards. Every pattern of losses is a walk.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.multirate.losses.models import LossModel, Memory
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array, undetectable_mode

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

    def split(self, chosen: set[int]) -> Automaton:
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
        return Automaton(tuple(self.phases[node] for node, _ in copies), tuple(edges))

    def without_losses(self) -> Word:
        """The pattern in which every sample comes, from the start on."""
        word, node = list[int](), 0
        while not word or self.phases[node]:
            word.append(max(self.out[node], key=lambda i: sum(self.edges[i].arrived)))
            node = self.edges[word[-1]].target
        return tuple(word)

    def followed(self, flux: Array) -> list[Word]:
        """The periodic patterns, as edges of the origin, that take the edge of largest flux at each node."""
        period, found = max(self.phases) + 1, {}
        best = [max(leaving, key=lambda i: flux[i]) for leaving in self.out]
        for start in range(len(self.phases)):
            path, seen, node = list[int](), dict[int, int](), start
            while node not in seen:
                seen[node] = len(path)
                path.append(best[node])
                node = self.edges[best[node]].target
            cycle = path[seen[node] :]
            turn = next(k for k, i in enumerate(cycle) if self.edges[i].phase == 0)
            word = _once(tuple(self.edges[i].origin for i in (*cycle[turn:], *cycle[:turn])), period)
            found[min(word[k:] + word[:k] for k in range(0, len(word), period))] = word
        return list(found.values())

    def cycles(self) -> list[Word]:
        """Periodic patterns, the shortest first; each once, wherever it begins."""
        period = max(self.phases) + 1
        found: dict[Word, Word] = {}
        starts = [i for i, phase in enumerate(self.phases) if phase == 0]
        queue: deque[tuple[int, int, Word]] = deque((start, start, ()) for start in starts)
        for _ in range(WALKS):
            if not queue or len(found) >= CYCLES:
                break
            start, node, word = queue.popleft()
            if node == start and word and self.phases[node] == 0:
                once = _once(word, period)
                turns = [once[k:] + once[:k] for k in range(0, len(once), period)]
                found.setdefault(min(turns), once)
            if len(word) == LONGEST * period:
                continue
            queue.extend((start, self.edges[i].target, (*word, i)) for i in self.out[node])
        return list(found.values())


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


def require_detectable(problem: MultirateProblem, given: Automaton) -> list[Word]:
    """The periodic patterns; raises InvalidInputError if one hides an unstable mode."""
    words = given.cycles()
    for word in words:
        transition, outputs = np.eye(problem.plant.order), [np.zeros((0, problem.plant.order))]
        for i in word:
            outputs.append(problem.plant.C[list(given.edges[i].arrived)] @ transition)
            transition = problem.plant.A @ transition
        if (mode := undetectable_mode(transition, np.vstack(outputs), discrete=True)) is not None:
            raise InvalidInputError(
                f"the plant is not detectable under losses: where the samples come as {patterns(given.edges, word)} "
                f"(1: comes), again and again, the mode with multiplier {mode:.6g} is never seen; allow fewer losses "
                "in a row, change the periods, or add a sensor"
            )
    return words


def closed_loop(problem: MultirateProblem, gain: Array) -> tuple[Array, Array]:
    """A - L C and [B_d, B_w - L D] of one instant; L (n, q) is zero for samples that do not come."""
    plant = problem.plant
    noise = -gain @ plant.D
    return plant.A - gain @ plant.C, np.hstack([plant.B_d, noise + plant.B_w if plant.correlated else noise])


def along(problem: MultirateProblem, gains: Array, edges: Iterator[int] | Sequence[int]) -> PeriodicSystem:
    """The error system along a periodic pattern; gains (edges, n, q)."""
    stages = []
    for i in edges:
        A, B = closed_loop(problem, gains[i])
        stages.append(Stage(A, B, problem.plant.W, np.zeros((len(problem.plant.W), B.shape[1]))))
    return PeriodicSystem(tuple(stages))


def gains_by_edge(given: Automaton, gains: Array) -> Array:
    """Gains (N, n, q) of the schedule for each edge: no correction by a sample that does not come."""
    return np.stack([gains[edge.phase] * np.array(edge.arrived, dtype=float) for edge in given.edges])
