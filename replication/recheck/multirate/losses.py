"""The largest gain over all patterns of losses: what may happen is a graph, with storage functions along its walks."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

from replication.recheck.exact import (
    blocks,
    characteristic,
    is_positive,
    is_schur,
    minus,
    nought,
    scaled,
    squares,
    times,
    turned,
    unit,
)
from replication.recheck.multirate.levels import Schedule, Sensed, inputs_over, recurrent, schedule, scheduled
from replication.recheck.reading import Certificate, Matrix, Proof, count, matrix, need, several, small, symmetric, take

MOST_INSTANTS = 2000
State = tuple[int, ...]
"""The phase, then the losses in a row of each packet."""


class Graph:
    """Which states follow each other, and which samples come on the way; numbered as they are reached from rest."""

    def __init__(self, planned: Schedule, packets: list[list[int]], most: list[int]) -> None:
        self.states: list[State] = [(0, *[0] * len(packets))]
        self.instants: list[tuple[int, int, frozenset[int]]] = []
        place = {self.states[0]: 0}
        for number, (phase, *lost) in enumerate(self.states):  # which grows meanwhile
            measured = planned.measured(phase)
            ways = [
                self._ways([i for i in one if i in measured], *pair)
                for one, *pair in zip(packets, lost, most, strict=True)
            ]
            for way in product(*ways):
                end = ((phase + 1) % planned.length, *(after for after, _ in way))
                if end not in place:
                    place[end] = len(self.states)
                    self.states.append(end)
                self.instants.append((number, place[end], frozenset(i for _, came in way for i in came)))
            small(len(self.instants) <= MOST_INSTANTS, f"more than {MOST_INSTANTS} cases of losses")

    @staticmethod
    def _ways(due: list[int], lost: int, most: int) -> list[tuple[int, list[int]]]:
        """It arrives, or is lost once more; a packet without samples keeps its count."""
        if not due:
            return [(lost, [])]
        return [(0, due), *([(lost + 1, [])] if lost < most else [])]

    def from_state(self, state: int) -> list[int]:
        """The instants that begin there."""
        return [i for i, (begin, _, _) in enumerate(self.instants) if begin == state]


def gain_under_losses(given: Certificate) -> Proof:
    """The gain of given gains, one for each case."""
    names = ("sensors", "periods", "offsets", "together", "misses")
    chosen, periods, offsets, together, misses = take(given.parameters, "parameters", *names)
    plant, _ = scheduled(given.plant, chosen, schedule(periods, offsets))
    need(type(together) is int and together in (0, 1), "together is 0 or 1")
    sensors = list(range(len(plant.C)))
    packets = [sensors] if together else [[i] for i in sensors]
    graph = Graph(plant.times, packets, several(misses, "misses", count, len(packets)))
    gains, at, to, stored, word, turn, v = take(given.witness, "witness", "L", "at", "to", "P", "word", "turn", "v")
    steps = _steps(plant, graph, gains)
    lower, upper = given.stated("lower", "upper")
    need(lower > 0 and upper > 0, "the bounds are not positive")
    _bounded(plant, graph, steps, (at, to, stored), upper)
    walk = several(word, "word", count)
    need(bool(walk) and all(i < len(steps) for i in walk), "a case that is none")
    for i, j in zip(walk, walk[1:] + walk[:1], strict=True):
        need(graph.instants[i][1] == graph.instants[j][0], "the pattern does not repeat")
    around = [steps[i] for i in walk]
    rotation, inputs = inputs_over(turn, v, len(around[0][1][0]), len(around))
    need(len(inputs) == len(around), "an input for each case of the pattern")
    need(is_schur(characteristic(times(*(a for a, _ in around[::-1])))), "the pattern is not stable")
    states = recurrent(((*step, one) for step, one in zip(around, inputs, strict=True)), rotation)
    produced = sum(squares(times(plant.W, state)) for state in states)
    spent = sum(squares(one) for one in inputs)
    need(spent > 0 and produced >= lower**2 * spent, "the disturbance has a smaller gain")
    return Proof(lower, upper, True)


def _steps(plant: Sensed, graph: Graph, gains: Any) -> list[tuple[Matrix, Matrix]]:
    """(A, B) of the error system in each case: the gain acts on the samples that come."""
    injected = several(gains, "L", lambda value, where: matrix(value, where, len(plant.A)), len(graph.instants))
    need(all(len(one[0]) == len(plant.C) for one in injected), "L has a column for each sensor")
    found = []
    for one, (_, _, came) in zip(injected, graph.instants, strict=True):
        acting = [[entry if i in came else Fraction(0) for i, entry in enumerate(row)] for row in one]
        noise = scaled(-1, times(acting, plant.D))
        found.append((minus(plant.A, times(acting, plant.C)), blocks([[plant.B, noise]])))
    return found


def _bounded(
    plant: Sensed, graph: Graph, steps: list[tuple[Matrix, Matrix]], witness: tuple[Any, Any, Any], level: Fraction
) -> None:
    """Refuse unless along every walk some of the functions e'Pe fall by more than |We|^2 - g^2 |v|^2 in each step."""
    size = len(plant.A)
    at, to, stored = witness
    states = several(at, "at", count)
    need(bool(states) and states[0] == 0, "the first function is not that of the start")
    ends = several(to, "to", lambda value, where: several(value, where, count), len(states))
    storage = several(stored, "P", lambda value, where: symmetric(value, where, size), len(states))
    weight = times(turned(plant.W), plant.W)
    for own, (state, further) in enumerate(zip(states, ends, strict=True)):
        need(is_positive(storage[own]), f"P[{own}] is not positive")
        begun = graph.from_state(state)
        need(len(begun) == len(further), f"function {own} does not meet every case of its state")
        for i, next_ in zip(begun, further, strict=True):
            need(
                next_ < len(states) and states[next_] == graph.instants[i][1], f"function {own} goes astray in case {i}"
            )
            both = blocks([list(steps[i])])
            inputs = len(both[0]) - size
            before = minus(storage[own], weight)
            room = blocks([[before, nought(size, inputs)], [nought(inputs, size), unit(inputs, level**2)]])
            need(is_positive(minus(room, times(turned(both), storage[next_], both))), f"no fall in case {i}")


CHECKS = {"multirate.gain-under-losses": gain_under_losses}
