"""What a statement says as data: the terms that a theorem exports, which are compared with the claims of a paper.

The sentence of a theorem does not depend on it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias, TypeVar

from replication.verify.predicate import NO_READING, YES_NO, Exported, Term
from replication.verify.quantities import unit_of
from replication.verify.reading import written
from replication.verify.theorem import Found, Side

T = TypeVar("T")
Parameters = Mapping[str, Any]
Chosen: TypeAlias = T | Callable[[Parameters], T]
"""A value, or what gives it from the parameters of a certificate."""


@dataclass(frozen=True, kw_only=True)
class Says:
    """A term of which a theorem speaks, as data: see `predicate.Term`; one for each class of estimators, if several.

    setting: the parameters but `relative`, unless given. readings: of the paper `source`, under which its text speaks
    of this term. found: what is proved of it, from all that was read, proved and worded; that of the theorem unless
    given. universal: it is about all plants, though the certificate has one.
    """

    quantity: Chosen[str]
    estimators: Chosen[tuple[str, ...]] = ("",)
    readings: Chosen[tuple[str, ...]] = (NO_READING,)
    setting: Chosen[Mapping[str, Any]] | None = None
    found: Callable[[Mapping[str, Any]], Found] | None = None
    universal: bool = False


def exported(
    says: Says, certificate: Mapping[str, Any], given: Mapping[str, Any], whole: Found
) -> tuple[Exported, ...]:
    """The terms with what is proved of them; the plant of a certificate of one's own is called so."""
    parameters, plant = certificate["parameters"], certificate["plant"]
    name = str(plant.get("name", "")) if isinstance(plant, Mapping) else ""
    name = name if certificate.get("paper") is not None else f"own plant {name}"
    found = whole if says.found is None else says.found(given)
    quantity = _chosen(says.quantity, parameters)
    statement, one = unit_of(quantity) == YES_NO, (found.lower, found.upper)
    usual = {key: value for key, value in parameters.items() if key != "relative"}
    return tuple(
        Exported(
            of=Term(
                quantity=quantity,
                plant="" if says.universal else name,
                setting=usual if says.setting is None else _chosen(says.setting, parameters),
                estimators=estimators,
            ),
            unit=unit_of(quantity),
            readings=_chosen(says.readings, parameters),
            items=() if statement else tuple((_end(low), _end(high)) for low, high in found.items or (one,)),
            holds=found.holds if statement else None,
        )
        for estimators in _chosen(says.estimators, parameters)
    )


def as_data(
    terms: tuple[Says, ...], source: str, certificate: Mapping[str, Any], known: Mapping[str, Any], whole: Found
) -> tuple[Exported, ...]:
    """All that a theorem exports; the readings of the paper `source` are not those of another one."""
    borrowed = source not in ("", certificate.get("paper"))
    stated = (replace(one, readings=(NO_READING,)) for one in terms) if borrowed else terms
    return tuple(one for says in stated for one in exported(says, certificate, known, whole))


def _chosen(value: Chosen[T], parameters: Parameters) -> T:
    return value(parameters) if callable(value) else value


def _end(side: Side) -> str | None:
    return None if side is None else str(written(side))
