"""What a level over a range of periods is worth: other estimators at the constant periods of the range."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from replication.estimation.api.baselines import baselines
from replication.estimation.api.results import Evidence
from replication.estimation.nonuniform.filters import Estimator, Filter, periodic_gain
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.stamped.stamped_filter import kalman_filter

NODES = 9
"""Constant periods at which other estimators are compared."""
ANGLES = 181
"""Frequencies between standing still and half the sampling frequency at which a smoother is looked at."""
KNOWN = 1.5
"""Where knowing the period is worth such a factor at constant periods, that is told."""
UNMOVED = 1e-9
"""Share of the disturbance in a pair of state and disturbance below which it belongs to a mode that is not seen."""
SETTLED = 1 - 1e-9
"""Spectral radius from which on a plant counts as one whose state does not decay."""


def constant_baselines(
    plant: SampledPlant, filter_: Estimator, periods: PeriodRange, *, stamped: bool = False
) -> tuple[Evidence, ...]:
    """Largest gains at constant periods of the range: of this filter, of no sensor, of Kalman filters, of a smoother.

    stamped: the filter knows the period.
    """
    nodes = [float(h) for h in periods.nodes(NODES if periods.h_l < periods.h_u else 1)]

    def largest(filters: Sequence[Estimator]) -> float:
        return max(periodic_gain(plant, one.at(h), [h]).value for one, h in zip(filters, nodes, strict=True))

    own = largest([filter_] * len(nodes))
    known = [kalman_filter(plant, h) for h in nodes]
    filters = [one for one in known if one is not None]
    kalman = largest(filters) if len(filters) == len(nodes) else None
    how = f"largest of {len(nodes)} constant periods"
    facts = [Evidence("level at constant periods", own, f"this filter; {how}")]
    limit = max(smoother_limit(plant, h) for h in nodes)
    facts += baselines(own, how, without=without_sensors(plant, nodes), kalman=kalman, limit=limit)
    if not stamped and kalman is not None and kalman < own / KNOWN:
        told = f"Kalman filters that know the period have {kalman / own:.2g} times this level"
        facts.append(Evidence("advice", told, "if each sample has a time stamp, use `design_stamped`, which takes it"))
    return tuple(facts)


def attained(level: float, compared: Sequence[Evidence], upper: float) -> float:
    """The larger of the levels of a sequence with its disturbance and of constant periods, which are sequences too.

    compared: `constant_baselines`, of which the first is the filter's own. upper: what no sequence exceeds.
    """
    own = compared[0].value
    assert isinstance(own, float)
    return min(max(level, own), upper)


def without_sensors(plant: SampledPlant, periods: Sequence[float]) -> float | None:
    """The largest gain of the estimate zero at constant periods; None if it is infinite."""
    if np.max(np.abs(np.linalg.eigvals(plant.discretise(max(periods))[0]))) >= SETTLED:
        return None
    zero = Filter(np.zeros((1, 1)), np.zeros((1, len(plant.C))), np.zeros((len(plant.L), 1)))
    return max(periodic_gain(plant, zero, [h]).value for h in periods)


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
