"""Statements on the gain of filters under nonuniform sampling: for given filters, and for every filter of form (4)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flint import ctx, fmpq

from replication.verify.algebra.decimals import above, below
from replication.verify.nonuniform.floor import require_no_filter_below
from replication.verify.nonuniform.gain import attained_level, lyapunov_level
from replication.verify.nonuniform.system import (
    PERIODS,
    PRECISION,
    Filter,
    Plant,
    Time,
    read_filter,
    read_plant,
    require_stable,
)
from replication.verify.reading import fields, positive, rational, require_empty, sequence, text
from replication.verify.theorem import Theorem, require

Certificate = Mapping[str, Any]


def gain_upper(certificate: Certificate) -> Theorem:
    """An upper bound of the gain of a given filter over all sampling sequences."""
    level, scope = _upper(certificate, *_subject(certificate, "from", "to", "weight"))
    return Theorem(sentence=f"The gain of the given filter {scope} is at most {above(level)}.", upper=level)


def keeps_level(certificate: Certificate) -> Theorem:
    """A given filter has a given level for all sampling sequences."""
    plant, filter_, ends, weight = _subject(certificate, "from", "to", "weight", "level")
    wanted = positive(certificate["parameters"]["level"], "parameters.level")
    level, scope = _upper(certificate, plant, filter_, ends, weight)
    require(level <= wanted, f"the bound {level} exceeds the level {wanted}")
    return Theorem(sentence=f"The given filter has the level {above(wanted)} {scope}.", upper=level, holds=True)


def gain_lower(certificate: Certificate) -> Theorem:
    """A lower bound of the gain of a given filter over all sampling sequences."""
    level, scope = _lower(certificate, *_subject(certificate, "from", "to", "weight"))
    return Theorem(sentence=f"The gain of the given filter {scope} is more than {below(level)}.", lower=level)


def breaks_level(certificate: Certificate) -> Theorem:
    """A given filter does not have a given level for all sampling sequences."""
    plant, filter_, ends, weight = _subject(certificate, "from", "to", "weight", "level")
    wanted = positive(certificate["parameters"]["level"], "parameters.level")
    level, scope = _lower(certificate, plant, filter_, ends, weight)
    require(level >= wanted, f"the bound {level} is below the level {wanted}")
    return Theorem(
        sentence=f"The given filter does not have the level {below(wanted)} {scope}: its gain is more than "
        f"{below(level)}.",
        lower=level,
        holds=False,
    )  # fmt: skip


def optimum_upper(certificate: Certificate) -> Theorem:
    """An upper bound of the least gain of a filter of form (4): that of some filter."""
    plant = read_plant(certificate["plant"])
    start, stop, weight = fields(certificate["parameters"], "parameters", "from", "to", "weight")
    given, storage = fields(certificate["witness"], "witness", "filter", "storage")
    filter_ = read_filter(given, "witness.filter", plant)
    ends = _ends(plant, start, stop)
    with ctx.workprec(PRECISION):
        level = lyapunov_level(plant, filter_, ends, text(weight, "parameters.weight"), certificate["bound"], storage)
    return Theorem(sentence=f"Some filter has the level {above(level)} {_scope(ends, weight)}.", upper=level)


def optimum_lower(certificate: Certificate) -> Theorem:
    """A lower bound of the gain of every filter of form (4) at one constant period of the range."""
    plant = read_plant(certificate["plant"])
    (name,) = fields(certificate["parameters"], "parameters", "period")
    level = _floor(certificate, plant, name)
    return Theorem(
        sentence=f"Every stable filter of form (4) has a gain above {below(level)} at the constant period {name}.",
        lower=level,
    )  # fmt: skip


def no_filter_keeps_level(certificate: Certificate) -> Theorem:
    """No filter of form (4) has a given level for every sampling sequence: a constant sequence breaks it."""
    plant = read_plant(certificate["plant"])
    name, given = fields(certificate["parameters"], "parameters", "period", "level")
    wanted = positive(given, "parameters.level")
    level = _floor(certificate, plant, name)
    require(level >= wanted, f"the bound {level} is below the level {wanted}")
    return Theorem(
        sentence=f"No stable filter of form (4) has the level {below(wanted)} for every sequence of the range: at the "
        f"constant period {name} its gain is above {below(level)}.",
        lower=level,
        holds=False,
    )  # fmt: skip


def stable(certificate: Certificate) -> Theorem:
    """The error system is asymptotically stable for every sampling sequence whose periods are bounded below."""
    plant, filter_, (least, _), _ = _subject(certificate, "from", "to", "weight")
    require_empty(certificate, "bound", "witness")
    require_stable(plant, filter_)
    return Theorem(
        sentence="The error system is exponentially stable for every sampling sequence with periods of at least "
        f"{_time(least)} s: A is Hurwitz, A_f Schur.",
        holds=True,
    )


def _subject(certificate: Certificate, *names: str) -> tuple[Plant, Filter, tuple[Time, Time], str]:
    """Plant, filter, range and weight: the filter stands with the plant if it is printed, else in the parameters."""
    plant, parameters = read_plant(certificate["plant"]), certificate["parameters"]
    if "filter" in certificate["plant"]:
        given, path = certificate["plant"]["filter"], "plant.filter"
    else:
        names = (*names, "filter")
        given, path = parameters.get("filter"), "parameters.filter"
    start, stop, weight = fields(parameters, "parameters", *names)[:3]
    return plant, read_filter(given, path, plant), _ends(plant, start, stop), text(weight, "parameters.weight")


def _ends(plant: Plant, start: Any, stop: Any) -> tuple[Time, Time]:
    """Both ends of the range of periods; refused if they stand in the wrong order."""
    ends = plant.period(start, "parameters.from"), plant.period(stop, "parameters.to")
    require(PERIODS.index(start) <= PERIODS.index(stop), "parameters.from exceeds parameters.to")
    return ends


def _upper(
    certificate: Certificate, plant: Plant, filter_: Filter, ends: tuple[Time, Time], weight: str
) -> tuple[fmpq, str]:
    """The proved level and the words for the sequences it holds for."""
    (storage,) = fields(certificate["witness"], "witness", "storage")
    with ctx.workprec(PRECISION):
        level = lyapunov_level(plant, filter_, ends, weight, certificate["bound"], storage)
    return level, _scope(ends, weight)


def _lower(
    certificate: Certificate, plant: Plant, filter_: Filter, ends: tuple[Time, Time], weight: str
) -> tuple[fmpq, str]:
    """The attained level and the words for the sequences it is about."""
    with ctx.workprec(PRECISION):
        level = attained_level(plant, filter_, ends, weight, certificate["bound"], certificate["witness"])
    return level, _scope(ends, weight)


def _floor(certificate: Certificate, plant: Plant, name: Any) -> fmpq:
    """The level that no filter attains at the constant period of this name."""
    (stated,) = fields(certificate["bound"], "bound", "lower")
    (start,) = fields(certificate["witness"], "witness", "start")
    level = positive(stated, "bound.lower")
    with ctx.workprec(PRECISION):
        require_no_filter_below(
            plant, plant.period(name, "parameters.period"), level, sequence(start, "witness.start", rational)
        )
    return level


def _scope(ends: tuple[Time, Time], weight: str) -> str:
    """For which sequences, and in which norm."""
    low, high = (_time(end) for end in ends)
    sequences = f"at the constant period {low} s" if low == high else f"over all periods from {low} to {high} s"
    return sequences + {"samples": "", "duration": ", both norms weighted by the periods,"}[weight]


def _time(time: Time) -> str:
    rational_, pi = time
    return " + ".join([str(rational_)] * (rational_ != 0) + [f"{pi} pi"] * (pi != 0))


STATEMENTS: Mapping[str, Callable[[Certificate], Theorem]] = {
    "nonuniform.gain-upper": gain_upper,
    "nonuniform.gain-lower": gain_lower,
    "nonuniform.keeps-level": keeps_level,
    "nonuniform.breaks-level": breaks_level,
    "nonuniform.optimum-upper": optimum_upper,
    "nonuniform.optimum-lower": optimum_lower,
    "nonuniform.no-filter-keeps-level": no_filter_keeps_level,
    "nonuniform.stable": stable,
}
