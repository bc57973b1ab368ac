"""What a certificate proves, as data, and the one way in which the verifier says no."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:  # what a paper wants can be read without it
    from flint import fmpq

    from replication.verify.predicate import Exported

Side: TypeAlias = "fmpq | None"
"""One end of a proved interval; None if the certificate says nothing on that side."""


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
