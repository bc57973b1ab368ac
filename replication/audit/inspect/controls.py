"""Negative controls: what is wrong on purpose must be found: stored verdicts derived again from altered input."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal

from msgspec.structs import replace

from replication.audit.inspect.headline import Basis, basis
from replication.audit.judge.printed import parse
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


def controls(results: ResultsFile) -> tuple[Control, ...]:
    """Every kind of alteration that `results` has a claim for, tried on each such claim."""
    errata = {erratum.id: erratum for erratum in results.errata}
    made = (
        _control("a printed number moved by a unit of its last place", "no agreement", _moved_prints, results, errata),
        _control("a statement that holds turned into one that does not", "no agreement", _denied, results, errata),
        _control("the proof of an erratum taken away", "no agreement", _unproved, results, errata),
        _control("the evidence of a claim taken away", "an error", _emptied, results, errata),
        _control("a print that differs replaced by what was computed", "agreement", _mended, results, errata, True),
    )
    return tuple(control for control in made if control.tried)


Alteration = tuple[ClaimRecord, Mapping[str, ErratumRecord]]
Maker = Callable[[ClaimRecord, Mapping[str, ErratumRecord]], Iterator[Alteration]]


def _control(
    altered: str,
    expected: str,
    make: Maker,
    results: ResultsFile,
    errata: Mapping[str, ErratumRecord],
    agree: bool = False,
) -> Control:
    tried = [(claim, *alteration) for claim in results.claims for alteration in make(claim, errata)]
    unnoticed = [claim for claim, record, known in tried if (rejudge(record, known).verdict in AGREEING) is not agree]
    missed = tuple({claim.id: claim for claim in unnoticed}.values())
    return Control(
        altered=altered, expected=expected, tried=len(tried), caught=len(tried) - len(unnoticed), missed=missed
    )


def _moved_prints(claim: ClaimRecord, errata: Mapping[str, ErratumRecord]) -> Iterator[Alteration]:
    if claim.verdict in AGREEING and basis(claim) is Basis.DIGITS and not parse(claim.printed).relation:
        for text in moved(claim.printed):
            yield replace(claim, printed=text), errata


def _denied(claim: ClaimRecord, errata: Mapping[str, ErratumRecord]) -> Iterator[Alteration]:
    if claim.verdict in AGREEING and claim.holds is not None and claim.margin is not None:
        yield replace(claim, holds=not claim.holds, margin=-abs(claim.margin) - 1), errata


def _unproved(claim: ClaimRecord, errata: Mapping[str, ErratumRecord]) -> Iterator[Alteration]:
    if claim.verdict is Verdict.REPRODUCED_AFTER_ERRATUM and claim.erratum is not None:
        yield claim, {**errata, claim.erratum: replace(errata[claim.erratum], holds=False)}


def _emptied(claim: ClaimRecord, errata: Mapping[str, ErratumRecord]) -> Iterator[Alteration]:
    if claim.verdict in AGREEING:
        yield replace(claim, computed=None, lower=None, upper=None, holds=None, margin=None, probability=None), errata


def _mended(claim: ClaimRecord, errata: Mapping[str, ErratumRecord]) -> Iterator[Alteration]:
    if claim.verdict is not Verdict.DIFFERS or claim.kind is not Kind.VALUE:
        return
    if isinstance(claim.computed, int | float):
        (entry,) = parse(claim.printed).entries
        places = max(0, -Decimal(str(float(entry.unit))).adjusted())
        yield replace(claim, printed=f"{claim.computed:.{places}f}"), errata


def moved(printed: str) -> Iterator[str]:
    """`printed` with one of its numbers moved by one unit of its last place, up and down, for each number in turn.

    A number that would change its sign is moved up only: its printed form has another length then.
    """
    text = printed.replace("−", "-")
    begin = 0
    for entry in parse(printed).entries:
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
