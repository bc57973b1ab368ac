"""What is said of a number, as data: a claim says a predicate, a theorem exports what it proves, and the two compare.

Standard library only. A quantity has its unit here, and an estimator its class; what is not here cannot be said.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

YES_NO = "yes or no"
"""The unit of a statement, which holds or fails."""
NO_READING = "none"

QUANTITIES: Mapping[str, tuple[str, str]] = {
    # Measurements at several rates.
    "smallest gain": ("1", "the smallest worst-case gain"),
    "gain": ("1", "the worst-case gain of given gains"),
}
"""Unit and words of each quantity that can be spoken of."""

ESTIMATORS: Mapping[str, str] = {
    "periodic one-step observers": "observer that predicts one step",
    "one-step predictors": "predicts one step",
    "all estimators": "no estimator, not even a smoother",
}
"""Each class of estimators, with the words by which the sentence of a theorem on it names it."""

Relation = Literal["is", "is not", "at most", "at least", "less than", "more than", "holds", "fails"]


@dataclass(frozen=True, kw_only=True)
class Term:
    """One number, or one statement, of which something is said.

    plant: its name in the paper's plants.py; empty for all plants, or where there is none. setting: the parameters of
    a certificate that belong to what is said. estimators: the class of estimators, empty where none enters.
    """

    quantity: str
    plant: str = ""
    setting: Mapping[str, Any] = field(default_factory=dict)
    estimators: str = ""


@dataclass(frozen=True, kw_only=True)
class Predicate:
    """What a claim says of a term: its relation `to` a printed number or another term; None if it holds or fails.

    unit: that of the quantity. reading: under which the text says so, that of the claim if empty.
    """

    of: Term
    relation: Relation = "holds"
    to: str | Term | None = None
    unit: str = ""
    reading: str = ""

    @property
    def terms(self) -> tuple[Term, ...]:
        """The terms that it speaks of."""
        return (self.of, self.to) if isinstance(self.to, Term) else (self.of,)


@dataclass(frozen=True, kw_only=True)
class Exported:
    """What a theorem proves of a term: closed bounds as rationals, of each number of a list, or whether it holds.

    readings: the readings of the paper under which the text speaks of this term.
    """

    of: Term
    unit: str
    readings: tuple[str, ...] = (NO_READING,)
    items: tuple[tuple[str | None, str | None], ...] = ()
    holds: bool | None = None


def term(quantity: str, /, plant: str = "", estimators: str = "", **setting: Any) -> Term:
    """A term in few words; what is set becomes plain JSON."""
    return Term(quantity=quantity, plant=plant, estimators=estimators, setting=json.loads(json.dumps(setting)))


def unit_of(quantity: str) -> str:
    """The unit of a quantity; empty for one that is not known."""
    return QUANTITIES.get(quantity, ("", ""))[0]


def same(first: Any, second: Any) -> bool:
    """Whether two JSON values are equal, with types: true is not 1."""
    return json.dumps(first, sort_keys=True) == json.dumps(second, sort_keys=True)


def differences(wanted: Term, reading: str, proved: Exported) -> list[str]:
    """How a theorem falls short of speaking of a term under a reading, in words; empty if it does speak of it."""
    found = []
    of = proved.of
    if of.quantity != wanted.quantity:
        found.append(f"it is about {_words(of.quantity)}, not {_words(wanted.quantity)}")
    if of.plant != wanted.plant:
        found.append(f"another plant: {of.plant or 'all'}, not {wanted.plant or 'all'}")
    for name in sorted(of.setting.keys() | wanted.setting.keys()):
        there, asked = of.setting.get(name), wanted.setting.get(name)
        if not same(there, asked):
            instance = name in of.setting and name not in wanted.setting
            told = "of all" if instance else f"not {_shown(asked)}" if name in wanted.setting else ""
            found.append(f"for {name} {_shown(there)} {told}" if name in of.setting else f"not for {name} {told[4:]}")
    if of.estimators != wanted.estimators:
        found.append(f"for {of.estimators or 'no class of estimators'}, not for {wanted.estimators or 'none'}")
    if reading not in proved.readings:
        found.append(f"under the reading {' or '.join(proved.readings)} only, not {reading}")
    return found


def _words(quantity: str) -> str:
    return QUANTITIES.get(quantity, ("", quantity))[1]


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
