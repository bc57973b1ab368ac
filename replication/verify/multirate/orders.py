"""Levels compared: where shorter periods have the larger optimum, and what Theorem 1 loses with one matrix."""

from __future__ import annotations

from itertools import combinations
from math import gcd
from types import SimpleNamespace
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import product, submatrix
from replication.verify.kernel import Positive, decide
from replication.verify.multirate.bounds import unseen_for_long
from replication.verify.multirate.levels import Matrices, require_lower, require_theorem_2
from replication.verify.multirate.sensing import CHOSEN, PERIOD, Sensing, read_sensing
from replication.verify.reading import integer, matrices, positive, sequence, sized, symmetric
from replication.verify.says import Says
from replication.verify.statement import LOWER, Depends, Table, statement
from replication.verify.theorem import require

PERIODS = Depends(lambda given: sized(sequence, PERIOD, len(given.sensors)))
TWO: Table = {"sensors": CHOSEN["sensors"], "shorter": PERIODS, "longer": PERIODS}
PHASES: Table = {name: reader for name, reader in CHOSEN.items() if name != "relative"}


def _together(periods: list[int], given: Any) -> Any:
    """The reader of a plant with all sensors at instant 0."""
    chosen = SimpleNamespace(sensors=given.sensors, periods=periods, offsets=[0] * len(periods))
    return lambda value, path: read_sensing(value, path, chosen)


def _both(given: Any) -> Any:
    return lambda value, path: [_together(periods, given)(value, path) for periods in (given.shorter, given.longer)]


@statement(
    "multirate.shorter-periods",
    source="okajima2023",
    parameters=TWO,
    plant=Depends(_both),
    witness={
        "level": positive,
        "P": Depends(lambda given: sized(sequence, sized(symmetric, given.plant[1].order), given.plant[1].phases)),
        "Y": Depends(
            lambda given: sized(matrices, given.plant[1].order, given.plant[1].sensors, given.plant[1].phases)
        ),
        "start": integer,
        "d": Depends(lambda given: sized(matrices, given.plant[0].B_d.ncols(), 1)),
    },
    holds=False,
    says=Says(quantity="shorter periods are better", setting={}, readings=("rule", "rule-best-timing")),
)
def shorter_periods(
    plant: list[Sensing], shorter: list[int], longer: list[int], level: fmpq, P: Matrices, Y: Matrices,
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
    require(all(gcd(a, b) == 1 for a, b in combinations(shorter, 2)), f"{shorter} have a common factor")
    require_theorem_2(plant[1], P, Y, level)
    require_lower(level, unseen_for_long(plant[0], start, d))


@statement(
    "multirate.one-matrix",
    source="okajima2023",
    parameters=PHASES,
    plant=Depends(lambda given: sized(read_sensing, given, "L")),
    bound=LOWER,
    witness={"Z": Depends(lambda given: sized(sequence, sized(symmetric, _width(given.plant)), given.plant.phases))},
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
        decide(Positive(Z_k, f"Z_{k}"))
        before = submatrix(Z_k, range(n), range(n))
        gained += product(step, product(Z_k, step.transpose())) - before
        weighed = product(plant.W, product(before, plant.W.transpose()))
        states += sum((weighed[i, i] for i in range(weighed.nrows())), fmpq(0))
        noises += sum((Z_k[i, i] for i in range(n, Z_k.nrows())), fmpq(0))
    decide(Positive(gained, "what the states gain in a step by all Z_k"))
    require_lower(lower, states / noises)


def _width(plant: Sensing) -> int:
    return plant.order + plant.noises
