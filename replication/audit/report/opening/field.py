"""All claims in one picture: a row for each paper, a column for each consequence, the worst first in each cell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from replication.audit.brief import Consequence
from replication.audit.model import Verdict
from replication.audit.report.claim import ClaimView
from replication.audit.report.paper import PaperView

ORDER = (
    Verdict.ERROR,
    Verdict.REFUTED,
    Verdict.DIFFERS,
    Verdict.REPRODUCED_AFTER_ERRATUM,
    Verdict.COMPATIBLE,
    Verdict.REPRODUCED,
    Verdict.CONSISTENT,
    Verdict.UNDETERMINED,
)
"""Order of the marks in a cell: what does not stand, what does, what nobody can tell."""

FAILS = (Verdict.REFUTED, Verdict.DIFFERS)
STANDS = (Verdict.REPRODUCED, Verdict.CONSISTENT, Verdict.REPRODUCED_AFTER_ERRATUM)
MOST_PLACES = 3
MOST_NAMES = 2
"""Papers with a failing guarantee that the answer names."""
_WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")


@dataclass(frozen=True, kw_only=True)
class Cell:
    """The claims of a paper of one consequence, repeats aside; places: where the failing ones stand."""

    consequence: Consequence
    marks: tuple[ClaimView, ...]
    places: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Lane:
    """One paper. broken: whether a theorem or guarantee of it fails; sound: whether it has some, and all hold.

    corrected: whether one of them holds only once a misprint is corrected.
    """

    paper: PaperView
    cells: tuple[Cell, ...]
    broken: bool
    sound: bool
    corrected: bool


@dataclass(frozen=True, kw_only=True)
class Field:
    """The answer in a sentence, the rows in two groups with their headings, and how many fail by consequence."""

    answer: str
    groups: tuple[tuple[str, tuple[Lane, ...]], ...]
    columns: tuple[Consequence, ...]
    failing: int
    failures: tuple[tuple[Consequence, int], ...]


def field(papers: Sequence[PaperView]) -> Field:
    """The picture of all papers, those with a failing guarantee first."""
    lanes = [_lane(paper) for paper in papers]
    failures = Counter(
        cell.consequence for lane in lanes for cell in lane.cells for view in cell.marks if view.record.verdict in FAILS
    )
    columns = tuple(
        kind for kind in Consequence if any(c.marks for lane in lanes for c in lane.cells if c.consequence is kind)
    )
    groups = (
        ("A central guarantee fails", tuple(lane for lane in lanes if lane.broken)),
        ("No central guarantee fails", tuple(lane for lane in lanes if not lane.broken)),
    )
    return Field(
        answer=answer(lanes),
        groups=tuple(group for group in groups if group[1]),
        columns=columns,
        failing=failures.total(),
        failures=tuple((kind, failures[kind]) for kind in Consequence if failures[kind]),
    )


def answer(lanes: Sequence[Lane]) -> str:
    """What comes out, in one sentence: in which papers a guarantee fails, and what is true of the others."""
    judged = [lane for lane in lanes if any(cell.marks for cell in lane.cells)]
    if not judged:
        return "There is no claim to judge."
    broken = sum(lane.broken for lane in judged)
    whole, rest = len(judged), len(judged) - broken
    others = [lane for lane in judged if not lane.broken]
    corrected = any(lane.corrected for lane in others)
    sound = f"every theorem passes our tests{', some only once misprints are corrected' if corrected else ''}"
    if not all(lane.sound for lane in others):
        sound = f"no theorem fails{' once misprints are corrected' if corrected else ''}"
    whose = "the paper" if whole == 1 else "both papers" if whole == 2 else f"all {_count(whole)} papers"
    if not broken:
        return f"In {whose} {sound}."
    if not rest:
        return f"In {whose} a central guarantee fails."
    where = "the other paper" if rest == 1 else f"the other {_count(rest)} papers"
    names = " and ".join(lane.paper.record.cited.replace(" (undated)", "") for lane in judged if lane.broken)
    which = names if broken <= MOST_NAMES else f"{_count(broken)} of {_count(whole)} papers"
    return f"In {which} a central guarantee fails; in {where} {sound}."


def _count(number: int) -> str:
    return _WORDS[number] if number < len(_WORDS) else str(number)


def _lane(paper: PaperView) -> Lane:
    cells = tuple(_cell(paper, kind) for kind in Consequence)
    theorems = [view.record.verdict for cell in cells for view in cell.marks if cell.consequence is Consequence.THEOREM]
    return Lane(
        paper=paper,
        cells=cells,
        broken=any(verdict in FAILS for verdict in theorems),
        sound=bool(theorems) and all(verdict in STANDS for verdict in theorems),
        corrected=Verdict.REPRODUCED_AFTER_ERRATUM in theorems,
    )


def _cell(paper: PaperView, kind: Consequence) -> Cell:
    own = (view for view in paper.claims if view.consequence is kind and not view.record.claim.repeats)
    marks = tuple(sorted(own, key=lambda view: ORDER.index(view.record.verdict)))
    failing = [view.record.claim.place for view in marks if view.record.verdict in FAILS]
    places = dict.fromkeys(place.partition(";")[0].partition(",")[0].strip() for place in failing)
    return Cell(consequence=kind, marks=marks, places=tuple(places)[:MOST_PLACES])
