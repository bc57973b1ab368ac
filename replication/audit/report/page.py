"""Pages: the report, and for each paper an article and a sheet of corrections with their data; each loads nothing.

Everything that a page says of a paper comes from the results file; the templates hold words only. The same results
and figures give the same bytes. The report is the opening, one page per paper (`paper`), then what stands behind the
verdicts (`sections`). The evidence of the claims is packed, and drawn where a reader opens a claim (`evidence`).
"""

import base64
import csv
import hashlib
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
from markupsafe import Markup

from replication.audit.inspect.headline import GROUPS, headline, plain
from replication.audit.publish.linked_data import filled
from replication.audit.report.claim import MEANING, standings, targets
from replication.audit.report.evidence import checks, drawings, packed, played
from replication.audit.report.guard import require_sourced
from replication.audit.report.opening import field, rows
from replication.audit.report.paper import PaperView, paper_view
from replication.audit.report.sections import across, chart, sections
from replication.audit.report.templates import environment, source, style_sheet, terms
from replication.audit.report.told import briefs
from replication.audit.store.records import ResultsFile
from replication.errors import AuditError
from replication.files import write_atomically, write_directory

UNPRINTED = ("scope", "policies", "tolerances", "sensitivity", "lineage", "experiments")
"""Parts and sections that stand on a screen only; the contents of the print edition leave them out."""


def build_report(results: ResultsFile, figures: Path, output: Path, root: Path | None = None) -> Path:
    """Write the report of `results` with the files in `figures` at `output` and return `output`.

    root: of the project, for the links to code; the folder above that of the page, unless given.
    Raises AuditError if a figure file is missing or belongs to other results, a formula cannot be set, a table names an
    unknown claim, a part of the template is missing, or the page shows a number that does not come from the results.
    """
    place = output.resolve()
    depth = len(place.relative_to(root).parts) - 1 if root is not None and place.is_relative_to(root) else 1
    proofs = checks(results, root)
    page, evidence, known = _made(results, figures, "../" * depth, proofs)
    require_sourced({"": page, **evidence}, results, known)
    write_atomically(output, page.encode())
    return output


def render(results: ResultsFile, figures: Path, root: str = "../") -> str:
    """The text of the report; root: the way to the folder of the project, for links to code in no public place.

    Other arguments and errors as for `build_report`.
    """
    return _made(results, figures, root, checks(results, None))[0]


def shown(results: ResultsFile, figures: Path) -> dict[str, Any]:
    """What the templates show; tables are in the order of the results file, so that its page is that of the run."""
    results = msgspec.convert(msgspec.to_builtins(results, order="deterministic"), ResultsFile)
    _require_known(results)
    read = targets(results.claims)
    order = list(standings(results))
    records = sorted(results.papers, key=lambda paper: order.index(paper.key))
    papers = [paper_view(paper, results, figures, read) for paper in records]
    summaries, drawn = dict.fromkeys(order, None) | briefs(results), field(papers)
    return {
        "results": results,
        "run": results.run,
        "papers": papers,
        "sections": sections(results, read),
        "claims_by_id": {view.record.id: view for paper in papers for view in paper.claims},
        "certificates_by_path": {certificate.path: certificate for certificate in results.certificates},
        "headline": headline(results),
        "field": drawn,
        "rows": rows(drawn.lanes, summaries, figures),
        "costs": chart(across(results)),
        "groups": GROUPS,
        "plain": plain,
        "terms": terms,
        "briefs": summaries,
        "headings": tuple(paper.sums for paper in papers),
        "meaning": MEANING,
        "unprinted": UNPRINTED,
        "linked_data": Markup(json.dumps(filled("summary", results=results)).replace("<", "\\u003c")),
        "inferred": {erratum.id for erratum in results.errata if erratum.inference},
    }


def _made(
    results: ResultsFile, figures: Path, beside: str, proofs: Mapping[str, Any]
) -> tuple[str, dict[str, str], dict[str, Any]]:
    """The page, the evidence that is packed into it, and what both were made from."""
    templates = environment()
    plays = played(proofs)
    parts = {"script": True, "check": bool(proofs["entries"]), "play": bool(plays)}
    scripts = {name: source(f"{name}.js") for name, present in parts.items() if present}
    root = results.project.sources(results.run.commit, results.run.dirty) or beside
    context = shown(results, figures) | {"checked": frozenset(proofs["entries"]), "plays": plays}
    evidence = drawings(templates, {**context, "root": root})
    digests = [base64.b64encode(hashlib.sha256(code.encode()).digest()).decode() for code in scripts.values()]
    page = templates.get_template("template.html.j2").render(
        context,
        root=root,
        beside=beside,
        packed=Markup(packed(evidence)),
        certificates=Markup(packed(proofs)) if proofs["entries"] else "",
        style=style_sheet("check.css"),
        drawn=Markup(rules(context["papers"])),
        scripts={name: Markup(code) for name, code in scripts.items()},
        allowed=Markup(" ".join(f"'sha256-{digest}'" for digest in digests)),
    )
    return page, evidence, context


def rules(papers: Sequence[PaperView]) -> str:
    """The rules of the classes in all figures, each once."""
    rules = {name: rule for paper in papers for figure in paper.figures for name, rule in figure.styles.items()}
    return "".join(f".{name}{{{rule}}}\n" for name, rule in sorted(rules.items()))


def _require_known(results: ResultsFile) -> None:
    papers = {paper.key for paper in results.papers}
    strangers = sorted({claim.paper for claim in results.claims} - papers)
    named = {name for paper in results.papers for table in paper.tables for name in table.claims}
    named |= {name for paper in results.papers for item in paper.scope for name in item.claims}
    unknown = sorted(named - {claim.id for claim in results.claims})
    paths = {path for claim in results.claims for path in claim.evidence.certificates}
    missing = sorted(paths - {certificate.path for certificate in results.certificates})
    if strangers or unknown or missing:
        raise AuditError(
            f"the results name papers ({strangers}), claims ({unknown}) or certificates ({missing}) that they do not "
            "hold; make them again with `python -m replication run`"
        )


_CLAIMS = ("id", "place", "statement", "printed", "computed", "lower", "upper", "verdict", "proved", "reason", "code")
_ERRATA = ("id", "place", "printed", "meant", "inference", "holds", "text", "code")


def build_articles(results: ResultsFile, figures: Path, directory: Path) -> Path:
    """Write `KEY.html`, `KEY-corrections.html` and a CSV of each for all papers into `directory`, which holds no more.

    figures: the folder of the drawings. Raises AuditError as `page.render` does; nothing half-written is left.
    """
    known = shown(results, figures)
    files = (file for paper in known["papers"] for file in _files(paper, known))
    write_directory(directory, {name: text.encode() for name, text in files})
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
    template = environment().get_template("article.html.j2")
    page = template.render(
        known,
        paper=paper,
        sheet=sheet,
        tabled={c.claim.record.id for t in paper.tables for row in t.rows for c in row if c.claim is not None},
        root=known["results"].project.sources(known["run"].commit, known["run"].dirty) or "../../",
        style=style_sheet("article.css"),
        drawn=Markup("" if sheet else rules([paper])),
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
