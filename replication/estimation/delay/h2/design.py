"""Kalman and least-entropy gains of a delay plant, as `design` gives them: the exact gain and the exact mean error.

The gains come from the filter Riccati equation of the plant with each delay by its first Legendre moments. Both
measures are taken of the observer in continuous time, with true exponentials, and set beside the least of any.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.baselines import baselines
from replication.estimation.api.results import Bracket, Evidence
from replication.estimation.api.shown import frozen
from replication.estimation.api.tradeoff import Goal, Measures, TradeOff, balanced
from replication.estimation.api.tradeoff import tradeoff as curve
from replication.estimation.delay.exact.central import central
from replication.estimation.delay.exact.forms import injection_terms, plant_terms
from replication.estimation.delay.exact.ladder import FilterModel
from replication.estimation.delay.exact.limit import Limit, climbed, limit, require_seen
from replication.estimation.delay.exact.loop import exact_gain
from replication.estimation.delay.exact.terms import PlantTerms, Terms
from replication.estimation.delay.exact.worth import worth
from replication.estimation.delay.general.design import known_levels
from replication.estimation.delay.general.lines import line_form
from replication.estimation.delay.general.noise import require_noise
from replication.estimation.delay.general.observer import DelayObserver
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.general.rates import moment_plant
from replication.estimation.delay.general.result import InnovationsResult, arrays_of, signals_of
from replication.estimation.delay.general.scaling import scaling_of
from replication.estimation.delay.h2.variance import error_covariance, smoother_covariance
from replication.estimation.validation import Array

BOTH_ENDS = "exact closed loop with true exponentials, all frequencies; not certified"
WIDTH, TOLERANCE = 1e-6, 1e-8
"""Relative width of the exact gain; change of the least mean error over two models at which the climb ends."""
MARGIN = 0.01
"""Relative distance above the least level at which gains are computed: nearer to it they grow without bound."""
DEGREE, STATES = 12, 120
"""Moments of each delay unless a degree is asked for, and states of the model for which there are fewer."""
OF = "rms error of z"


def mean_design(
    plant: DelayPlant, *, goal: Goal, level: float | None, degree: int | None, order: int
) -> InnovationsResult:
    """The Kalman filter, or the central gains at `level` or, without one, where both measures lose the same share.

    Raises as `design`: InvalidInputError, InfeasibleError and SolverError.
    """
    designs = _Designs(plant, degree)
    asked: tuple[Evidence, ...] = (Evidence("goal", str(goal), "white noise of unit intensity"),)
    aim = np.inf
    if goal is Goal.MIXED:
        aim = designs.balance() if level is None else designs.above_least(level)
        asked += (Evidence("level of the design", aim if np.isfinite(aim) else "infinite", "least entropy"),)
    observer = designs.at(aim)
    gain = exact_gain(observer, WIDTH)
    covariance, reach = error_covariance(plant_terms(plant), injection_terms(observer))
    arrays, axes = arrays_of(observer)
    evidence = (
        *asked,
        *_mean_facts(plant, covariance, reach),
        Evidence("gains computed with", f"{designs.degree} moments of each delay", "filter Riccati equation"),
        Evidence("lower end attained at", gain.frequency, "exact closed loop", "rad/s"),
        *known_levels(plant),
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


def tradeoff(plant: DelayPlant, points: int) -> TradeOff:
    """Designs from just above the least level to the Kalman filter; raises as `mean_design`."""
    designs = _Designs(plant, None)
    return curve("delay", OF, points, designs.least(), designs.measures)


class _Designs:
    """The central gains of a plant at any level, each computed once."""

    def __init__(self, plant: DelayPlant, degree: int | None) -> None:
        if np.any(plant.d11):
            raise InvalidInputError(
                "z holds w itself (d11), and white noise has an infinite mean square; leave d11 out, or estimate a "
                "filtered signal"
            )
        require_noise(plant)
        require_seen(plant_terms(plant))
        self.plant, self.scaling = plant, scaling_of(plant)
        self.form = line_form(self.scaling.plant(plant))
        most = (STATES - plant.states) // max(self.form.width, 1)
        self.degree = max(min(DEGREE, most), self.form.moments, 1) if degree is None else degree
        self.model = moment_plant(self.form, self.degree)

    def at(self, level: float) -> DelayObserver:
        """The observer, in the units of the plant."""
        try:
            gains, _ = central(self.model, level)
        except (InfeasibleError, np.linalg.LinAlgError) as error:
            what = f"for the level {level:.6g}" if np.isfinite(level) else "of the Kalman filter"
            raise SolverError(
                f"the gains {what} are not found with {self.degree} moments of each delay ({error}); "
                "raise the level, or set `degree`"
            ) from error
        n, q, kernels = self.form.states, self.form.measurements, []
        start = n
        for line in self.form.lines:
            stop = start + self.degree * line.width
            kernels.append(gains[start:stop].reshape(self.degree, line.width, q) / self.scaling.time)
            start = stop
        l0 = gains[:n] / self.scaling.states[:, None] / self.scaling.time
        return DelayObserver(
            self.plant, self.scaling.back(self.form), l0, np.zeros((self.form.outputs, q)), tuple(kernels)
        )

    def measures(self, level: float) -> Measures:
        """The exact gain and root mean square of the design at a level."""
        observer = self.at(level)
        covariance, _ = error_covariance(plant_terms(self.plant), injection_terms(observer))
        return exact_gain(observer, WIDTH).upper, float(np.sqrt(np.trace(covariance)))

    @cached_property
    def limit(self) -> Limit:
        """The least level of any observer."""
        found = limit(self.plant)
        if found.level <= 0.0:
            raise InfeasibleError("the least level cannot be told from zero: there is nothing to trade; take goal h2")
        return found

    def least(self) -> float:
        """The smallest level of a design."""
        found = self.limit
        return (1 + MARGIN) * (found.level + found.moving)

    def above_least(self, level: float) -> float:
        """The level if some observer keeps it."""
        found = self.limit
        if level <= found.level - found.moving:
            raise InfeasibleError(
                f"no observer has a gain below {level!r}: the least is {found.level:.6g}; ask for more"
            )
        return level

    def balance(self) -> float:
        """The level whose design loses the same share of both measures."""
        return balanced(self.least(), self.limit.level, self.measures)


def _mean_facts(plant: DelayPlant, covariance: Array, reach: float) -> tuple[Evidence, ...]:
    """The mean error of z, each and together, beside those without sensors, of any observer and of a smoother."""
    terms, how = plant_terms(plant), "white noise of unit intensity; spectrum over all frequencies, true exponentials"
    own, each = float(np.sqrt(np.trace(covariance))), np.sqrt(np.diag(covariance)).tolist()
    rungs, moving = climbed(terms, _model_rms, 0.0, TOLERANCE)
    order, least = rungs[-1]
    models = f"Riccati equation on models of rising order, up to {order} moments; last change {moving:.1e}"
    limit_rms = float(np.sqrt(np.trace(smoother_covariance(terms, reach))))
    return (
        Evidence(OF, own, how),
        *(Evidence(f"rms error of z[{i}]", value, how) for i, value in enumerate(each) if len(each) > 1),
        Evidence("least rms error of any observer", least, models),
        *baselines(own, how, what="rms error", without=_alone(terms, plant.measurements), limit=limit_rms),
    )


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
