"""When the verdict of a claim changed: a table that `make readme` writes, and what git keeps of it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from replication.audit.store.provenance import git
from replication.audit.store.records import ResultsFile
from replication.errors import AuditError

TABLE = "docs/verdicts.csv"
HEAD = ("claim", "verdict", "proved")
ABSENT = "no claim"
"""Stands where a table does not have the claim."""

Verdicts = Mapping[str, str]


@dataclass(frozen=True)
class Step:
    """What one commit made of one claim: its day, its short name, and the words before and after."""

    claim: str
    day: str
    commit: str
    old: str
    new: str

    def __str__(self) -> str:
        return f"{self.day} {self.commit} {self.claim}: {self.old} -> {self.new}"


def table(results: ResultsFile) -> str:
    """Each claim with its verdict and whether a theorem says it, as CSV in the order of the ids."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(HEAD)
    for claim in sorted(results.claims, key=lambda claim: claim.id):
        writer.writerow([claim.id, claim.verdict, "yes" if claim.judgement.proved else "no"])
    return stream.getvalue()


def read_table(text: str) -> Verdicts:
    """The words for each claim; raises AuditError if the text is no such table."""
    head, *rows = list(csv.reader(text.splitlines())) or [[]]
    if tuple(head) != HEAD or any(len(row) != len(HEAD) for row in rows):
        raise AuditError(f"{TABLE} must have the columns {', '.join(HEAD)}; write it anew with `make readme`")
    return {claim: f"{verdict}, proved" if proved == "yes" else verdict for claim, verdict, proved in rows}


def steps(root: Path) -> tuple[Step, ...]:
    """Every change between committed tables, the oldest first; raises AuditError where git has none."""
    log = git(root, "log", "--reverse", "--first-parent", "--format=%H %h %cs", "--", TABLE)
    if not log:
        raise AuditError(f"git knows no {TABLE} here; in a clone with its history, `make readme`, and commit the table")
    commits = [line.split() for line in log.splitlines()]
    tables = [read_table(git(root, "show", f"{name}:./{TABLE}") or ",".join(HEAD)) for name, _, _ in commits]
    return tuple(_changes([(short, day) for _, short, day in commits], tables))


def _changes(commits: Sequence[tuple[str, str]], tables: Sequence[Verdicts]) -> Iterator[Step]:
    for (short, day), old, new in zip(commits[1:], tables, tables[1:], strict=False):
        for claim in sorted({*old, *new}):
            before, after = old.get(claim, ABSENT), new.get(claim, ABSENT)
            if before != after:
                yield Step(claim, day, short, before, after)
