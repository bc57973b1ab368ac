"""The true worst-case gain of a filter over every sampling sequence, between a proved level and an attained one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from replication.estimation.nonuniform.filters import Estimator
from replication.estimation.nonuniform.guarantee.guarantee import Guarantee, guaranteed_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.worst_case import BadSequence, worst_sequence


@dataclass(frozen=True)
class WorstCaseGain:
    """lower: attained by `attack`; upper: proved by `guarantee` for the continuum of periods."""

    attack: BadSequence
    guarantee: Guarantee

    @property
    def lower(self) -> float:
        """||e|| / ||w|| of a sequence and disturbance that are at hand."""
        return self.attack.level

    @property
    def upper(self) -> float:
        """A level that no sequence in the range exceeds."""
        return self.guarantee.level


def worst_case_gain(
    plant: SampledPlant,
    filter_: Estimator,
    periods: PeriodRange,
    *,
    horizon: int,
    final_horizon: int,
    max_leaves: int,
    cuts: Sequence[float] | None = None,
    per_duration: bool = False,
) -> WorstCaseGain:
    """Both ends; see `guaranteed_level` and `worst_sequence` for the effort each argument buys and the errors
    raised."""
    guarantee = guaranteed_level(plant, filter_, periods, max_leaves=max_leaves, cuts=cuts, per_duration=per_duration)
    attack = worst_sequence(
        plant, filter_, periods, horizon=horizon, final_horizon=final_horizon, per_duration=per_duration
    )
    return WorstCaseGain(attack, guarantee)
