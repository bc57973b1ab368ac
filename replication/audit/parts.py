"""The parts of a paper beside its claims, as frozen data: figures, tables, scope, formulas; and the paper itself.

What reaches the disk is a `msgspec.Struct`; what holds a function beside it stays in memory.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec

from replication.audit.brief import Brief
from replication.audit.model import Claim, Erratum, Experiment, Reading
from replication.audit.model import Results as Results
from replication.audit.people import Reply
from replication.errors import AuditError


@dataclass(frozen=True, kw_only=True)
class FigureData:
    """Columns of numbers behind a figure: what the CSV holds and `plot` draws. Columns may differ in length."""

    columns: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure in three steps: `data` reads results, `plot` draws data on matplotlib axes, `alt` says it in words.

    name: file name without suffix, for example `okajima2023-fig2`. published: whether it redraws a figure of the paper.
    title is the message, a text or a function of the data that finds its numbers there; it has few words. plot returns
    a `matplotlib.figure.Figure`; alt returns text with numbers taken from the data.
    """

    name: str
    place: str
    title: str | Callable[[FigureData], str]
    caption: str
    published: bool
    uses: tuple[str, ...]
    data: Callable[[Results], FigureData]
    plot: Callable[[FigureData], Any]
    alt: Callable[[FigureData], str]


class ScopeItem(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One part of the paper: audited by `claims` (ids) and `figures` (names), or left out for `reason`."""

    part: str
    claims: tuple[str, ...] = ()
    figures: tuple[str, ...] = ()
    reason: str = ""


class Coverage(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How many numerals, or numbered items, of a text are bound, excused with a reason, or neither.

    aside: those that only number, name or furnish the text, and are not in the total; see `inspect.coverage`.
    """

    text: str
    of: str
    total: int
    bound: int
    excused: int
    open: int
    aside: int


CELL = "claim:"
"""How the cell of a table begins that stands for a claim."""


class Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of the paper in its own shape: each cell is text or, as `claim:ID`, stands for that claim.

    `claim:ID|–|unstable` says what the paper prints, and what that means if the claim, which prints no number, holds.
    """

    place: str
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        if odd := next((row for row in self.rows if self.header and len(row) != len(self.header)), None):
            raise AuditError(f"table {self.place!r}: the row {odd!r:.80} has not as many cells as the header")

    @property
    def claims(self) -> tuple[str, ...]:
        """The ids of the claims that its cells stand for."""
        cells = (cell for row in self.rows for cell in row if cell.startswith(CELL))
        return tuple(cell.removeprefix(CELL).partition("|")[0] for cell in cells)


class Formula(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A formula that the report shows: `latex` is rendered as MathML, `text` says what it is."""

    text: str
    latex: str

    def __post_init__(self) -> None:
        braces = re.findall(r"(?<!\\)[{}]", self.latex)
        if braces.count("{") != braces.count("}"):
            raise AuditError(f"formula {self.text!r}: in {self.latex!r} a brace is missing")


class Sensitivity(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The result behind a claim at the printed value of a parameter, and at both ends of that print's rounding.

    claim: its id. parameter, printed: the parameter and the number printed for it. None where there is no result.
    """

    claim: str
    parameter: str
    printed: str
    base: float
    low: float | None
    high: float | None


class CommonLevel(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What an estimator of the paper reaches on the plant that all papers share, as a bracket.

    sensor: how it measures, with the multiple m in words. multiple: m, in base periods; 1 is the ideal sensor.
    measure: what the numbers are. lower, upper: equal where the value is exact.
    """

    sensor: str
    multiple: int
    lower: float
    upper: float
    measure: str


class StatedPaper(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is said of a source paper; year is None if the text gives none, coverage is of each of its texts.

    notebook: name of its tutorial, if it has one. brief: what leads the report on it. orcids: of the authors, by name,
    where they are known. replies: of the authors, to claims.
    """

    key: str
    title: str
    authors: tuple[str, ...]
    year: int | None
    venue: str
    doi: str
    summary: str
    bibtex: str
    notebook: str = ""
    formulas: tuple[Formula, ...] = ()
    tables: tuple[Table, ...] = ()
    scope: tuple[ScopeItem, ...] = ()
    coverage: tuple[Coverage, ...] = ()
    readings: tuple[Reading, ...] = ()
    brief: Brief | None = None
    orcids: dict[str, str] = {}
    replies: tuple[Reply, ...] = ()


class Paper(StatedPaper, frozen=True, kw_only=True):
    """A source paper as this package audits it.

    `findings` turns results into sentences that lead the paper's page, `sensitivity` into how far claims move while
    printed parameters move within their rounding, `common` into what its estimators reach on the common plant. All
    functions have results, and claims of a sensitivity, by their names without the key of the paper.
    """

    experiments: tuple[Experiment, ...]
    claims: tuple[Claim, ...]
    errata: tuple[Erratum, ...] = ()
    figures: tuple[Figure, ...] = ()
    findings: Callable[[Results], tuple[str, ...]] = lambda results: ()
    sensitivity: Callable[[Results], tuple[Sensitivity, ...]] = lambda results: ()
    common: Callable[[Results], tuple[CommonLevel, ...]] = lambda results: ()

    def short(self, name: str) -> str:
        """The name of an experiment as the functions know it."""
        return name.removeprefix(f"{self.key}.")
