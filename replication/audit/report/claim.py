"""What the report shows of a claim: its entries side by side, in the order of the paper."""

import contextlib
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import msgspec

from replication.audit.brief import Consequence
from replication.audit.judge import numerals
from replication.audit.judge.agreement import Target, rounds_to
from replication.audit.judge.policies import once
from replication.audit.judge.printed import Printed
from replication.audit.model import CORRECTED, DISAGREES, HOLDS, Kind, Policy, StatedClaim, Verdict
from replication.audit.report.entries import EntryView, side_by_side
from replication.audit.store.records import ClaimRecord
from replication.errors import AuditError

_NAMED = {
    Consequence.THEOREM: re.compile(r"(theorem|lemma|corollary|proposition|algorithm)s?\b", re.IGNORECASE),
    Consequence.TABLE: re.compile(r"(table|figs?\.|figure)\b|.*,\s+(table|figs?\.)$", re.IGNORECASE),
    Consequence.HEADLINE: re.compile(r"(abstract|conclusions?|introduction|blog|sec\. I)\b", re.IGNORECASE),
}
"""By what a place begins with, or is called; the first that fits."""
_FORMULA = re.compile(r".*parameters|eqs?\.|equations?\b", re.IGNORECASE)
_NUMBERS = (Kind.VALUE, Kind.BOUND, Kind.STATISTICAL)

MEANING = {
    Consequence.THEOREM: ("Theorems and guarantees", "what the paper proves or promises"),
    Consequence.HEADLINE: ("Headline results", "what its text leads with"),
    Consequence.TABLE: ("Table and figure entries", "single printed values"),
    Consequence.DIGIT: ("Other printed numbers", "counts, sizes, parameters"),
    Consequence.REMARK: ("Steps and remarks", "formulas, asides, citations"),
}


@dataclass(frozen=True, kw_only=True)
class Standing:
    """How a paper stands; claims that repeat a number are not counted.

    theorems: claims on its theorems and guarantees. refuted, broken: how many of these are false, or fail in any way.
    sound: whether there are some and all hold; corrected: whether one holds only once a misprint is corrected. open:
    whether one of them, or a headline result, holds under one reading of the text and fails under another. failing: of
    all claims. claims: how many there are.
    """

    theorems: int
    refuted: int
    broken: int
    sound: bool
    corrected: bool
    open: bool
    failing: int
    claims: int

    @property
    def outcome(self) -> tuple[str, Verdict | None, str]:
        """In words, with their tone before, and the verdict whose mark says the same, if any does."""
        if self.broken:
            return "fails", Verdict.REFUTED, "false guarantee" if self.refuted else "guarantee fails"
        if self.open:
            return "partly", None, "depends on the reading"
        if self.failing:
            return "partly", None, "one result differs" if self.failing == 1 else "results differ"
        if self.corrected:
            return "holds", Verdict.REPRODUCED_AFTER_ERRATUM, "holds once corrected"
        return "holds", Verdict.REPRODUCED, "nothing fails"

    @property
    def rank(self) -> tuple[bool, bool]:
        """The order of papers: first a false guarantee, then one that hangs on the reading, then the others."""
        return not self.broken, not self.open


def standing(claims: Iterable[ClaimRecord]) -> Standing:
    """How the paper with these claims stands."""
    records = once(tuple(claims))
    promised = [claim for claim in records if consequence(claim.claim) in (Consequence.THEOREM, Consequence.HEADLINE)]
    theorems = [claim for claim in promised if consequence(claim.claim) is Consequence.THEOREM]
    return Standing(
        theorems=len(theorems),
        refuted=sum(claim.verdict is Verdict.REFUTED for claim in theorems),
        broken=sum(claim.verdict in DISAGREES for claim in theorems),
        sound=bool(theorems) and all(claim.verdict in (*HOLDS, Verdict.REPRODUCED_AFTER_ERRATUM) for claim in theorems),
        corrected=any(claim.verdict is Verdict.REPRODUCED_AFTER_ERRATUM for claim in theorems),
        open=any(
            claim.verdict is Verdict.UNDETERMINED and {True, False} <= {item.holds for item in claim.evidence.outcomes}
            for claim in promised
        ),
        failing=sum(claim.verdict in DISAGREES for claim in records),
        claims=len(records),
    )


