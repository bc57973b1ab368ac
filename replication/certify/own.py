"""Certificates of designs for a plant of one's own: what the verifier can prove of the result of a method's `design`.

The plant is the one that was designed for, number by number: each float as the rational that it is, or as the decimal
that it is written as. Gains are always the floats that a program would run with.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from replication.certify import decimals, multirate, nonuniform, rationals, rounded_up
from replication.certify import dualrate as dualrate_makers
from replication.certify.delay import levels as delay_makers
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.results import GainResult
from replication.estimation.delay.result import DelayResult
from replication.estimation.delay.sos.certificate import Certificate
from replication.estimation.dualrate.result import DualRateResult
from replication.estimation.multirate.losses.facade import LossResult
from replication.estimation.multirate.losses.models import InARow
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.multirate.result import MultirateResult
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.result import NonuniformResult, StampedResult
from replication.verify.dualrate.loop import Observer
from replication.verify.run import check
from replication.verify.subjects import FORMAT
from replication.verify.theorem import Refused

Made = dict[str, Any]

WIDTH = "1/1000000"
"""Largest relative distance of the bounds of an exact gain that is asked of a certificate."""
LEVEL_BITS = 40


def certificate(result: GainResult, name: str = "own", *, as_written: bool = False) -> Made:
    """The certificate of a design, as the verifier reads it: `paper` null, `claims` empty.

    What it proves: of a multi-rate observer its gain, from both sides, and the largest one over all patterns with at
    most so many losses in a row; of a filter for nonuniform sampling the guaranteed level, and if it takes time stamps
    its gain from both sides; of a dual-rate loop that it is stable; for a system with delays that the level is reached
    by an observer of Theorem 3, whose gains are those of the certificate's own storage, close to those of the result.

    Parameters
    ----------
    result : MultirateResult, LossResult, NonuniformResult, StampedResult, DualRateResult or DelayResult
        What `design` or `analyse` of the method returned.
    name : str
        Of plant and certificate: letters, digits, points, underscores and hyphens.
    as_written : bool
        Take the numbers of the plant as the shortest decimals that are read as these floats, as in a plant file.

    Raises
    ------
    InvalidInputError
        The verifier has no statement for such a result (the message says why), or a number is not finite.
    SolverError
        No certificate was found, or the verifier refuses the one that was made.

    Examples
    --------
    >>> from replication.estimation.multirate import MultiratePlant, design
    >>> cart = MultiratePlant(A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=[[0, 1], [1, 0]], D=np.diag([0.5, 0.1]))
    >>> certificate(design(cart, periods=(1, 4)), "cart")["statement"]
    'multirate.gain'
    """
    return certified(result, name, as_written=as_written)[0]


def certified(result: GainResult, name: str = "own", *, as_written: bool = False) -> tuple[Made, str]:
    """`certificate` with the sentence that the verifier says it proves."""
    kind = next((kind for kind in METHODS if isinstance(result, kind)), None)
    if kind is None or (isinstance(result, DelayResult) and not isinstance(result.proof, Certificate)):
        raise InvalidInputError(
            f"the verifier has no statement on a {type(result).__name__}; a certificate is made of the result of "
            "`design`, of a plant with delays if it is free of noise"
        )
    document = METHODS[kind](result, name, decimals if as_written else rationals)
    try:
        theorem = check(document)
    except Refused as refusal:
        raise SolverError(f"no certificate: the verifier refuses the one that was made: {refusal}") from None
    return document, theorem.sentence


def _theorem(statement: str, plant: Mapping[str, Any], parameters: Mapping[str, Any]) -> Made:
    """All fields but bound and witness."""
    return {
        "format": FORMAT,
        "paper": None,
        "name": plant["name"],
        "claims": [],
        "statement": statement,
        "plant": dict(plant),
        "parameters": dict(parameters),
    }


def _finite(number: Any, **arrays: Any) -> dict[str, Any]:
    """The arrays as nested lists, written by `number`; raises InvalidInputError for an entry that is no number."""
    for name, values in arrays.items():
        if not np.all(np.isfinite(np.asarray(values, dtype=float))):
            raise InvalidInputError(f"{name} of the result holds a number that is not finite; nothing can be proved")
    return {name: number(np.asarray(values, dtype=float).tolist()) for name, values in arrays.items()}


def _multirate(result: MultirateResult, name: str, number: Any) -> Made:
    theorem = _sensed("multirate.gain", result, result.problem, {"relative": WIDTH}, name, number)
    theorem["plant"] |= _finite(rationals, L=result.gains["L"])
    return {**theorem, **multirate.in_units(theorem, result.value, multirate.gain)}


def _losses(result: LossResult, name: str, number: Any) -> Made:
    if not isinstance(result.model, InARow):
        raise InvalidInputError(
            "the verifier has no statement on mean errors; a certificate is made under at most so many losses in a row"
        )
    misses: Any = result.model.misses  # as it is kept, one for each sensor or one for all
    counts = misses * result.model.channels(result.problem.plant.sensors) if len(misses) == 1 else misses
    more = {"together": int(result.model.together), "misses": list(counts)}
    theorem = _sensed("multirate.gain-under-losses", result, result.problem, more, name, number)
    gains = _finite(rationals, L=result.gains["L"])["L"]
    return {**theorem, **multirate.gain_under_losses(theorem, gains, result.bracket.upper)}


def _sensed(
    statement: str, result: GainResult, problem: MultirateProblem, more: Mapping[str, Any], name: str, number: Any
) -> Made:
    """A theorem on a result, all sensors used."""
    plant, schedule = problem.plant, problem.schedule
    if plant.correlated:
        raise InvalidInputError("the verifier has no statement on sensor noise that also drives the plant (B_w, or S)")
    if not result.bracket.lower > 0:
        raise InvalidInputError(f"no certificate: {statement} is a statement on gains above zero, and this may be zero")
    return _theorem(
        statement,
        {"name": name, **_finite(number, A=plant.A, B_d=plant.B_d, C=plant.C, D=plant.D, W=plant.W)},
        {
            "sensors": list(range(plant.sensors)),
            "periods": list(schedule.periods),
            "offsets": list(schedule.offsets),
            **more,
        },
    )


def _nonuniform(result: NonuniformResult, name: str, number: Any) -> Made:
    filter_ = result.filter
    fields = _sampled("nonuniform.gain-upper", result.plant, result.periods, number)
    theorem = _theorem(
        "nonuniform.gain-upper",
        {"name": name, **fields, "filter": _finite(rationals, **vars(filter_))},
        {"from": "h_l", "to": "h_u", "weight": "samples"},
    )
    return {**theorem, **nonuniform.gain_upper(theorem, leaves=result.gain.guarantee.leaves)}


def _stamped(result: StampedResult, name: str, number: Any) -> Made:
    _finite(rationals, G=result.filter.G)
    fields = _sampled("nonuniform.stamped-gain", result.plant, result.periods, number)
    theorem = _theorem("nonuniform.stamped-gain", {"name": name, **fields}, {})
    document = nonuniform.stamped_gain(theorem, result.filter, result.gain.guarantee, result.gain.attack.runs)
    return {**theorem, **document}


def _sampled(statement: str, plant: SampledPlant, periods: PeriodRange, number: Any) -> Made:
    """A sampled plant with its range of periods; raises InvalidInputError for a single one."""
    if not periods.h_l < periods.h_u:
        raise InvalidInputError(
            f"no certificate: {statement} is a statement on a range of periods, and this one is a single period of "
            f"{periods.h_l:g} s"
        )
    return _finite(number, **vars(plant), h_l=[periods.h_l, 0.0], h_u=[periods.h_u, 0.0])


def _dualrate(result: DualRateResult, name: str, number: Any) -> Made:
    problem = result.loop.design
    model = problem.model
    reasons = (
        (model.B_u.shape[1] == len(model.C) == 1, "one input and one output"),
        (result.observer_name in {*Observer}, f"one of the observers {', '.join(Observer)}"),
        (not result.discrete_gain, "a gain in the differential equation of the observer"),
    )
    for fits, what in reasons:
        if not fits:
            raise InvalidInputError(f"no certificate: dualrate.stable is a statement on loops with {what}")
    theorem = _theorem(
        "dualrate.stable",
        {
            "name": name,
            **_finite(number, A=model.A, B=model.B_u, C=model.C),
            **_finite(rationals, K=problem.feedback, L=problem.injection),
            **_finite(number, T=problem.period),
            "M": str(problem.ratio),
        },
        {"observer": result.observer_name},
    )
    return {**theorem, **dualrate_makers.stable(result.loop)}


def _delay(result: DelayResult, name: str, number: Any) -> Made:
    system = result.plant
    fields = {"A0": system.a0, "A": system.a, "delays": system.delays, "B": system.b, "C10": system.c10}
    plant = {"name": name, **_finite(number, **fields, C1=system.c1, C2=system.c2)}
    level = rounded_up(_finite(float, level=result.value)["level"], LEVEL_BITS)
    reason, degrees = "", getattr(result.proof, "degree", 1)
    for degree in range(1, degrees + 1):
        theorem = _theorem("delay.gain-upper", plant, {"degree": degree})
        try:
            return {**theorem, "bound": {"upper": level}, "witness": delay_makers.grams_in_units(plant, level, degree)}
        except (InfeasibleError, SolverError) as error:
            reason = str(error)
    raise SolverError(f"no certificate: no exact storage was found up to degree {degrees} ({reason})")


METHODS: Mapping[type[GainResult], Callable[[Any, str, Any], Made]] = {
    LossResult: _losses,
    MultirateResult: _multirate,
    NonuniformResult: _nonuniform,
    StampedResult: _stamped,
    DualRateResult: _dualrate,
    DelayResult: _delay,
}
"""Makers by the class of the result; `number` writes the entries of the plant."""
