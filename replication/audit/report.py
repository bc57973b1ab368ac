"""The report: one HTML file that loads nothing, made from a results file and the figures beside it.

Everything that the page says of a paper comes from the results file; the template holds words only. The same results
and figures give the same bytes.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import quote

import msgspec
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from replication.audit import numerals, svg
from replication.audit.allowances import allowances
from replication.audit.files import write_atomically
from replication.audit.formulas import mathml
from replication.audit.headline import caveats, counts, sentence
from replication.audit.model import Verdict
from replication.audit.records import ClaimRecord, ErratumRecord, FigureRecord, PaperRecord, ResultsFile
from replication.audit.view import ClaimView, anchor, views
from replication.errors import AuditError

SOURCES = Path(__file__).resolve().parents[2] / "report"
"""Template, style sheet and script; they lie beside the report that they make."""

_UNSEEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ufdd0-\ufdef\ufffe\uffff]")
_CODE = re.compile(r"([A-Za-z0-9_./-]+):([0-9]+)")
_Record = TypeVar("_Record", ClaimRecord, ErratumRecord, FigureRecord)


@dataclass(frozen=True, kw_only=True)
class FigureView:
    """A figure with what its two files hold; `error` in the record means that there are none."""

    record: FigureRecord
    view_box: str = ""
    drawing: str = ""
    csv_link: str = ""
    svg_link: str = ""


@dataclass(frozen=True, kw_only=True)
class PaperView:
    """All that the report shows of one paper."""

    record: PaperRecord
    claims: tuple[ClaimView, ...]
    counts: Mapping[Verdict, int]
    figures: tuple[FigureView, ...]
    errata: tuple[ErratumRecord, ...]
    formulas: tuple[tuple[str, Markup], ...]

    @property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """Name and heading of each part that this paper has, in the order of the page."""
        present = {
            ("formulas", "Formulas"): self.formulas,
            ("tables", "Tables of the paper"): self.record.tables,
            ("claims", "Claims"): self.claims,
            ("figures", "Figures"): self.figures,
            ("errata", "Errata"): self.errata,
            ("scope", "Scope"): self.record.scope,
        }
        return tuple(part for part, content in present.items() if content)


def build_report(results: ResultsFile, figures: Path, output: Path) -> Path:
    """Write the report of `results` with the files in `figures` at `output` and return `output`.

    Raises AuditError if a figure file is missing or belongs to other results, a formula cannot be set, a table names an
    unknown claim, or a part of the template is missing.
    """
    place = output.resolve()
    depth = len(place.relative_to(SOURCES.parent).parts) - 1 if place.is_relative_to(SOURCES.parent) else 1
    write_atomically(output, render(results, figures, root="../" * depth).encode())
    return output


def render(results: ResultsFile, figures: Path, root: str = "../") -> str:
    """The text of the report; root: the way from its folder to that of the project, for the links to code.

    Other arguments and errors as for `build_report`.
    """
    script = _source("script.js")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    claims = {claim.id: claim for claim in results.claims}
    _require_known_claims(results, claims)
    return (
        _environment()
        .get_template("template.html.j2")
        .render(
            results=results,
            root=root,
            run=results.run,
            papers=[_paper(paper, results, figures) for paper in results.papers],
            claims_by_id={view.record.id: view for view in views(results.claims)},
            counts=counts(results.claims),
            sentence=sentence(results.claims),
            caveats=caveats(results.claims, results.errata),
            inferred={erratum.id for erratum in results.errata if erratum.inference},
            allowances=allowances(results.claims),
            unexpected=[claim for claim in results.claims if claim.verdict != claim.expected_verdict],
            style=Markup(_source("style.css")),
            script=Markup(script),
            script_hash=f"sha256-{digest}",
        )
    )


def _paper(paper: PaperRecord, results: ResultsFile, figures: Path) -> PaperView:
    claims = _of(paper, results.claims)
    return PaperView(
        record=paper,
        claims=views(claims),
        counts=counts(claims),
        figures=tuple(_figure(record, figures) for record in _of(paper, results.figures)),
        errata=_of(paper, results.errata),
        formulas=tuple((text, mathml(latex)) for text, latex in paper.formulas),
    )


def _of(paper: PaperRecord, records: tuple[_Record, ...]) -> tuple[_Record, ...]:
    return tuple(record for record in records if record.paper == paper.key)


def _figure(record: FigureRecord, directory: Path) -> FigureView:
    if record.error:
        return FigureView(record=record)
    drawing, table = directory / f"{record.name}.svg", directory / f"{record.name}.csv"
    for path in (drawing, table):
        if not path.is_file():
            raise AuditError(f"{path} is missing; make the figures with `python -m replication run`")
    if hashlib.sha256(table.read_bytes()).hexdigest() != record.csv_sha256:
        raise AuditError(f"{table} is not the data of these results; run `python -m replication run` again")
    text = drawing.read_text(encoding="utf-8")
    view_box, content = svg.inner(text)
    return FigureView(
        record=record,
        view_box=view_box,
        drawing=Markup(content),
        csv_link=_data_uri("text/csv", table.read_text(encoding="utf-8")),
        svg_link=_data_uri("image/svg+xml", text),
    )


def _data_uri(media_type: str, text: str) -> str:
    return f"data:{media_type};charset=utf-8,{quote(text, safe='!$()*+,-./:;=?@_~')}"


def _require_known_claims(results: ResultsFile, claims: Mapping[str, ClaimRecord]) -> None:
    papers = {paper.key for paper in results.papers}
    strangers = sorted({claim.paper for claim in results.claims} - papers)
    named = [cell[6:] for p in results.papers for t in p.tables for row in t.rows for cell in row if _names_claim(cell)]
    named += [name for paper in results.papers for item in paper.scope for name in item.claims]
    unknown = sorted(set(named) - set(claims))
    if strangers or unknown:
        raise AuditError(
            f"the results name papers ({strangers}) or claims ({unknown}) that they do not hold; "
            "make them again with `python -m replication run`"
        )


def _names_claim(cell: str) -> bool:
    return cell.startswith("claim:")


def _source(name: str) -> str:
    try:
        return (SOURCES / name).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise AuditError(f"{SOURCES / name} is missing; the report is built from a checkout of the project") from None


def _environment() -> Environment:
    _source("template.html.j2")
    environment = Environment(
        loader=FileSystemLoader(SOURCES),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_shown,
    )
    environment.filters |= {
        "short": numerals.short,
        "full": numerals.full,
        "signed": numerals.signed,
        "seconds": numerals.seconds,
        "layout": numerals.layout,
        "anchor": lambda name, kind: anchor(kind, name),
        "slug": lambda verdict: str(verdict).replace(" ", "-"),
        "code_link": code_link,
        "pretty": lambda value: msgspec.json.format(
            msgspec.json.encode(value, order="deterministic"), indent=2
        ).decode(),
    }
    environment.tests |= {"claim_cell": _names_claim}
    return environment


def code_link(code: str, root: str) -> str:
    """Address of `file:line` from the folder of the report; empty if `code` is not of that form."""
    match = _CODE.fullmatch(code)
    return f"{root}{match[1]}#L{match[2]}" if match else ""


def _shown(value: Any) -> Any:
    """Refuse a forgotten value, and keep out of the page what HTML cannot hold."""
    if value is None:
        raise AuditError("the template shows a value that is None; give it a condition")
    return _UNSEEN.sub("\N{REPLACEMENT CHARACTER}", value) if type(value) is str else value
