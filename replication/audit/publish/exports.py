"""The folder of exports: badges, linked data, CODECHECK configurations, ReScience metadata and BibTeX of a run."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable
from pathlib import Path

import msgspec

from replication.audit.inspect.headline import counts, sentence
from replication.audit.judge.verdict import AGREES
from replication.audit.model import Verdict
from replication.audit.publish.linked_data import Json, claims_graph, without_empty
from replication.audit.publish.software import Software, read_software
from replication.audit.report.consequence import standing
from replication.audit.store.records import ClaimRecord, PaperRecord, ResultsFile
from replication.files import write_atomically

CODECHECK = "https://codecheck.org.uk/spec/config/1.0/"
HEIGHT, PADDING, MARK = 20, 7, 16
CHARACTER = 6.6
"""Width in pixels that one character of 11 px text is given; `textLength` then makes the text as wide as its box."""

TICK, CROSS, DIAMOND = "M4 10.5l3.5 3.5l6-8", "M4.5 5.5l8 8m0-8l-8 8", "M8.5 5.5l4.5 4.5l-4.5 4.5l-4.5-4.5z"
GOOD, SOME, BAD = ("#0b6b46", TICK), ("#8a5200", DIAMOND), ("#a11d2f", CROSS)
"""Colour, with a contrast of more than 4.5:1 to white, and mark: all agree, something does not, a theorem fails."""


def export_texts(results: ResultsFile, software: Software) -> dict[str, str]:
    """Name and text of each exported file; the same results give the same texts."""
    texts = {
        "badges/all.svg": badge("replication", results.claims),
        "claims.jsonld": to_json(claims_graph(results, software)),
        "citation.bib": bibtex(results, software),
        "metadata.yaml": rescience(results, software),
    }
    for paper in results.papers:
        claims = [claim for claim in results.claims if claim.paper == paper.key]
        texts[f"badges/{paper.key}.svg"] = badge(paper.key, claims)
        texts[f"codecheck/{paper.key}/codecheck.yml"] = codecheck(paper, results, software)
    return dict(sorted(texts.items()))


def write_exports(results: ResultsFile, root: Path, directory: Path) -> tuple[Path, ...]:
    """Write every export of `results` below `directory`; returns the paths. root: of the project, for CITATION.cff."""
    paths = []
    for name, text in export_texts(results, read_software(root)).items():
        write_atomically(directory / name, text.encode())
        paths.append(directory / name)
    return tuple(paths)


def badge(label: str, claims: Iterable[ClaimRecord]) -> str:
    """One badge: how many of the claims agree, how many the text leaves undecided, and whether a verdict has moved.

    A tick says that all agree, a diamond that some do not, a cross that a theorem fails or a verdict has changed.
    """
    chosen = tuple(claims)
    found = counts(chosen)
    undecided = found[Verdict.UNDETERMINED]
    agree = sum(found[verdict] for verdict in AGREES)
    moved = sum(claim.unexpected for claim in chosen)
    text = f"{moved} off the pin" if moved else f"{agree} of {sum(found.values())} agree"
    text += f", {undecided} undecided" if undecided and not moved else ""
    stands = standing(chosen)
    return draw(label, text, BAD if moved or stands.broken else SOME if stands.failing else GOOD)


def draw(label: str, text: str, look: tuple[str, str]) -> str:
    """A badge of two boxes as stand-alone SVG: `label`, then the mark and `text` on the colour of `look`."""
    colour, mark = look
    left = _width(label)
    right = _width(text) + MARK
    full = html.escape(f"{label}: {text}")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + right:g}" height="{HEIGHT}" role="img" '
        f'aria-label="{full}"><title>{full}</title>'
        f'<rect width="{left + right:g}" height="{HEIGHT}" rx="3" fill="#3a3f45"/>'
        f'<path d="M{left:g} 0h{right - 3:g}a3 3 0 0 1 3 3v{HEIGHT - 6}a3 3 0 0 1-3 3h-{right - 3:g}z" '
        f'fill="{colour}"/>'
        f'<path d="{mark}" transform="translate({left:g})" fill="none" stroke="#fff" '
        f'stroke-width="2"/>'
        f'<g fill="#fff" font-family="Verdana,DejaVu Sans,sans-serif" font-size="11">'
        f"{_text(label, PADDING)}{_text(text, left + MARK)}</g></svg>\n"
    )


def _width(text: str) -> float:
    return CHARACTER * len(text) + 2 * PADDING


def _text(text: str, x: float) -> str:
    return f'<text x="{x:g}" y="14" textLength="{CHARACTER * len(text):g}">{html.escape(text)}</text>'


def codecheck(paper: PaperRecord, results: ResultsFile, software: Software) -> str:
    """`codecheck.yml` of one paper: what a codechecker has to rebuild, and what came out here.

    No checker, certificate or date of a check is named: they are for the person who does one.
    """
    figures = [record for record in results.figures if record.paper == paper.key and not record.error]
    claims = [claim for claim in results.claims if claim.paper == paper.key]
    manifest = [
        {"file": f"figures/{record.name}.{suffix}", "comment": f"{record.place}: {record.title}"}
        for record in figures
        for suffix in ("svg", "csv")
    ]
    return _yaml(
        {
            "version": CODECHECK,
            "paper": without_empty(
                {
                    "title": paper.title,
                    "authors": [{"name": name} for name in paper.authors],
                    "reference": f"https://doi.org/{paper.doi}" if paper.doi else "",
                }
            ),
            "manifest": [
                {"file": "report/results.json", "comment": "every claim with its evidence and verdict"},
                *manifest,
            ],
            "summary": f"{sentence(claims)} Made by `make report` of {software.title}, version {software.version}.",
            **({"repository": software.repository_code} if software.repository_code else {}),
        }
    )


def rescience(results: ResultsFile, software: Software) -> str:
    """`metadata.yaml` in the manner of ReScience C: this package as the replication, the papers as the originals."""
    return _yaml(
        {
            "title": software.title,
            "type": "Replication",
            "authors": [
                without_empty({"name": person.full_name, "orcid": person.orcid}) for person in software.authors
            ],
            "abstract": software.abstract,
            "keywords": list(software.keywords),
            "language": "Python",
            "domain": "Control engineering",
            "code": [
                without_empty({"url": software.repository_code, "doi": software.doi, "version": software.version})
            ],
            "date": results.run.date,
            "replication": [
                without_empty(
                    {
                        "cite": f"{', '.join(paper.authors)}: {paper.title}",
                        "bib": paper.key,
                        "doi": paper.doi,
                        "url": f"https://doi.org/{paper.doi}" if paper.doi else "",
                    }
                )
                for paper in results.papers
            ],
        }
    )


def bibtex(results: ResultsFile, software: Software) -> str:
    """BibTeX of this package and of every paper that it replicates."""
    fields = {
        "title": f"{{{software.title}}}",
        "author": " and ".join(f"{{{person.full_name}}}" for person in software.authors),
        "version": software.version,
        "year": results.run.date[:4],
        "doi": software.doi,
        "url": software.url or software.repository_code,
    }
    lines = [f"  {name} = {{{value}}}," for name, value in fields.items() if value]
    own = "\n".join(["@software{replication,", *lines, "}"])
    return "\n\n".join([own, *(paper.bibtex.strip() for paper in results.papers)]) + "\n"


def to_json(content: Json) -> str:
    """Indented JSON with the fields in their order and one newline at the end."""
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _yaml(content: Json) -> str:
    return msgspec.yaml.encode(content, order=None).decode()
