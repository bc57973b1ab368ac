"""What the report shows of one paper: its record with counts, claims, tables, figures and errata."""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from markupsafe import Markup

from replication.audit.brief import Consequence, Explorer
from replication.audit.inspect.headline import Tally, counts, grouped, tally
from replication.audit.judge.agreement import Target
from replication.audit.judge.policies import once
from replication.audit.model import DISAGREES, Kind, Reading, Verdict
from replication.audit.parts import CELL, Table
from replication.audit.report.claim import MEANING, ClaimView, Standing, standing, views
from replication.audit.report.evidence import Ladder, ladders
from replication.audit.report.explore import PictureView, explorers
from replication.audit.report.templates import mathml
from replication.audit.store.records import ErratumRecord, FigureRecord, PaperRecord, ResultsFile
from replication.drawing.panels import inner, with_classes
from replication.errors import AuditError
from replication.files import sha256

_NUMBERS = re.compile(r"[\d\s.,()]+")
"""A heading that says nothing without the name of what is counted."""


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

    numbers: of the entries that print one, neither a run time nor a draw, how many have each verdict. drawn: how many
    print a draw. counts: how many entries have each verdict, as their marks say. timed: how many print a run time of
    another computer.
    """

    record: Table
    rows: tuple[tuple[CellView, ...], ...]
    numbers: Mapping[Verdict, int]
    drawn: int
    counts: Mapping[Verdict, int]
    timed: int


def table_view(table: Table, claims: Mapping[str, ClaimView]) -> TableView:
    """The table; claims: those of its paper, by id."""
    rows = tuple(tuple(_cells(table.header, row, claims)) for row in table.rows)
    shown = [cell.claim for row in rows for cell in row if cell.claim is not None]
    printed = [view for view in shown if view.record.claim.printed and not view.record.timed]
    # Of a draw no digit can agree: it is only probable enough.
    judged = [view for view in printed if view.record.claim.kind is not Kind.STATISTICAL]
    return TableView(
        record=table,
        rows=rows,
        numbers={verdict: sum(view.record.verdict is verdict for view in judged) for verdict in Verdict},
        drawn=len(printed) - len(judged),
        counts={verdict: sum(v.record.verdict is verdict and not v.record.timed for v in shown) for verdict in Verdict},
        timed=sum(view.record.timed for view in shown),
    )


def _cells(header: tuple[str, ...], row: tuple[str, ...], claims: Mapping[str, ClaimView]) -> Iterator[CellView]:
    down, _, across = header[0].partition("\\") if "\\" in header[0] else (header[0], "", header[0])
    for place, cell in enumerate(row):
        if cell.startswith(CELL):
            beside = () if row[0].startswith(CELL) else (named(down, row[0]),)
            above = (named(across, header[place]),) if place else ()
            name, printed, ours = (*cell.removeprefix(CELL).split("|"), "", "")[:3]
            headings = tuple(filter(None, (*beside, *above)))
            yield CellView(claim=claims[name], headings=headings, printed=printed, ours=ours)
        else:
            yield CellView(text=cell)


def named(name: str, heading: str) -> str:
    """A heading with the name of what it counts, if it is nothing but numbers: "K = 2", "Example 1"."""
    name, heading = name.strip(), heading.strip()
    if not name or not _NUMBERS.fullmatch(heading):
        return heading
    return f"{name} {heading}" if name.isalpha() and len(name) > 1 else f"{name} = {heading}"


@dataclass(frozen=True, kw_only=True)
class FigureView:
    """A figure with its drawing, and the rules of the classes in it; `error` in the record means that there is none."""

    record: FigureRecord
    view_box: str = ""
    drawing: str = ""
    styles: Mapping[str, str] = field(default_factory=dict)


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
    """The claims of a paper of one consequence, which is a column in the picture of all claims. timed: run times of
    another computer, which are one mark; repeats: how many claims say again what another one says. failing: what does
    not hold, in words, with its number and verdict.
    """

    consequence: Consequence
    marks: tuple[ClaimView, ...]
    timed: tuple[ClaimView, ...]
    failing: tuple[tuple[str, int, Verdict], ...]
    repeats: int


def cell_of(claims: Iterable[ClaimView], kind: Consequence) -> Cell:
    """What the picture of all claims has of a paper in the column of this consequence."""
    listed = [view for view in claims if view.consequence is kind]
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


@dataclass(frozen=True, kw_only=True)
class PaperView:
    """All that the report shows of one paper; cells: its row in the picture of all claims."""

    record: PaperRecord
    claims: tuple[ClaimView, ...]
    standing: Standing
    cells: tuple[Cell, ...]
    counts: Mapping[Verdict, int]
    tally: Tally
    total: int
    proved: int
    figures: tuple[FigureView, ...]
    errata: tuple[ErratumRecord, ...]
    formulas: tuple[tuple[str, Markup], ...]
    ladders: tuple[Ladder, ...]
    explorers: tuple[tuple[Explorer, tuple[PictureView, ...]], ...]
    tables: tuple[TableView, ...]

    @property
    def rounded(self) -> tuple[ClaimView, ...]:
        """Claims that print a level above the least one, by no more than the accuracy of the solver."""
        return tuple(view for view in self.claims if view.record.counted and view.rounded)

    @property
    def printed(self) -> Tally:
        """How the numbers of its tables stand."""
        return grouped({verdict: sum(table.numbers[verdict] for table in self.tables) for verdict in Verdict})

    @property
    def sums(self) -> dict[str, int]:
        """The numbers that the headings of its parts say, which are sentences of `html/headings.html.j2`."""
        certain = sum(not erratum.inference and erratum.holds for erratum in self.errata)
        theirs = sum(figure.record.published for figure in self.figures)
        checked = sum(bool(item.claims) for item in self.record.scope)
        return {
            "numbers": sum(self.printed.numbers.values()),
            "draws": sum(table.drawn for table in self.tables),
            "ladders": len(self.ladders),
            "outside": sum(not ladder.inside for ladder in self.ladders),
            "errata": len(self.errata),
            "certain": certain,
            "inferred": len(self.errata) - certain,
            "slips": sum(erratum.scan for erratum in self.errata),
            "above": len(self.rounded),
            "theirs": theirs,
            "ours": len(self.figures) - theirs,
            "resting": len({v.record.id for listed in self.resting.values() for v in listed if v.record.counted}),
            "formulas": len(self.formulas),
            "checked": checked,
            "left": len(self.record.scope) - checked,
        }

    @property
    def readings(self) -> dict[str, Reading]:
        """What is assumed where the text leaves a choice, by name."""
        return {reading.name: reading for reading in self.record.readings}

    @property
    def resting(self) -> dict[str, tuple[ClaimView, ...]]:
        """The claims that rest on each reading, or have an outcome under it, by its name and in the paper's order."""
        listed = sorted(self.claims, key=lambda view: view.place)
        return {name: tuple(view for view in listed if name in view.record.rested) for name in self.readings}

    @property
    def by_consequence(self) -> tuple[tuple[str, tuple[ClaimView, ...]], ...]:
        """The claims, repeats included, by what hangs on them, each group with its title; remarks of ours come last."""
        theirs = [view for view in self.claims if not view.record.claim.ours]
        groups = [
            (MEANING[kind][0], tuple(view for view in theirs if view.consequence is kind)) for kind in Consequence
        ]
        groups.append(("Remarks of ours, not counted", tuple(view for view in self.claims if view.record.claim.ours)))
        return tuple(group for group in groups if group[1])

    @property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """Name and heading of each part that this paper has, in the order of the page; the name is its template."""
        present = {
            ("findings", "Findings"): self.record.findings,
            ("tables", "Tables"): self.tables,
            ("ladder", "How close"): self.ladders,
            ("explore", "Try it"): self.explorers,
            ("errata", "Corrections"): self.errata or self.rounded,
            ("claims", "All claims"): self.claims,
            ("figures", "Figures"): self.figures,
            ("readings", "Assumptions"): self.record.readings,
            ("formulas", "Formulas"): self.formulas,
            ("scope", "Scope"): self.record.scope,
        }
        return tuple(part for part, content in present.items() if content)


