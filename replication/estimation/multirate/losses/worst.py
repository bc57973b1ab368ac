"""The worst gain over all patterns of losses, from both sides, and gains that make it small."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate.losses.automaton import Automaton, Word, along, closed_loop, patterns
from replication.estimation.multirate.losses.storage import (
    Walks,
    central_gains,
    kernel,
    least_level,
    proved_level,
)
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array

CLOSE = 1e-4
"""Relative width at which a bracket is good enough."""
LARGEST = 2400
"""Edges times entries of a storage function up to which more of the past is told apart."""
SHARE = 0.3
"""Of the nodes that are told apart by their past in each round, those where most is at stake."""
MEASURED = 10
"""Patterns whose exact gain is computed: the shortest, and those that forget the slowest."""
LONGEST, FOLLOWED = 12, 4
"""Periods of the schedule up to which growing patterns are followed, and how many of the largest at each node."""
MARGINS = (1e-3, 1e-2, 0.1)
"""Relative distances above the least level at which gains are made, each where the one before proves nothing."""


@dataclass(frozen=True, eq=False)
class Worst:
    """lower: the exact gain of the periodic pattern `word`; upper: proved for all patterns by storage functions P
    (nodes, n, n) on the nodes of `tree`, in the units of the plant."""

    lower: float
    upper: float
    word: Word
    tree: Automaton
    P: Array


def worst_pattern(problem: MultirateProblem, given: Automaton, gains: Array, words: list[Word]) -> tuple[float, Word]:
    """The largest exact gain of the periodic patterns; raises InfeasibleError if one makes the error grow."""
    systems = {word: along(problem, gains, word) for word in words}
    radii = {word: system.spectral_radius() ** (1 / system.period) for word, system in systems.items()}
    for word, radius in radii.items():
        if radius >= 1:
            raise InfeasibleError(
                f"the error grows by {radius:.6g} an instant where samples come as {patterns(given.edges, word)} "
                "(1: comes), again and again, so no level is guaranteed; allow fewer losses in a row, or "
                "design the gains for them"
            )
    slowest = sorted(words, key=lambda word: -radii[word])[:MEASURED]
    levels = {word: l2_gain(systems[word]).lower for word in dict.fromkeys((*slowest, *words[:MEASURED]))}
    worst = max(levels, key=lambda word: levels[word])
    return levels[worst], worst


def bracket(problem: MultirateProblem, given: Automaton, gains: Array, words: list[Word]) -> Worst:
    """The worst gain of `gains` (edges, n, q); raises SolverError if no level is proved."""
    lower, word = worst_pattern(problem, given, gains, words)
    best, tree, unit = Worst(lower, np.inf, word, given, np.zeros((0, 0, 0))), given, lower if lower > 0 else 1.0
    while True:
        walks = Walks.of(problem, tree, unit)
        moved = [walks.moved(i, gains[edge.origin]) for i, edge in enumerate(tree.edges)]
        try:
            storage = least_level(walks, moved)
        except InfeasibleError:
            # Most often no storage exists since some longer pattern grows; if it is found, that is the answer.
            worst_pattern(problem, given, gains, [*growing(problem, given, gains), *words])
            break
        except SolverError:
            break
        upper = proved_level(walks, moved, storage.P)
        if upper < best.upper:
            best = replace(best, upper=upper, tree=tree, P=walks.storage(storage.P))
        lower, word = worst_pattern(problem, given, gains, tree.followed(storage.flux))
        if lower > best.lower:
            best = replace(best, lower=lower, word=word)
        finer = _told_apart(tree, storage.flux)
        if (
            best.upper <= best.lower * (1 + CLOSE)
            or finer is None
            or len(finer.edges) * problem.plant.order**2 > LARGEST
        ):
            break
        tree = finer
    if not np.isfinite(best.upper):
        raise SolverError(
            f"no level was proved for all patterns of losses; the worst one found has the gain {best.lower:.6g}; allow "
            "fewer losses in a row, or change the units of the states"
        )
    return best


def growing(problem: MultirateProblem, given: Automaton, gains: Array) -> list[Word]:
    """A periodic pattern along which the error of `gains` (edges, n, q) grows, if large products lead to one."""
    steps = [closed_loop(problem, gain)[0] for gain in gains]
    period = max(given.phases) + 1
    for start in (node for node, phase in enumerate(given.phases) if phase == 0):
        front: list[tuple[int, Word, Array]] = [(start, (), np.eye(problem.plant.order))]
        for _ in range(LONGEST * period):
            ahead: dict[int, list[tuple[int, Word, Array]]] = {}
            for node, word, moved in front:
                for i in given.out[node]:
                    target = given.edges[i].target
                    ahead.setdefault(target, []).append((target, (*word, i), steps[i] @ moved))
            for _, word, moved in ahead.get(start, []):
                if np.max(np.abs(np.linalg.eigvals(moved))) >= 1:
                    return [word]
            front = [way for ways in ahead.values() for way in sorted(ways, key=lambda way: -_size(way[2]))[:FOLLOWED]]
    return []


def _size(matrix: Array) -> float:
    return float(np.linalg.norm(matrix))


def found_level(problem: MultirateProblem, given: Automaton, gains: Array, words: list[Word]) -> float:
    """The largest exact gain of patterns that are soon found; raises InfeasibleError if one makes the error grow."""
    level, _ = worst_pattern(problem, given, gains, words)
    walks = Walks.of(problem, given, level if level > 0 else 1.0)
    try:
        flux = least_level(walks, [walks.moved(i, gain) for i, gain in enumerate(gains)]).flux
    except SolverError:
        return level
    return max(level, worst_pattern(problem, given, gains, given.followed(flux))[0])


def _told_apart(tree: Automaton, flux: Array) -> Automaton | None:
    """Nodes with the largest flux told apart by their past; None where there is only one past."""
    through = np.zeros(len(tree.phases))
    ways = np.zeros(len(tree.phases), dtype=int)
    for edge, share in zip(tree.edges, flux, strict=True):
        through[edge.target] += share
        ways[edge.target] += 1
    several = np.flatnonzero(ways > 1)
    if not len(several):
        return None
    ranked = several[np.argsort(-through[several], kind="stable")]
    return tree.split({int(i) for i in ranked[: max(1, int(SHARE * len(several)))]})


def least_gains(problem: MultirateProblem, given: Automaton, unit: float) -> Array:
    """Gains (edges, n, q) that know which samples came, with the least level that storage functions prove.

    unit: a level of about the right size. Raises InfeasibleError or SolverError if there are none.
    """
    walks = Walks.of(problem, given, unit)
    opened = [walks.open_loop(i) for i in range(len(given.edges))]
    kernels = [kernel(seen, moved.shape[1]) for moved, seen in opened]
    storage = least_level(walks, [moved for moved, _ in opened], kernels)
    proved = []
    for margin in MARGINS:
        squared = storage.squared * (1 + margin) ** 2
        gains = central_gains(walks, storage, squared)
        closed = [walks.moved(i, gain) for i, gain in enumerate(gains)]
        try:
            proved.append((proved_level(walks, closed, least_level(walks, closed).P), gains))
        except SolverError:
            continue
        if proved[-1][0] <= walks.unit * np.sqrt(squared) * (1 + margin):
            break
    if not proved or not np.isfinite(min(level for level, _ in proved)):
        raise SolverError("no gains under losses were proved; allow fewer losses in a row, or change the units")
    return min(proved, key=lambda pair: pair[0])[1]
