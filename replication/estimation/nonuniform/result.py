"""What a level over a range of periods is worth: no sensor over all sequences, other estimators at constant periods."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import scipy
from threadpoolctl import threadpool_limits

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError, SolverError
from replication.estimation.api.export import Phase, Recursion
from replication.estimation.api.plants import Signals
from replication.estimation.api.results import LITTLE, Bracket, Evidence, GainResult, baselines
from replication.estimation.api.running import RunningObserver
from replication.estimation.nonuniform.filters import Estimator, Filter, periodic_gain
from replication.estimation.nonuniform.guarantee import guaranteed_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.stamped.design import StampedFilter, kalman_filter
from replication.estimation.nonuniform.worst_case import BadSequence, WorstCaseGain, worst_case_gain, worst_sequence
from replication.estimation.validation import Array, frozen

if TYPE_CHECKING:
    import control


LEAVES = 4
"""Lyapunov matrices for the level without sensors, whose guarantee gains little by more."""
COMPARED = 9
"""Constant periods at which other estimators are compared."""
ANGLES = 181
"""Frequencies between standing still and half the sampling frequency at which a smoother is looked at."""
KNOWN = 1.5
"""Where knowing the period is worth such a factor at constant periods, that is told."""
UNMOVED = 1e-9
"""Share of the disturbance in a pair of state and disturbance below which it belongs to a mode that is not seen."""
SETTLED = 1 - 1e-9
"""Spectral radius from which on a plant counts as one whose state does not decay."""


@dataclass(frozen=True)
class Beside:
    """own: the filter's largest gain at constant periods; lower: of its bracket; facts: other levels, and advice."""

    own: float
    lower: float
    facts: tuple[Evidence, ...]


def beside(
    plant: SampledPlant,
    filter_: Estimator,
    periods: PeriodRange,
    ends: tuple[float, float],
    *,
    horizon: int,
    stamped: bool = False,
) -> Beside:
    """What a level over all sequences is worth: without sensors by the same measure, others at constant periods.

    ends: what a sequence attains, and what none exceeds. stamped: the filter knows the period. A constant period is a
    sequence, too, so that the lower end is at least what the filter has there.
    """
    nodes = [float(h) for h in periods.nodes(COMPARED if periods.h_l < periods.h_u else 1)]

    def largest(filters: Sequence[Estimator]) -> float:
        return max(periodic_gain(plant, one.at(h), [h]).value for one, h in zip(filters, nodes, strict=True))

    own = largest([filter_] * len(nodes))
    known = [kalman_filter(plant, h) for h in nodes]
    filters = [one for one in known if one is not None]
    kalman = largest(filters) if len(filters) == len(nodes) else None
    how = f"largest of {len(nodes)} constant periods"
    level = Bracket(min(max(ends[0], own), ends[1]), ends[1], "")
    facts = [Evidence("level at constant periods", own, f"this filter; {how}")]
    limit = max(smoother_limit(plant, h) for h in nodes)
    without = without_sensors(plant, periods, level.upper, horizon)
    facts += baselines(level, "all sampling sequences", without=without, kalman=kalman, limit=limit, others=how)
    if not stamped and kalman is not None and kalman < own / KNOWN:
        told = f"Kalman filters that know the period have {kalman / own:.2g} times this level"
        facts.append(Evidence("advice", told, "if each sample has a time stamp, use `design_stamped`, which takes it"))
    return Beside(own, level.lower, tuple(facts))


def without_sensors(plant: SampledPlant, periods: PeriodRange, level: float, horizon: int) -> Bracket | None:
    """The gain of the estimate zero over all sequences; None if it is infinite.

    level: one that it is compared with. Constant periods give the lower end, a bad sequence of `horizon` samples where
    that does not tell them apart.
    """
    lower = zero_at_constant_periods(plant, periods.nodes(COMPARED if periods.h_l < periods.h_u else 1).tolist())
    if lower is None:
        return None
    zero = zero_filter(plant)
    if periods.h_l == periods.h_u:
        return Bracket(lower, periodic_gain(plant, zero, [periods.h_l]).upper, "the exact gain")
    try:
        upper = max(guaranteed_level(plant, zero, periods, max_leaves=LEAVES).level, lower)
    except SolverError:
        upper = np.inf
    if level <= (1 - LITTLE) * lower:
        return Bracket(lower, upper, "constant periods")
    attack = worst_sequence(plant, zero, periods, horizon=horizon).level
    return Bracket(min(max(lower, attack), upper), upper, "a bad sequence")


