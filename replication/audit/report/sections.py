"""The sections of the report that follow the papers, in the order of the page; the contents list them by themselves.

A section is a line in `_SECTIONS`, a template `html/<name>.html.j2`, which finds what the builder of the section
returned under the name `shown`, and where its heading is a result a line in `html/headings.html.j2`. A builder that
returns None leaves its section out. First the papers side by side, then what stands behind the claims: theorems,
experiments, allowances, and the rounding of the digits. What is derived from the results is handed over as numbers,
which the templates write: a number inside a text of a builder's own stops the build (`page`).
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from replication.audit.inspect.headline import Basis, basis, controls, has_spread
from replication.audit.judge import numerals
from replication.audit.judge.agreement import Target, stored_intervals
from replication.audit.judge.policies import by_policy, once
from replication.audit.judge.verdict import SMALLEST_PROBABILITY, SMALLEST_PROBABILITY_REASON
from replication.audit.parts import CommonLevel, Sensitivity
from replication.audit.report.explore import axes, spread
from replication.audit.report.templates import VERDICTS, terms
from replication.audit.store.records import CertificateRecord, ClaimRecord, ExperimentRecord, PaperRecord, ResultsFile
from replication.errors import AuditError


@dataclass(frozen=True, kw_only=True)
class Column:
    """One kind of sensor, by the estimator of a paper.

    costs: by multiple, how many times the level of the ideal sensor that of this one is, at least and at most.
    """

    paper: PaperRecord
    ideal: CommonLevel
    costs: dict[int, tuple[float, float]]

    @property
    def name(self) -> str:
        """The sensor in short, without how m is meant."""
        return self.ideal.sensor.partition(": ")[0]


@dataclass(frozen=True, kw_only=True)
class CostCurve:
    """A column as a curve: dots, a band where only bounds are known; height: of its name, if that is at the edge."""

    column: Column
    path: str
    band: str
    dots: tuple[tuple[float, float], ...]
    height: float


@dataclass(frozen=True, kw_only=True)
class Chart:
    """Columns of one measure in one drawing, the steepest first; left: columns with another measure.

    words: for the sensors. peak: the largest cost.
    """

    words: tuple[str, ...]
    measure: str
    curves: tuple[CostCurve, ...]
    x_ticks: tuple[tuple[int, float], ...]
    y_ticks: tuple[tuple[float, float], ...]
    left: tuple[Column, ...]
    peak: float


NAME_HEIGHT = 105
"""Of the name of a curve, in units of the frame."""


def chart(shown: Sequence[Column]) -> Chart | None:
    """The largest group of columns whose measures agree, as curves of cost over the multiple; None for fewer than two.

    Letters aside: l2 is the norm of a sequence, L2 that of a function, and a cost is a ratio of either.
    """
    if not shown:
        return None
    ((measure, number),) = Counter(column.ideal.measure.casefold() for column in shown).most_common(1)
    chosen = [c for c in shown if c.ideal.measure.casefold() == measure and len(c.costs) > 1]
    if number < 2 or len(chosen) < 2:
        return None
    multiples = sorted({m for column in chosen for m in column.costs})
    costs = [1.0, *(most for column in chosen for _, most in column.costs.values())]
    frame = axes([float(m) for m in multiples], costs)
    last = min(max(column.costs) for column in chosen)
    chosen.sort(key=lambda column: -column.costs[last][1] if last in column.costs else 0.0)
    whole = [column for column in chosen if max(column.costs) == multiples[-1]]
    ends = [frame.y(column.costs[multiples[-1]][1]) for column in whole]
    heights = dict(zip(map(id, whole), spread(ends, [NAME_HEIGHT] * len(whole)), strict=True))
    curves = []
    for column in chosen:
        along, bounds = zip(*sorted(column.costs.items()), strict=True)
        lower, upper = zip(*bounds, strict=True)
        dots = tuple((round(frame.x(m), 1), round(frame.y(cost), 1)) for m, cost in zip(along, upper, strict=True))
        curves.append(
            CostCurve(
                column=column,
                path=frame.path(along, upper),
                band=frame.path([*along, *reversed(along)], [*upper, *reversed(lower)]),
                dots=dots,
                height=heights.get(id(column), 0),
            )
        )
    return Chart(
        words=tuple(dict.fromkeys(re.split(r",| \(", column.name)[0] for column in chosen)),
        measure=chosen[0].ideal.measure,
        curves=tuple(curves),
        x_ticks=tuple((m, round(frame.x(m), 1)) for m in multiples),
        y_ticks=frame.y_ticks,
        left=tuple(column for column in shown if column.ideal.measure.casefold() != measure),
        peak=max(costs),
    )


def across(results: ResultsFile) -> tuple[Column, ...]:
    """The columns of all papers. A sensor without an ideal (multiple 1) is left out."""
    columns = []
    for paper in results.papers:
        for sensor in dict.fromkeys(level.sensor for level in paper.common):
            levels = [level for level in paper.common if level.sensor == sensor]
            ideal = next((level for level in levels if level.multiple == 1), None)
            if ideal is not None:
                costs = {level.multiple: (level.lower / ideal.upper, level.upper / ideal.lower) for level in levels}
                costs[1] = (1.0, 1.0)
                columns.append(Column(paper=paper, ideal=ideal, costs=costs))
    return tuple(columns)


@dataclass(frozen=True, kw_only=True)
class Proofs:
    """supported: how many claims have theorems beside them; open: the ones without any, by reason. listed, twice,
    machine: how many certificates there are, and how many the second verifier and Coq have checked too."""

    certificates: tuple[tuple[CertificateRecord, tuple[ClaimRecord, ...]], ...]
    supported: int
    listed: int
    twice: int
    machine: int
    open: tuple[tuple[str, tuple[ClaimRecord, ...]], ...]


def proofs(results: ResultsFile) -> Proofs | None:
    """What the certificates of `results` prove, each with its claims; None if there is no certificate."""
    if not results.certificates:
        return None
    records = once(results.claims)
    reasons: dict[str, list[ClaimRecord]] = {}
    for claim in records:
        if not claim.judgement.proved and not claim.judgement.supported:
            reasons.setdefault(claim.judgement.unproved or "No certificate has been made.", []).append(claim)
    return Proofs(
        certificates=tuple(
            (certificate, tuple(claim for claim in results.claims if certificate.path in claim.evidence.certificates))
            for certificate in results.certificates
        ),
        supported=sum(bool(claim.judgement.supported) for claim in records),
        listed=len(results.certificates),
        twice=sum(certificate.proved and certificate.second for certificate in results.certificates),
        machine=sum(certificate.proved and bool(certificate.machine) for certificate in results.certificates),
        open=tuple((reason, tuple(claims)) for reason, claims in reasons.items()),
    )


Lineage = tuple[PaperRecord, tuple[tuple[ExperimentRecord, tuple[ClaimRecord, ...]], ...]]
"""A paper, and its experiments with the claims that each answers."""


def lineages(results: ResultsFile) -> tuple[Lineage, ...]:
    """Each paper that has an experiment behind a claim, with both in their order."""
    users: dict[str, list[ClaimRecord]] = {}
    for claim in results.claims:
        for name in claim.claim.uses:
            users.setdefault(name, []).append(claim)
    known = [(record, tuple(users[record.name])) for record in results.experiments if record.name in users]
    papers = ((paper, tuple(pair for pair in known if pair[0].paper == paper.key)) for paper in results.papers)
    return tuple((paper, pairs) for paper, pairs in papers if pairs)


Allowance = tuple[str, str, str, tuple[ClaimRecord, ...]]
"""What is compared, how much of it is allowed, why, and the claims that are judged so."""


def allowances(claims: Iterable[ClaimRecord]) -> tuple[Allowance, ...]:
    """Every allowance that a claim uses, once for each size and reason, in the order of the claims."""
    groups: dict[tuple[str, str, str], list[ClaimRecord]] = {}
    for claim in claims:
        for allowance in dict.fromkeys(_of(claim)):
            groups.setdefault(allowance, []).append(claim)
    return tuple((*what, tuple(users)) for what, users in groups.items())


def _of(claim: ClaimRecord) -> Iterator[tuple[str, str, str]]:
    if claim.claim.tolerance is not None:
        yield "distance from the print", f"≤ {claim.claim.tolerance}", claim.claim.tolerance_reason
    if has_spread(claim):
        yield "distance from the print", "as printed with it", f"The text prints {claim.claim.printed}."
    for evidence in (claim.evidence, claim.evidence.as_printed):
        if evidence is not None and evidence.threshold is not None:
            yield "residual of the statement", f"≤ {numerals.short(evidence.threshold)}", evidence.threshold_reason
    if basis(claim) is Basis.DRAW:
        allowed = f"≥ {numerals.short(SMALLEST_PROBABILITY)}"
        yield "probability of a draw as extreme", allowed, SMALLEST_PROBABILITY_REASON


Room = tuple[Sensitivity, float | None]
"""One parameter, moved by up to half a unit of its last place to the side that matters, by linear interpolation.

