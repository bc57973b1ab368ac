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


_SECTIONS: tuple[tuple[str, str, Callable[[ResultsFile, Mapping[str, Target]], Any]], ...] = (
    ("across", "Across the papers", lambda results, read: across(results)),
    ("words", "What the words mean", lambda results, read: {"verdicts": VERDICTS, "terms": terms(results.papers)}),
    ("proofs", "Proofs", lambda results, read: proofs(results)),
    ("policies", "Policies", lambda results, read: by_policy(results.claims)),
    ("tolerances", "Tolerances", lambda results, read: allowances(results.claims)),
    ("sensitivity", "Sensitivity to the printed digits", lambda results, read: rooms(results) or None),
    ("controls", "Negative controls", lambda results, read: controls(results, read) or None),
    ("lineage", "From data to claim", lambda results, read: lineages(results) or None),
    ("experiments", "Experiments", lambda results, read: results.experiments),
    ("environment", "Environment", lambda results, read: results.run),
    ("cite", "How to cite", lambda results, read: results.papers),
)


def sections(results: ResultsFile, read: Mapping[str, Target]) -> tuple[Section, ...]:
    """All sections that `results` has something for; read: the printed values of its claims, as they were read."""
    built = ((name, title, build(results, read)) for name, title, build in _SECTIONS)
    return tuple(_section(name, title, shown) for name, title, shown in built if shown is not None)


def _section(name: str, title: str, shown: Any) -> Section:
    heading, *numbers = _HEADINGS[name](shown) if name in _HEADINGS else (title,)
    return Section(name=name, title=title, heading=heading, numbers=tuple(numbers), shown=shown)


Heading = tuple[Any, ...]
"""A heading, and the numbers in it, one by one."""


def _costs(shown: Across) -> Heading:
    drawn = chart(shown)
    if drawn is None:
        return ("What a slow, late or irregular sensor costs",)
    m, cost = drawn.shared
    return f"By these designs the {drawn.words[0]} sensor costs most: ×{short(cost, 2)} at m = {m}", cost, m


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


_HEADINGS: dict[str, Callable[[Any], Heading]] = {
    "across": _costs,
    "proofs": _proved,
    "policies": lambda shown: ("Rules that hold for all papers alike",),
    "tolerances": lambda shown: ("Half a unit of the last place, save what is listed",),
    "sensitivity": _hinging,
    "controls": _caught,
    "lineage": lambda shown: ("What each claim rests on, back to the printed data",),
    "experiments": _computed,
}
"""The results that stand over a section."""
