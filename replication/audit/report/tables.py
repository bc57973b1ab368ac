"""The tables of a paper: which cells are claims, how many of them agree, what a cell is called where it stands alone.

On a narrow screen each number has a line of its own, without the headings above and beside it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from replication.audit.judge.verdict import AGREES
from replication.audit.model import Policy, Verdict
from replication.audit.parts import Table
from replication.audit.report.claim import ClaimView
from replication.audit.report.templates import CLAIM_CELL, claim_of

_NUMBERS = re.compile(r"[\d\s.,()]+")
"""A heading that says nothing without the name of what is counted."""

_CORRECTED = {Policy.ERRATUM, Verdict.REPRODUCED_AFTER_ERRATUM}


@dataclass(frozen=True, kw_only=True)
class CellView:
    """A text, or a claim with the headings of its row and its column; a row of a table begins with its heading.

    printed, ours: what stands in the paper, and what that means if it holds, where a claim prints no number.
    """

    text: str = ""
    printed: str = ""
    ours: str = ""
    claim: ClaimView | None = None
    headings: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class TableView:
    """A table with its claims in place.

    numbers: how many entries print one that has a verdict. agree: how many of these agree to the last digit,
    `corrected` of them once a misprint is; `chosen` more, not to the last digit, under an assumption of ours.
    unsettled: how many entries are undetermined.
    """

    record: Table
    rows: tuple[tuple[CellView, ...], ...]
    numbers: int
    agree: int
    chosen: int
    corrected: int
    unsettled: int


def table_view(table: Table, claims: Mapping[str, ClaimView]) -> TableView:
    """The table; claims: those of its paper, by id."""
    rows = tuple(tuple(_cells(table.header, row, claims)) for row in table.rows)
    shown = [cell.claim for row in rows for cell in row if cell.claim is not None]
    judged = [v for v in shown if v.record.claim.printed and v.record.verdict is not Verdict.UNDETERMINED]
    holding = [view for view in judged if view.record.verdict in AGREES]
    # Of a draw no digit agrees: it is only probable enough.
    exact = [view for view in holding if view.meant or (view.entries and all(entry.inside for entry in view.entries))]
    return TableView(
        record=table,
        rows=rows,
        numbers=len(judged),
        agree=len(exact),
        chosen=len(holding) - len(exact),
        corrected=sum(bool(_CORRECTED & {view.record.verdict, *view.record.judgement.policies}) for view in exact),
        unsettled=sum(view.record.verdict is Verdict.UNDETERMINED for view in shown),
    )


def _cells(header: tuple[str, ...], row: tuple[str, ...], claims: Mapping[str, ClaimView]) -> Iterator[CellView]:
    down, _, across = header[0].partition("\\") if "\\" in header[0] else (header[0], "", header[0])
    for place, cell in enumerate(row):
        if cell.startswith(CLAIM_CELL):
            beside = () if row[0].startswith(CLAIM_CELL) else (named(down, row[0]),)
            above = (named(across, header[place]),) if place else ()
            _, printed, ours = (*cell.split("|"), "", "")[:3]
            headings = tuple(filter(None, (*beside, *above)))
            yield CellView(claim=claims[claim_of(cell)], headings=headings, printed=printed, ours=ours)
        else:
            yield CellView(text=cell)


def named(name: str, heading: str) -> str:
    """A heading with the name of what it counts, if it is nothing but numbers: "K = 2", "Example 1"."""
    name, heading = name.strip(), heading.strip()
    if not name or not _NUMBERS.fullmatch(heading):
        return heading
    return f"{name} {heading}" if name.isalpha() and len(name) > 1 else f"{name} = {heading}"
