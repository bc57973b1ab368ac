"""The worst gain over all patterns of losses with at most so many in a row, of an observer whose gains follow them."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.work import PLACE, spend
from replication.verify.kernel import Positive, decide
from replication.verify.multirate.levels import Matrices, require_lower
from replication.verify.multirate.sensing import CHOSEN, Schedule, Sensing, attained, read_plant, require_fall, schedule
from replication.verify.reading import integer, matrices, sequence, several, sized, square, symmetric
from replication.verify.statement import BOTH, Depends, Table, statement
from replication.verify.theorem import Found, require

MOST_CASES = 2000


@dataclass(frozen=True)
class Case:
    """One instant: the node before it, the node after it, and the sensors whose samples came."""

    before: int
    after: int
    arrived: list[int]


@dataclass(frozen=True)
class Lossy:
    """All cases, and the plant with a "phase" for each of them, at which the samples that came are measured."""

    cases: list[Case]
    system: Sensing


def all_cases(measured: Schedule, channels: Sequence[Sequence[int]], misses: Sequence[int]) -> list[Case]:
    """All that may happen, node by node from the start on, in the order in which the nodes are reached.

    A node is a phase with, of each channel, how many of its samples were lost in a row; the start is phase 0 without a
    loss. A channel that has samples to carry at a phase loses them all or none; of two cases of a node the one in
    which the first channel that differs delivers comes first.
    """
    start = (0, (0,) * len(channels))
    nodes, waiting, cases = {start: 0}, deque([start]), list[Case]()
    while waiting:
        phase, lost = node = waiting.popleft()
        options = []
        for carried, count, most in zip(channels, lost, misses, strict=True):
            due = [i for i in carried if i in measured[phase]]
            loss = [(count + 1, list[int]())] if due and count < most else []
            options.append([(0 if due else count, due), *loss])
        # Two ways for each channel that may lose: as many cases as the product of them, before the first is made.
        count = prod(map(len, options))
        spend(count * PLACE, "the cases of the losses")
        require(len(cases) + count <= MOST_CASES, f"the losses make more than {MOST_CASES} cases")
        for choice in product(*options):
            after = ((phase + 1) % len(measured), tuple(count for count, _ in choice))
            if after not in nodes:
                nodes[after] = len(nodes)
                waiting.append(after)
            cases.append(Case(nodes[node], nodes[after], sorted(i for _, came in choice for i in came)))
    return cases


def read_lossy(value: Any, path: str, chosen: Any) -> Lossy:
    """A plant whose samples get lost (parameters `LOST`)."""
    seen, _ = read_plant(value, path, chosen.sensors)
    everyone = range(len(chosen.sensors))
    channels = [list(everyone)] if chosen.together else [[i] for i in everyone]
    cases = all_cases(schedule(chosen.periods, chosen.offsets), channels, chosen.misses)
    return Lossy(cases, seen([case.arrived for case in cases]))


LOST: Table = {
    **{name: CHOSEN[name] for name in ("sensors", "periods", "offsets")},
    "together": sized(integer, 0, 1),
    "misses": Depends(lambda values: sized(sequence, integer, 1 if values.together else len(values.sensors))),
}
"""together: whether the samples of one instant travel in one packet; misses: most losses in a row, of each channel."""
GAINS = Depends(
    lambda values: sized(matrices, values.plant.system.order, values.plant.system.sensors, len(values.plant.cases))
)
STORAGE = Depends(lambda values: sized(sequence, sized(symmetric, values.plant.system.order), len(values.at)))
NOISES = Depends(lambda values: sized(matrices, values.plant.system.noises, values.turn.nrows(), len(values.word)))


@statement(
    "multirate.gain-under-losses",
    parameters=LOST,
    plant=Depends(lambda values: sized(read_lossy, values)),
    bound=BOTH,
    holds=True,
    witness={
        "L": GAINS,
        "at": sized(several, integer),
        "to": Depends(lambda values: sized(sequence, sized(sequence, integer), len(values.at))),
        "P": STORAGE,
        "word": sized(several, integer),
        "turn": square,
        "v": NOISES,
    },
)
def gain_under_losses(plant: Lossy, lower: fmpq, upper: fmpq, L: Matrices, word: list[int], **fields: Any) -> Found:
    """For {subject} and the periods {periods}, offsets {offsets} of the sensors {sensors} (counted from 0), and for
    losses of at most {misses} {sent} in a row, the error system of the gains in this certificate, one for each case,
    is stable in every pattern of losses, and its largest l2 gain over all patterns is between {lower:down} and
    {upper:up}.

    Storage functions on the nodes from above; from below a disturbance in a pattern that repeats.
    """
    steps = plant.system.error_system(L)
    require_storage(plant, steps, fields["at"], fields["to"], fields["P"], upper)
    # All nodes are reached from the start, which takes nothing with the error at zero.
    require(all(i < len(plant.cases) for i in word), "witness.word has a case that is not there")
    walk = zip(word, [*word[1:], word[0]], strict=True)
    joined = all(plant.cases[i].after == plant.cases[j].before for i, j in walk)
    require(joined, "witness.word is no pattern that can repeat")
    require_lower(lower, attained([steps[i] for i in word], plant.system.W, fields["turn"], fields["v"]))
    return Found(words={"sent": "packets" if fields["together"] else "samples of each sensor"})


def require_storage(
    plant: Lossy, steps: Sequence[fmpq_mat], at: list[int], to: list[list[int]], P: Matrices, level: fmpq
) -> None:
    """Refuse unless from each storage function P_i, which belongs to the node at[i], every case of that node leads to
    one at its own end, the j-th of these cases to P_to[i][j], with the fall of Theorem 1.

    A walk through the nodes is then accompanied by one through the storage functions, the first of which is that of the
    start, and the falls add up along it.
    """
    require(at[0] == 0, "the first storage function is not at the start")
    cases_of: dict[int, list[int]] = {}
    for number, case in enumerate(plant.cases):
        cases_of.setdefault(case.before, []).append(number)
    for i, node in enumerate(at):
        decide(Positive(P[i], f"P_{i}"))
        leaving = cases_of.get(node, [])
        require(len(leaving) == len(to[i]), f"witness.to[{i}] needs an entry for each case of node {node}")
        for number, target in zip(leaving, to[i], strict=True):
            fits = target < len(at) and at[target] == plant.cases[number].after
            require(fits, f"case {number} does not lead from storage function {i} to {target}")
            require_fall(steps[number], plant.system.W, (P[i], P[target]), level, f"case {number} of storage {i}")
