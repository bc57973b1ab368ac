"""The sections of the report that follow the papers, in the order of the page; the contents list them by themselves.

A section is a line in `_SECTIONS` and a template `html/<name>.html.j2`, which finds what the builder of the section
returned under the name `shown`. A builder that returns None leaves its section out. Whatever takes more than a
few lines to build is a module of its own (`across`, for example), and a section that is
about all papers together stands first. What a builder derives from the results it hands over as numbers, which the
template writes: a number inside a text of the builder's own stops the build (`guard`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from replication.audit.inspect.controls import Control, controls
from replication.audit.judge.agreement import Target
from replication.audit.judge.numerals import short
from replication.audit.judge.policies import by_policy
from replication.audit.report.sections.across import Across, across, chart
from replication.audit.report.sections.lineage import ClaimRoom, Proofs, allowances, lineages, proofs, rooms
from replication.audit.report.words import VERDICTS, terms
from replication.audit.store.records import ExperimentRecord, ResultsFile


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section: the name is its id and its template, `shown` what the template shows.

    title: its name in the contents. heading: its result, where it has one, and the numbers in it.
    """

    name: str
    title: str
    heading: str
    numbers: tuple[float, ...]
    shown: Any


Heading = tuple[Any, ...]
"""A heading, and the numbers in it, one by one."""


def _costs(shown: Across) -> Heading:
    drawn = chart(shown)
    if drawn is None:
        return ("What a slow, late or irregular sensor costs",)
    sensors = " or ".join([", ".join(drawn.words[:-1]), drawn.words[-1]] if drawn.words[1:] else drawn.words)
    return (
        f"On one plant a sensor that is {sensors} raises our gain bounds up to {short(drawn.peak, 2)}-fold",
        drawn.peak,
    )


def _proved(shown: Proofs) -> Heading:
    whole = f"All {shown.twice}" if shown.twice == shown.listed else f"{shown.twice} of {shown.listed}"
    coq = f", {shown.machine} in Coq too" if shown.machine else ""
    return f"{whole} certificates pass in two arithmetics{coq}", shown.twice, shown.listed, shown.machine


def _hinging(shown: tuple[ClaimRoom, ...]) -> Heading:
    moved = sum(bool(item.deciding) for item in shown)
    return f"{moved} of {len(shown)} results hinge on the rounding of a printed parameter", moved, len(shown)


def _caught(shown: tuple[Control, ...]) -> Heading:
    tried, missed = sum(one.tried for one in shown), sum(one.tried - one.caught for one in shown)
    return f"Altered claims are caught, {f'save {missed} of {tried}' if missed else f'all {tried}'}", missed, tried


def _computed(shown: tuple[ExperimentRecord, ...]) -> Heading:
    failed = sum(bool(record.error) for record in shown)
    return f"{len(shown)} experiments, {failed or 'none'} failed", len(shown), failed


Build = Callable[[ResultsFile, Mapping[str, Target]], Any]
_SECTIONS: tuple[tuple[str, str, Callable[[Any], Heading] | str, Build], ...] = (
    ("across", "Across the papers", _costs, lambda results, read: across(results)),
    ("words", "What the words mean", "", lambda results, read: {"verdicts": VERDICTS, "terms": terms(results.papers)}),
    ("proofs", "Proofs", _proved, lambda results, read: proofs(results)),
    ("policies", "Policies", "Rules that hold for all papers alike", lambda results, read: by_policy(results.claims)),
    (
        "tolerances",
        "Tolerances",
        "Half a unit of the last place, save what is listed",
        lambda results, read: allowances(results.claims),
    ),
    ("sensitivity", "Sensitivity to the printed digits", _hinging, lambda results, read: rooms(results) or None),
    ("controls", "Negative controls", _caught, lambda results, read: controls(results, read) or None),
    (
        "lineage",
        "From data to claim",
        "What each claim rests on, back to the printed data",
        lambda results, read: lineages(results) or None,
    ),
    ("experiments", "Experiments", _computed, lambda results, read: results.experiments),
    ("environment", "Environment", "", lambda results, read: results.run),
    ("cite", "How to cite", "", lambda results, read: results.papers),
)
"""Name, title, the result that stands over the section, and what it shows."""


def sections(results: ResultsFile, read: Mapping[str, Target]) -> tuple[Section, ...]:
    """All sections that `results` has something for; read: the printed values of its claims, as they were read."""
    made = []
    for name, title, told, build in _SECTIONS:
        if (shown := build(results, read)) is not None:
            heading, *numbers = told(shown) if callable(told) else (told or title,)
            made.append(Section(name=name, title=title, heading=heading, numbers=tuple(numbers), shown=shown))
    return tuple(made)
