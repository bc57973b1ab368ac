"""For each paper an article and a sheet of corrections, to be printed or sent to its authors, each with its data."""

import csv
import io
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup

from replication.audit.report.page import rules, shown
from replication.audit.report.paper import PaperView
from replication.audit.report.templates import environment, source, style_sheet
from replication.audit.store.records import ResultsFile
from replication.files import write_directory

_CLAIMS = ("id", "place", "statement", "printed", "computed", "lower", "upper", "verdict", "proved", "reason", "code")
_ERRATA = ("id", "place", "printed", "meant", "inference", "holds", "text", "code")


def build_articles(results: ResultsFile, figures: Path, directory: Path) -> Path:
    """Write `KEY.html`, `KEY-corrections.html` and a CSV of each for all papers into `directory`, which holds no more.

    figures: the folder of the drawings. Raises AuditError as `page.render` does; nothing half-written is left.
    """
    known = shown(results, figures)
    write_directory(
        directory, {name: text.encode() for paper in known["papers"] for name, text in _files(paper, known)}
    )
    return directory


def _files(paper: PaperView, known: Mapping[str, Any]) -> Iterable[tuple[str, str]]:
    """Name and content of the four files on a paper."""
    key = paper.record.key
    for end, sheet in (("", False), ("-corrections", True)):
        yield f"{key}{end}.html", _page(paper, known, sheet=sheet)
    yield f"{key}.csv", _table(_CLAIMS, (_claim(view.record) for view in paper.claims))
    yield f"{key}-corrections.csv", _table(_ERRATA, ([getattr(e, name) for name in _ERRATA] for e in paper.errata))


def _page(paper: PaperView, known: Mapping[str, Any], *, sheet: bool) -> str:
    """One page; what the report links to on its own page leads to the report."""
    page = (
        environment()
        .get_template("article.html.j2")
        .render(
            known,
            paper=paper,
            sheet=sheet,
            tabled={c.claim.record.id for t in paper.tables for row in t.rows for c in row if c.claim is not None},
            root=known["results"].project.sources(known["run"].commit, known["run"].dirty) or "../../",
            style=Markup(re.sub(r"\n\s+", "\n", style_sheet() + source("article.css"))),
            drawn=Markup("" if sheet else rules([paper])),
        )
    )
    return re.sub(r'(<a [^>]*?href=")#(?!top")', r"\1../index.html#", page)


def _claim(record: Any) -> list[object]:
    claim, evidence, judgement = record.claim, record.evidence, record.judgement
    computed = evidence.value if evidence.value is not None else evidence.holds
    head = [record.id, claim.place, claim.statement, claim.printed, computed, evidence.lower, evidence.upper]
    return [*head, record.verdict, judgement.proved, judgement.reason, evidence.code]


def _table(header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(["" if cell is None else cell for cell in row] for row in rows)
    return text.getvalue()
