"""Negative controls: what is wrong on purpose must be found: stored verdicts derived again from altered input."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal

from msgspec.structs import replace

from replication.audit.inspect.headline import Basis, basis
from replication.audit.judge.agreement import Target
from replication.audit.judge.printed import Printed
from replication.audit.judge.verdict import rejudge
from replication.audit.model import Kind, Verdict
from replication.audit.store.records import ClaimRecord, ErratumRecord, ResultsFile

AGREEING = (Verdict.REPRODUCED, Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.CONSISTENT)


@dataclass(frozen=True, kw_only=True)
class Control:
    """One kind of alteration: what was altered, how often it was tried, and the claims where it went unnoticed."""

    altered: str
    expected: str
    tried: int
    caught: int
    missed: tuple[ClaimRecord, ...]


Errata = Mapping[str, ErratumRecord]
Maker = Callable[[ClaimRecord, Errata, Printed | None], Iterator[tuple[ClaimRecord, Errata]]]
"""Yields alterations of a claim, given how its print was read: the record, and the errata to judge it with."""


def controls(results: ResultsFile, targets: Mapping[str, Target]) -> tuple[Control, ...]:
    """Every kind of alteration that `results` has a claim for, tried on each such claim; targets: by claim."""
    made = (
        _control(results, targets, "a printed number moved by a unit of its last place", _moved_prints),
        _control(results, targets, "a statement that holds turned into one that does not", _denied),
        _control(results, targets, "the proof of an erratum taken away", _unproved),
        _control(results, targets, "the evidence of a claim taken away", _emptied, "an error"),
        _control(results, targets, "a print that differs replaced by what was computed", _mended, "agreement"),
    )
    return tuple(control for control in made if control.tried)


def _control(
    results: ResultsFile, targets: Mapping[str, Target], altered: str, make: Maker, expected: str = "no agreement"
) -> Control:
    errata = {erratum.id: erratum for erratum in results.errata}
    tried, caught = 0, 0
    unnoticed: dict[str, ClaimRecord] = {}
    for claim in results.claims:
        target = targets.get(claim.id)
        for record, known in make(claim, errata, target.printed if target else None):
            # A print that was left alone is not read again.
            judged = rejudge(record, known, target if record.claim is claim.claim else None)
            tried += 1
            if (judged.verdict in AGREEING) is (expected == "agreement"):
                caught += 1
            else:
                unnoticed[claim.id] = claim
    return Control(altered=altered, expected=expected, tried=tried, caught=caught, missed=tuple(unnoticed.values()))


def _reprinted(record: ClaimRecord, text: str) -> ClaimRecord:
    return replace(record, claim=replace(record.claim, printed=text))


def _moved_prints(record: ClaimRecord, errata: Errata, printed: Printed | None) -> Iterator[tuple[ClaimRecord, Errata]]:
    if record.verdict in AGREEING and basis(record) is Basis.DIGITS and printed is not None and not printed.relation:
        for text in moved(printed):
            yield _reprinted(record, text), errata


def _denied(record: ClaimRecord, errata: Errata, printed: Printed | None) -> Iterator[tuple[ClaimRecord, Errata]]:
    evidence = record.evidence
    if record.verdict in AGREEING and evidence.holds is not None and evidence.margin is not None:
        denied = replace(evidence, holds=not evidence.holds, margin=-abs(evidence.margin) - 1)
        yield replace(record, evidence=denied), errata


def _unproved(record: ClaimRecord, errata: Errata, printed: Printed | None) -> Iterator[tuple[ClaimRecord, Errata]]:
    name = record.claim.erratum
    if record.verdict is Verdict.REPRODUCED_AFTER_ERRATUM and name is not None:
        yield record, {**errata, name: replace(errata[name], holds=False)}


def _emptied(record: ClaimRecord, errata: Errata, printed: Printed | None) -> Iterator[tuple[ClaimRecord, Errata]]:
    if record.verdict in AGREEING:
        nothing = dict.fromkeys(("value", "lower", "upper", "holds", "margin", "probability"))
        yield replace(record, evidence=replace(record.evidence, **nothing)), errata


def _mended(record: ClaimRecord, errata: Errata, printed: Printed | None) -> Iterator[tuple[ClaimRecord, Errata]]:
    value = record.evidence.value
    if record.verdict is not Verdict.DIFFERS or record.claim.kind is not Kind.VALUE or printed is None:
        return
    if isinstance(value, int | float):
        (entry,) = printed.entries
        places = max(0, -Decimal(str(float(entry.unit))).adjusted())
        yield _reprinted(record, f"{value:.{places}f}"), errata


def moved(printed: Printed) -> Iterator[str]:
    """A print with one of its numbers moved by one unit of its last place, up and down, for each number in turn.

    A number that would change its sign is moved up only: its printed form has another length then.
    """
    text = printed.text.replace("−", "-")
    begin = 0
    for entry in printed.entries:
        digits = entry.text.lstrip("+-")
        begin = text.index(digits, begin)
        end = begin + len(digits)
        unit = Decimal(1).scaleb(_exponent(digits))
        for other in (Decimal(digits) + unit, Decimal(digits) - unit):
            if other >= 0:
                yield text[:begin] + format(other, "f") + text[end:]
        begin = end


def _exponent(digits: str) -> int:
    exponent = Decimal(digits).as_tuple().exponent
    assert isinstance(exponent, int)  # a printed number is finite
    return exponent
