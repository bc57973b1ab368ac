"""Filters for nonuniformly sampled measurements, for a plant of one's own: `design`, `analyse`, `simulate`.

The plant runs in continuous time and is sampled at periods that change from sample to sample within [h_l, h_u]. A
design gives one filter, whose level holds for every sequence of periods in the range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence

from replication.drawing.panel import Panel
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.results import (
    Bracket,
    Evidence,
    GainResult,
    Simulation,
    frozen,
    require_result,
)
from replication.estimation.api.running import RunningObserver
from replication.estimation.api.signals import Signals, is_statespace, numbered, split_outputs
from replication.estimation.nonuniform.bracket import WorstCaseGain, worst_case_gain
from replication.estimation.nonuniform.exchange import robust_design
from replication.estimation.nonuniform.filter_lmi import LmiSolution
from replication.estimation.nonuniform.filters import Filter, periodic_gain
from replication.estimation.nonuniform.nominal import riccati_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, as_periods
from replication.estimation.nonuniform.worst_case import error_ratio, sequence_gain, simulate_error
from replication.estimation.validation import Array

if TYPE_CHECKING:
    import control

QUANTITY = "l2 gain from the disturbance w (held between samples) to the error z - z^, over all sampling sequences"
BOTH_ENDS = "a sampling sequence with its disturbance; a Lyapunov certificate for all of them"
LEAVES, HORIZON = 16, 400
"""Default effort: Lyapunov matrices of the guarantee, and samples of the worst sequence searched for."""
NODES = 60
"""Points of the plot over the sampling period."""


class RunningFilter(RunningObserver):
    """Eq. (4): x^(k+1) = A_f x^(k) + B_f y(k); the estimate is z^(k) = C_f x^(k), and no input is known.

    A sample that did not come (y None) only makes the sampling interval longer: the filter waits, and its level holds
    as long as the interval stays in the range. A sample that is not complete is refused. `reset` takes x^(0) (nf,).
    """

    def __init__(self, filter_: Filter) -> None:
        """Start at x^(0) = 0."""
        self.filter = filter_
        super().__init__(len(filter_.A), 0, filter_.B.shape[1])

    @property
    def estimate(self) -> Array:
        """z^(k), (s,)."""
        return np.asarray(self.filter.C @ self._state)

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
class NonuniformResult(GainResult):
    """A filter (gains A_f, B_f, C_f) with both ends of its worst-case gain: `gain.attack` and `gain.guarantee`."""

    plant: SampledPlant
    filter: Filter
    periods: PeriodRange
    gain: WorstCaseGain

    def observer(self) -> RunningFilter:
        """The filter, one step for each sample; see `RunningFilter` for samples that do not come."""
        return RunningFilter(self.filter)

    def to_statespace(self) -> control.StateSpace:
        """The filter from y to z^; its dt is the period if there is only one, else unspecified (True)."""
        constant = self.periods.h_l == self.periods.h_u
        system = self.filter.to_statespace(self.periods.h_l if constant else True)
        system.set_inputs(list(self.signals.measurements))
        system.set_outputs([f"estimate of {name}" for name in self.signals.outputs])
        return system

    def panels(self) -> tuple[Panel, ...]:
        """The gain at constant sampling periods over the range, beside the bracket over all sequences."""
        periods = self.periods.nodes(NODES if self.periods.h_l < self.periods.h_u else 2)
        gains = np.array([periodic_gain(self.plant, self.filter, [float(h)]).value for h in periods])
        levels = {"worst sequence found": self.bracket.lower, "guaranteed level": self.value}
        return (Panel(periods, "sampling period (s)", "gain to the error", {"constant period": gains}, levels),)


def design(
    plant: SampledPlant | control.StateSpace,
    *,
    periods: PeriodRange | Sequence[float],
    goal: Literal["robust", "nominal"] = "robust",
    measured: int | Sequence[int | str] | None = None,
    leaves: int = LEAVES,
    horizon: int = HORIZON,
) -> NonuniformResult:
    """A filter for sampling periods from h_l to h_u, periods = (h_l, h_u) in seconds.

    plant: a `SampledPlant` of arrays, or a continuous-time `control.StateSpace` with inputs w and outputs y and z;
    the latter with measured: how many of the first outputs are y, or which ones, by index or name.
    goal: "robust" minimises one level for the whole range (one Lyapunov function); "nominal" is the optimum at the
    middle of the range, whose level over the range is whatever comes out. leaves, horizon: effort of the guarantee and
    of the search for a bad sequence. Raises InvalidInputError for what does not fit (see `SampledPlant`), and the
    errors of `robust_design`, `riccati_level` and `guaranteed_level`.

    >>> tank = SampledPlant([[-1, 0], [1, -0.5]], [[1, 0], [0, 0]], [[0, 1]], [[0, 0.1]], [[1, 0]])
    >>> best = design(tank, periods=(0.1, 0.3), leaves=2, horizon=50)
    >>> 0 < best.bracket.lower <= best.value <= best.fact("level of the design").value
    True
    """
    checked, signals = _plant(plant, measured)
    range_ = _range(periods)
    if goal == "robust":
        found = robust_design(checked, range_)
        report = found.design.report
        _require_positive(found.design)
        facts: tuple[Evidence, ...] = (
            Evidence("level of the design", found.design.level, "LMI (10) at all periods, one Lyapunov function"),
            Evidence("violation left", found.violation, "largest eigenvalue of LMI (10) over the range"),
            Evidence("level of the design too low by", found.shortfall, "relative; dual times violation, first order"),
            Evidence("solver", f"{report.name} {report.version}: {report.status}", "its own word"),
        )
        return _result(checked, signals, found.design.filter, range_, facts, leaves, horizon)
    if goal == "nominal":
        nominal = riccati_level(checked, range_.middle)
        how = f"Riccati recursion, constant period {range_.middle:g} s"
        facts = (Evidence("level of the design", nominal.level, how),)
        return _result(checked, signals, nominal.filter, range_, facts, leaves, horizon)
    raise InvalidInputError(f'goal must be "robust" or "nominal", got {goal!r}')


def analyse(
    plant: SampledPlant | control.StateSpace,
    filter_: Filter | control.StateSpace,
    *,
    periods: PeriodRange | Sequence[float],
    measured: int | Sequence[int | str] | None = None,
    leaves: int = LEAVES,
    horizon: int = HORIZON,
) -> NonuniformResult:
    """What a given filter guarantees; filter_: `Filter` (A_f, B_f, C_f) or a strictly proper `control.StateSpace`.

    The other arguments as in `design`. Raises InvalidInputError if the filter does not fit the plant, InfeasibleError
    if it is unstable, SolverError if no certificate is found.
    """
    checked, signals = _plant(plant, measured)
    return _result(checked, signals, _filter(filter_), _range(periods), (), leaves, horizon)


def simulate(result: NonuniformResult, sampling_periods: Any = None, *, disturbance: Any = None) -> Simulation:
    """The error z - z^ at the samples, from rest.

    sampling_periods: h_0 ... h_{K-1} (K,) in seconds, all in the range; disturbance: w (K, m). Without a disturbance
    the one that hurts most is taken; without sampling periods, too, the worst sequence that the analysis found. Raises
    InvalidInputError for periods outside the range, or another length.
    """
    require_result(result, NonuniformResult)
    if sampling_periods is None:
        if disturbance is not None:
            raise InvalidInputError("give the sampling periods that belong to the disturbance")
        periods, w = result.gain.attack.periods, result.gain.attack.w
    else:
        periods = as_periods("sampling_periods", sampling_periods)
        low, high = result.periods.h_l, result.periods.h_u
        if np.any(periods < low) or np.any(periods > high):
            raise InvalidInputError(f"sampling_periods must lie in [{low:g}, {high:g}] s, where the level holds")
        given = sequence_gain(result.plant, result.filter, periods)[1] if disturbance is None else disturbance
        w = np.asarray(given)
    error = simulate_error(result.plant, result.filter, periods, w)
    return Simulation(
        method="nonuniform",
        time=np.concatenate([[0.0], np.cumsum(periods)]),
        time_label="time (s)",
        # Nothing is held after the last sample.
        signals=frozen({"error": error, "disturbance": np.vstack([w, np.zeros_like(w[:1])])}),
        ratio=error_ratio(periods, w, error) if np.any(w) else None,
        steps=True,
    )


def _require_positive(design: LmiSolution) -> None:
    """Raise InfeasibleError if the least level may be zero: no filter has it, and what the solver found is rounding."""
    delta = float(design.variables.delta)
    if delta <= design.report.residuals["gap"] * (1 + delta):
        raise InfeasibleError(
            f"the least level for these periods cannot be told from zero (found {design.level:.3g}), and no filter "
            "attains zero: a single period, or a sensor without noise of its own, may reveal the disturbance; widen "
            "the range or describe the noise by D"
        )


def _plant(
    plant: SampledPlant | control.StateSpace, measured: int | Sequence[int | str] | None
) -> tuple[SampledPlant, Signals]:
    if isinstance(plant, SampledPlant):
        if measured is not None:
            raise InvalidInputError("measured belongs to a control.StateSpace; a SampledPlant has C and L")
        n, outputs = plant.order, len(plant.L)
        return plant, Signals(numbered("x", n), (), numbered("y", len(plant.C)), numbered("z", outputs))
    if not is_statespace(plant):
        raise InvalidInputError(
            f"plant must be a SampledPlant or a control.StateSpace, got {type(plant).__name__}; "
            "arrays make one: SampledPlant(A, B, C, D, L)"
        )
    if measured is None:
        raise InvalidInputError("give the measured outputs: measured=1, or their names; the others are estimated")
    seen, others = split_outputs(plant, measured)
    if not plant.isctime(strict=True):
        raise InvalidInputError(f"the plant must be continuous-time, got dt = {plant.dt}; pass it before sampling")
    if np.any(plant.D[others]):
        raise InvalidInputError("the estimated outputs must have no feedthrough from w: set these rows of D to zero")
    labels = plant.output_labels
    signals = Signals(tuple(plant.state_labels), (), tuple(labels[i] for i in seen), tuple(labels[i] for i in others))
    return SampledPlant(plant.A, plant.B, plant.C[seen], plant.D[seen], plant.C[others]), signals


def _filter(given: Filter | control.StateSpace) -> Filter:
    if isinstance(given, Filter):
        return given
    if not is_statespace(given):
        raise InvalidInputError(f"filter_ must be Filter(A_f, B_f, C_f) or a StateSpace, got {type(given).__name__}")
    if given.dt == 0:
        raise InvalidInputError("filter_ runs from sample to sample, got a continuous-time one; sample it first")
    if np.any(given.D):
        raise InvalidInputError("the filter must be strictly proper: form (4) has no D")
    return Filter(given.A, given.B, given.C)


def _range(periods: PeriodRange | Sequence[float]) -> PeriodRange:
    if isinstance(periods, PeriodRange):
        return periods
    if np.ndim(periods) != 1 or len(periods) != 2:
        raise InvalidInputError(f"periods must be (h_l, h_u) in seconds, got {periods!r}")
    return PeriodRange(*periods)


def _result(
    plant: SampledPlant,
    signals: Signals,
    filter_: Filter,
    periods: PeriodRange,
    evidence: tuple[Evidence, ...],
    leaves: int,
    horizon: int,
) -> NonuniformResult:
    try:
        gain = worst_case_gain(plant, filter_, periods, horizon=horizon, final_horizon=horizon, max_leaves=leaves)
    except ArpackNoConvergence as error:
        raise SolverError(
            f"no worst disturbance over {horizon} samples was found ({error}): many hurt alike; change `horizon`, or "
            "widen the range of sampling periods"
        ) from error
    attack, guarantee = gain.attack, gain.guarantee
    found = (
        Evidence(
            "lower end attained by",
            f"runs {attack.runs} of h_u, h_l",
            f"disturbance over {len(attack.periods)} samples",
        ),
        Evidence(
            "upper end proved by", f"{guarantee.leaves} Lyapunov matrices", "certificate for the continuum of periods"
        ),
        Evidence("spectral radius of A_f", filter_.spectral_radius(), "stable for every sequence iff below one"),
        Evidence("sampling periods", f"{periods.h_l:g} to {periods.h_u:g}", "as given", "s"),
    )
    return NonuniformResult(
        method="nonuniform",
        quantity=QUANTITY,
        bracket=Bracket(gain.lower, gain.upper, BOTH_ENDS),
        gains=frozen({"A_f": filter_.A, "B_f": filter_.B, "C_f": filter_.C}),
        axes={"A_f": "(state, state)", "B_f": "(state, measurement)", "C_f": "(output, state)"},
        evidence=(*evidence, *found),
        signals=signals,
        plant=plant,
        filter=filter_,
        periods=periods,
        gain=gain,
    )