def consequence(claim: StatedClaim) -> Consequence:
    """The declared consequence; else the gravest by any place of the claim, of which a semicolon parts several."""
    if claim.consequence is not None:
        return claim.consequence
    if claim.kind is Kind.CITED:
        return Consequence.REMARK
    order = list(Consequence)
    return min((_by_place(claim, place.strip()) for place in claim.place.split(";")), key=order.index)


def _by_place(claim: StatedClaim, place: str) -> Consequence:
    if kinds := [kind for kind, form in _NAMED.items() if form.match(place)]:
        return kinds[0]
    if not claim.printed:
        return Consequence.REMARK
    # A level in the text is what a reader takes home; a count or an equation's matrix is not.
    level = claim.kind in _NUMBERS and "." in claim.printed and not _FORMULA.match(place)
    return Consequence.HEADLINE if level else Consequence.DIGIT


MOST_ENTRIES = 6
MOST_COLUMNS = 2
"""Entries that the line of a claim lists; a larger list or matrix is shown in full in the evidence."""

LARGE = 10
"""Ratio of a computed number to its print from which on it is told as such, and not in per cent."""


@dataclass(frozen=True, kw_only=True)
class ClaimView:
    """A claim as the report shows it; `entries` is empty where printed and computed cannot be set side by side.

    place: number of the claim in the order of the paper. residual: what the threshold of a statement is compared with.
    within: how many entries agree with the print. rows: the same entries as they stand in print, row by row,
    each a tuple of cells, each of one entry or, if complex, of two. meant: the same beside what is meant instead of a
    misprinted result, if the claim agrees with that. elsewhere: where the claim agrees under another reading than its
    own, what came out there, and the name of that reading.
    """

    record: ClaimRecord
    place: int
    entries: tuple[EntryView, ...]
    rows: tuple[tuple[tuple[EntryView, ...], ...], ...]
    meant: tuple[tuple[tuple[EntryView, ...], ...], ...]
    within: int
    residual: float | None
    consequence: Consequence
    off: tuple[float, str] | None
    elsewhere: tuple[str, str] | None

    @property
    def settled(self) -> str:
        """Why the claim may stand folded: it holds, or the text does not settle it; empty if it may not."""
        if self.record.unexpected:
            return ""
        if self.record.claim.kind is Kind.CITED:
            return "open"
        return "holds" if self.record.verdict in HOLDS else ""

    @property
    def printed(self) -> str:
        """The print in one line, or how many numbers it has."""
        return self.record.claim.printed if self.in_row or len(self.entries) < 2 else f"{len(self.entries)} numbers"

    @property
    def ours(self) -> str:
        """What came out, in one line."""
        evidence = self.record.evidence
        if self.in_row:
            cells = ("".join(e.sign[1] + e.head + e.tail for e in cell) + "i" * (len(cell) == 2) for cell in self.cells)
            return ", ".join(cells)
        if self.entries:
            return f"{self.within} of {len(self.entries)} agree"
        if evidence.value is not None and self.record.claim.printed:
            return numerals.layout(evidence.value)
        if evidence.probability is not None:
            return f"probability {numerals.short(evidence.probability, 3)}"
        holding, among = self.record.judgement.readings
        if self.record.verdict is Verdict.UNDETERMINED and 0 < holding < among:
            return f"holds under {holding} of {among} readings"
        if evidence.holds is not None:
            return "holds" if evidence.holds else "does not hold"
        return f"{len(evidence.outcomes)} readings" if evidence.outcomes else ""

    @property
    def rounded(self) -> str:
        """What a print should say that agrees only because a solver stops above the optimum; empty for any other."""
        value = self.record.evidence.value
        if Policy.SOLVER not in self.record.judgement.policies or not isinstance(value, int | float):
            return ""
        printed, rounded = rounds_to(self.record.claim.printed, value)
        return numerals.exact(rounded) if rounded != printed else ""

    @property
    def cells(self) -> Iterator[tuple[EntryView, ...]]:
        """The cells of the rows, one after the other."""
        return (cell for row in self.rows for cell in row)

    @property
    def in_row(self) -> bool:
        """Whether the row lists all entries."""
        return 0 < len(self.entries) <= MOST_ENTRIES and max(map(len, self.rows)) <= MOST_COLUMNS


def targets(claims: Iterable[ClaimRecord]) -> dict[str, Target]:
    """What each claim that prints numbers stands for, by its id: here the report reads its printed values, once."""
    numbers = {}
    for record in claims:
        if record.claim.printed:
            # A statement may print what is no number; the verdict of any other such claim is `error`.
            with contextlib.suppress(AuditError):
                numbers[record.id] = Target.judged(record.claim, record.judgement)
    return numbers


