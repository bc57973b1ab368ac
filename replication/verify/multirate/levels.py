"""Two-sided bounds of the gain of given gains, also under losses, and of the smallest gain of any observer."""

import itertools
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import gcd, prod
from types import SimpleNamespace
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, product, submatrix
from replication.verify.algebra.work import PLACE, spend
from replication.verify.kernel import at_most, decide, definite
from replication.verify.multirate.sensing import (
    CHOSEN,
    PERIOD,
    Schedule,
    Sensing,
    attained,
    read_sensing,
    require_fall,
    require_theorem_1,
    schedule,
    supplied,
    unseen_for_long,
    unseen_forever,
)
from replication.verify.predicate import NO_READING, Says
from replication.verify.reading import integer, matrices, positive, sequence, several, sized, square, symmetric
from replication.verify.statement import BOTH, LOWER, Depends, Table, statement
from replication.verify.theorem import Found, require

Matrices = list[fmpq_mat]
on_sensors = partial(
    statement,
    source="okajima2023",
    parameters=CHOSEN,
    plant=Depends(lambda values: sized(read_sensing, values)),
    bound=BOTH,
    holds=True,
)
"""A statement on the two bounds of a gain of a plant that is seen by chosen sensors."""
OBSERVERS = ("periodic one-step observers", "one-step predictors")
"""The upper bound is that of one of the first; the lower one holds for the second, which are more."""
UNDER = (NO_READING, "observers of form (15)", "columns of Table 1")
"""Readings of the paper under which its levels are those of the observers that it designs."""


def _excess(values: Mapping[str, Any]) -> Found:
    """The relative distance between both bounds: the level of the theorem is at most the upper one."""
    return Found(lower=fmpq(0), upper=values["upper"] / values["lower"] - 1)


TIGHT = (
    Says(quantity="excess of Theorem 2", estimators=OBSERVERS[:1], found=_excess),
    Says(quantity="excess over gains of Theorem 2", found=_excess),
)
"""The level of the witness is one of Theorem 2, and its gains have it; no observer has one below the lower bound."""
GAINS = Depends(lambda values: sized(matrices, values.plant.order, values.plant.sensors, values.plant.phases))
STORAGE = Depends(lambda values: sized(sequence, sized(symmetric, values.plant.order), values.plant.phases))
RECURRENT = Depends(lambda values: sized(matrices, values.plant.B_d.ncols(), values.turn.nrows(), values.plant.phases))
FINITE = Depends(lambda values: sized(matrices, values.plant.B_d.ncols(), 1))
NOISES = Depends(lambda values: sized(matrices, values.plant.noises, values.turn.nrows(), values.plant.phases))
"""Of all disturbances and sensor noises together."""


@on_sensors(
    "multirate.gain",
    plant=Depends(lambda values: sized(read_sensing, values, "L")),
    witness={"P": STORAGE, "turn": square, "v": NOISES},
    says=(
        "gain",
        "level of Theorem 1",
        Says(quantity="stable error system"),
        Says(quantity="excess of Theorem 1", found=_excess),
    ),
)
def gain(plant: Sensing, lower: fmpq, upper: fmpq, P: Matrices, turn: fmpq_mat, v: Matrices, **chosen: Any) -> None:
    """For {subject} and the periods {periods}, offsets {offsets} of the sensors {sensors} (counted from 0), the error
    system of its gains is stable, with an l2 gain between {lower:down} and {upper:up}; the upper bound is one of
    <Theorem 1|a storage function with the period of the schedule>.
    """
    require_bracket(lower, upper, chosen["relative"])
    steps = plant.error_system(plant.gains)
    require_theorem_1(steps, plant.W, P, upper)
    require_lower(lower, attained(steps, plant.W, turn, v))


@on_sensors(
    "multirate.optimum-noncausal",
    witness={"P": STORAGE, "Y": GAINS, "turn": square, "d": RECURRENT},
    says=(Says(quantity="smallest gain", estimators=(*OBSERVERS, "all estimators"), readings=UNDER), *TIGHT),
)
def optimum_noncausal(
    plant: Sensing, lower: fmpq, upper: fmpq, P: Matrices, Y: Matrices, turn: fmpq_mat, d: Matrices, **chosen: Any
) -> None:
    """For {subject} and the periods {periods}, offsets {offsets} of the sensors {sensors} (counted from 0), <by
    Theorem 2 |>some observer that predicts one step has a gain of at most {upper:up}; no estimator, not even a
    smoother, has one below {lower:down}.
    """
    require_bracket(lower, upper, chosen["relative"])
    require_theorem_2(plant, P, Y, upper)
    require_lower(lower, unseen_forever(plant, turn, d))


