"""Statements on the gain of filters under nonuniform sampling: for given filters, and for every filter of form (4)."""

from __future__ import annotations

from flint import acb_mat, fmpq

from replication.verify.algebra.balls import circle_point
from replication.verify.nonuniform.floor import require_no_filter_below
from replication.verify.nonuniform.gain import (
    Storage,
    complex_vector,
    read_pattern,
    read_storage,
    require_attained,
    require_level,
)
from replication.verify.nonuniform.system import (
    PRECISION,
    Case,
    Filter,
    Plant,
    Time,
    read_case,
    read_ends,
    read_filter,
    read_filtered,
    read_plant,
    read_weight,
    require_stable,
)
from replication.verify.reading import positive, rational, sequence, sized, text
from replication.verify.statement import LOWER, UPPER, Depends, Found, statement
from replication.verify.theorem import require

CASE = Depends(lambda given: sized(read_case, given.plant))
LEVEL = Depends(lambda given: sized(read_case, given.plant, "level"))
STORED = {
    "storage": Depends(lambda given: sized(read_storage, given.plant.A.nrows() + given.parameters.filter.A.nrows()))
}
ATTAINED = {
    "pattern": Depends(lambda given: sized(read_pattern, given.parameters.ends)),
    "turn": rational,
    "w": Depends(lambda given: sized(sequence, sized(complex_vector, given.plant.B.ncols()), len(given.pattern))),
}


@statement(
    "nonuniform.gain-upper",
    "The gain of the given filter {parameters.scope} is at most {upper:up}.",
    plant=read_filtered,
    parameters=CASE,
    bound=UPPER,
    witness=STORED,
    bits=PRECISION,
)
def gain_upper(plant: Plant, parameters: Case, upper: fmpq, storage: Storage) -> None:
    """An upper bound of the gain of a given filter over all sampling sequences."""
    require_level(plant, parameters, upper, storage)


@statement(
    "nonuniform.keeps-level",
    "The given filter has the level {parameters.level:up} {parameters.scope}.",
    plant=read_filtered,
    parameters=LEVEL,
    bound=UPPER,
    witness=STORED,
    holds=True,
    bits=PRECISION,
)
def keeps_level(plant: Plant, parameters: Case, upper: fmpq, storage: Storage) -> None:
    """A given filter has a given level for all sampling sequences."""
    require_level(plant, parameters, upper, storage)
    require(upper <= parameters.level, f"the bound {upper} exceeds the level {parameters.level}")


@statement(
    "nonuniform.gain-lower",
    "The gain of the given filter {parameters.scope} is more than {lower:down}.",
    plant=read_filtered,
    parameters=CASE,
    bound=LOWER,
    witness=ATTAINED,
    bits=PRECISION,
)
def gain_lower(plant: Plant, parameters: Case, lower: fmpq, pattern: list[Time], turn: fmpq, w: list[acb_mat]) -> None:
    """A lower bound of the gain of a given filter over all sampling sequences."""
    require_attained(plant, parameters, lower, pattern, circle_point(turn), w)


@statement(
    "nonuniform.breaks-level",
    "The given filter does not have the level {parameters.level:down} {parameters.scope}: its gain is more than {lower:down}.",
    plant=read_filtered,
    parameters=LEVEL,
    bound=LOWER,
    witness=ATTAINED,
    holds=False,
    bits=PRECISION,
)
def breaks_level(
    plant: Plant, parameters: Case, lower: fmpq, pattern: list[Time], turn: fmpq, w: list[acb_mat]
) -> None:
    """A given filter does not have a given level for all sampling sequences."""
    require_attained(plant, parameters, lower, pattern, circle_point(turn), w)
    require(lower >= parameters.level, f"the bound {lower} is below the level {parameters.level}")


@statement(
    "nonuniform.optimum-upper",
    "Some filter has the level {upper:up} {scope}.",
    plant=read_plant,
    parameters={"from": text, "to": text, "weight": read_weight},
    bound=UPPER,
    witness={
        "filter": Depends(lambda given: sized(read_filter, given.plant)),
        "storage": Depends(lambda given: sized(read_storage, given.plant.A.nrows() + given.filter.A.nrows())),
    },
    bits=PRECISION,
)
def optimum_upper(
    plant: Plant, from_: str, to: str, weight: str, upper: fmpq, filter: Filter, storage: Storage
) -> Found:
    """An upper bound of the least gain of a filter of form (4): that of some filter."""
    case = Case(ends=read_ends(plant, from_, to), weight=weight, filter=filter)
    require_level(plant, case, upper, storage)
    return Found(words={"scope": case.scope})


@statement(
    "nonuniform.optimum-lower",
    "Every stable filter of form (4) has a gain above {lower:down} at the constant period {period}.",
    plant=read_plant,
    parameters={"period": text},
    bound=LOWER,
    witness={"start": sized(sequence, rational)},
    bits=PRECISION,
)
def optimum_lower(plant: Plant, period: str, lower: fmpq, start: list[fmpq]) -> None:
    """A lower bound of the gain of every filter of form (4) at one constant period of the range."""
    require_no_filter_below(plant, plant.period(period, "parameters.period"), lower, start)


@statement(
    "nonuniform.no-filter-keeps-level",
    "No stable filter of form (4) has the level {level:down} for every sequence of the range: at the constant period "
    "{period} its gain is above {lower:down}.",
    plant=read_plant,
    parameters={"period": text, "level": positive},
    bound=LOWER,
    witness={"start": sized(sequence, rational)},
    holds=False,
    bits=PRECISION,
)
def no_filter_keeps_level(plant: Plant, period: str, level: fmpq, lower: fmpq, start: list[fmpq]) -> None:
    """No filter of form (4) has a given level for every sampling sequence: a constant sequence breaks it."""
    require_no_filter_below(plant, plant.period(period, "parameters.period"), lower, start)
    require(lower >= level, f"the bound {lower} is below the level {level}")


@statement(
    "nonuniform.stable",
    "The error system is exponentially stable for every sampling sequence with periods of at least {parameters.least} s: A is "
    "Hurwitz, A_f Schur.",
    plant=read_filtered,
    parameters=CASE,
    holds=True,
    bits=PRECISION,
)
def stable(plant: Plant, parameters: Case) -> None:
    """The error system is asymptotically stable for every sampling sequence whose periods are bounded below."""
    require_stable(plant, parameters.filter)
