"""The answer in a sentence, and all claims in one picture: a row for each paper, a column for each consequence."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from replication.audit.brief import Consequence
from replication.audit.inspect.headline import Tally, tally
from replication.audit.model import Verdict
from replication.audit.report.claim import FAILS, ClaimView, Standing, standing
from replication.audit.report.paper import PaperView
from replication.errors import listed

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
_WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
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
    """The answer in a sentence, the rows, and how the claims add up."""

    answer: str
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
    own = [view.record for paper in papers for view in paper.claims if view.record.counted]
    return Field(
        answer=answer(
            [lane.standing for lane in lanes], tally(own), _whose(lanes, True), _whose(lanes, False), _mended(lanes)
        ),
        lanes=tuple(lanes),
        columns=columns,
        tally=tally(own),
    )


def _whose(lanes: Sequence[Lane], broken: bool) -> str:
    """The papers of which a theorem fails, or only other results do, and what it is if it is one."""
    chosen = [lane for lane in lanes if bool(lane.standing.broken) is broken and lane.failing]
    if len(chosen) == 1 and (chosen[0].standing.broken if broken else chosen[0].standing.failing) == 1:
        word, named = chosen[0].failing[0][0], chosen[0].paper.record.named
        return f"The {word} guarantee of {named}" if broken else f"{named} ({word})"
    named = ", ".join(lane.paper.record.named for lane in chosen)
    return f"A guarantee of {'each of ' * (len(chosen) > 1)}{named}" if broken else named


def _mended(lanes: Sequence[Lane]) -> str:
    """The papers of which a theorem holds once it is corrected."""
    return listed([lane.paper.record.named for lane in lanes if lane.standing.corrected and not lane.standing.broken])


def answer(papers: Sequence[Standing], found: Tally, false: str = "", off: str = "", mended: str = "") -> str:
    """The answer in one or two sentences: which theorems are false, and what is true of the other papers.

    Where there is no theorem to speak of, how many results hold. false: whose theorem fails; off: where
    there is none, those of which other results do; mended: those of which a theorem holds once corrected.
    """
    judged = [paper for paper in papers if paper.claims]
    if not judged:
        return "There is no claim to judge."
    if not any(paper.theorems for paper in judged):
        number = sum(found.numbers.values()) + found.timed
        return f"Of {number} result{'s' * (number != 1)}, {found.words}."
    others = [paper for paper in judged if not paper.broken]
    whole = f"all {count(len(judged))} papers" if len(judged) > 2 else ("both papers", "the paper")[len(judged) == 1]
    if len(others) == len(judged):
        return _of_others(others, whole, mended, off)
    refuted = all(paper.refuted for paper in judged if paper.broken)
    first = f"{false} {'is false' if refuted else 'fails'}."
    rest = "the other paper" if len(others) == 1 else f"the other {count(len(others))} papers"
    return f"{first} {_of_others(others, rest, mended)}" if others else first


def _of_others(papers: Sequence[Standing], whose: str, mended: str, off: str = "") -> str:
    """What is true of papers of which no theorem fails; that none is refuted does not say that all hold."""
    failing = sum(paper.failing for paper in papers)
    sound = all(paper.sound for paper in papers) and not failing
    said = f"{'Every' if sound else 'No'} theorem of {whose} {'passes our tests' if sound else 'is refuted'}"
    if mended:
        said = f"Theorems of {whose} survive our tests, some of {mended} once corrected"
    differ = f"; {count(failing)} result{'' if failing == 1 else 's'} of {off} differ{'s' * (failing == 1)}"
    return f"{said}{differ * bool(off)}."


def count(number: int) -> str:
    """A small number as a word."""
    return _WORDS[number] if number < len(_WORDS) else str(number)


def _cell(paper: PaperView, kind: Consequence) -> Cell:
    listed = [view for view in paper.claims if view.consequence is kind]
    own = [view for view in listed if view.record.counted]
    timed = [view for view in own if view.record.timed]
    marks = sorted((view for view in own if view not in timed), key=lambda view: ORDER.index(view.record.verdict))
    failing: dict[tuple[str, Verdict], list[ClaimView]] = defaultdict(list)
    for view in marks:
        if view.record.verdict in FAILS:
            failing[_named(view), view.record.verdict].append(view)
    return Cell(
        consequence=kind,
        marks=tuple(marks),
        timed=tuple(timed),
        failing=tuple(
            (_named(found[0], alone=len(found) == 1), len(found), verdict) for (_, verdict), found in failing.items()
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
