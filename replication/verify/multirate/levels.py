"""Two-sided bounds of the gain of given gains, and of the smallest gain of any observer (Theorems 1 and 2)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, identity, product, zeros
from replication.verify.kernel import AtMost, Positive, decide
from replication.verify.multirate.bounds import attained, require_theorem_1, unseen_for_long, unseen_forever
from replication.verify.multirate.sensing import CHOSEN, Sensing, read_sensing
from replication.verify.predicate import NO_READING
from replication.verify.reading import integer, matrices, sequence, sized, square, symmetric
from replication.verify.says import Says
from replication.verify.statement import BOTH, Depends, statement
from replication.verify.theorem import Found

Matrices = list[fmpq_mat]
on_sensors = partial(
    statement,
    source="okajima2023",
    parameters=CHOSEN,
    plant=Depends(lambda given: sized(read_sensing, given)),
    bound=BOTH,
    holds=True,
)
"""A statement on the two bounds of a gain of a plant that is seen by chosen sensors."""
OBSERVERS = ("periodic one-step observers", "one-step predictors")
"""The upper bound is that of one of the first; the lower one holds for the second, which are more."""
UNDER = (NO_READING, "predictors", "table-alone")
"""Readings of the paper under which its levels are those of the observers that it designs."""


def _excess(given: Mapping[str, Any]) -> Found:
    """The relative distance between both bounds: the level of the theorem is at most the upper one."""
    return Found(lower=fmpq(0), upper=given["upper"] / given["lower"] - 1)


TIGHT = (
    Says(quantity="excess of Theorem 2", estimators=OBSERVERS[:1], found=_excess),
    Says(quantity="excess over gains of Theorem 2", found=_excess),
)
"""The level of the witness is one of Theorem 2, and its gains have it; no observer has one below the lower bound."""
GAINS = Depends(lambda given: sized(matrices, given.plant.order, given.plant.sensors, given.plant.phases))
STORAGE = Depends(lambda given: sized(sequence, sized(symmetric, given.plant.order), given.plant.phases))
RECURRENT = Depends(lambda given: sized(matrices, given.plant.B_d.ncols(), given.turn.nrows(), given.plant.phases))
FINITE = Depends(lambda given: sized(matrices, given.plant.B_d.ncols(), 1))
NOISES = Depends(lambda given: sized(matrices, given.plant.noises, given.turn.nrows(), given.plant.phases))
"""Of all disturbances and sensor noises together."""


@on_sensors(
    "multirate.gain",
    plant=Depends(lambda given: sized(read_sensing, given, "L")),
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

    The gain of the given gains L_k: Theorem 1 from above, a disturbance from below.
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

    The smallest gain where smoothers do no better: Theorem 2 from above, a disturbance that is never seen below.
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

    The smallest gain: Theorem 2 from above, a disturbance of finite length that is seen too late from below.
    """
    require_bracket(lower, upper, chosen["relative"])
    require_theorem_2(plant, P, Y, upper)
    require_lower(lower, unseen_for_long(plant, start, d))


def require_theorem_2(system: Sensing, P: list[fmpq_mat], Y: list[fmpq_mat], level: fmpq) -> None:
    """Refuse unless P_k and Y_k satisfy inequality (30) as printed, at every phase.

    By a Schur complement with its first block it is the inequality of Theorem 1 for the gains L_k = P_k^-1 Y_k; and its
    diagonal blocks are positive definite, so P_k > 0.
    """
    n, weight = system.order, system.W.transpose() * system.W
    for k in range(system.phases):
        driven, seen = system.open_loop(k)
        step = product(P[k], driven) - system.acting(k, Y[k]) * seen
        m = step.ncols() - n
        rest = block([[P[k - 1] - weight, zeros(n, m)], [zeros(m, n), identity(m) * level**2]])
        whole = block([[P[k], step], [step.transpose(), rest]])
        decide(Positive(whole, f"the matrix (30) of Theorem 2 at phase {k}"))


def require_bracket(lower: fmpq, upper: fmpq, relative: fmpq) -> None:
    """Refuse bounds that are farther apart than the theorem that is wanted allows."""
    for less, more in ((lower, upper), (upper, lower * (1 + relative))):
        decide(AtMost(less, more, f"the bounds are not within the relative width {relative}"))


def require_lower(lower: fmpq, squared: fmpq) -> None:
    """Refuse unless the square of a proved ratio is not below that of the bound."""
    decide(AtMost(lower**2, squared, "the disturbance of the witness does not reach the lower bound"))
