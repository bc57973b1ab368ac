"""Evidence from a family of readings, with the outcome under each; and which of the loops searched the text allows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from papers.shao.printed import table_1
from papers.shao.problem import SINGLE
from replication.audit.model import Evidence, Outcome, Results
from replication.verify.predicate import Predicate, Term, term

TIED = 1e-9
"""Errors whose ratio is this near to one are equal up to rounding."""


def by_margin(margins: Mapping[str, float], **told: Any) -> Evidence:
    """A statement that holds where a margin is positive; margins: by reading, that of the claim first."""
    outcomes = tuple(Outcome(reading=reading, holds=margin > 0, margin=margin) for reading, margin in margins.items())
    return Evidence(holds=outcomes[0].holds, margin=outcomes[0].margin, outcomes=outcomes, **told)


def by_value(values: Mapping[str, float], **told: Any) -> Evidence:
    """A printed number; values: the number by reading, that of the claim first."""
    outcomes = tuple(Outcome(reading=reading, value=value) for reading, value in values.items())
    return Evidence(value=outcomes[0].value, outcomes=outcomes, **told)


def against_one_correction(results: Results) -> str:
    """What Table I says of the reading of DRC-PMI under which it corrects once in M T."""
    found, printed = results["table"]["ratios"][SINGLE][0], table_1("DRC-PMI")[0]
    return f"Table I speaks against this reading, which gives an error of {found:.2f} % where {printed} % is printed."


def printed_forms(structures: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Those with L in continuous time and the observer in the form of (7) and (8), whatever the command."""
    return [entry for entry in structures if not any(entry["structure"][2:])]


def radius_of(observer: str) -> Term:
    """The spectral radius of a loop over a slow period."""
    return term("spectral radius over a slow period", "motor", observer=observer)


def stable(observer: str) -> Predicate:
    """That a loop is stable."""
    return Predicate(of=radius_of(observer), relation="less than", to="1")


def unstable(observer: str) -> Predicate:
    """That a loop is unstable."""
    return Predicate(of=radius_of(observer), relation="more than", to="1")
