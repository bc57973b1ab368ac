"""What a level of a delay observer is worth: the same gain without sensors, of a Kalman filter, of a smoother."""

from __future__ import annotations

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.api.results import Evidence, baselines
from replication.estimation.delay.exact.central import central
from replication.estimation.delay.exact.ladder import FilterModel, ladder_model
from replication.estimation.delay.exact.loop import error_response
from replication.estimation.delay.exact.peak import gain_bracket
from replication.estimation.delay.exact.smoothing import smoother_bound
from replication.estimation.delay.exact.terms import PlantTerms, Terms
from replication.estimation.linear.norms import hinf_norm
from replication.estimation.validation import Array

WIDTH = 1e-4
"""Relative width of the gain without sensors."""
ORDER, STATES = 6, 120
"""Moments of each piece of the past in the model of the Kalman filter, fewer for more states than these."""

DEPENDENT = 1e-10
"""Least eigenvalue of the correlations of the noise in the measurements, below which one has no noise of its own."""


def worth(plant: PlantTerms, level: float) -> tuple[Evidence, ...]:
    """The facts to set beside `level`, with advice where it is hardly below that without sensors."""
    nothing = Terms(np.zeros((len(plant.terms.constant), plant.sizes[2])))
    how = "gain from w to the error of z, true exponentials"
    try:
        without = gain_bracket(error_response(plant, nothing), WIDTH).upper
    except InfeasibleError:
        without = None
    except (SolverError, np.linalg.LinAlgError):
        found = baselines(level, how, without=None, limit=smoother_bound(plant).level)
        unknown = Evidence("level without sensors", "open", "a root of the plant on the imaginary axis, or next to it")
        return unknown, *found[1:], _kalman(plant)
    return *baselines(level, how, without=without, limit=smoother_bound(plant).level), _kalman(plant)


def _kalman(plant: PlantTerms) -> Evidence:
    what = "level of the Kalman filter"
    order = ORDER
    model = ladder_model(plant, order)
    while len(model.a) > STATES and order > 1:
        order -= 1
        model = ladder_model(plant, order)
    how = f"white noise of unit intensity; on a model with {len(model.a)} states"
    try:
        return Evidence(what, kalman_level(model), how)
    except np.linalg.LinAlgError:
        return Evidence(what, "none", "a measurement without noise of its own: its gains would be infinite")
    except (InfeasibleError, SolverError) as error:
        return Evidence(what, "open", f"{how}: {error}")


def kalman_level(model: FilterModel) -> float:
    """The gain from w to the error of z of the Kalman filter for white w; LinAlgError if there is none."""
    R = model.dy @ model.dy.T
    size = np.sqrt(np.diag(R))
    if np.any(size == 0) or np.linalg.eigvalsh(R / np.outer(size, size))[0] < DEPENDENT:
        raise np.linalg.LinAlgError
    L, _ = central(model)
    Lz = np.linalg.solve(R, (model.dz @ model.dy.T).T).T
    error = model.a - L @ model.cy, model.b - L @ model.dy, model.cz - Lz @ model.cy, model.dz - Lz @ model.dy
    return hinf_norm(*_sampled(*error)).upper


def _sampled(a: Array, b: Array, c: Array, d: Array) -> tuple[Array, Array, Array, Array]:
    """A discrete-time system with the same norm: s = rate (z - 1) / (z + 1) takes the axis to the unit circle."""
    rate = float(np.abs(np.linalg.eigvals(a)).max()) or 1.0
    resolvent = np.linalg.inv(rate * np.eye(len(a)) - a)
    root = np.sqrt(2 * rate)
    return resolvent @ (rate * np.eye(len(a)) + a), root * resolvent @ b, root * c @ resolvent, d + c @ resolvent @ b
