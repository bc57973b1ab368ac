"""Negative controls: what is wrong on purpose must be found: stored verdicts derived again from altered input."""

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal

from msgspec.structs import replace

from replication.audit.inspect.headline import Basis, basis
from replication.audit.judge.agreement import Target, measure
from replication.audit.judge.printed import Printed
from replication.audit.judge.verdict import rejudge
from replication.audit.model import AGREES, CORRECTED, Evidence, Kind, Policy, Verdict
from replication.audit.store.records import ClaimRecord, ErratumRecord, ResultsFile
from replication.errors import AuditError

EXPECTED = {
    "a printed number moved by a unit of its last place": "no agreement",
    "a statement that holds turned into one that does not": "no agreement",
    "the proof of an erratum taken away": "no agreement",
    "the evidence of a claim taken away": "an error",
    "a print that differs replaced by what was computed": "agreement",
}
"""What each kind of alteration must give."""
_MOVED, _DENIED, _UNPROVED, _EMPTIED, _MENDED = EXPECTED
Errata = Mapping[str, ErratumRecord]


@dataclass(frozen=True, kw_only=True)
class Control:
    """One kind of alteration: what was altered, how often it was tried, and the claims where it went unnoticed."""

    altered: str
    expected: str
    tried: int
    caught: int
    missed: tuple[ClaimRecord, ...]


def controls(results: ResultsFile, targets: Mapping[str, Target]) -> tuple[Control, ...]:
    """Every kind of alteration that `results` has a claim for, tried on each such claim; targets: by claim."""
    errata = {erratum.id: erratum for erratum in results.errata}
    tried: dict[str, list[ClaimRecord | None]] = {altered: [] for altered in EXPECTED}
    for claim in results.claims:
        target, readings = targets.get(claim.id), results.readings.get(claim.paper, ())
        for altered, record, known in _alterations(claim, errata, target):
            # A print that was left alone is not read again.
            judged = rejudge(record, known, target if record.claim is claim.claim else None, readings=readings)
            agrees = judged.verdict in AGREES and Policy.SOLVER not in judged.policies
            tried[altered].append(None if agrees is (EXPECTED[altered] == "agreement") else claim)
    return tuple(
        Control(
            altered=altered,
            expected=EXPECTED[altered],
            tried=len(outcomes),
            caught=outcomes.count(None),
            missed=tuple({claim.id: claim for claim in outcomes if claim is not None}.values()),
        )
        for altered, outcomes in tried.items()
        if outcomes
    )


def _alterations(
    record: ClaimRecord, errata: Errata, target: Target | None
) -> Iterator[tuple[str, ClaimRecord, Errata]]:
    """What can be altered of a claim: the kind, the record, and the errata to judge it with."""
    claim, evidence, erratum = record.claim, record.evidence, record.claim.erratum
    printed = target.printed if target else None
    if record.verdict in AGREES:
        # Agreement under one reading of several, over rounded inputs, within a printed uncertainty, or within what a
        # solver leaves open is wider than the rounding of the print, and half-way between two prints agrees with both.
        spread = printed is not None and any(entry.spread for entry in printed.entries)
        wide = evidence.outcomes or evidence.over_inputs or spread or Policy.SOLVER in record.judgement.policies
        if (
            target is not None
            and not (wide or target.printed.relation)
            and basis(record) is Basis.DIGITS
            and not _tied(target, evidence)
        ):
            if claim.meant and record.verdict in CORRECTED:
                # What is meant was compared; the print was found wrong and would be so with another digit.
                for text in moved(Target.of(replace(claim, printed=claim.meant)).printed):
                    yield _MOVED, replace(record, claim=replace(claim, meant=text)), errata
            else:
                for text in moved(target.printed):
                    yield _MOVED, replace(record, claim=replace(claim, printed=text, uncertainty="")), errata
        if evidence.holds is not None and evidence.margin is not None:
            against = tuple(replace(outcome, holds=False, margin=None) for outcome in evidence.outcomes)
            denied = replace(evidence, holds=not evidence.holds, margin=-abs(evidence.margin) - 1, outcomes=against)
            yield _DENIED, replace(record, evidence=denied), errata
        if record.verdict in CORRECTED and erratum is not None:
            yield _UNPROVED, record, {**errata, erratum: replace(errata[erratum], holds=False)}
        nothing = dict.fromkeys(("value", "lower", "upper", "holds", "margin", "probability", "over_inputs"))
        yield _EMPTIED, replace(record, evidence=replace(evidence, **nothing, outcomes=())), errata
    single = claim.kind is Kind.VALUE and isinstance(evidence.value, int | float) and not evidence.outcomes
    if record.verdict is Verdict.DIFFERS and single and printed is not None:
        (entry,) = printed.entries
        places = max(0, -Decimal(str(float(entry.unit))).adjusted())
        yield _MENDED, replace(record, claim=replace(claim, printed=f"{evidence.value:.{places}f}")), errata


def _tied(target: Target, evidence: Evidence) -> bool:
    with contextlib.suppress(AuditError):  # of a record that does not fit, the verdict says so
        return any(number.tied for number in measure(target, evidence))
    return False


def moved(printed: Printed) -> Iterator[str]:
    """A print with one of its numbers moved by one unit of its last place, up and down, for each number in turn.

    A number that would change its sign is moved up only: its printed form has another length then.
    """
    text = printed.plain
    begin = 0
    for entry in printed.entries:
        digits = entry.text.lstrip("+-")
        begin = text.index(digits, begin)
        end = begin + len(digits)
        unit = Decimal(entry.unit.numerator) / entry.unit.denominator
        for number in (Decimal(digits) + unit, Decimal(digits) - unit):
            if number >= 0:
                yield text[:begin] + format(number, "f") + text[end:]
        begin = end
