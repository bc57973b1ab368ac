"""Pages: the report, and for each paper an article and a sheet of corrections with their data; each loads nothing.

Everything that a page says of a paper comes from the results file; the templates hold words only. The same results
and figures give the same bytes. The report is the opening, one page per paper (`paper`), then what stands behind the
verdicts (`sections`). The evidence of the claims is packed, and drawn where a reader opens a claim (`evidence`).

The finished page is read again, as its reader sees it. A number may stand on it if it is part of a text of the results
(a statement, a place such as "Table 1", a date), or if it is a number of the results, or one that a builder derived
from them and handed over as a number (a count, a deviation), written with as many digits as one likes. Names, checksums
and inputs (`code`, `pre`) and drawings (`svg`), which have a checksum of their own, are not read. A number that was
typed into a template or into a sentence is neither. Briefs, titles and captions are written by hand: a number in them
must stand elsewhere in the results.
"""

import base64
import bisect
import dataclasses
import hashlib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import msgspec
from markupsafe import Markup

from replication.audit.brief import Brief, Consequence
from replication.audit.inspect.headline import GROUPS, headline, plain
from replication.audit.judge import numerals
from replication.audit.publish.linked_data import filled
from replication.audit.report.claim import MEANING, targets
from replication.audit.report.evidence import checks, drawings, packed, played
from replication.audit.report.opening import picture_of
from replication.audit.report.paper import PaperView, paper_view
from replication.audit.report.sections import across, chart, sections
from replication.audit.report.templates import environment, source, style_sheet, terms
from replication.audit.report.told import briefs
from replication.audit.store.records import FigureRecord, ResultsFile
from replication.errors import AuditError
from replication.files import csv_text, write_atomically, write_directory

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
    views = [paper_view(paper, results, figures, read) for paper in results.papers]
    papers = sorted(views, key=lambda paper: paper.standing.rank)
    summaries = dict.fromkeys(paper.record.key for paper in papers) | briefs(results)
    met = {cell.consequence for paper in papers for cell in paper.cells if cell.marks or cell.timed}
    return {
        "results": results,
        "run": results.run,
        "papers": papers,
        "sections": sections(results, read),
        "claims_by_id": {view.record.id: view for paper in papers for view in paper.claims},
        "certificates_by_path": {certificate.path: certificate for certificate in results.certificates},
        "headline": headline(results),
        "columns": [kind for kind in Consequence if kind in met],
        "pictures": {paper.record.key: picture_of(paper, figures) for paper in papers if paper.standing.claims},
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
    yield f"{key}.csv", csv_text(_CLAIMS, (_claim(view.record) for view in paper.claims))
    errata = ([getattr(erratum, name) for name in _ERRATA] for erratum in paper.errata)
    yield f"{key}-corrections.csv", csv_text(_ERRATA, errata)


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


NOT_READ = frozenset({"script", "style", "svg", "code", "pre"})
READ_ATTRIBUTES = frozenset({"aria-label", "alt", "title", "content"})
WITHIN = frozenset({"span", "sub", "sup"})
"""What may stand inside a word: the digits of one number, an index, a power."""
WHOLE = 100
"""Integers below are compared exactly; from here on they may be rounded numbers."""

OF_A_BOUND = numerals.SHOWN
"""A number with so many digits may be a bound, which is rounded outwards, by up to a unit of its last place."""

_POWERS = str.maketrans("⁻−⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")
_RAISED = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_CARET = re.compile(r"(?<=[0-9])\^\{?\+?([-−]?[0-9]+)\}?")
_NUMBER = re.compile(
    r"(?<![\w.])([0-9]++(?:\.[0-9]++)?+|\.[0-9]++)(?:×10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)|e([-+−]?[0-9]+))?(?![⁻⁰¹²³⁴⁵⁶⁷⁸⁹])"
)
_POWER = re.compile(r"(?<![\w.×])([0-9]++)([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_RATIONAL = re.compile(r"-?[0-9]+/[0-9]+")
"""A text that is one exact number, such as the end of an interval, is none in whose words a number may stand."""
_AROUND = 60


def require_sourced(page: Mapping[str, str], *sources: Any) -> None:
    """Raise AuditError that names the first number on `page` that is in none of `sources`, with the text around it.

    page: HTML by the part of the report that it is, which the message names; "" for the page itself.
    sources: what the page was made from, first of all the results; dataclasses, structs, mappings and sequences are
    looked through for numbers, and the texts of the first one for numbers in words.
    """
    known = sorted({abs(Fraction(number)) for number in numbers_of(sources)})
    words = {number.group() for text in _texts(sources[0]) for number in _numbers(text)}
    for name, html in page.items():
        reader = _Reader()
        reader.feed(html)
        reader.close()
        for text in map(_raised, reader.texts):
            for number in _numbers(text):
                if number.group() not in words and not _is_one_of(number, known):
                    around = text[max(0, number.start() - _AROUND) : number.end() + _AROUND].strip()
                    where = f" of #{name}" if name else ""
                    raise AuditError(
                        f"the report{where} says {number.group()!r} in {around!r}, and the results hold no such "
                        "number; take it from the results, or hand it over from a builder as a number, not as a text"
                    )


def _raised(text: str) -> str:
    """A text in which a power of a number is part of it, as set: 10⁴ for 10^4."""
    return _CARET.sub(lambda match: match[1].translate(_RAISED), text)


def numbers_of(source: Any) -> set[float | Fraction]:
    """All numbers inside dataclasses, structs, mappings and sequences, at any depth; texts and flags hold none."""
    return {leaf for leaf in _leaves(source, _parts) if not isinstance(leaf, str)}


def _texts(source: Any) -> Iterator[str]:
    texts = (leaf for leaf in _leaves(source, _told) if isinstance(leaf, str))
    return (_raised(text) for text in texts if not _RATIONAL.fullmatch(text))


def _leaves(source: Any, parts: Callable[[Any], Iterable[Any]]) -> Iterator[Any]:
    """The numbers and texts of what has parts; a record that is part of many views is looked at once."""
    met, waiting = set[int](), [source]
    while waiting:
        part = waiting.pop()
        if isinstance(part, int | float | Fraction | str) and not isinstance(part, bool):
            yield part
        elif id(part) not in met:
            met.add(id(part))
            waiting.extend(parts(part))


def _told(source: Any) -> Iterable[Any]:
    """What was not written by hand."""
    if isinstance(source, FigureRecord):
        return (source.place, source.alt, source.error)
    return () if isinstance(source, Brief) else _parts(source)


def _parts(source: Any) -> Iterable[Any]:
    if isinstance(source, Mapping):
        return (part for item in source.items() for part in item)
    if isinstance(source, list | tuple | set | frozenset):
        return source
    if isinstance(source, msgspec.Struct):
        return (getattr(source, name) for name in source.__struct_fields__)
    if dataclasses.is_dataclass(source):
        return (getattr(source, field.name) for field in dataclasses.fields(source))
    return ()


def _numbers(text: str) -> Iterator[re.Match[str]]:
    yield from _NUMBER.finditer(text)
    yield from _POWER.finditer(text)


def _is_one_of(match: re.Match[str], known: list[Fraction]) -> bool:
    """Whether one of `known` (sorted, without signs) is written so to the digits shown."""
    mantissa, power = (match[1], match[2] or match[3]) if match.re is _NUMBER else ("1", match[2])
    if match.re is _POWER and match[1] != "10":
        return False
    shown = Decimal(mantissa).scaleb(int(power.translate(_POWERS)) if power else 0)
    exponent = shown.as_tuple().exponent
    assert isinstance(exponent, int)  # the pattern matches finite numbers only
    whole = not power and "." not in mantissa and shown < WHOLE
    outwards = len(shown.as_tuple().digits) >= OF_A_BOUND
    half = Fraction(0) if whole else Fraction(10) ** exponent / (1 if outwards else 2)
    # A float is rounded for the page from its binary value, which may lie a hair beyond the half.
    slack = half * Fraction(1, 10**6)
    first = bisect.bisect_left(known, Fraction(shown) - half - slack)
    return first < len(known) and known[first] <= Fraction(shown) + half + slack


class _Reader(HTMLParser):
    """Collects the texts that a reader sees or hears, each up to the next tag that is not inside a word."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.texts: list[str] = []
        self._closed_by: list[str] = []
        self._joins = self._raises = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        # What a browser may load is told to it, not to a reader.
        if not self._closed_by and "http-equiv" not in dict(attrs):
            self.texts.extend(value for name, value in attrs if name in READ_ATTRIBUTES and value)
        if tag in NOT_READ:
            self._closed_by.append(tag)
        self._joins, self._raises = self._joins and tag in WITHIN, tag == "sup"

    def handle_endtag(self, tag: str) -> None:
        if self._closed_by and tag == self._closed_by[-1]:
            self._closed_by.pop()
        self._joins = self._joins and tag in WITHIN

    def handle_data(self, data: str) -> None:
        if self._closed_by:
            return
        if self._joins:
            self.texts[-1] += f"^{data}" if self._raises and self.texts[-1][-1:].isdigit() else data
        else:
            self.texts.append(data)
        self._joins, self._raises = True, False
