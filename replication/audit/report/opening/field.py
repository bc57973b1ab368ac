"""The answer in a sentence, and all claims in one picture: a row for each paper, a column for each consequence."""

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from replication.audit.brief import Consequence
from replication.audit.inspect.headline import Tally, tally
from replication.audit.model import DISAGREES, Verdict
from replication.audit.report.claim import ClaimView, Standing, standing
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

MOST_PLACES = 3
_END = re.compile(r"(-\d+|\.[^.]*\d[^.]*)+$")
"""What numbers a claim among others of one name."""


@dataclass(frozen=True, kw_only=True)
class Cell:
    """The claims of a paper of one consequence. timed: run times of another computer, which are one mark; repeats: how
    many claims say again what another one says. failing: what does not hold, in words, with its number and verdict.
    """

    consequence: Consequence
    marks: tuple[ClaimView, ...]
    timed: tuple[ClaimView, ...]
    failing: tuple[tuple[str, int, Verdict], ...]
    repeats: int


@dataclass(frozen=True, kw_only=True)
class Lane:
    """One paper, with how it stands."""

    paper: PaperView
    cells: tuple[Cell, ...]
    standing: Standing

    @property
    def failing(self) -> tuple[tuple[str, int], ...]:
        """What does not hold, in words, each with its number."""
        return tuple((words, number) for cell in self.cells for words, number, _ in cell.failing)


@dataclass(frozen=True, kw_only=True)
class Field:
    """The rows, and how the claims add up.

    broken: the papers of which a theorem fails. off: those of which only other results do. mended: of which a theorem
    holds once corrected, and none fails.
    """

    broken: tuple[Lane, ...]
    off: tuple[Lane, ...]
    mended: tuple[Lane, ...]
    lanes: tuple[Lane, ...]
    columns: tuple[Consequence, ...]
    tally: Tally


def field(papers: Sequence[PaperView]) -> Field:
    """The picture of all papers, in their order."""
    lanes = [
        Lane(
            paper=paper,
            cells=tuple(_cell(paper, kind) for kind in Consequence),
            standing=standing(view.record for view in paper.claims),
        )
        for paper in papers
    ]
    filled = {cell.consequence for lane in lanes for cell in lane.cells if cell.marks or cell.timed}
    columns = tuple(kind for kind in Consequence if kind in filled)
    records = [view.record for paper in papers for view in paper.claims if view.record.counted]
    return Field(
        broken=tuple(lane for lane in lanes if lane.failing and lane.standing.broken),
        off=tuple(lane for lane in lanes if lane.failing and not lane.standing.broken),
        mended=tuple(lane for lane in lanes if lane.standing.corrected and not lane.standing.broken),
        lanes=tuple(lanes),
        columns=columns,
        tally=tally(records),
    )


def _cell(paper: PaperView, kind: Consequence) -> Cell:
    listed = [view for view in paper.claims if view.consequence is kind]
    counted = [view for view in listed if view.record.counted]
    timed = [view for view in counted if view.record.timed]
    marks = sorted((view for view in counted if view not in timed), key=lambda view: ORDER.index(view.record.verdict))
    failing: dict[tuple[str, Verdict], list[ClaimView]] = defaultdict(list)
    for view in marks:
        if view.record.verdict in DISAGREES:
            failing[_named(view), view.record.verdict].append(view)
    return Cell(
        consequence=kind,
        marks=tuple(marks),
        timed=tuple(timed),
        failing=tuple(
            (_named(views[0], alone=len(views) == 1), len(views), verdict) for (_, verdict), views in failing.items()
        )[:MOST_PLACES],
        repeats=sum(bool(view.record.claim.repeats) for view in listed),
    )


def _named(view: ClaimView, alone: bool = False) -> str:
    """A failing claim in words: the table that it is an entry of, or else what its name says; its number if alone."""
    if view.consequence is Consequence.TABLE:
        return view.record.claim.place.partition(";")[0].partition(",")[0].strip()
    name = view.record.id.partition(".")[2]
    numbered = _END.search(name) if alone else None
    name = _END.sub("", name).rpartition(".")[2] + (numbered[0] if numbered else "")
    return re.sub(r"[-.]", " ", name)
