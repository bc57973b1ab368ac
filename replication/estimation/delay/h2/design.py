"""Kalman and least-entropy gains of a delay plant, as `design` gives them: the exact gain and the exact mean error.

The gains come from the filter Riccati equation of the plant with each delay by its first Legendre moments. Both
measures are taken of the observer in continuous time, with true exponentials, and set beside the least of any.
"""

from __future__ import annotations

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.api.results import Bracket, Evidence, baselines
from replication.estimation.api.shown import Goal
from replication.estimation.delay.exact.central import central
from replication.estimation.delay.exact.forms import injection_terms, plant_terms
from replication.estimation.delay.exact.ladder import FilterModel
from replication.estimation.delay.exact.limit import climbed
from replication.estimation.delay.exact.terms import PlantTerms, Terms
from replication.estimation.delay.exact.worth import worth
from replication.estimation.delay.general.design import AGREES, UNSETTLED, known_levels, over_ranges
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.general.result import InnovationsResult, arrays_of, signals_of
from replication.estimation.delay.general.scaling import scaling_of
from replication.estimation.delay.h2.designs import OF, Designs, returns
from replication.estimation.delay.h2.variance import error_covariance, smoother_covariance
from replication.estimation.validation import Array, frozen

BOTH_ENDS = "exact closed loop with true exponentials, all frequencies; not certified"
TOLERANCE, NOTICED = 1e-8, 1e-3
"""Relative change of the least mean error over two models at which the climb ends; excess over it that is told."""


def mean_design(
    plant: DelayPlant, *, goal: Goal, level: float | None, degree: int | None, order: int
) -> InnovationsResult:
    """The Kalman filter, or the central gains at `level` or, without one, where both measures lose the same share.

    Raises as `design`: InvalidInputError, InfeasibleError and SolverError.
    """
    designs = Designs(plant, degree)
    asked: tuple[Evidence, ...] = (Evidence("goal", str(goal), "white noise of unit intensity"),)
    aim = np.inf
    if goal is Goal.MIXED:
        aim = designs.balance() if level is None else designs.above_least(level)
        asked += (Evidence("level of the design", aim if np.isfinite(aim) else "infinite", "least entropy"),)
    observer, gain = designs.exact(aim)
    covariance, reach = error_covariance(plant_terms(plant), injection_terms(observer))
    arrays, axes = arrays_of(observer)
    evidence = (
        *asked,
        *_mean_facts(plant, covariance, reach),
        Evidence("gains computed with", f"{designs.degree} moments of each delay", "filter Riccati equation"),
        Evidence("lower end attained at", gain.frequency, "exact closed loop", "rad/s"),
        *over_ranges(observer),
        *known_levels(plant, gain.upper),
        *worth(plant_terms(plant), gain.upper),
    )
    return InnovationsResult(
        bracket=Bracket(gain.lower, gain.upper, BOTH_ENDS),
        gains=frozen(arrays),
        axes=axes,
        evidence=evidence,
        signals=signals_of(plant),
        gains_of=observer,
        covariance=frozen({"z": covariance})["z"],
        order=order,
    )


def _mean_facts(plant: DelayPlant, covariance: Array, reach: float) -> tuple[Evidence, ...]:
    """The mean error of z, each and together, beside those without sensors, of any observer and of a smoother."""
    terms, how = plant_terms(plant), "white noise of unit intensity; spectrum over all frequencies, true exponentials"
    own, each = float(np.sqrt(np.trace(covariance))), np.sqrt(np.diag(covariance)).tolist()
    value, models = _least_rms(plant, own)
    limit_rms = float(np.sqrt(np.trace(smoother_covariance(terms, reach))))
    return (
        Evidence(OF, own, how),
        *(Evidence(f"rms error of z[{i}]", value, how) for i, value in enumerate(each) if len(each) > 1),
        Evidence("least rms error of any observer", value, models),
        *(_excess(plant, own, value) if isinstance(value, float) else ()),
        *baselines(own, how, what="rms error", without=_alone(terms, plant.measurements), limit=limit_rms),
    )


def _least_rms(plant: DelayPlant, own: float) -> tuple[float | str, str]:
    """The least rms error, or "open" where models do not agree, or give more than `own`; and how it is known."""
    scaling = scaling_of(plant)
    terms, unit = plant_terms(scaling.plant(plant)), scaling.time**-0.5
    try:
        rungs, moving = climbed(terms, lambda model, near: unit * _model_rms(model, near), 0.0, TOLERANCE)
    except (InfeasibleError, np.linalg.LinAlgError) as error:
        return "open", f"a model has no Kalman filter, to rounding: {error}"
    order, least = rungs[-1]
    models = f"Riccati equation on models of rising order, up to {order} moments; last change {moving:.1e}"
    if moving > UNSETTLED * least:
        return "open", f"models of rising order do not agree: {least:.6g}, last change {moving:.1e}"
    if least > own * (1 + AGREES):
        return "open", f"models of rising order give {least:.6g}, above what is attained"
    return least, models


def _excess(plant: DelayPlant, own: float, least: float) -> tuple[Evidence, ...]:
    """What is lost where the optimal gains jump."""
    if own <= least * (1 + NOTICED) or not returns(plant):
        return ()
    why = "a disturbance that y has shown acts again later, and the optimal gains jump there"
    return (Evidence("above the least", f"{100 * (own / least - 1):.2g} %", why),)


def _model_rms(model: FilterModel, _: float) -> float:
    """The rms error of the Kalman filter of a model."""
    P = central(model)[1]
    return float(np.sqrt(max(np.trace(model.cz @ P @ model.cz.T), 0.0)))


def _alone(terms: PlantTerms, measurements: int) -> float | None:
    """The rms error of the estimate zero; None if it is infinite, or a root next to the axis leaves it open."""
    nothing = Terms(np.zeros((len(terms.terms.constant), measurements)))
    try:
        return float(np.sqrt(np.trace(error_covariance(terms, nothing)[0])))
    except (InfeasibleError, SolverError, np.linalg.LinAlgError):
        return None
