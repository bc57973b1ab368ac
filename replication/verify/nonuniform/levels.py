"""Statements on the gain of filters under nonuniform sampling: for given filters, and for every filter of form (4)."""

from __future__ import annotations

from flint import acb_mat, fmpq

from replication.verify.algebra.balls import circle_point
from replication.verify.nonuniform import gain, system
from replication.verify.nonuniform.floor import require_no_filter_below
from replication.verify.nonuniform.gain import Storage, require_attained, require_level
from replication.verify.nonuniform.system import Case, Filter, Plant, Time, on_filtered, on_plant
from replication.verify.reading import positive, rational, sequence, sized, text
from replication.verify.statement import LOWER, UPPER, Depends, Found, Table
from replication.verify.theorem import require

CASE = Depends(lambda given: sized(system.read_case, given.plant))
LEVEL = Depends(lambda given: sized(system.read_case, given.plant, "level"))
STORED = {
    "storage": Depends(
        lambda given: sized(gain.read_storage, given.plant.A.nrows() + given.parameters.filter.A.nrows())
    )
}
ATTAINED: Table = {
    "pattern": Depends(lambda given: sized(gain.read_pattern, given.parameters.ends)),
    "turn": rational,
    "w": Depends(lambda given: sized(sequence, sized(gain.complex_vector, given.plant.B.ncols()), len(given.pattern))),
}


@on_filtered("nonuniform.gain-upper", parameters=CASE, bound=UPPER, witness=STORED)
def gain_upper(plant: Plant, parameters: Case, upper: fmpq, storage: Storage) -> None:
    """The gain of the given filter {parameters.scope} is at most {upper:up}."""
    require_level(plant, parameters, upper, storage)


@on_filtered("nonuniform.keeps-level", parameters=LEVEL, bound=UPPER, witness=STORED, holds=True)
def keeps_level(plant: Plant, parameters: Case, upper: fmpq, storage: Storage) -> None:
    """The given filter has the level {parameters.level:up} {parameters.scope}."""
    require_level(plant, parameters, upper, storage)
    require(upper <= parameters.level, f"the bound {upper} exceeds the level {parameters.level}")


@on_filtered("nonuniform.gain-lower", parameters=CASE, bound=LOWER, witness=ATTAINED)
def gain_lower(plant: Plant, parameters: Case, lower: fmpq, pattern: list[Time], turn: fmpq, w: list[acb_mat]) -> None:
    """The gain of the given filter {parameters.scope} is more than {lower:down}."""
    require_attained(plant, parameters, lower, pattern, circle_point(turn), w)


@on_filtered("nonuniform.breaks-level", parameters=LEVEL, bound=LOWER, witness=ATTAINED, holds=False)
def breaks_level(
    plant: Plant, parameters: Case, lower: fmpq, pattern: list[Time], turn: fmpq, w: list[acb_mat]
) -> None:
    """The given filter does not have the level {parameters.level:down} {parameters.scope}: its gain is more than
    {lower:down}.
    """
    require_attained(plant, parameters, lower, pattern, circle_point(turn), w)
    require(lower >= parameters.level, f"the bound {lower} is below the level {parameters.level}")


@on_plant(
    "nonuniform.optimum-upper",
    source="mustafa",
    parameters={"from": text, "to": text, "weight": system.read_weight},
    bound=UPPER,
    witness={
        "filter": Depends(lambda given: sized(system.read_filter, given.plant)),
        "storage": Depends(lambda given: sized(gain.read_storage, given.plant.A.nrows() + given.filter.A.nrows())),
    },
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
)
def optimum_lower(plant: Plant, period: str, lower: fmpq, start: list[fmpq]) -> None:
    """Every stable filter of <form (4)|the form x_f(k+1) = A_f x_f(k) + B_f y(k), estimate C_f x_f(k)> has a gain above
    {lower:down} at the constant period {period}.
    """
    require_no_filter_below(plant, plant.period(period, "parameters.period"), lower, start)


@on_plant(
    "nonuniform.no-filter-keeps-level",
    source="mustafa",
    parameters={"period": text, "level": positive},
    bound=LOWER,
    witness={"start": sized(sequence, rational)},
    holds=False,
)
def no_filter_keeps_level(plant: Plant, period: str, level: fmpq, lower: fmpq, start: list[fmpq]) -> None:
    """No stable filter of <form (4)|the form x_f(k+1) = A_f x_f(k) + B_f y(k), estimate C_f x_f(k)> has the level
    {level:down} for every sequence of the range: at the constant period {period} its gain is above {lower:down}.
    """
    require_no_filter_below(plant, plant.period(period, "parameters.period"), lower, start)
    require(lower >= level, f"the bound {lower} is below the level {level}")


@on_filtered("nonuniform.stable", parameters=CASE, holds=True)
def stable(plant: Plant, parameters: Case) -> None:
    """The error system is exponentially stable for every sampling sequence with periods of at least {parameters.least}
    s: A is Hurwitz, A_f Schur.
    """
    system.require_stable(plant, parameters.filter)