With the share of that half unit that a claim which agrees bears, 1 if it rounds to its print on all of it; or that a
claim which does not agree takes until it does, None if it never does.
"""


@dataclass(frozen=True, kw_only=True)
class ClaimRoom:
    """One claim and the parameters that it was tried with, first the one whose rounding decides soonest.

    agrees: whether the result rounds to the print at the printed parameters.
    """

    claim: ClaimRecord
    agrees: bool
    rooms: tuple[Room, ...]

    @property
    def deciding(self) -> tuple[Room, ...]:
        """The parameters whose own rounding is enough to end the agreement, or the difference."""
        return tuple(room for room in self.rooms if (room[1] != 1.0 if self.agrees else room[1] is not None))


def rooms(results: ResultsFile) -> tuple[ClaimRoom, ...]:
    """All claims that were tried, in the order of the claims; AuditError if one of them is unknown."""
    claims = {claim.id: claim for claim in results.claims}
    sensitivities: dict[str, list[Sensitivity]] = {}
    for moves in (moves for paper in results.papers for moves in paper.sensitivity):
        if moves.claim not in claims:
            raise AuditError(f"a sensitivity names {moves.claim!r}, which is no claim; correct the paper's experiment")
        sensitivities.setdefault(moves.claim, []).append(moves)
    records = []
    for claim in (claim for claim in results.claims if claim.id in sensitivities):
        intervals = stored_intervals(claim.claim, claim.judgement)
        if len(intervals) != 1:
            raise AuditError(f"a sensitivity names {claim.id!r}, which does not print one number that is a value")
        least, most = intervals[0].ends
        tried = [_room(moves, least, most) for moves in sensitivities[claim.id]]
        tried.sort(key=lambda room: math.inf if room[1] is None else room[1])
        agrees = least <= Fraction(sensitivities[claim.id][0].base) <= most
        records.append(ClaimRoom(claim=claim, agrees=agrees, rooms=tuple(tried)))
    return tuple(records)


def _room(moves: Sensitivity, least: Fraction, most: Fraction) -> Room:
    base = Fraction(moves.base)
    if least <= base <= most:
        return moves, min(_share(base, end, least, most) for end in (moves.low, moves.high))
    nearest = least if base < least else most
    ways = [(nearest - base) / (Fraction(end) - base) for end in (moves.low, moves.high) if end not in (None, base)]
    needed = [way for way in ways if 0 < way <= 1]
    return moves, float(min(needed)) if needed else None


def _share(base: Fraction, end: float | None, least: Fraction, most: Fraction) -> float:
    """How much of the way from `base` to `end` lies within the print; none is known if there is no result there."""
    if end is None:
        return 0.0
    edge = Fraction(end)
    if least <= edge <= most:
        return 1.0
    return float(((most if edge > base else least) - base) / (edge - base))


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section: the name is its id and its template, `shown` what the template shows.

    title: its name in the contents. numbers: those of its heading that what is shown does not hold.
    """

    name: str
    title: str
    numbers: Mapping[str, int]
    shown: Any