def zero_filter(plant: SampledPlant) -> StampedFilter:
    """The estimate zero, of error x."""
    return StampedFilter(np.zeros((1, plant.order + plant.B.shape[1], len(plant.C))))


def zero_at_constant_periods(plant: SampledPlant, periods: Sequence[float]) -> float | None:
    """The largest gain of the estimate zero at constant periods; None if it is infinite."""
    if np.max(np.abs(np.linalg.eigvals(plant.discretise(max(periods))[0]))) >= SETTLED:
        return None
    return max(periodic_gain(plant, zero_filter(plant), [h]).value for h in periods)


def smoother_limit(plant: SampledPlant, h: float) -> float:
    """The gain from disturbances that the sensors do not see to z, at the worst of ANGLES frequencies: what no
    estimator beats at the constant period h, even if it knows all samples, past and future."""
    Phi, Gamma = plant.discretise(h)
    n, (r, m) = plant.order, plant.D.shape
    if m <= r:
        # The sensors tell apart all disturbances.
        return 0.0
    circle = np.exp(1j * np.linspace(0.0, np.pi, ANGLES))[:, None, None]
    state = np.concatenate([circle * np.eye(n) - Phi, np.broadcast_to(plant.C, (ANGLES, r, n))], axis=1)
    drive = np.broadcast_to(np.vstack([-Gamma, plant.D]), (ANGLES, n + r, m))
    # Pairs [x; w] that go on for ever at a frequency while y stays zero.
    unseen = np.linalg.svd(np.concatenate([state, drive], axis=2)).Vh[:, n + r :].conj().mT
    x, w = unseen[:, :n], unseen[:, n:]
    moved = np.linalg.svd(w, compute_uv=False)[:, -1] > UNMOVED
    gains = np.linalg.norm(plant.L @ x[moved] @ np.linalg.pinv(w[moved]), 2, axis=(1, 2))
    return float(np.max(gains, initial=0.0))


BOTH_ENDS = (
    "a sampling sequence with its disturbance, or a constant one over all time; a Lyapunov certificate for all of them"
)
QUANTITY = "l2 gain from the disturbance w (held between samples) to the error z - z^, over all sampling sequences"
AXES = {"A_f": "(state, state)", "B_f": "(state, measurement)", "C_f": "(output, state)"}
NODES = 60
"""Points of the plot over the sampling period."""