@on_sensors(
    "multirate.optimum-causal",
    witness={"P": STORAGE, "Y": GAINS, "start": integer, "d": FINITE},
    says=(Says(quantity="smallest gain", estimators=OBSERVERS, readings=UNDER), *TIGHT),
)
def optimum_causal(
    plant: Sensing, lower: fmpq, upper: fmpq, P: Matrices, Y: Matrices, start: int, d: Matrices, **chosen: Any
) -> None:
    """For {subject} and the periods {periods}, offsets {offsets} of the sensors {sensors} (counted from 0), <by
    Theorem 2 |>some observer that predicts one step has a gain of at most {upper:up}; no one-step predictor, which
    estimates z(k) from the measurements up to k - 1, has one below {lower:down}, but a filter that uses y(k) too may.
    """
    require_bracket(lower, upper, chosen["relative"])
    require_theorem_2(plant, P, Y, upper)
    require_lower(lower, unseen_for_long(plant, start, d))


def require_theorem_2(system: Sensing, P: list[fmpq_mat], Y: list[fmpq_mat], level: fmpq) -> None:
    """Refuse unless P_k and Y_k satisfy inequality (30) as printed, at every phase.

    By a Schur complement with its first block it is the inequality of Theorem 1 for the gains L_k = P_k^-1 Y_k; and its
    diagonal blocks are positive definite, so P_k > 0.
    """
    for k in range(system.phases):
        driven, output = system.open_loop(k)
        whole = matrix_30(system, P, k, product(P[k], driven) - system.acting(k, Y[k]) * output, level)
        decide(definite(whole, f"the matrix (30) of Theorem 2 at phase {k}"))


def matrix_30(system: Sensing, P: Sequence[fmpq_mat], phase: int, step: fmpq_mat, level: fmpq) -> fmpq_mat:
    """[P_k, M; M', diag(P_(k-1) - W'W, g^2 I)] at a phase k, M = P_k [A_k B_k]."""
    return block([[P[phase], step], [step.transpose(), supplied(system.W, P[phase - 1], step.ncols(), level)]])


def require_bracket(lower: fmpq, upper: fmpq, relative: fmpq) -> None:
    """Refuse bounds that are farther apart than the theorem that is wanted allows."""
    for less, more in ((lower, upper), (upper, lower * (1 + relative))):
        decide(at_most(less, more, f"the bounds are not within the relative width {relative}"))


def require_lower(lower: fmpq, squared: fmpq) -> None:
    """Refuse unless the square of a proved ratio is not below that of the bound."""
    decide(at_most(lower**2, squared, "the disturbance of the witness does not reach the lower bound"))


# Levels compared: where shorter periods have the larger optimum, and what Theorem 1 loses with one matrix.


PERIODS = Depends(lambda values: sized(sequence, PERIOD, len(values.sensors)))
TWO: Table = {"sensors": CHOSEN["sensors"], "shorter": PERIODS, "longer": PERIODS}
PHASES: Table = {name: reader for name, reader in CHOSEN.items() if name != "relative"}


def read_longer(value: Any, path: str, values: Any) -> Sensing:
    """A plant with the longer periods, all sensors at instant 0."""
    offsets = [0] * len(values.longer)
    return read_sensing(value, path, SimpleNamespace(sensors=values.sensors, periods=values.longer, offsets=offsets))


@statement(
    "multirate.shorter-periods",
    source="okajima2023",
    parameters=TWO,
    plant=Depends(lambda values: sized(read_longer, values)),
    witness={"level": positive, "P": STORAGE, "Y": GAINS, "start": integer, "d": FINITE},
    holds=False,
    says=Says(
        quantity="shorter periods are better",
        setting={},
        readings=("all periods, both sensors at instant 0", "all periods, each with its best timing"),
    ),
)
def shorter_periods(
    plant: Sensing, shorter: list[int], longer: list[int], level: fmpq, P: Matrices, Y: Matrices,
    start: int, d: Matrices, **_: Any,
) -> None:  # fmt: skip
    """Of the periods {shorter} and {longer} the longer ones have the smaller optimum, with both sensors at instant 0
    and with the best timing of each. For one level g from {level:down} to {level:up}: with {longer} some observer that
    predicts one step has a gain below g; with {shorter}, which have no common factor, no one-step predictor has one
    below g, whatever the offsets.

    Periods without common factors meet in every combination of phases, so that other offsets are another start.
    """
    pairs = list(zip(shorter, longer, strict=True))
    require(all(a <= b for a, b in pairs) and shorter != longer, f"{shorter} are not shorter than {longer}")
    require(all(gcd(a, b) == 1 for a, b in itertools.combinations(shorter, 2)), f"{shorter} have a common factor")
    require_theorem_2(plant, P, Y, level)
    often = replace(plant, measured=schedule(shorter, [0] * len(shorter)))
    require_lower(level, unseen_for_long(often, start, d))


