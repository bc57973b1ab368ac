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

from replication.audit.inspect.controls import controls
from replication.audit.judge.agreement import Target
from replication.audit.judge.policies import by_policy
from replication.audit.report.sections.across import across
from replication.audit.report.sections.lineage import allowances, lineages, proofs, rooms
from replication.audit.store.records import ResultsFile


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section: the name is its id and its template, `shown` what the template shows."""

    name: str
    title: str
    shown: Any


_SECTIONS: tuple[tuple[str, str, Callable[[ResultsFile, Mapping[str, Target]], Any]], ...] = (
    ("across", "Across the papers", lambda results, read: across(results)),
    ("words", "What the verdicts mean", lambda results, read: ()),
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
    return tuple(Section(name=name, title=title, shown=shown) for name, title, shown in built if shown is not None)