def paper_view(paper: PaperRecord, results: ResultsFile, figures: Path, read: Mapping[str, Target]) -> PaperView:
    """The paper with what `results` holds of it and the files in `figures`; raises AuditError as `page.render`.

    read: the `targets` of the claims.
    """
    claims = tuple(claim for claim in results.claims if claim.paper == paper.key)
    shown = views(claims, read)
    drawn = tuple(_figure(record, figures) for record in results.figures if record.paper == paper.key)
    names = [figure.record.name for figure in drawn if figure.drawing]
    return PaperView(
        record=paper,
        claims=shown,
        standing=standing(claims),
        cells=tuple(cell_of(shown, kind) for kind in Consequence),
        counts=counts(claims),
        tally=tally(claims),
        total=len(once(claims)),
        proved=sum(claim.judgement.proved for claim in once(claims)),
        figures=drawn,
        errata=tuple(erratum for erratum in results.errata if erratum.paper == paper.key),
        formulas=tuple((formula.text, mathml(formula.latex)) for formula in paper.formulas),
        ladders=ladders(paper, shown),
        explorers=explorers(paper, names, figures, shown),
        tables=tuple(table_view(table, {view.record.id: view for view in shown}) for table in paper.tables),
    )


def _figure(record: FigureRecord, directory: Path) -> FigureView:
    if record.error:
        return FigureView(record=record)
    drawing, table = directory / f"{record.name}.svg", directory / f"{record.name}.csv"
    for path in (drawing, table):
        if not path.is_file():
            raise AuditError(f"{path} is missing; make the figures with `python -m replication run`")
    if sha256(table) != record.csv_sha256:
        raise AuditError(f"{table} is not the data of these results; run `python -m replication run` again")
    view_box, content = inner(drawing.read_text(encoding="utf-8"))
    classed, styles = with_classes(content)
    return FigureView(record=record, view_box=view_box, drawing=Markup(classed), styles=styles)