class RunningFilter(RunningObserver):
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
        super().__init__(len(filter_.A), 0, filter_.B.shape[1])

    @property
    def estimate(self) -> Array:
        """z^(k), (s,)."""
        return np.asarray(self.filter.C @ self._state)

    def _recursion(self) -> Recursion:
        return Recursion([self._phase()], self.states)

    def _phase(self) -> Phase:
        inputs, due = np.zeros((self.states, 0)), np.ones(self.measurements, dtype=bool)
        return Phase(self.filter.A, inputs, self.filter.B, self.filter.C, due)

    def to_statespace(self) -> control.StateSpace:
        """The filter from y to z^, at its samples, whose period is unspecified (True)."""
        system = self.filter.to_statespace()
        if self.signals is not None:
            system.set_inputs(list(self.signals.measurements))
            system.set_outputs([f"estimate of {name}" for name in self.signals.outputs])
        return system

    def _begin(self, start: Array) -> None:
        self._state = start

    def _advance(self, u: Array, y: Array) -> None:
        missing = np.isnan(y)
        if np.all(missing):
            self.missed += len(y)
        elif np.any(missing):
            raise InvalidInputError(
                f"y must be complete or None, got {y.tolist()}; the filter takes all sensors at once"
            )
        else:
            self._state = self.filter.A @ self._state + self.filter.B @ y


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SequenceResult(GainResult):
    """A filter with both ends of its worst-case gain over every sampling sequence.

    Attributes
    ----------
    plant : SampledPlant
        The plant for which the level holds.
    periods : PeriodRange
        The sampling periods for which it holds, s.
    filter : Estimator
        The gains as a filter.
    """

    quantity: str = QUANTITY
    plant: SampledPlant
    periods: PeriodRange
    filter: Estimator

    def others(self, periods: Array) -> Mapping[str, Sequence[Estimator]]:
        """By name, filters for each of the periods to compare with."""
        return {}

    def panels(self) -> tuple[Panel, ...]:
        """The gain at constant periods over the range, of this filter and of others, beside the bracket."""
        periods = self.periods.nodes(NODES if self.periods.h_l < self.periods.h_u else 2)
        filters = {"constant period": [self.filter] * len(periods), **self.others(periods)}
        curves = {name: self._gains(several, periods) for name, several in filters.items()}
        lower = self.bracket.lower
        return self._panel(periods, "sampling period (s)", "gain to the error", curves, worst_sequence_found=lower)

    def _gains(self, filters: Sequence[Estimator], periods: Array) -> Array:
        pairs = zip(filters, periods.tolist(), strict=True)
        return np.array([periodic_gain(self.plant, filter_.at(h), [h]).value for filter_, h in pairs])


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class NonuniformResult(SequenceResult):
    """A filter (gains A_f, B_f, C_f) of form (4), which does not know the periods.

    Attributes
    ----------
    gain : WorstCaseGain
        `gain.attack` attains the lower end of the bracket, `gain.guarantee` proves the upper one.
    """

    method: str = "nonuniform"
    axes: Mapping[str, str] = field(default_factory=AXES.copy)
    filter: Filter
    gain: WorstCaseGain

    def observer(self) -> RunningFilter:
        """The filter of eq. (4), to run in a loop: one step for each sample."""
        return RunningFilter(self.filter).named(self.signals)

    def to_statespace(self) -> control.StateSpace:
        """The filter from y to z^; its dt is the sampling period if there is only one, else unspecified (True)."""
        system = self.observer().to_statespace()
        if self.periods.h_l == self.periods.h_u:
            system.dt = self.periods.h_l
        return system

    def estimator(self, *settings: object, **named: object) -> control.StateSpace:
        """The same as `to_statespace`."""
        return self.to_statespace()


def result_of(
    plant: SampledPlant,
    signals: Signals,
    filter_: Filter,
    periods: PeriodRange,
    evidence: tuple[Evidence, ...],
    leaves: int,
    horizon: int,
) -> NonuniformResult:
    """Both ends of the filter's worst-case gain, and what else is known of it, after the `evidence` of its design."""
    # Products of small matrices gain nothing from threads, and lose much where processors are busy.
    with threadpool_limits(1, user_api="blas"), searched(horizon):
        gain = worst_case_gain(plant, filter_, periods, horizon=horizon, final_horizon=horizon, max_leaves=leaves)
        compared = beside(plant, filter_, periods, (gain.lower, gain.upper), horizon=horizon)
    lower = compared.lower
    facts = (
        *ends_found(gain.attack, lower, gain.guarantee.leaves),
        Evidence("spectral radius of A_f", filter_.spectral_radius(), "stable for every sequence iff below one"),
        Evidence("sampling periods", f"{periods.h_l:g} to {periods.h_u:g}", "as given", "s"),
        *compared.facts,
    )
    return NonuniformResult(
        bracket=Bracket(lower, gain.upper, BOTH_ENDS),
        gains=frozen({"A_f": filter_.A, "B_f": filter_.B, "C_f": filter_.C}),
        evidence=(*evidence, *facts),
        signals=signals,
        plant=plant,
        filter=filter_,
        periods=periods,
        gain=gain,
    )


@contextmanager
def searched(horizon: int) -> Iterator[None]:
    """Tell what to change where no worst disturbance over `horizon` samples is found."""
    try:
        yield
    except scipy.sparse.linalg.ArpackNoConvergence as error:
        raise SolverError(
            f"no worst disturbance over {horizon} samples was found ({error}): many hurt alike; change `horizon`, or "
            "widen the range of sampling periods"
        ) from error


def ends_found(attack: BadSequence, lower: float, matrices: int) -> tuple[Evidence, Evidence]:
    """How both ends of a bracket were found; lower: the end itself, above the level of the attack if constant periods
    are worse in the long run."""
    what, how = f"runs {attack.runs} of h_u, h_l", f"disturbance over {len(attack.periods)} samples"
    if lower > attack.level:
        what, how = "a constant period", "exact gain over all time"
    upper = f"{matrices} Lyapunov matrices"
    return (
        Evidence("lower end attained by", what, how),
        Evidence("upper end proved by", upper, "certificate for the continuum of periods"),
    )
