"""What is known of the losses, and all that may happen then, as a finite automaton.

Known is that at most so many samples are lost in a row, the probability of independent losses, or a channel with good
and bad times (Gilbert, Bell Syst. Tech. J. 39, 1960). A model steps from what it remembers of the past to what may come
next. An edge of the automaton is one instant: which samples came, and what is known afterwards. Every pattern of losses
is a walk.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from math import prod
from typing import Any, Self

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.linear.periodic import PeriodicSystem
from replication.estimation.multirate.problem import MultirateProblem, error_under, unseen_mode
from replication.estimation.validation import Array, at_most

MOST_MISSES = 50
Memory = tuple[int, ...]
Option = tuple[bool, int, float]
"""Of one channel: whether its samples come, what it remembers then, and the probability (NaN if none is known)."""


@dataclass(frozen=True)
class LossModel(ABC):
    """The samples of each sensor travel on a channel of its own, or those of one instant `together` in one packet."""

    together: bool = field(default=False, kw_only=True)

    @property
    def _packet(self) -> str:
        return ", in one packet" if self.together else ""

    def channels(self, sensors: int) -> int:
        """How many channels there are."""
        return 1 if self.together else sensors

    def require(self, sensors: int) -> None:
        """Raise InvalidInputError unless each field has one entry, or one for each channel."""
        count = self.channels(sensors)
        for name, value in vars(self).items():
            if isinstance(value, tuple) and len(value) not in (1, count):
                raise InvalidInputError(
                    f"{name} must be one number, or one for each of {count} "
                    f"{'packet' if self.together else 'sensors'}, got {value}"
                )

    def following(self, memory: Memory, due: Sequence[bool]) -> Iterator[tuple[tuple[bool, ...], Memory, float]]:
        """Which samples may come of those that are due, what is remembered then, and with which probability."""
        busy = [any(due)] if self.together else list(due)
        options = [
            self.options(c, state) if used else [(False, state, 1.0)]
            for c, (state, used) in enumerate(zip(memory, busy, strict=True))
        ]
        for choice in product(*options):
            probability = prod(p for _, _, p in choice)
            if probability == 0:
                continue
            came = [c for c, _, _ in choice] * (len(due) if self.together else 1)
            yield tuple(a and b for a, b in zip(came, due, strict=True)), tuple(m for _, m, _ in choice), probability

    @abstractmethod
    def options(self, channel: int, state: int) -> list[Option]:
        """What may happen on a channel that is used."""

    @abstractmethod
    def __str__(self) -> str:
        """The model in words."""


@dataclass(frozen=True)
class InARow(LossModel):
    """At most so many losses in a row, in any pattern; `analyse` then gives the worst case over all of them.

    Parameters
    ----------
    misses : int or sequence of int
        Most losses in a row, of all sensors or of each; 0 for none.
    together : bool
        The samples of one instant travel in one packet.

    Raises
    ------
    InvalidInputError
        An entry is no whole number from 0 to 50.
    """

    misses: int | Sequence[int]

    def __post_init__(self) -> None:
        entries = tuple(self.misses) if isinstance(self.misses, (Sequence, np.ndarray)) else (self.misses,)
        counts = tuple(0 if type(m) is int and m == 0 else at_most("misses", m, MOST_MISSES) for m in entries)
        object.__setattr__(self, "misses", counts)

    def options(self, channel: int, state: int) -> list[Option]:
        """Count the losses since the last arrival."""
        arrival: Option = (True, 0, np.nan)
        return [arrival, (False, state + 1, np.nan)] if state < _entry(self.misses, channel) else [arrival]

    def __str__(self) -> str:
        return f"at most {_listed(self.misses)} lost in a row{self._packet}"


@dataclass(frozen=True)
class Independent(LossModel):
    """Each sample that is due is lost with a probability, whatever happened before.

    Parameters
    ----------
    probability : float or sequence of float
        Of a loss, for all sensors or for each.
    together : bool
        The samples of one instant travel in one packet.

    Raises
    ------
    InvalidInputError
        A probability is not from 0 to 1.
    """

    probability: float | Sequence[float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "probability", _probabilities("probability", self.probability))

    def options(self, channel: int, state: int) -> list[Option]:
        """Nothing is remembered."""
        p = _entry(self.probability, channel)
        return [(True, 0, 1 - p), (False, 0, p)]

    def __str__(self) -> str:
        return f"each sample is lost with probability {_listed(self.probability)}{self._packet}"


@dataclass(frozen=True)
class Markov(LossModel):
    """Losses that come in bursts: the probability of a loss depends on whether the sample before was lost.

    Parameters
    ----------
    after_arrival : float or sequence of float
        Probability of a loss after a sample that came, for all sensors or for each.
    after_loss : float or sequence of float
        Probability of a loss after a loss; below one.
    together : bool
        The samples of one instant travel in one packet.

    Raises
    ------
    InvalidInputError
        A probability is not from 0 to 1, or `after_loss` is one: a burst would never end.
    """

    after_arrival: float | Sequence[float]
    after_loss: float | Sequence[float]

    def __post_init__(self) -> None:
        after = {name: _probabilities(name, getattr(self, name)) for name in ("after_arrival", "after_loss")}
        for name, probabilities in after.items():
            object.__setattr__(self, name, probabilities)
        if max(after["after_loss"]) >= 1:
            raise InvalidInputError(
                "after_loss must be below 1, or a burst never ends; leave out a sensor that is lost"
            )

    def options(self, channel: int, state: int) -> list[Option]:
        """Whether the last sample was lost is remembered."""
        p = _entry(self.after_loss if state else self.after_arrival, channel)
        return [(True, 0, 1 - p), (False, 1, p)]

    def __str__(self) -> str:
        return (
            f"lost with probability {_listed(self.after_arrival)} after an arrival, {_listed(self.after_loss)} after "
            f"a loss{self._packet}"
        )


def _entry(values: Any, channel: int) -> Any:
    return values[channel if len(values) > 1 else 0]


def _listed(values: Any) -> str:
    return ", ".join(str(value) for value in values)


def _probabilities(name: str, items: Any) -> tuple[float, ...]:
    entries = tuple(items) if isinstance(items, (Sequence, np.ndarray)) and not isinstance(items, str) else (items,)
    for value in entries:
        plain = isinstance(value, (int, float, np.floating)) and not isinstance(value, bool)
        if not plain or not 0 <= value <= 1:
            raise InvalidInputError(f"{name} must be probabilities from 0 to 1, got {value!r}")
    if not entries:
        raise InvalidInputError(f"{name} must have an entry")
    return tuple(float(value) for value in entries)


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
