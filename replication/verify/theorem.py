"""What a certificate proves, as data, and the one way in which the verifier says no."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

YES_NO = "yes or no"
"""The unit of a statement, which holds or fails."""
NO_READING = "none"
Side: TypeAlias = Any
"""One end of a proved interval, exact; None if the certificate says nothing on that side.

An fmpq, which is not named: what a paper wants can be read without the arithmetic.
"""


class Refused(Exception):
    """The certificate does not prove what it claims; the message says which step failed, and with which value."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """What a proof finds beyond what was stated: words of the sentence, and bounds and truth as in a Theorem."""

    words: Mapping[str, Any] = field(default_factory=dict)
    lower: Side = None
    upper: Side = None
    holds: bool | None = None
    items: tuple[tuple[Side, Side], ...] = ()


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
class Exported:
    """What a theorem proves of a term: closed bounds as rationals, of each number of a list, or whether it holds.

    readings: the readings of the paper under which the text speaks of this term.
    """

    of: Term
    unit: str
    readings: tuple[str, ...] = (NO_READING,)
    items: tuple[tuple[str | None, str | None], ...] = ()
    holds: bool | None = None


@dataclass(frozen=True, kw_only=True)
class Theorem:
    """One proved sentence.

    sentence: the theorem with its numbers. lower, upper: proved closed bounds of the quantity it is about. holds: for a
    yes/no statement, whether it is true. items: for a list of quantities, a pair (lower, upper) of each, in the order
    in which the paper prints them. says: the same as data, for each term that the theorem speaks of.
    """

    sentence: str
    lower: Side = None
    upper: Side = None
    holds: bool | None = None
    items: tuple[tuple[Side, Side], ...] = ()
    says: tuple[Exported, ...] = ()


def require(condition: bool, message: str) -> None:
    """Raise Refused with `message` unless `condition`."""
    if not condition:
        raise Refused(message)


def same(first: Any, second: Any) -> bool:
    """Whether two JSON values are equal, with types: true is not 1."""
    return json.dumps(first, sort_keys=True) == json.dumps(second, sort_keys=True)
