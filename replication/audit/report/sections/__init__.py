"""The sections of the report that follow the papers, in the order of the page; the contents list them by themselves.

A section is a line in `_SECTIONS`, a template `html/<name>.html.j2`, which finds what the builder of the section
returned under the name `shown`, and where its heading is a result a line in `html/headings.html.j2`. A builder that
returns None leaves its section out. Whatever takes more than a few lines to build is a module of its own (`across`, for
example), and a section that is about all papers together stands first. What is derived from the results is handed over
as numbers, which the templates write: a number inside a text of a builder's own stops the build (`guard`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from replication.audit.inspect.controls import controls
from replication.audit.judge.agreement import Target
from replication.audit.judge.policies import by_policy
from replication.audit.report.sections.across import across
from replication.audit.report.sections.lineage import allowances, lineages, proofs, rooms
from replication.audit.report.words import VERDICTS, terms
from replication.audit.store.records import ResultsFile


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section: the name is its id and its template, `shown` what the template shows.

    title: its name in the contents. numbers: those of its heading that what is shown does not hold.
    """

    name: str
    title: str
    numbers: Mapping[str, int]
    shown: Any


Build = Callable[[ResultsFile, Mapping[str, Target]], Any]
_SECTIONS: tuple[tuple[str, str, Build], ...] = (
    ("across", "Across the papers", lambda results, read: across(results) or None),
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
"""Name, title, and what it shows."""
_NUMBERS: Mapping[str, Callable[[Any], dict[str, int]]] = {
    "sensitivity": lambda shown: {"tried": len(shown), "moved": sum(bool(item.deciding) for item in shown)},
    "controls": lambda shown: {
        "tried": sum(control.tried for control in shown),
        "missed": sum(control.tried - control.caught for control in shown),
    },
    "experiments": lambda shown: {"run": len(shown), "failed": sum(bool(record.error) for record in shown)},
}


def sections(results: ResultsFile, read: Mapping[str, Target]) -> tuple[Section, ...]:
    """All sections that `results` has something for; read: the printed values of its claims, as they were read."""
    built = [(name, title, build(results, read)) for name, title, build in _SECTIONS]
    return tuple(
        Section(name=name, title=title, numbers=_NUMBERS.get(name, lambda shown: {})(shown), shown=shown)
        for name, title, shown in built
        if shown is not None
    )
