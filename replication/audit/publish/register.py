"""Several projects side by side on a page: what each has audited, and with what outcome, from their results alone."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup

from replication.audit.inspect.headline import counts
from replication.audit.judge.policies import once
from replication.audit.model import Verdict
from replication.audit.report.claim import anchor
from replication.audit.report.templates import environment, style_sheet
from replication.audit.store.records import ClaimRecord, PaperRecord, ResultsFile, read_results
from replication.errors import InvalidInputError
from replication.files import write_atomically


@dataclass(frozen=True, kw_only=True)
class Row:
    """One paper of a project; report: address of its page in the report, empty if there is none."""

    paper: PaperRecord
    counts: Mapping[Verdict, int]
    total: int
    proved: int
    unexpected: int
    report: str


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One project, by its results."""

    results: ResultsFile
    rows: tuple[Row, ...]
    counts: Mapping[Verdict, int]
    total: int
    report: str


def build_register(files: Sequence[Path], output: Path) -> Path:
    """Write the page on these results files, or folders that hold one, at `output`, and return `output`.

    Raises AuditError that names the file which is no results file, or one of another schema; InvalidInputError if one
    is given twice. Nothing is written then.
    """
    paths = [path / "results.json" if path.is_dir() else path for path in files]
    for path, times in Counter(path.resolve() for path in paths).items():
        if times > 1:
            raise InvalidInputError(f"{path} is given {times} times; give each project once")
    entries = [entry(read_results(path), _report(path, output)) for path in paths]
    write_atomically(output, render_register(entries).encode())
    return output


def render_register(entries: Sequence[Entry]) -> str:
    """The text of the page, projects by title; the same results give the same text."""
    ordered = sorted(entries, key=lambda one: (one.results.project.title, one.report))
    verdicts = [verdict for verdict in Verdict if any(one.counts[verdict] for one in ordered)]
    template = environment().get_template("register.html.j2")
    return template.render(entries=ordered, verdicts=verdicts, style=Markup(style_sheet()))


def entry(results: ResultsFile, report: str) -> Entry:
    """What the page says of a project; report: address of its report, or empty."""
    return Entry(
        results=results,
        rows=tuple(_row(paper, results.claims, report) for paper in results.papers),
        counts=counts(results.claims),
        total=len(once(results.claims)),
        report=report,
    )


def _row(paper: PaperRecord, claims: Sequence[ClaimRecord], report: str) -> Row:
    own = [claim for claim in claims if claim.paper == paper.key]
    return Row(
        paper=paper,
        counts=counts(own),
        total=len(once(own)),
        proved=sum(claim.judgement.proved for claim in once(own)),
        unexpected=sum(claim.unexpected for claim in own),
        report=report and f"{report}#{quote(anchor('paper', paper.key))}",
    )


def _report(results: Path, output: Path) -> str:
    """The address of the report beside a results file, seen from the page."""
    page = results.resolve().parent / "index.html"
    return quote(os.path.relpath(page, output.resolve().parent)) if page.is_file() else ""