@statement(
    "multirate.one-matrix",
    source="okajima2023",
    parameters=PHASES,
    plant=Depends(lambda values: sized(read_sensing, values, "L")),
    bound=LOWER,
    witness={"Z": Depends(lambda values: sized(sequence, sized(symmetric, _width(values.plant)), values.plant.phases))},
    says="level of Theorem 1 with one P",
)
def one_matrix(plant: Sensing, lower: fmpq, Z: Matrices, **_: Any) -> None:
    """With one matrix P for all instants, Theorem 1 gives no level below {lower:down} for the gains of {subject},
    periods {periods} and offsets {offsets}.

    The inner products of Z_k > 0 with the matrices of Theorem 1 add up to more than 0, and to at most g^2 times the sum
    of the traces of the parts of Z_k on noises, less that of W'W on states, if the Z_k weigh the states after a step no
    less than those before it.
    """
    n, steps = plant.order, plant.error_system(plant.gains)
    gained, states, noises = fmpq_mat(n, n), fmpq(0), fmpq(0)
    for k, (step, Z_k) in enumerate(zip(steps, Z, strict=True)):
        decide(definite(Z_k, f"Z_{k}"))
        before = submatrix(Z_k, range(n), range(n))
        gained += product(step, product(Z_k, step.transpose())) - before
        weighed = product(plant.W, product(before, plant.W.transpose()))
        states += sum((weighed[i, i] for i in range(weighed.nrows())), fmpq(0))
        noises += sum((Z_k[i, i] for i in range(n, Z_k.nrows())), fmpq(0))
    decide(definite(gained, "what the states gain in a step by all Z_k"))
    require_lower(lower, states / noises)


def _width(plant: Sensing) -> int:
    return plant.order + plant.noises


# The worst gain over all patterns of losses with at most so many in a row, of an observer whose gains follow them.


MOST_CASES = 2000


@dataclass(frozen=True)
class Case:
    """One instant: the node before it, the node after it, and the sensors whose samples came."""

    before: int
    after: int
    arrived: list[int]


@dataclass(frozen=True)
class Lossy(Sensing):
    """The plant with a "phase" for each case, at which the samples that came are measured."""

    cases: Sequence[Case] = ()


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
        for choice in itertools.product(*options):
            after = ((phase + 1) % len(measured), tuple(count for count, _ in choice))
            if after not in nodes:
                nodes[after] = len(nodes)
                waiting.append(after)
            cases.append(Case(nodes[node], nodes[after], sorted(i for _, came in choice for i in came)))
    return cases


def read_lossy(value: Any, path: str, chosen: Any) -> Lossy:
    """A plant whose samples get lost (parameters `LOST`)."""
    plant = read_sensing(value, path, chosen)
    everyone = range(len(chosen.sensors))
    channels = [list(everyone)] if chosen.together else [[i] for i in everyone]
    cases = all_cases(plant.measured, channels, chosen.misses)
    return Lossy(**vars(plant) | {"measured": [case.arrived for case in cases]}, cases=cases)


LOST: Table = {
    **{name: CHOSEN[name] for name in ("sensors", "periods", "offsets")},
    "together": sized(integer, 0, 1),
    "misses": Depends(lambda values: sized(sequence, integer, 1 if values.together else len(values.sensors))),
}
"""together: whether the samples of one instant travel in one packet; misses: most losses in a row, of each channel."""


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
        "P": Depends(lambda values: sized(sequence, sized(symmetric, values.plant.order), len(values.at))),
        "word": sized(several, integer),
        "turn": square,
        "v": Depends(lambda values: sized(matrices, values.plant.noises, values.turn.nrows(), len(values.word))),
    },
)
def gain_under_losses(plant: Lossy, lower: fmpq, upper: fmpq, L: Matrices, word: list[int], **fields: Any) -> Found:
    """For {subject} and the periods {periods}, offsets {offsets} of the sensors {sensors} (counted from 0), and for
    losses of at most {misses} {sent} in a row, the error system of the gains in this certificate, one for each case,
    is stable in every pattern of losses, and its largest l2 gain over all patterns is between {lower:down} and
    {upper:up}.

    Storage functions on the nodes from above; from below a disturbance in a pattern that repeats.
    """
    steps = plant.error_system(L)
    require_storage(plant, steps, fields["at"], fields["to"], fields["P"], upper)
    # All nodes are reached from the start, which takes nothing with the error at zero.
    require(all(i < len(plant.cases) for i in word), "witness.word has a case that is not there")
    walk = zip(word, [*word[1:], word[0]], strict=True)
    joined = all(plant.cases[i].after == plant.cases[j].before for i, j in walk)
    require(joined, "witness.word is no pattern that can repeat")
    require_lower(lower, attained([steps[i] for i in word], plant.W, fields["turn"], fields["v"]))
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
        decide(definite(P[i], f"P_{i}"))
        leaving = cases_of.get(node, [])
        require(len(leaving) == len(to[i]), f"witness.to[{i}] needs an entry for each case of node {node}")
        for number, target in zip(leaving, to[i], strict=True):
            fits = target < len(at) and at[target] == plant.cases[number].after
            require(fits, f"case {number} does not lead from storage function {i} to {target}")
            require_fall(steps[number], plant.W, (P[i], P[target]), level, f"case {number} of storage {i}")