Build = Callable[[ResultsFile, Mapping[str, Target]], Any]
_SECTIONS: tuple[tuple[str, str, Build], ...] = (
    ("across", "Across the papers", lambda results, read: across(results) or None),
    ("words", "What the words mean", lambda results, read: {"verdicts": VERDICTS, "terms": terms(results.papers)}),
    ("proofs", "Proofs", lambda results, read: proofs(results)),
    ("policies", "Policies", lambda results, read: by_policy(results.claims)),
    ("tolerances", "Tolerances", lambda results, read: allowances(results.claims)),
    ("sensitivity", "Sensitivity to the printed digits", lambda results, read: rooms(results) or None),
    ("controls", "Negative controls", lambda results, read: controls(results, read) or None),
    ("lineage", "From data to claim", lambda results, read: lineages(results) or None),
    ("experiments", "Experiments", lambda results, read: results.experiments),
    ("environment", "Environment", lambda results, read: results.run),
    ("cite", "How to cite", lambda results, read: results.papers),
)
"""Name, title, and what it shows."""
_NUMBERS: Mapping[str, Callable[[Any], dict[str, int]]] = {
    "sensitivity": lambda shown: {"tried": len(shown), "moved": sum(bool(item.deciding) for item in shown)},
    "controls": lambda shown: {
        "tried": sum(control.tried for control in shown),
        "missed": sum(control.tried - control.caught for control in shown),
    },
    "experiments": lambda shown: {"run": len(shown), "failed": sum(bool(record.error) for record in shown)},
}


def sections(results: ResultsFile, read: Mapping[str, Target]) -> tuple[Section, ...]:
    """All sections that `results` has something for; read: the printed values of its claims, as they were read."""
    built = [(name, title, build(results, read)) for name, title, build in _SECTIONS]
    return tuple(
        Section(name=name, title=title, numbers=_NUMBERS.get(name, lambda shown: {})(shown), shown=shown)
        for name, title, shown in built
        if shown is not None
    )
