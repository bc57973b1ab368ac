"""The observer of a general delay plant as `design` gives it: the proved level, the exact gain, and the limit."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal, NoReturn

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.results import Bracket, Evidence
from replication.estimation.api.shown import Goal
from replication.estimation.delay.exact.central import FilterModel, central, scaling_of
from replication.estimation.delay.exact.limit import Limit, climbed, limit
from replication.estimation.delay.exact.response import error_response, gain_bracket, right_roots
from replication.estimation.delay.exact.smoothing import (
    alone,
    beside,
    error_covariance,
    smoother_bound,
    smoother_covariance,
    worth,
)
from replication.estimation.delay.exact.terms import PlantTerms, plant_terms
from replication.estimation.delay.general import synthesis
from replication.estimation.delay.general.observer import DelayObserver, exact_gain, worst_gain
from replication.estimation.delay.general.synthesis import OF, Designs, GeneralLevel, returns
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.result import AGREES, DelayResult, kept, made
from replication.estimation.delay.spectrum import require_seen, rightmost_roots
from replication.estimation.validation import Array, FrozenArrays

BOTH_ENDS = "exact closed loop with true exponentials; a storage function"
WIDTH, ROUGH = 1e-4, 1e-3
"""Relative width of the exact gain; over ranges of delays."""
DECADES, FREQUENCIES = 3, 600
"""Where that stays open: frequencies around the rate of the longest delay."""
UNSETTLED = 1e-3
"""Relative change of the least level over models of rising order from which it is open."""


def design_general(
    plant: DelayPlant, *, degree: int | None, margin: float, level: float | None, **shown: Any
) -> DelayResult:
    """An observer `margin` above the least level of its degree, or at `level`; as `design` says."""
    synthesis.require_noise(plant)
    scaling = scaling_of(plant)
    require_seen(scaling.plant(plant), scaling.time)
    degree = synthesis.degree_of(plant) if degree is None else degree
    if level is None:
        if smoother_bound(plant_terms(plant)).level <= 0.0 and limit(plant).level <= 0.0:
            raise InfeasibleError(
                f"the least level cannot be told from zero: {plant.measurements} measurements may reveal "
                f"{plant.inputs} disturbances, or z is not disturbed; let more disturbances act, or ask for a `level`"
            )
        least = _least(plant, degree)
        proof, observer = synthesis.observer_at(plant, least.level * (1.0 + margin), degree, least.scaling)
        how = f"degree {degree}, {least.steps} steps of the interior-point method; evaluated afterwards"
        facts = (Evidence("least level", least.level, how), *known_levels(plant, least.level))
        return _result(proof, observer, facts, shown)
    try:
        proof, observer = synthesis.observer_at(plant, level, degree, scaling_of(plant).at(level))
    except (InfeasibleError, SolverError) as error:
        _refuse(plant, level, error)
    return _result(proof, observer, known_levels(plant, level), shown)


def _least(plant: DelayPlant, degree: int) -> GeneralLevel:
    """`least_level`, with what is known where it finds none."""
    try:
        return synthesis.least_level(plant, degree)
    except SolverError as error:
        known = "; ".join(f"{fact.what}: {fact.value}" for fact in known_levels(plant))
        raise SolverError(
            f"degree {degree} is found to prove no level, and which one is least stays open ({known}): {error}; raise "
            "the degree"
        ) from error


def _refuse(plant: DelayPlant, level: float, error: Exception) -> NoReturn:
    """Raise InfeasibleError for a level below what any estimator reaches, else SolverError: it is open."""
    bound = smoother_bound(plant_terms(plant))
    if level < bound.level:
        raise InfeasibleError(
            f"the level {level:.6g} is out of reach: at {bound.frequency:.6g} rad/s no estimator, not even one that "
            f"knows the future, has a gain below {bound.level:.6g}; relax the level, or measure more"
        ) from error
    raise SolverError(
        f"whether the level {level:.6g} can be reached is open, no estimator has one below {bound.level:.6g}: {error}"
    ) from error


def known_levels(plant: DelayPlant, attained: float = np.inf, least: Limit | None = None) -> tuple[Evidence, ...]:
    """What is known of the least level of any observer: that at hand, or the exact one, and that of a smoother."""
    what, below = "least level of any observer", "no estimator below"
    try:
        least = limit(plant) if least is None else least
    except (InfeasibleError, SolverError, InvalidInputError) as error:
        bound = smoother_bound(plant_terms(plant))
        return (
            Evidence(what, "open", str(error)),
            Evidence(below, bound.level, f"knowing the future, at {bound.frequency:.4g} rad/s"),
        )
    exact = f"Riccati equation on models of rising order; last change {least.moving:.1e}"
    value, exact = _settled(least.level, least.moving, attained, exact, "a level that is attained")
    smoother = f"knowing the future, at {least.frequency:.4g} rad/s, true exponentials"
    return Evidence(what, value, exact), Evidence(below, least.smoother, smoother)


def _settled(least: float, moving: float, attained: float, how: str, what: str) -> tuple[float | str, str]:
    """The least value and `how` it is known; "open" where models do not agree, or give more than is `attained`."""
    if moving > UNSETTLED * least:
        return "open", f"models of rising order do not agree: {least:.6g}, last change {moving:.1e}"
    if least > attained * (1.0 + AGREES):
        return "open", f"models of rising order give {least:.6g}, above {what}"
    return least, how


def left_alone(plant: DelayPlant) -> tuple[Evidence, ...]:
    """What the plant does without an observer, and what any observer can do."""
    terms = plant_terms(plant)
    still = error_response(terms)
    rightmost, roots, gain, rms = "rightmost root", "unstable roots", "gain from w to z", "rms of z"
    try:
        how = "collocation, refined by Newton's method"
        facts = [Evidence(rightmost, f"{rightmost_roots(plant, 1)[0]:.6g}", how, "1/s")]
    except SolverError as error:
        facts = [Evidence(rightmost, "open", str(error))]
    try:
        count = right_roots(still)[1]
    except (SolverError, np.linalg.LinAlgError) as error:
        facts += [Evidence(what, "open", str(error)) for what in (roots, gain, rms)]
        return *facts, *known_levels(plant)
    facts.append(Evidence(roots, count, "argument principle, true exponentials"))
    if count:
        facts += [Evidence(what, "infinite", "the plant is not stable") for what in (gain, rms)]
    else:
        bracket = gain_bracket(still, WIDTH)
        facts.append(Evidence(gain, bracket.upper, "upper bound over all frequencies"))
        facts.append(Evidence(f"{gain}, lower end", bracket.lower, f"attained at {bracket.frequency:.4g} rad/s"))
        mean = "infinite" if np.any(plant.d11) else _rms(error_covariance(terms)[0])
        facts.append(Evidence(rms, mean, WHITE))
    return *facts, *known_levels(plant)


def _result(
    proof: GeneralLevel, observer: DelayObserver, facts: tuple[Evidence, ...], shown: Mapping[str, Any]
) -> DelayResult:
    """The gains with their exact closed loop. Raises SolverError if this exceeds what was proved."""
    lower, closed = _closed_loop(observer)
    fault = f"and have the gain {lower:.6g}: rounding spoils the kernels; raise `margin`"
    bracket, plant = kept(lower, proof.level, fault, BOTH_ENDS), observer.plant
    evidence = (
        *facts,
        *closed,
        *_mean(observer),
        Evidence("upper end proved by", f"degree {proof.degree}", "storage with moments of each delay"),
        Evidence("slack of the proof", proof.slack, "least eigenvalue of its inequalities, in natural units; positive"),
        *over_ranges(observer),
        *worth(plant_terms(plant), bracket),
    )
    return made(observer, bracket, evidence, proof=proof, **shown)


def _closed_loop(observer: DelayObserver) -> tuple[float, list[Evidence]]:
    """A gain that is attained, and what is known of the largest one, delays and kernels exact."""
    try:
        gain = exact_gain(observer, WIDTH)
    except SolverError as error:
        # Roots next to the axis are hard to count; that the error dies out rests on the storage function then.
        omega = np.concatenate([[0.0], np.logspace(-DECADES, DECADES, FREQUENCIES) / observer.plant.delays[-1]])
        gains = observer.error.gains(omega)
        where = Evidence("lower end attained at", float(omega[gains.argmax()]), "on a grid of frequencies", "rad/s")
        return float(gains.max()), [where, Evidence("exact gain, upper end", "open", str(error))]
    return gain.lower, [
        Evidence("lower end attained at", gain.frequency, "exact closed loop", "rad/s"),
        Evidence("exact gain, upper end", gain.upper, "exact closed loop, all frequencies"),
    ]


def over_ranges(observer: DelayObserver) -> list[Evidence]:
    """The worst gain where delays are known within ranges only."""
    plant = observer.plant
    if all(np.ptp(ends) == 0.0 for ends in plant.ranges):
        return []
    try:
        worst = worst_gain(observer)
        terms = plant_terms(plant)
        still = gain_bracket(replace(error_response(terms), ranges=plant.ranges), ROUGH)
    except (InfeasibleError, SolverError) as error:
        return [Evidence("worst gain over the ranges", "open", str(error))]
    where = ", ".join(f"{delay:.4g}" for delay in worst.delays[: plant.delay_count])
    return [
        Evidence("worst gain over the ranges", worst.upper, "constant delays anywhere in them"),
        Evidence("attained there", worst.lower, f"delays {where} s, {worst.frequency:.4g} rad/s"),
        Evidence(
            "level without sensors over the ranges", still.upper, "estimate zero; constant delays anywhere in them"
        ),
    ]


EXACT_ENDS = "exact closed loop with true exponentials, all frequencies; not certified"
TOLERANCE, NOTICED = 1e-8, 1e-3
"""Relative change of the least mean error over two models at which the climb ends; excess over it that is told."""


def mean_design(plant: DelayPlant, *, goal: Goal, level: float | None, degree: int | None, **shown: Any) -> DelayResult:
    """The Kalman filter, or the central gains at `level` or, without one, where both measures lose the same share."""
    designs = Designs(plant, degree)
    facts: tuple[Evidence, ...] = (Evidence("goal", str(goal), "white noise of unit intensity"),)
    aim, without = np.inf, _alone(plant_terms(plant))
    if goal is Goal.MIXED:
        aim = (
            designs.balance(without if isinstance(without, float) else np.inf)
            if level is None
            else designs.above_least(level)
        )
        facts += (Evidence("level of the design", aim if np.isfinite(aim) else "infinite", "least entropy"),)
    observer, gain = designs.exact(aim)
    covariance, reach = error_covariance(plant_terms(plant), observer.terms)
    bracket, held = Bracket(gain.lower, gain.upper, EXACT_ENDS), FrozenArrays({"z": covariance})["z"]
    evidence = (
        *facts,
        *_mean_facts(plant, covariance, reach, without),
        Evidence("gains computed with", f"{designs.degree} moments of each delay", "filter Riccati equation"),
        Evidence("lower end attained at", gain.frequency, "exact closed loop", "rad/s"),
        *over_ranges(observer),
        *known_levels(plant, gain.upper, designs.limit if goal is Goal.MIXED else None),
        *worth(plant_terms(plant), bracket),
    )
    return made(observer, bracket, evidence, covariance=held, **shown)


RMS, WHITE = "rms error", "white noise of unit intensity; spectrum over all frequencies, true exponentials"


def _mean(observer: DelayObserver) -> tuple[Evidence, ...]:
    """The mean error of z of gains that were not made for it, beside that without sensors."""
    plant = observer.plant
    if np.any(plant.d11 - observer.lz @ plant.d21) or any(np.any(observer.lz @ d) for d in plant.d21_delayed):
        return (Evidence(OF, "infinite", "white noise enters the error of z itself"),)
    try:
        covariance, _ = error_covariance(plant_terms(plant), observer.terms)
    except (InfeasibleError, SolverError, np.linalg.LinAlgError) as error:
        return (Evidence(OF, "open", str(error)),)
    rms = _rms(covariance)
    return Evidence(OF, rms, WHITE), *beside(rms, WHITE, _alone(plant_terms(plant)), what=RMS)


def _mean_facts(
    plant: DelayPlant, covariance: Array, reach: float, without: float | Literal["open"] | None
) -> tuple[Evidence, ...]:
    """The mean error of z, each and together, beside those without sensors, of any observer and of a smoother."""
    rms, each = _rms(covariance), np.sqrt(np.diag(covariance)).tolist()
    least, models = _least_rms(plant, rms)
    facts = [Evidence(OF, rms, WHITE)]
    facts += [Evidence(f"rms error of z[{i}]", value, WHITE) for i, value in enumerate(each) if len(each) > 1]
    facts.append(Evidence("least rms error of any observer", least, models))
    if isinstance(least, float) and rms > least * (1 + NOTICED) and returns(plant):
        why = "a disturbance that y has shown acts again later, and the optimal gains jump there"
        facts.append(Evidence("above the least", f"{100 * (rms / least - 1):.2g} %", why))
    return *facts, *beside(rms, WHITE, without, _rms(smoother_covariance(plant_terms(plant), reach)), RMS)


def _least_rms(plant: DelayPlant, rms: float) -> tuple[float | str, str]:
    """The least rms error, or "open" where models do not agree, or give more than `rms`; and how it is known."""
    scaling = scaling_of(plant)

    def of_model(model: FilterModel, _: float) -> float:
        """The rms error of its Kalman filter."""
        square = np.trace(model.cz @ central(model)[1] @ model.cz.T)
        return float(scaling.time**-0.5 * np.sqrt(max(square, 0.0)))

    try:
        rungs, moving = climbed(plant_terms(scaling.plant(plant)), of_model, 0.0, TOLERANCE)
    except (InfeasibleError, np.linalg.LinAlgError) as error:
        return "open", f"a model has no Kalman filter, to rounding: {error}"
    order, least = rungs[-1]
    models = f"Riccati equation on models of rising order, up to {order} moments; last change {moving:.1e}"
    return _settled(least, moving, rms, models, "what is attained")


def _rms(covariance: Array) -> float:
    return float(np.sqrt(np.trace(covariance)))


def _alone(terms: PlantTerms) -> float | Literal["open"] | None:
    """The rms error of the estimate zero."""
    return alone(lambda: _rms(error_covariance(terms)[0]))
