"""What a level over a range of periods is worth: no sensor over all sequences, other estimators at constant periods."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import scipy

from replication.errors import InvalidInputError, SolverError
from replication.estimation.api.results import LITTLE, Bracket, Evidence, baselines
from replication.estimation.nonuniform.filters import Estimator, gains_at, periodic_gain
from replication.estimation.nonuniform.guarantee import guaranteed_level
from replication.estimation.nonuniform.nominal import riccati_filter
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.stamped.design import StampedFilter, kalman_filters
from replication.estimation.nonuniform.worst_case import worst_sequence

LEAVES = 4
"""Lyapunov matrices for the level without sensors, whose guarantee gains little by more."""
COMPARED = 9
"""Constant periods at which other estimators are compared."""
FLOOR, HALVINGS = 1e-4, 40
"""Relative distance at which the search for the level of no filter ends, and its halvings at most."""
ANGLES = 181
"""Frequencies between standing still and half the sampling frequency at which a smoother is looked at."""
KNOWN = 1.5
"""Where knowing the period is worth such a factor at constant periods, that is told."""
UNMOVED = 1e-9
"""Share of the disturbance in a pair of state and disturbance below which it belongs to a mode that is not seen."""
SETTLED = 1 - 1e-9
"""Spectral radius from which on a plant counts as one whose state does not decay."""


def beside(
    plant: SampledPlant, filter_: Estimator, periods: PeriodRange, ends: tuple[float, float], *, horizon: int
) -> tuple[float, tuple[Evidence, ...]]:
    """What a level over all sequences is worth: without sensors by the same measure, others at constant periods.

    ends: what a sequence attains, and what none exceeds. The lower one comes back first: a constant period is a
    sequence, too, so that it is at least what the filter has there.
    """
    nodes = periods.nodes(COMPARED if periods.h_l < periods.h_u else 1).tolist()
    gain, filters = float(max(gains_at(plant, [filter_] * len(nodes), nodes))), kalman_filters(plant, nodes)
    kalman = float(max(gains_at(plant, filters, nodes))) if filters else None
    how = f"largest of {len(nodes)} constant periods"
    level = Bracket(min(max(ends[0], gain), ends[1]), ends[1], "")
    facts = [Evidence("level at constant periods", gain, f"this filter; {how}")]
    limit = max(smoother_limit(plant, h) for h in nodes)
    without = without_sensors(plant, periods, level.upper, horizon)
    facts += baselines(level, "all sampling sequences", without=without, kalman=kalman, limit=limit, others=how)
    if not isinstance(filter_, StampedFilter) and kalman is not None and kalman < gain / KNOWN:
        advice = f"Kalman filters that know the period have {kalman / gain:.2g} times this level"
        facts.append(
            Evidence("advice", advice, "if each sample has a time stamp, use `design_stamped`, which takes it")
        )
    return level.lower, tuple(facts)


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
    return float(max(gains_at(plant, [zero_filter(plant)] * len(periods), periods)))


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
