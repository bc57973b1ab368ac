"""All claims in one picture: a row for each paper, a column for each consequence, the worst first in each cell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from replication.audit.brief import Consequence
from replication.audit.model import Verdict
from replication.audit.report.claim import ClaimView
from replication.audit.report.paper import PaperView
from replication.audit.store.records import PaperRecord

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
PROMISES = (Consequence.THEOREM, Consequence.HEADLINE)
STANDS = (Verdict.REPRODUCED, Verdict.CONSISTENT, Verdict.REPRODUCED_AFTER_ERRATUM)
MOST_PLACES = 3
MOST_NAMES = 2
"""Papers with a failing guarantee that the answer names."""
_WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")


@dataclass(frozen=True, kw_only=True)
class Cell:
    """The claims of a paper of one consequence, repeats aside, of which there are `repeats`; places: where the failing
    ones stand.
    """

    consequence: Consequence
    marks: tuple[ClaimView, ...]
    places: tuple[str, ...]
    repeats: int


@dataclass(frozen=True, kw_only=True)
class Lane:
    """One paper. promises: whether a theorem or guarantee of it is among the claims; broken: whether one of them fails;
    sound: whether it has some, and all hold.

    corrected: whether one of them holds only once an erratum is corrected. open: whether one of them, or a headline
    statement, holds under one reading of the text and fails under another.
    """

    paper: PaperView
    cells: tuple[Cell, ...]
    promises: bool
    broken: bool
    sound: bool
    corrected: bool
    open: bool


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
        ("No central guarantee is refuted", tuple(lane for lane in lanes if lane.promises and not lane.broken)),
        ("Printed results, no theorem", tuple(lane for lane in lanes if not lane.promises)),
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
    if not any(lane.promises for lane in judged):
        return _tally([view.record.verdict for lane in judged for cell in lane.cells for view in cell.marks])
    others = [lane for lane in judged if not lane.broken]
    whole, rest = len(judged), len(others)
    if not others:
        whose = "the paper" if whole == 1 else "both papers" if whole == 2 else f"all {_count(whole)} papers"
        return f"In {whose} a central guarantee fails."
    if rest == whole:
        where = "in the paper" if whole == 1 else "in the papers"
        sentence = _said_of(others, "no central guarantee", where)
        return f"{sentence[0].upper()}{sentence[1:]}."
    failing = [lane.paper.record for lane in judged if lane.broken]
    which = " and ".join(_authors(record) for record in failing)
    if len(failing) > MOST_NAMES:
        which = f"{_count(len(failing))} of {_count(whole)} papers"
    where = "in the other" if rest == 1 else "in the others"
    return f"In {which} a central guarantee fails; {_said_of(others, 'none', where)}."


def _tally(verdicts: Sequence[Verdict]) -> str:
    """How many results come out, where there is no theorem to speak of."""
    counted = Counter(verdicts)
    printed = counted[Verdict.REPRODUCED] + counted[Verdict.CONSISTENT]
    corrected, failing = counted[Verdict.REPRODUCED_AFTER_ERRATUM], sum(counted[verdict] for verdict in FAILS)
    failed = counted[Verdict.ERROR]
    chosen, unsettled = counted[Verdict.COMPATIBLE], counted[Verdict.UNDETERMINED]
    parts = [
        f"{printed} of {len(verdicts)} results come{'s' if printed == 1 else ''} out as printed",
        f"{_count(corrected)} after an erratum" if corrected else "",
        f"{_count(chosen)} as compatible" if chosen else "",
        f"{_count(failing)} {'does' if failing == 1 else 'do'} not" if failing else "none fails",
        f"{_count(unsettled)} stay{'s' if unsettled == 1 else ''} open" if unsettled else "",
        f"{_count(failed)} ended in an error" if failed else "",
    ]
    return f"{', '.join(filter(None, parts))}."


def _said_of(lanes: Sequence[Lane], none: str, where: str) -> str:
    """What is true of papers of which no guarantee fails; that none is refuted does not say that all hold."""
    corrected, unsettled = any(lane.corrected for lane in lanes), [lane.paper.record for lane in lanes if lane.open]
    said = f"{where} {none} is refuted{' once corrected' if corrected else ''}"
    if all(lane.sound for lane in lanes):
        said = (
            f"every theorem passes our tests {where}{', some only once misprints are corrected' if corrected else ''}"
        )
    if not unsettled:
        return said
    whose = _authors(unsettled[0]) if len(unsettled) == 1 else f"{_count(len(unsettled))} of them"
    return f"{said}; that of {whose} depends on the reading"


def _authors(record: PaperRecord) -> str:
    return record.cited.partition(" (")[0]


def _count(number: int) -> str:
    return _WORDS[number] if number < len(_WORDS) else str(number)


def _lane(paper: PaperView) -> Lane:
    cells = tuple(_cell(paper, kind) for kind in Consequence)
    promised = [view for cell in cells for view in cell.marks if cell.consequence in PROMISES]
    theorems = [view.record for view in promised if view.consequence is Consequence.THEOREM]
    verdicts = [record.verdict for record in theorems]
    return Lane(
        paper=paper,
        cells=cells,
        promises=bool(theorems),
        broken=any(verdict in FAILS for verdict in verdicts),
        sound=bool(theorems) and all(verdict in STANDS for verdict in verdicts),
        corrected=any(record.claim.erratum and record.verdict not in FAILS for record in theorems),
        open=any(map(_depends_on_the_reading, promised)),
    )


def _depends_on_the_reading(view: ClaimView) -> bool:
    record = view.record
    return record.verdict is Verdict.UNDETERMINED and {True, False} <= {one.holds for one in record.evidence.outcomes}


def _cell(paper: PaperView, kind: Consequence) -> Cell:
    listed = [view for view in paper.claims if view.consequence is kind]
    own = (view for view in listed if view.record.counted)
    marks = tuple(sorted(own, key=lambda view: ORDER.index(view.record.verdict)))
    failing = [view.record.claim.place for view in marks if view.record.verdict in FAILS]
    places = dict.fromkeys(place.partition(";")[0].partition(",")[0].strip() for place in failing)
    return Cell(consequence=kind, marks=marks, places=tuple(places)[:MOST_PLACES], repeats=len(listed) - len(marks))
