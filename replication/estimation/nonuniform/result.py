"""What a filter guarantees for every sampling sequence, as a result: with fixed gains, or with time stamps."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from threadpoolctl import threadpool_limits

from replication.drawing.panels import Panel
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.design import Design, Solution
from replication.estimation.api.export import Phase, Recursion
from replication.estimation.api.plants import Signals
from replication.estimation.api.results import Bracket, Evidence
from replication.estimation.api.running import PeriodicObserver
from replication.estimation.linear.periodic import PeriodicSystem
from replication.estimation.nonuniform.filters import Estimator, Filter, error_system, gains_at, observer, riccati_level
from replication.estimation.nonuniform.guarantee import Guarantee, guaranteed_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, balancing
from replication.estimation.nonuniform.robust import robust_design
from replication.estimation.nonuniform.stamped.design import StampedFilter, kalman_filters, proved_design
from replication.estimation.nonuniform.stamped.observer import StampedObserver
from replication.estimation.nonuniform.worst_case import (
    WorstCaseGain,
    beside,
    floor_of_any_filter,
    worst_sequence,
    zero_at_constant_periods,
    zero_filter,
)
from replication.estimation.validation import Array, FrozenArrays, StateSpace, positive_scalar

BOTH_ENDS = (
    "a sampling sequence with its disturbance, or a constant one over all time; a Lyapunov certificate for all of them"
)
QUANTITY = "l2 gain from the disturbance w (held between samples) to the error z - z^, over all sampling sequences"
AXES = {"A_f": "(state, state)", "B_f": "(state, measurement)", "C_f": "(output, state)"}
NODES = 60
"""Points of the plot over the sampling period."""


STAMPED_AXES = {
    "G_x": "(cell of the period before, state, measurement)",
    "G_w": "(cell of the period before, disturbance, measurement)",
    "edges": "(edge of a cell, s)",
}
LEAVES = 16
"""Lyapunov matrices of a guarantee, and for the level of no sensor where it is to be less than that of a design."""


def recursion(filter_: Filter) -> Recursion:
    """The filter, one step for each sample."""
    n, r = filter_.B.shape
    return Recursion([Phase(filter_.A, np.zeros((n, 0)), filter_.B, filter_.C, np.ones(r, dtype=bool))], n)


def gains_of(filter_: Filter) -> dict[str, Array]:
    """By name."""
    return {"A_f": filter_.A, "B_f": filter_.B, "C_f": filter_.C}


def labelled(filter_: Filter, dt: float | bool, signals: Signals | None) -> StateSpace:
    """The filter from y to z^, with the names of the plant."""
    system = filter_.to_statespace(dt)
    if signals is not None:
        system.set_inputs(list(signals.measurements))
        system.set_outputs([f"estimate of {name}" for name in signals.outputs])
    return system


class RunningFilter(PeriodicObserver):
    """Eq. (4): x^(k+1) = A_f x^(k) + B_f y(k); the estimate is z^(k) = C_f x^(k), and no input is known.

    A sample that did not come (y None) only makes the sampling interval longer: the filter waits, and its level holds
    as long as the interval stays in the range. A sample that is not complete is refused. `reset` takes x^(0) (nf,).

    Parameters
    ----------
    filter_ : Filter
        A_f, B_f and C_f; it starts at x^(0) = 0.
    """

    def __init__(self, filter_: Filter) -> None:
        self.filter = filter_
        super().__init__(recursion(filter_).phases, (), starts=len(filter_.A))

    def to_statespace(self) -> StateSpace:
        """The filter from y to z^, at its samples, whose period is unspecified (True)."""
        return labelled(self.filter, True, self.signals)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SequenceResult(Design):
    """A filter with both ends of its worst-case gain over every sampling sequence.

    Attributes
    ----------
    plant : SampledPlant
        The plant for which the level holds.
    periods : PeriodRange
        The sampling periods for which it holds, s.
    filter : Estimator
        The gains as a filter.
    gain : WorstCaseGain
        `gain.attack` attains the lower end of the bracket; `gain.guarantee` proves the upper one.
    """

    quantity: str = QUANTITY
    plant: SampledPlant
    periods: PeriodRange
    filter: Estimator
    gain: WorstCaseGain

    @abstractmethod
    def constant(self, h: float) -> Filter:
        """The filter as it is at a constant period h, in form (4)."""

    @classmethod
    @abstractmethod
    def proved(
        cls, solution: Solution, plant: SampledPlant, periods: PeriodRange, leaves: int
    ) -> tuple[Estimator, Guarantee, Sequence[Evidence]]:
        """The filter of a solution with its guarantee, of so many Lyapunov matrices at most, and facts of the
        method."""

    @classmethod
    def worst(cls, solution: Solution, *, horizon: int, leaves: int = LEAVES, **data: Any) -> Self:
        """The result for the gains of a solution: both ends of the worst-case gain over every sequence."""
        plant, periods = data["plant"], data["periods"]
        with threadpool_limits(1, user_api="blas"):
            filter_, guarantee, more = cls.proved(solution, plant, periods, leaves)
            attack, upper = worst_sequence(plant, filter_, periods, horizon=horizon), guarantee.level
            lower, levels = beside(plant, filter_, periods, (attack.level, upper), horizon=horizon)
        what, how = f"runs {attack.runs} of h_u, h_l", f"disturbance over {len(attack.periods)} samples"
        if lower > attack.level:  # constant periods are worse in the long run
            what, how = "a constant period", "exact gain over all time"
        facts = [
            *solution.evidence,
            Evidence("lower end attained by", what, how),
            Evidence(
                "upper end proved by",
                f"{guarantee.leaves} Lyapunov matrices",
                "certificate for the continuum of periods",
            ),
            *more,
            Evidence("sampling periods", f"{periods.h_l:g} to {periods.h_u:g}", "as given", "s"),
        ]
        data |= {"filter": filter_, "gain": WorstCaseGain(attack, guarantee)}
        bracket = Bracket(lower, upper, BOTH_ENDS)
        return cls(bracket=bracket, gains=FrozenArrays(solution.gains), evidence=(*facts, *levels), **data)

    def error_system(self) -> PeriodicSystem:
        """At the middle of the range, as a constant period."""
        return error_system(self.plant, self.filter, [self.periods.middle])

    def phases(self) -> Recursion:
        """At the middle of the range, as a constant period."""
        return recursion(self.constant(self.periods.middle))

    def others(self, periods: list[float]) -> Mapping[str, Sequence[Estimator]]:
        """By name, filters for each of the periods to compare with."""
        return {}

    def panels(self) -> tuple[Panel, ...]:
        """The gain at constant periods over the range, of this filter and of others, beside the bracket."""
        periods = self.periods.nodes(NODES if self.periods.h_l < self.periods.h_u else 2)
        nodes = periods.tolist()
        filters = {"constant period": [self.filter] * len(nodes), **self.others(nodes)}
        curves = {name: gains_at(self.plant, several, nodes) for name, several in filters.items()}
        lower = self.bracket.lower
        return self._panel(periods, "sampling period (s)", "gain to the error", curves, worst_sequence_found=lower)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class NonuniformResult(SequenceResult):
    """A filter (gains A_f, B_f, C_f) of form (4), which does not know the periods."""

    method: str = "nonuniform"
    axes: Mapping[str, str] = field(default_factory=AXES.copy)
    filter: Filter

    @classmethod
    def solve(cls, plant: SampledPlant, periods: PeriodRange, goal: str) -> Solution:
        """The filter of least level over the range, or the optimum at its middle; raises InvalidInputError."""
        if not isinstance(goal, str) or goal not in ("robust", "nominal"):
            raise InvalidInputError(f'goal must be "robust" or "nominal", got {goal!r}')
        if goal == "nominal":
            nominal = riccati_level(plant, periods.middle)
            how = f"Riccati recursion, constant period {periods.middle:g} s"
            return Solution(gains_of(nominal.filter), (Evidence("level of the design", nominal.level, how),))
        balanced = balancing(plant)
        robust = robust_design(plant.in_coordinates(balanced), periods)
        design, filter_, report = robust.design, robust.design.filter, robust.design.report
        delta = float(design.variables.delta)
        if delta <= report.residuals["gap"] * (1 + delta):
            raise InfeasibleError(
                f"the least level for these periods cannot be told from zero (found {design.level:.3g}), and no filter "
                "attains zero: a single period, or a sensor without noise of its own, may reveal the disturbance; "
                "widen the range or describe the noise by D"
            )
        facts = (
            Evidence("level of the design", design.level, "matrix inequality (10), one Lyapunov function"),
            Evidence("violation left", robust.violation, "largest eigenvalue of that matrix inequality over the range"),
            Evidence(
                "estimated shortfall of the finite-grid level",
                robust.shortfall,
                "relative; dual times violation, first order",
            ),
            Evidence("solver", f"{report.name} {report.version}: {report.status}", "its own word"),
        )
        return Solution(gains_of(filter_.in_units(np.diag(balanced))), facts)

    @classmethod
    def proved(
        cls, solution: Solution, plant: SampledPlant, periods: PeriodRange, leaves: int
    ) -> tuple[Filter, Guarantee, Sequence[Evidence]]:
        """With the spectral radius of A_f."""
        filter_ = Filter(*solution.gains.values())
        guarantee = guaranteed_level(plant, filter_, periods, max_leaves=leaves)
        how = "stable for every sequence iff below one"
        return filter_, guarantee, [Evidence("spectral radius of A_f", filter_.spectral_radius(), how)]

    def constant(self, h: float) -> Filter:
        """The filter itself."""
        return self.filter

    def observer(self) -> RunningFilter:
        """The filter of eq. (4), to run in a loop: one step for each sample."""
        return RunningFilter(self.filter).named(self.signals)

    def to_statespace(self) -> StateSpace:
        """The filter from y to z^; its dt is the sampling period if there is only one, else unspecified (True)."""
        single = self.periods.h_l == self.periods.h_u
        return labelled(self.filter, self.periods.h_l if single else True, self.signals)

    def estimator(self, *settings: Any, **named: Any) -> StateSpace:
        """The same as `to_statespace`."""
        return self.to_statespace()


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StampedResult(SequenceResult):
    """A filter that takes time stamps (gains G_x, G_w).

    x^(k|k) = x^(k) + G_x v, w^(k) = G_w v with v = y(k) - C x^(k), and G of the cell in which the period before lies;
    then the plant's own dynamics over h_k.

    Attributes
    ----------
    known : array (n, p)
        Effect of known inputs.
    """

    method: str = "nonuniform with time stamps"
    axes: Mapping[str, str] = field(default_factory=STAMPED_AXES.copy)
    filter: StampedFilter
    known: Array

    @classmethod
    def solve(cls, plant: SampledPlant, periods: PeriodRange, cells: int) -> Solution:
        """The filter of least level, or that of gain zero where the level of no sensor is less; with its proof."""
        least, guarantee = proved_design(plant, periods, cells=cells)
        filter_, report = least.filter, guarantee.report
        how = "Lyapunov functions by the period before, gain free in the periods"
        facts = (
            Evidence("level of the design", least.level, how),
            Evidence("violation left", least.violation, "largest eigenvalue of its inequality over the range"),
            Evidence("solver", f"{report.name} {report.version}: {report.status}", "its own word"),
        )
        without = zero_at_constant_periods(plant, periods.nodes(3).tolist())
        if without is not None and guarantee.level > without:
            zero = zero_filter(plant)
            still = guaranteed_level(plant, zero, periods, max_leaves=LEAVES)
            if still.level <= guarantee.level:
                filter_, guarantee = zero, still
        n, edges = plant.order, np.array([periods.h_l, *filter_.edges, periods.h_u])
        gains = {"G_x": filter_.G[:, :n], "G_w": filter_.G[:, n:], "edges": edges}
        return Solution(gains, facts, {"filter": filter_, "guarantee": guarantee})

    @classmethod
    def proved(
        cls, solution: Solution, plant: SampledPlant, periods: PeriodRange, leaves: int
    ) -> tuple[StampedFilter, Guarantee, Sequence[Evidence]]:
        """What `solve` proved, with a floor of any filter."""
        guarantee = solution.own["guarantee"]
        floor = floor_of_any_filter(plant, periods, guarantee.level)
        how = "Riccati recursion, the worst constant period"
        more = [] if floor is None else [Evidence("least level of any filter", floor, how)]
        return solution.own["filter"], guarantee, more

    def constant(self, h: float) -> Filter:
        """x^(k+1) = Phi(h) x^(k) + K (y(k) - C x^(k)) with the gain after that period."""
        return observer(self.plant, h, np.hstack(self.plant.discretise(h)) @ self.filter.gain(h))

    def observer(self) -> StampedObserver:  # type: ignore[override]
        """The filter, to run in a loop: `step(y, t=...)` for each sample."""
        instance = StampedObserver(self.plant, self.filter, self.periods, self.known, self.signals.measurements)
        return instance.named(self.signals)

    def to_statespace(self, h: float | None = None) -> StateSpace:
        """The filter from y to z^ at a constant period h (s), without known inputs; that of the middle unless given.

        Raises InvalidInputError unless h is positive.
        """
        period = self.periods.middle if h is None else positive_scalar("h", h, unit="s")
        return labelled(self.constant(period), period, self.signals)

    def others(self, periods: list[float]) -> Mapping[str, Sequence[Estimator]]:
        """Kalman filters made for each period, if there is one at all of them."""
        return {"Kalman filters": filters} if (filters := kalman_filters(self.plant, periods)) else {}
