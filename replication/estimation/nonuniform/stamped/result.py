"""What a filter with time stamps guarantees for every sampling sequence, as a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from replication.errors import InvalidInputError, SolverError
from replication.estimation.api.plants import Signals
from replication.estimation.api.results import Bracket, Evidence
from replication.estimation.nonuniform.filters import Estimator
from replication.estimation.nonuniform.guarantee import guaranteed_level
from replication.estimation.nonuniform.nominal import riccati_filter
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.result import (
    BOTH_ENDS,
    SequenceResult,
    beside,
    ends_found,
    searched,
    zero_at_constant_periods,
    zero_filter,
)
from replication.estimation.nonuniform.stamped.design import StampedFilter, StampedProof, kalman_filter
from replication.estimation.nonuniform.stamped.observer import StampedObserver
from replication.estimation.nonuniform.worst_case import BadSequence, worst_sequence
from replication.estimation.validation import Array, frozen, positive_scalar

if TYPE_CHECKING:
    import control

AXES = {
    "G_x": "(cell of the period before, state, measurement)",
    "G_w": "(cell of the period before, disturbance, measurement)",
    "edges": "(edge of a cell, s)",
}
"""What the axes of the gains are."""
LEAVES = 16
"""Lyapunov matrices for the level of no sensor."""
FLOOR = 1e-4
"""Relative distance at which the search for the level of no filter ends."""
HALVINGS = 40


@dataclass(frozen=True, eq=False)
class StampedGain:
    """attack: a sequence and a disturbance at hand; proof: of a level that no sequence exceeds."""

    attack: BadSequence
    proof: StampedProof


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StampedResult(SequenceResult):
    """A filter that takes time stamps (gains G_x, G_w).

    x^(k|k) = x^(k) + G_x v, w^(k) = G_w v with v = y(k) - C x^(k), and G of the cell in which the period before lies;
    then the plant's own dynamics over h_k.

    Attributes
    ----------
    known : array (n, p)
        Effect of known inputs.
    gain : StampedGain
        `gain.attack` attains the lower end of the bracket, `gain.proof` proves the upper one.
    """

    method: str = "nonuniform with time stamps"
    axes: Mapping[str, str] = field(default_factory=AXES.copy)
    filter: StampedFilter
    known: Array
    gain: StampedGain

    def observer(self) -> StampedObserver:
        """The filter, to run in a loop: `step(y, t=...)` for each sample."""
        made = StampedObserver(self.plant, self.filter, self.periods, self.known, self.signals.measurements)
        return made.named(self.signals)

    def to_statespace(self, h: float | None = None) -> control.StateSpace:
        """The filter from y to z^ at a constant period h (s), without known inputs; that of the middle unless given.

        Raises InvalidInputError unless h is positive.
        """
        import control

        period = self.periods.middle if h is None else positive_scalar("h", h, unit="s")
        K = self.plant.transition(period)[: self.plant.order] @ self.filter.gain(period)
        Phi, _ = self.plant.discretise(period)
        feedthrough = np.zeros((len(self.plant.L), len(self.plant.C)))
        system = control.StateSpace(Phi - K @ self.plant.C, K, self.plant.L, feedthrough, period)
        system.set_inputs(list(self.signals.measurements))
        system.set_outputs([f"estimate of {name}" for name in self.signals.outputs])
        return system

    def others(self, periods: Array) -> Mapping[str, Sequence[Estimator]]:
        """Kalman filters made for each period, if there is one at all of them."""
        made = [kalman_filter(self.plant, h) for h in periods.tolist()]
        known = [one for one in made if one is not None]
        return {"Kalman filters": known} if len(known) == len(periods) else {}


def stamped_result(
    plant: SampledPlant,
    signals: Signals,
    filter_: StampedFilter,
    proof: StampedProof,
    periods: PeriodRange,
    known: Array,
    evidence: tuple[Evidence, ...],
    horizon: int,
) -> StampedResult:
    """Both ends of the filter's worst-case gain, and what else is known of it, after the `evidence` of its design.

    Where the level of no sensor is less, the filter is that of gain zero.
    """
    without = zero_at_constant_periods(plant, periods.nodes(3).tolist())
    if without is not None and proof.level > without:
        filter_, proof = _better(plant, filter_, proof, periods)
    with searched(horizon):
        attack = worst_sequence(plant, filter_, periods, horizon=horizon)
        compared = beside(plant, filter_, periods, (attack.level, proof.level), horizon=horizon, stamped=True)
    lower = compared.lower
    facts = [*evidence, *ends_found(attack, lower, len(proof.storage))]
    if (least := floor_of_any_filter(plant, periods, proof.level)) is not None:
        facts.append(Evidence("least level of any filter", least, "Riccati recursion, the worst constant period"))
    facts.append(Evidence("sampling periods", f"{periods.h_l:g} to {periods.h_u:g}", "as given", "s"))
    n, edges = plant.order, np.array([periods.h_l, *filter_.edges, periods.h_u])
    return StampedResult(
        bracket=Bracket(lower, proof.level, BOTH_ENDS),
        gains=frozen({"G_x": filter_.G[:, :n], "G_w": filter_.G[:, n:], "edges": edges}),
        evidence=(*facts, *compared.facts),
        signals=signals,
        plant=plant,
        filter=filter_,
        periods=periods,
        known=known,
        gain=StampedGain(attack, proof),
    )


def _better(
    plant: SampledPlant, filter_: StampedFilter, proof: StampedProof, periods: PeriodRange
) -> tuple[StampedFilter, StampedProof]:
    """The filter, or that of gain zero if its level is less."""
    zero = zero_filter(plant)
    least = guaranteed_level(plant, zero, periods, max_leaves=LEAVES)
    if least.level > proof.level:
        return filter_, proof
    before = tuple(map(tuple, least.tree.before()))
    return zero, StampedProof(least.level, least.system.storage(least.P), least.cells.edges, before)


def floor_of_any_filter(plant: SampledPlant, periods: PeriodRange, level: float) -> float | None:
    """A level below `level` that no filter has, whatever it knows: the period may be constant, at either end or in the
    middle. None where the Riccati recursion does not tell."""
    floors = []
    for h in sorted(set(periods.nodes(3).tolist())):
        low, high = 0.0, level
        try:
            for _ in range(HALVINGS):
                if high - low <= FLOOR * level:
                    break
                middle = (low + high) / 2
                low, high = (middle, high) if riccati_filter(plant, h, middle) is None else (low, middle)
        except (InvalidInputError, SolverError):
            continue
        floors.append(low)
    return max(floors, default=None)
