"""The part of the README that comes from a run: verdicts per paper and what the audit found, between two markers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from replication.audit.inspect.headline import theorems
from replication.audit.judge.policies import once
from replication.audit.model import Verdict
from replication.audit.store.records import ResultsFile, read_results
from replication.errors import AuditError
from replication.files import write_atomically

SHOWN_FINDINGS = 4
"""Findings per paper in the README, the first ones; the report has all."""
BEGIN, END = "<!-- results: begin, written by `make readme` -->", "<!-- results: end -->"


def results_block(results: ResultsFile) -> str:
    """Markdown: verdicts per paper as a table, how many claims are proved, the first findings of each paper."""
    proved = theorems(once(results.claims))
    return "\n".join([BEGIN, "", *_table(results), "", *([proved, ""] if proved else []), *_findings(results), END])


def replace_block(text: str, block: str) -> str:
    """`text` with the part between the markers replaced; raises AuditError if the markers are not there once each."""
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise AuditError(f"the README must hold the lines {BEGIN!r} and {END!r} once each, in this order")
    return text[: text.index(BEGIN)] + block + text[text.index(END) + len(END) :]


def is_stale(readme: Path, results: ResultsFile) -> bool:
    """Whether the file has a part that comes from a run, and not from these results."""
    text = readme.read_text(encoding="utf-8") if readme.is_file() else ""
    return BEGIN in text and replace_block(text, results_block(results)) != text


def update(readme: Path, results: Path) -> None:
    """Write the results of a run into the README."""
    text = replace_block(readme.read_text(encoding="utf-8"), results_block(read_results(results)))
    write_atomically(readme, text.encode())


def _table(results: ResultsFile) -> Iterator[str]:
    shown = [verdict for verdict in Verdict if verdict is not Verdict.ERROR]
    yield "| Paper | claims | " + " | ".join(shown) + " |"
    yield "| --- " + "| ---: " * (len(shown) + 1) + "|"
    for paper in results.papers:
        claims = [claim for claim in once(results.claims) if claim.paper == paper.key]
        counts = Counter(claim.verdict for claim in claims)
        numbers = " | ".join(str(counts[verdict]) for verdict in shown)
        yield f"| {_cell(paper.cited)} | {counts.total()} | {numbers} |"


def _findings(results: ResultsFile) -> Iterator[str]:
    for paper in results.papers:
        yield f"**{paper.cited}**"
        yield ""
        yield from (f"- {finding}" for finding in paper.findings[:SHOWN_FINDINGS])
        yield ""
        if paper.readings:
            count = len(paper.readings)
            yield f"Where the text leaves a choice, the claims name one of {count} readings; the report lists them."
            yield ""


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    root = Path(__file__).resolve().parents[3]
    update(root / "README.md", root / "report" / "results.json")
