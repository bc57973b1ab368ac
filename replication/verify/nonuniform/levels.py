"""Statements on the gain of filters under nonuniform sampling: for given filters, and for every filter of form (4)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flint import acb_mat, fmpq

from replication.verify.algebra.balls import circle_point
from replication.verify.kernel import AtMost, decide
from replication.verify.nonuniform import gain, system
from replication.verify.nonuniform.floor import require_no_filter_below
from replication.verify.nonuniform.gain import Storage, require_attained, require_level
from replication.verify.nonuniform.system import PERIODS, Case, Filter, Plant, on_filtered, on_plant
from replication.verify.predicate import NO_READING
from replication.verify.reading import positive, rational, sequence, sized, text
from replication.verify.says import Says
from replication.verify.statement import LOWER, UPPER, Depends, Table
from replication.verify.theorem import Found

GAIN, LEAST, GIVEN, EVERY = (
    "gain over sequences",
    "least gain over sequences",
    "the given filter",
    "filters of form (4)",
)
SEQUENCES = {"samples": "every sequence, samples", "duration": "every sequence, seconds"}
"""What the norms count: samples, a reading of the paper, or seconds, beyond its text."""
AT_ONE_PERIOD = (NO_READING, "least nominal level", "periods of the grid")


def _readings(parameters: Mapping[str, Any]) -> tuple[str, ...]:
    """At one constant period both norms count alike, and the text speaks of it as nominal."""
    if parameters["from"] == parameters["to"]:
        return (*AT_ONE_PERIOD, "level of the filter found")
    some = ("a level, whichever",) if parameters["weight"] == "samples" else ()
    return (SEQUENCES[parameters["weight"]], *some)


def _range(parameters: Mapping[str, Any]) -> dict[str, Any]:
    return {name: parameters[name] for name in ("from", "to", *(("filter",) if "filter" in parameters else ()))}


STABLE = (NO_READING, "our filter", "valid as stable")


OF_FILTER = Says(quantity=GAIN, estimators=(GIVEN,), setting=_range, readings=_readings)
OF_ANY = Says(quantity=LEAST, estimators=(EVERY,), setting=_range, readings=_readings)
AT_PERIOD = Says(
    quantity=LEAST,
    estimators=(EVERY,),
    setting=lambda given: {"from": given["period"], "to": given["period"]},
    readings=AT_ONE_PERIOD,
)
WITHIN_RANGE = Says(
    quantity=LEAST,
    estimators=(EVERY,),
    setting={"from": PERIODS[0], "to": PERIODS[-1]},
    readings=(*SEQUENCES.values(), "grid of one element"),
)
"""A constant period is one of the sequences: a lower bound there is one over the range, whatever the norms count."""

CASE = Depends(lambda given: sized(system.read_case, given.plant))
LEVEL = Depends(lambda given: sized(system.read_case, given.plant, "level"))
STORED = {
    "storage": Depends(
        lambda given: sized(gain.read_storage, given.plant.A.nrows() + given.parameters.filter.A.nrows())
    )
}
ATTAINED: Table = {
    "pattern": gain.read_pattern,
    "turn": rational,
    "w": Depends(lambda given: sized(sequence, sized(gain.complex_vector, given.plant.B.ncols()), len(given.pattern))),
}


@on_filtered("nonuniform.gain-upper", parameters=CASE, bound=UPPER, witness=STORED, says=OF_FILTER)
def gain_upper(plant: Plant, parameters: Case, upper: fmpq, storage: Storage) -> None:
    """The gain of the given filter {parameters.scope} is at most {upper:up}."""
    require_level(plant, parameters, upper, storage)


@on_filtered("nonuniform.keeps-level", parameters=LEVEL, bound=UPPER, witness=STORED, holds=True, says=OF_FILTER)
def keeps_level(plant: Plant, parameters: Case, upper: fmpq, storage: Storage) -> None:
    """The given filter has the level {parameters.level:up} {parameters.scope}."""
    require_level(plant, parameters, upper, storage)
    decide(AtMost(upper, parameters.level, f"the bound {upper} exceeds the level {parameters.level}"))


@on_filtered("nonuniform.gain-lower", parameters=CASE, bound=LOWER, witness=ATTAINED, says=OF_FILTER)
def gain_lower(plant: Plant, parameters: Case, lower: fmpq, pattern: list[fmpq], turn: fmpq, w: list[acb_mat]) -> None:
    """The gain of the given filter {parameters.scope} is more than {lower:down}."""
    require_attained(plant, parameters, lower, pattern, circle_point(turn), w)


@on_filtered("nonuniform.breaks-level", parameters=LEVEL, bound=LOWER, witness=ATTAINED, holds=False, says=OF_FILTER)
def breaks_level(
    plant: Plant, parameters: Case, lower: fmpq, pattern: list[fmpq], turn: fmpq, w: list[acb_mat]
) -> None:
    """The given filter does not have the level {parameters.level:down} {parameters.scope}: its gain is more than
    {lower:down}.
    """
    require_attained(plant, parameters, lower, pattern, circle_point(turn), w)
    decide(AtMost(parameters.level, lower, f"the bound {lower} is below the level {parameters.level}"))


@on_plant(
    "nonuniform.optimum-upper",
    source="mustafa",
    parameters={"from": text, "to": text, "weight": system.read_weight},
    bound=UPPER,
    witness={
        "filter": Depends(lambda given: sized(system.read_filter, given.plant)),
        "storage": Depends(lambda given: sized(gain.read_storage, given.plant.A.nrows() + given.filter.A.nrows())),
    },
    says=OF_ANY,
)
def optimum_upper(
    plant: Plant, from_: str, to: str, weight: str, upper: fmpq, filter: Filter, storage: Storage
) -> Found:
    """Some filter of <form (4)|the form x_f(k+1) = A_f x_f(k) + B_f y(k), estimate C_f x_f(k)> has the level {upper:up}
    {scope}.
    """
    case = Case(ends=system.read_ends(plant, from_, to), weight=weight, filter=filter, level=upper)
    require_level(plant, case, upper, storage)
    return Found(words={"scope": case.scope})


@on_plant(
    "nonuniform.optimum-lower",
    source="mustafa",
    parameters={"period": text},
    bound=LOWER,
    witness={"start": sized(sequence, rational)},
    says=(AT_PERIOD, WITHIN_RANGE),
)
def optimum_lower(plant: Plant, period: str, lower: fmpq, start: list[fmpq]) -> Found:
    """Every stable filter of <form (4)|the form x_f(k+1) = A_f x_f(k) + B_f y(k), estimate C_f x_f(k)> has a gain above
    {lower:down} at the constant period {period} s.
    """
    constant = plant.period(period, "parameters.period")
    require_no_filter_below(plant, constant, lower, start)
    return Found(words={"period": system.in_words(constant)})


@on_plant(
    "nonuniform.no-filter-keeps-level",
    source="mustafa",
    parameters={"period": text, "level": positive},
    bound=LOWER,
    witness={"start": sized(sequence, rational)},
    holds=False,
    says=(AT_PERIOD, WITHIN_RANGE, Says(quantity="least level of (6)", setting={}, readings=("grid of one element",))),
)
def no_filter_keeps_level(plant: Plant, period: str, level: fmpq, lower: fmpq, start: list[fmpq]) -> Found:
    """No stable filter of <form (4)|the form x_f(k+1) = A_f x_f(k) + B_f y(k), estimate C_f x_f(k)> has the level
    {level:down} for every sequence of the range: at the constant period {period} s its gain is above {lower:down}<, so
    that (6) has no solution there with this level|>.

    Of a solution P-bar > 0 of the strict inequality (6) at a period the filter is Schur, and has the level there.
    """
    constant = plant.period(period, "parameters.period")
    require_no_filter_below(plant, constant, lower, start)
    decide(AtMost(level, lower, f"the bound {lower} is below the level {level}"))
    return Found(words={"period": system.in_words(constant)})


@on_filtered(
    "nonuniform.stable",
    parameters=CASE,
    holds=True,
    says=Says(quantity="stable for every sequence", setting=_range, estimators=(GIVEN,), readings=STABLE),
)
def stable(plant: Plant, parameters: Case) -> None:
    """The error system of the given filter is exponentially stable for every sampling sequence with periods of at least
    {parameters.least} s: A is Hurwitz, A_f Schur.
    """
    system.require_stable(plant, parameters.filter)
