"""A filter for samples with time stamps, for a plant of one's own: `design_stamped`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from replication.estimation.api.results import Evidence
from replication.estimation.api.signals import numbered
from replication.estimation.nonuniform.facade import HORIZON, SampledPlantReader, as_range
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.stamped.design import CELLS
from replication.estimation.nonuniform.stamped.proof import proved_design
from replication.estimation.nonuniform.stamped.result import StampedResult, stamped_result
from replication.estimation.nonuniform.stamped.stamped_filter import StampedPlant
from replication.estimation.validation import as_matrix

if TYPE_CHECKING:
    import control


class StampedPlantReader(SampledPlantReader):
    """The same plants, of which A may have eigenvalues anywhere."""

    advice = "; arrays make one: StampedPlant(A, B, C, D, L)"
    makes = StampedPlant


read_stamped_plant = StampedPlantReader()


def design_stamped(
    plant: SampledPlant | control.StateSpace,
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
        Plant of arrays, or a continuous-time system with inputs w and outputs y and z. It may be unstable.
    periods : (float, float) or PeriodRange
        Shortest and longest sampling period h_l, h_u, s.
    measured : int, or sequence of int or str
        How many of the first outputs of a `control.StateSpace` are y, or which ones, by index or name.
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
    checked, signals = read_stamped_plant(plant, measured=measured)
    range_ = as_range(periods)
    inputs = np.zeros((checked.order, 0)) if B_u is None else as_matrix("B_u", B_u, rows=checked.order)
    signals = replace(signals, inputs=numbered("u", inputs.shape[1]))
    # Products of small matrices gain nothing from threads, and lose much where processors are busy.
    with threadpool_limits(1, user_api="blas"):
        found, proof = proved_design(checked, range_, cells=cells)
        facts = (
            Evidence(
                "level of the design", found.level, "Lyapunov functions by the period before, gain free in the periods"
            ),
            Evidence("violation left", found.violation, "largest eigenvalue of its inequality over the range"),
            Evidence("solver", f"{found.report.name} {found.report.version}: {found.report.status}", "its own word"),
        )
        return stamped_result(checked, signals, found.filter, proof, range_, inputs, facts, horizon)