def views(claims: Iterable[ClaimRecord], read: Mapping[str, Target]) -> tuple[ClaimView, ...]:
    """The claims of one paper as they stand in it; read: their `targets`."""
    return tuple(_view(place, record, read.get(record.id)) for place, record in enumerate(claims))


def anchor(kind: str, name: str) -> str:
    """An id for `name` that is unique, readable and valid in HTML and in a URL, whatever characters the name has."""
    return f"{kind}-" + re.sub(r"[^A-Za-z0-9.-]", lambda match: f"_{ord(match.group()):x}_", name)


def _view(place: int, record: ClaimRecord, target: Target | None) -> ClaimView:
    evidence = record.evidence
    entries: tuple[EntryView, ...] = ()
    if target is not None and evidence.value is not None:
        # The verdict of a claim whose numbers do not fit is `error`, and its reason says what does not.
        with contextlib.suppress(AuditError, OverflowError, ValueError):
            entries = side_by_side(target, evidence)
    if record.timed:
        entries = tuple(map(_timed, entries))
    return ClaimView(
        record=record,
        place=place,
        entries=entries,
        rows=_rows(target.printed, entries) if target is not None and entries else (),
        meant=_meant(record),
        within=sum(entry.inside for entry in entries),
        residual=None
        if evidence.threshold is None or evidence.margin is None
        else evidence.threshold - evidence.margin,
        consequence=consequence(record.claim),
        off=_off(target, record),
        elsewhere=_elsewhere(target, record, entries),
    )


def _timed(entry: EntryView) -> EntryView:
    """Seconds of two computers: two digits, or all before the point, none of which agrees or differs."""
    seconds = float(entry.full.replace(numerals.MINUS, "-"))
    shown = round(seconds) if seconds >= 100 else float(f"{seconds:.2g}")
    return replace(entry, head=numerals.short(shown), tail="", agreed=0, shown=float(shown))


def _elsewhere(target: Target | None, record: ClaimRecord, entries: tuple[EntryView, ...]) -> tuple[str, str] | None:
    """What agrees with the print, and under which reading, where the value of the claim itself does not."""
    if record.verdict is not Verdict.COMPATIBLE or target is None or all(entry.inside for entry in entries):
        return None
    for outcome in record.evidence.outcomes:
        if outcome.value is not None:
            alternatives = side_by_side(target, outcome.evidence)
            if all(entry.inside for entry in alternatives):
                number = alternatives[0].head + alternatives[0].tail
                return number if len(alternatives) == 1 else f"all {len(alternatives)} agree", outcome.reading
    return None


def _meant(record: ClaimRecord) -> tuple[tuple[tuple[EntryView, ...], ...], ...]:
    """The rows of entries beside what an erratum corrects the print to; empty if it corrects none that came out."""
    if not record.claim.meant or record.verdict not in CORRECTED:
        return ()
    with contextlib.suppress(AuditError, OverflowError, ValueError):
        target = Target.of(msgspec.structs.replace(record.claim, printed=record.claim.meant))
        return _rows(target.printed, side_by_side(target, record.evidence))
    return ()


def _off(target: Target | None, record: ClaimRecord) -> tuple[float, str] | None:
    """How far one printed decimal is from what was computed for it: per cent, a factor from `LARGE` on."""
    computed = record.evidence.value
    if record.verdict is not Verdict.DIFFERS or target is None or not isinstance(computed, (int, float)):
        return None
    if "." not in record.claim.printed:
        return None
    (entry,) = target.printed.entries
    if not entry.value or not computed or (computed < 0) is not (entry.value < 0):
        return None
    ratio = computed / float(entry.value)
    if ratio >= LARGE:
        return ratio, "times the print"
    return 100 * abs(ratio - 1), "% below the print" if ratio < 1 else "% above the print"


def _rows(printed: Printed, entries: tuple[EntryView, ...]) -> tuple[tuple[tuple[EntryView, ...], ...], ...]:
    """The entries in the layout of the print: a matrix has its rows, a list one entry below the other."""
    left = iter(entries)
    cells = [tuple(next(left) for _ in cell) for cell in printed.cells]
    width = printed.shape[1] if len(printed.shape) == 2 else 1
    return tuple(tuple(cells[start : start + width]) for start in range(0, len(cells), width))
