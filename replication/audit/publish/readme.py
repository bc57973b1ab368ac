"""The part of a README that comes from a run, between markers, and its badges."""

from __future__ import annotations

import re
from pathlib import Path

from replication.audit.inspect.headline import theorems
from replication.audit.judge.policies import once
from replication.audit.publish.archive import badges
from replication.audit.report.claim import standings
from replication.audit.report.opening.told import BriefView, briefs
from replication.audit.store.records import PaperRecord, ResultsFile
from replication.errors import AuditError

BEGIN, END = "<!-- results: begin, written by `make readme` -->", "<!-- results: end -->"
BADGES = "docs/badges"


def results_block(results: ResultsFile) -> str:
    """Markdown: how many claims are proved, and of each paper its badge, its result and what explains it."""
    papers, told = {paper.key: paper for paper in results.papers}, briefs(results)
    said = {name: re.findall(r"<title>(.*?)</title>", svg) for name, svg in badges(results, BADGES, "claims").items()}
    image = {Path(name).stem: f"![{title}]({name})" for name, (title,) in said.items()}
    lines = [
        f"- **{papers[key].cited}** {image[key]} {_line(papers[key], told.get(key))}" for key in standings(results)
    ]
    return "\n".join([BEGIN, "", *lines, "", f"{image['all']} {theorems(once(results.claims))}".strip(), "", END])


def replace_block(text: str, block: str, begin: str = BEGIN, end: str = END) -> str:
    """`text` with the part between the markers replaced; raises AuditError if the markers are not there once each."""
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise AuditError(f"the README must hold the lines {begin!r} and {end!r} once each, in this order")
    return text[: text.index(begin)] + block + text[text.index(end) + len(end) :]


def is_stale(readme: Path, results: ResultsFile) -> bool:
    """Whether the file has a part that comes from a run, and it is not of these results."""
    text = readme.read_text(encoding="utf-8") if readme.is_file() else ""
    if BEGIN not in text:
        return False
    return replace_block(text, results_block(results)) != text


def _line(paper: PaperRecord, told: BriefView | None) -> str:
    """What the opening of the report says of the paper, without its links."""
    if told is None:
        return paper.findings[0] if paper.findings else ""
    return f"{told.headline.text}." if told.headline.text else told.card.text
