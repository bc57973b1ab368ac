"""What is said of a number, as data: a claim says a predicate, a theorem exports what it proves, and the two compare.

Standard library only. What can be spoken of stands in `quantities`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

YES_NO = "yes or no"
"""The unit of a statement, which holds or fails."""
NO_READING = "none"

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


def same(first: Any, second: Any) -> bool:
    """Whether two JSON values are equal, with types: true is not 1."""
    return json.dumps(first, sort_keys=True) == json.dumps(second, sort_keys=True)
