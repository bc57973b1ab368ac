"""Filters for nonuniformly sampled measurements, for a plant of one's own: `design`, `analyse`, `simulate`.

The plant runs in continuous time and is sampled at periods that change from sample to sample within [h_l, h_u]. A
design gives one filter, whose level holds for every sequence of periods in the range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from replication.errors import InvalidInputError
from replication.estimation.api.design import Solution
from replication.estimation.api.plants import Signals, is_statespace, numbered, parts_of, read_plant
from replication.estimation.api.shown import Simulation, simulated
from replication.estimation.nonuniform.filters import Filter
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, as_periods
from replication.estimation.nonuniform.result import LEAVES, NonuniformResult, StampedResult, gains_of
from replication.estimation.nonuniform.stamped.design import CELLS, StampedPlant
from replication.estimation.nonuniform.worst_case import error_ratio, sequence_gain, simulate_error
from replication.estimation.validation import StateSpace, as_matrix

HORIZON = 400
"""Default effort: samples of the worst sequence searched for."""
FORGOTTEN = 1e-12
"""Share of the state left at the next sample below which a period is taken for a slip of the unit."""


def _read(plant: Any, measured: Any, makes: type[SampledPlant] = SampledPlant) -> tuple[SampledPlant, Signals]:
    """A continuous-time plant whose outputs are measured, y, or estimated, z, and its names.

    Raises InvalidInputError for norms over time, for which nothing is designed.
    """
    if isinstance(plant, SampledPlant) and plant.weighted:
        raise InvalidInputError(
            f"levels are of norms over the samples, got a {type(plant).__name__}; give a SampledPlant"
        )

    def read(system: Any, measured: Any) -> tuple[SampledPlant, Signals]:
        if measured is None:
            raise InvalidInputError("give the measured outputs: measured=1, or their names; the others are estimated")
        signals = parts_of(system, continuous=True, measured=measured).signals
        return makes.from_statespace(system, measured), signals

    return read_plant(
        plant,
        SampledPlant,
        read,
        {"measured": measured},
        arrays="SampledPlant",
        advice=f"; arrays make one: {makes.__name__}(A, B, C, D, L)",
        refusal="measured belongs to a control.StateSpace; a SampledPlant has C and L",
    )


def design(
    plant: SampledPlant | StateSpace,
    *,
    periods: PeriodRange | Sequence[float],
    goal: Literal["robust", "nominal"] = "robust",
    measured: int | Sequence[int | str] | None = None,
    leaves: int = LEAVES,
    horizon: int = HORIZON,
) -> NonuniformResult:
    """A filter for sampling periods from h_l to h_u.

    Parameters
    ----------
    plant : SampledPlant or control.StateSpace
        Plant of arrays, or a continuous-time system with inputs w and outputs y and z.
    periods : (float, float) or PeriodRange
        Shortest and longest sampling period h_l, h_u, s.
    goal : "robust" or "nominal"
        "robust" minimises one level for the whole range (matrix inequality (10), one Lyapunov function); "nominal" is
        the optimum at the middle of the range, whose level over the range is whatever comes out.
    measured : int, or sequence of int or str
        How many of the first outputs of a `control.StateSpace` are y, or which ones, by index or name.
    leaves : int
        Lyapunov matrices of the guarantee at most.
    horizon : int
        Samples of the bad sequence that is searched for.

    Returns
    -------
    NonuniformResult
        The filter (4) with a level that holds for every sampling sequence; the evidence holds the level of the design
        and how far it may lie below the least one (estimated shortfall of the finite-grid level).

    Raises
    ------
    InvalidInputError
        An argument does not fit, see `SampledPlant` and `PeriodRange`.
    InfeasibleError
        The least level cannot be told from zero, or the gain is infinite.
    SolverError
        The solver does not settle, or no certificate is found.

    Notes
    -----
    The filter is recovered from the LMI by eq. (11) of Mustafa, Chen and Fujioka; in place of their grid, the period
    that violates (10) most joins the finitely many at which it is asked for, until none does.

    Examples
    --------
    >>> tank = SampledPlant([[-1, 0], [1, -0.5]], [[1, 0], [0, 0]], [[0, 1]], [[0, 0.1]], [[1, 0]])
    >>> best = design(tank, periods=(0.1, 0.3), leaves=2, horizon=50)
    >>> 0 < best.bracket.lower <= best.value <= best.fact("level of the design").value
    True
    """
    checked, signals = _read(plant, measured)
    range_ = as_range(periods)
    # Between two samples a stable plant must not forget its state altogether.
    remainder = np.exp(float(np.max(np.linalg.eigvals(checked.A).real)) * range_.h_u)
    if remainder < FORGOTTEN:
        raise InvalidInputError(
            f"periods are in seconds: over {range_.h_u:g} s the plant forgets its state (what is left of it is "
            f"{remainder:.0e}), and samples say nothing of the next; if milliseconds were meant, divide by 1000"
        )
    solution = NonuniformResult.solve(checked, range_, goal)
    return NonuniformResult.worst(
        solution, leaves=leaves, horizon=horizon, plant=checked, signals=signals, periods=range_
    )


def analyse(
    plant: SampledPlant | StateSpace,
    filter_: Filter | StateSpace,
    *,
    periods: PeriodRange | Sequence[float],
    measured: int | Sequence[int | str] | None = None,
    leaves: int = LEAVES,
    horizon: int = HORIZON,
) -> NonuniformResult:
    """What a given filter guarantees.

    Parameters
    ----------
    plant : SampledPlant or control.StateSpace
        As in `design`.
    filter_ : Filter or control.StateSpace
        A_f, B_f and C_f of eq. (4), or a strictly proper discrete-time system.
    periods : (float, float) or PeriodRange
        As in `design`, s.
    measured, leaves, horizon : see there
        As in `design`.

    Returns
    -------
    NonuniformResult
        The same filter with a level that holds for every sampling sequence.

    Raises
    ------
    InvalidInputError
        An argument does not fit, or the filter does not fit the plant.
    InfeasibleError
        The filter is unstable.
    SolverError
        No certificate is found.
    """
    checked, signals = _read(plant, measured)
    solution, range_ = Solution(gains_of(_filter(filter_))), as_range(periods)
    return NonuniformResult.worst(
        solution, leaves=leaves, horizon=horizon, plant=checked, signals=signals, periods=range_
    )


def simulate(
    result: NonuniformResult | StampedResult, sampling_periods: Any = None, *, disturbance: Any = None
) -> Simulation:
    """The error z - z^ at the samples, from rest.

    Parameters
    ----------
    result : NonuniformResult or StampedResult
        What `design`, `analyse` or `design_stamped` gave.
    sampling_periods : array (K,), optional
        h_0 ... h_{K-1}, s, all in the range; the worst sequence that the analysis found unless given.
    disturbance : array (K, m), optional
        w; the one that hurts most unless given.

    Returns
    -------
    Simulation
        Signals "error" (K + 1, s) and "disturbance".

    Raises
    ------
    InvalidInputError
        A period outside the range, another length, or a disturbance without its sampling periods.
    """
    if not isinstance(result, StampedResult):
        NonuniformResult.require(result)
    if sampling_periods is None:
        if disturbance is not None:
            raise InvalidInputError("give the sampling periods that belong to the disturbance")
        periods, w = result.gain.attack.periods, result.gain.attack.w
    else:
        periods = as_periods("sampling_periods", sampling_periods)
        low, high = result.periods.h_l, result.periods.h_u
        if np.any(periods < low) or np.any(periods > high):
            raise InvalidInputError(f"sampling_periods must lie in [{low:g}, {high:g}] s, where the level holds")
        inputs = sequence_gain(result.plant, result.filter, periods)[1] if disturbance is None else disturbance
        w = np.asarray(inputs)
    error = simulate_error(result.plant, result.filter, periods, w)
    # Nothing is held after the last sample.
    signals = {
        "error": (error, result.signals.called(result.signals.outputs)),
        "disturbance": (np.vstack([w, np.zeros_like(w[:1])]), result.signals.disturbances or numbered("w", w.shape[1])),
    }
    time = np.concatenate([[0.0], np.cumsum(periods)])
    return simulated(
        result.method, time, signals, ratio=error_ratio(result.plant, periods, w, error) if np.any(w) else None
    )


def _filter(filter_: Filter | StateSpace) -> Filter:
    if isinstance(filter_, Filter):
        return filter_
    if not is_statespace(filter_):
        raise InvalidInputError(f"filter_ must be Filter(A_f, B_f, C_f) or a StateSpace, got {type(filter_).__name__}")
    if filter_.dt == 0:
        raise InvalidInputError("filter_ runs from sample to sample, got a continuous-time one; sample it first")
    if np.any(filter_.D):
        raise InvalidInputError("the filter must be strictly proper: form (4) has no D")
    return Filter(filter_.A, filter_.B, filter_.C)


def as_range(periods: PeriodRange | Sequence[float]) -> PeriodRange:
    """The range that a user gave; raises InvalidInputError unless it is a pair of periods in order."""
    if isinstance(periods, PeriodRange):
        return periods
    if np.ndim(periods) != 1 or len(periods) != 2:
        raise InvalidInputError(f"periods must be (h_l, h_u) in seconds, got {periods!r}")
    return PeriodRange(*periods)


def design_stamped(
    plant: SampledPlant | StateSpace,
    *,
    periods: PeriodRange | Sequence[float],
    measured: int | Sequence[int | str] | None = None,
    B_u: npt.ArrayLike | None = None,
    cells: int = CELLS,
    horizon: int = HORIZON,
) -> StampedResult:
    """A filter for sampling periods from h_l to h_u that knows each period, by the time stamps of the samples.

    Parameters
    ----------
    plant : SampledPlant, StampedPlant or control.StateSpace
        As in `design`; it may be unstable.
    periods, measured : see there
        As in `design`.
    B_u : array (n, p), optional
        Effect of known inputs on the state, which are held from sample to sample; they change no level.
    cells : int
        Parts of the range, by the period before the sample, for each of which the filter has a gain; at most 64.
    horizon : int
        Samples of the bad sequence that is searched for.

    Returns
    -------
    StampedResult
        The filter with a level that holds for every sampling sequence; never above that of no sensor.

    Raises
    ------
    InvalidInputError
        An argument does not fit, see `StampedPlant` and `PeriodRange`.
    InfeasibleError
        The least level cannot be told from zero, or the samples do not see what grows.
    SolverError
        The solver does not settle, or no certificate is found.

    Notes
    -----
    The level is that of the same error, for the same disturbances, as the level of `design`: the gain from w to
    z - z^, where z^(k) is known before y(k) comes. Among all gains that depend on the period before and the coming one,
    in whatever way, the filter has the least level that Lyapunov functions of these cells prove.

    Examples
    --------
    >>> tank = SampledPlant([[-1, 0], [1, -0.5]], [[1, 0], [0, 0]], [[0, 1]], [[0, 0.1]], [[1, 0]])
    >>> best = design_stamped(tank, periods=(0.1, 0.3), horizon=50)
    >>> best.value <= design(tank, periods=(0.1, 0.3), leaves=2, horizon=50).value
    True
    >>> observer = best.observer()
    >>> for t, y in ((0.0, 0.5), (0.12, 0.6), (0.37, 0.4)):
    ...     estimate = observer.step([y], t=t)
    >>> estimate.shape
    (2,)
    """
    checked, signals = _read(plant, measured, StampedPlant)
    range_ = as_range(periods)
    inputs = np.zeros((checked.order, 0)) if B_u is None else as_matrix("B_u", B_u, rows=checked.order)
    signals = replace(signals, inputs=numbered("u", inputs.shape[1]))
    # Products of small matrices gain nothing from threads, and lose much where processors are busy.
    with threadpool_limits(1, user_api="blas"):
        solution = StampedResult.solve(checked, range_, cells)
        return StampedResult.worst(
            solution, horizon=horizon, plant=checked, signals=signals, periods=range_, known=inputs
        )
