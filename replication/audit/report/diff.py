"""The difference of two runs as a page: each claim that changed, and why, the verdicts first; then the runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
from markupsafe import Markup

from replication.audit.inspect.compare import Change, moved
from replication.audit.report.templates import environment, style_sheet
from replication.audit.store.records import ResultsFile, RunRecord
from replication.files import write_atomically


def build_page(old: ResultsFile, new: ResultsFile, changes: Sequence[Change], output: Path) -> Path:
    """Write the page of `changes` between two results files at `output`, whole or not at all, and return `output`."""
    write_atomically(output, render_page(old, new, changes).encode())
    return output


def render_page(old: ResultsFile, new: ResultsFile, changes: Sequence[Change]) -> str:
    """The text of the page; the same files give the same text."""
    rows = _run_rows(old.run, new.run)
    statements = {claim.id: claim.claim.statement for claim in (*old.claims, *new.claims)}
    return (
        environment()
        .get_template("diff.html.j2")
        .render(
            sentence=sentence(changes, len(new.claims)),
            verdicts=[change for change in changes if change.old != change.new],
            others=[change for change in changes if change.old == change.new],
            statements=statements,
            causes=Counter(str(cause) for change in changes for cause in change.causes),
            unlike=[row for row in rows if row[1] != row[2]],
            alike=[row for row in rows if row[1] == row[2]],
            moved=moved,
            text=_text,
            style=Markup(style_sheet()),
        )
    )


def sentence(changes: Sequence[Change], claims: int) -> str:
    """How many claims changed, and how many of those in their verdict."""
    if not changes:
        return f"None of {claims} claims changed."
    verdicts = sum(change.old != change.new for change in changes)
    return f"{len(changes)} of {claims} claims changed, {verdicts} of them in the verdict."


def _run_rows(old: RunRecord, new: RunRecord) -> list[tuple[str, str, str]]:
    """What the runs say of themselves, line by line; packages one by one, and only those that differ."""
    first, second = msgspec.to_builtins(old), msgspec.to_builtins(new)
    packages = first.pop("packages"), second.pop("packages")
    rows = [(name.replace("_", " "), _text(first[name]), _text(second[name])) for name in first]
    for name in sorted(packages[0].keys() | packages[1].keys()):
        versions = [_text(found.get(name)) for found in packages]
        if versions[0] != versions[1]:
            rows.append((name, *versions))
    return rows


def _text(value: Any) -> str:
    """A value of a record as text: words as they are, numbers with all their digits, lists and the like as JSON."""
    if value is None or value == "":
        return "—"
    return value if isinstance(value, str) else msgspec.json.encode(value).decode()
