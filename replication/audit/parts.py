"""The parts of a paper beside its claims, as frozen data: figures, tables, scope, formulas, people; and the paper.

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


PLACEHOLDER = re.compile(r"FIXME|TODO|X{4,}|^TITLE$|\bA\. AUTHOR\b|\bIN A SENTENCE\b")
"""What a template or a form leaves to be filled in."""


def plain_orcid(text: str) -> str:
    """The identifier without an address in front; ValueError for one whose check digit (ISO 7064, 11-2) is wrong."""
    digits = text.removeprefix("https://orcid.org/")
    total = 0
    for digit in digits.replace("-", "")[:-1]:
        total = (total + int(digit)) * 2 if digit.isdigit() else 0
    check = "0123456789X"[(12 - total % 11) % 11]
    if not re.fullmatch(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]", digits) or digits[-1] != check:
        raise ValueError(f"the ORCID {text!r} is none; copy it from orcid.org, such as 0000-0002-1825-0097")
    return digits


class Named(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A person; orcid: the plain identifier, empty if it is not known."""

    name: str
    orcid: str = ""

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise ValueError("a name is empty; write it")
        if self.orcid and plain_orcid(self.orcid) != self.orcid:
            raise ValueError(f"the ORCID {self.orcid!r} has an address in front; write {plain_orcid(self.orcid)!r}")


class Reply(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the authors answer to the verdict on a claim; it is shown with the claim, and changes no verdict.

    claim: its id, without the key of the paper in `paper.toml`. by: who replies. date: such as 2026-11-24.
    """

    claim: str
    text: str
    by: str = ""
    date: str = ""

    def __post_init__(self) -> None:
        if not self.text.strip():
            raise ValueError(f"the reply to {self.claim!r} is empty; write what the authors say, or take it out")
        if self.date and not re.fullmatch(r"\d{4}-\d\d-\d\d", self.date):
            raise ValueError(f'the date {self.date!r} of a reply is none; write year, month and day, as "2026-11-24"')


class Codecheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What codecheck.yml says of a check, by the person who does it.

    paper: the key of the paper that is checked, if there are several. codechecker: who checks. certificate: the number
    that the register gave, such as 2026-001. report: address or DOI of the certificate. check_time: when it was done.
    summary: of the certificate; without one, how many claims agree.
    """

    paper: str = ""
    codechecker: tuple[Named, ...] = ()
    certificate: str = ""
    report: str = ""
    check_time: str = ""
    summary: str = ""

    def __post_init__(self) -> None:
        if self.certificate and not re.fullmatch(r"\d{4}-\d{3}", self.certificate):
            raise ValueError(
                f"the certificate {self.certificate!r} is no number of the register; write year and number, as 2026-001"
            )
        for name, text in (("report", self.report), ("summary", self.summary), ("check_time", self.check_time)):
            if PLACEHOLDER.search(text):
                raise ValueError(f"{name} = {text!r} is a placeholder; write what it stands for, or leave it out")


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
