"""Verdicts: the one place where a claim and its evidence become a verdict, and where that can be done again.

`make_record` stores a claim with all numbers that its verdict depends on and judges what it has stored; `rejudge`
judges a stored record anew. Both go through `case_of` and `judge`, so a verdict set by hand is found out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import msgspec

from replication.audit.judge.agreement import Judgement, apart, digits, judge_bound, judge_value
from replication.audit.judge.evidence import plain, require_finite
from replication.audit.judge.printed import decimal_fraction, parse
from replication.audit.judge.proofs import with_proofs
from replication.audit.model import Claim, Evidence, Kind, Proof, Verdict
from replication.audit.store.records import CertificateRecord, ClaimRecord, ErratumRecord, Reading
from replication.errors import AuditError

SMALLEST_PROBABILITY = 0.01
"""A statistical claim is consistent if a draw at least as extreme as the printed one is at least this probable."""
SMALLEST_PROBABILITY_REASON = (
    "A single draw can only be contradicted by being improbable; at this level one true print in a hundred would be."
)

AGREES = (Verdict.REPRODUCED, Verdict.CONSISTENT)
NUMERIC = (Kind.VALUE, Kind.MATRIX, Kind.BOUND)


@dataclass(frozen=True, kw_only=True)
class Case:
    """All that a verdict depends on. proof_holds is None if the proof of the erratum could not be run."""

    kind: Kind
    reading: Reading
    method: str = "computed"
    printed: str = ""
    as_printed: Reading | None = None
    erratum: str | None = None
    proof_holds: bool | None = None
    tolerance: str | None = None
    tolerance_reason: str = ""
    not_checkable: str = ""
    note: str = ""


def judge(case: Case) -> Judgement:
    """The verdict on `case`, with the deviation in last-place units and the reason; never raises.

    Evidence that cannot be compared (no number, wrong layout, not finite, contradictory) gives `Verdict.ERROR`.
    """
    try:
        return _judge(case)
    except AuditError as error:
        return Judgement(Verdict.ERROR, None, str(error))


def make_record(
    claim: Claim,
    paper_key: str,
    evidence: Evidence | None,
    proof: Proof | None,
    code: str,
    seconds: float,
    error: str,
    certificates: Sequence[CertificateRecord] = (),
) -> ClaimRecord:
    """The record of `claim` with its verdict; never raises.

    evidence: what the claim answered, None after a failure. proof: that of the claim's erratum, None without one or
    when it failed. code: file:line of the answer. seconds: of its experiments. error: the failure, or empty.
    certificates: those that support the claim; what they prove takes the place of what was computed.
    """
    try:
        if error:
            raise AuditError(error)
        usable, failure = with_proofs(claim.kind, plain(evidence), certificates), ""
    except AuditError as unusable:
        # No number of a failed or malformed answer is kept, so that judging the record again gives an error too.
        usable, failure = Evidence(method=""), str(unusable)
    draft = _draft(claim, paper_key, usable, code, seconds)
    judgement = judge(case_of(draft, None if proof is None else proof.holds))
    if failure:
        judgement = Judgement(Verdict.ERROR, None, failure)
    return msgspec.structs.replace(
        draft,
        verdict=judgement.verdict,
        deviation_ulp=judgement.deviation_ulp,
        reason=judgement.reason,
        certificates=tuple(certificate.path for certificate in certificates),
    )


def rejudge(record: ClaimRecord, errata: Mapping[str, ErratumRecord]) -> Judgement:
    """Judge a stored record again from its numbers and the stored proofs alone; `record.verdict` is not looked at."""
    erratum = errata.get(record.erratum) if record.erratum is not None else None
    proved = erratum.holds if erratum is not None and not erratum.error else None
    return judge(case_of(record, proved))


def case_of(record: ClaimRecord, proof_holds: bool | None) -> Case:
    """What the verdict of `record` depends on."""
    return Case(
        kind=record.kind,
        reading=Reading(
            value=record.computed,
            lower=record.lower,
            upper=record.upper,
            holds=record.holds,
            margin=record.margin,
            threshold=record.threshold,
            threshold_reason=record.threshold_reason,
            probability=record.probability,
        ),
        method=record.method,
        printed=record.printed,
        as_printed=record.as_printed,
        erratum=record.erratum,
        proof_holds=proof_holds,
        tolerance=record.tolerance,
        tolerance_reason=record.tolerance_reason,
        not_checkable=record.not_checkable,
        note=record.note,
    )


def _judge(case: Case) -> Judgement:
    for name, reading in (("", case.reading), ("as_printed.", case.as_printed)):
        if reading is not None:
            require_finite(name, msgspec.to_builtins(reading))
    if case.not_checkable:
        return Judgement(Verdict.NOT_CHECKABLE, None, case.not_checkable)
    if not case.method:
        raise AuditError("there is no evidence: name the method by which the answer was computed")
    if case.kind is Kind.CITED:
        raise AuditError("a cited claim cannot be checked and must say why: set not_checkable in its evidence")
    if case.erratum is None:
        if case.as_printed is not None:
            raise AuditError("the evidence has as_printed but the claim names no erratum; set one or leave it out")
        return _compare(case)
    return _with_erratum(case, case.erratum)


def _with_erratum(case: Case, erratum: str) -> Judgement:
    """As printed if that agrees; else as corrected, which counts only if the proof of the erratum holds."""
    if case.as_printed is not None:
        printed = _compare(replace(case, reading=case.as_printed))
        before = f"As printed: {printed.reason}"
        if printed.verdict in AGREES:
            return printed
    elif case.note:
        before = f"As printed: {case.note}"
    else:
        raise AuditError(f"erratum {erratum}: the evidence has no as_printed, and no note that says why")
    corrected = _compare(case)
    reason = f"With erratum {erratum}: {corrected.reason} {before}"
    if corrected.verdict not in AGREES:
        return replace(corrected, reason=reason)
    if case.proof_holds is None:
        raise AuditError(f"the proof of erratum {erratum} could not be run, so its correction does not count")
    if not case.proof_holds:
        return replace(corrected, verdict=Verdict.DIFFERS, reason=f"The proof of the erratum does not hold. {reason}")
    return replace(corrected, verdict=Verdict.REPRODUCED_AFTER_ERRATUM, reason=reason)


def _compare(case: Case) -> Judgement:
    if case.tolerance is not None and not case.tolerance_reason:
        raise AuditError(f"the tolerance {case.tolerance} has no tolerance_reason; half a printed unit needs none")
    if case.tolerance is not None and case.kind not in (Kind.VALUE, Kind.MATRIX):
        raise AuditError(f"a claim of kind {case.kind} has no tolerance, got {case.tolerance}; leave it out")
    if case.kind in NUMERIC and not case.printed:
        raise AuditError(f"a claim of kind {case.kind} needs its printed value")
    _require_reasoned_threshold(case)
    return _COMPARISONS[case.kind](case)


def _require_reasoned_threshold(case: Case) -> None:
    threshold, reason = case.reading.threshold, case.reading.threshold_reason
    if threshold is None and not reason:
        return
    if threshold is None:
        raise AuditError(f"the evidence has a threshold_reason and no threshold: {reason!r}; give the number too")
    if not reason:
        raise AuditError(f"the threshold {threshold!r} has no threshold_reason; say in words why that much is allowed")
    if case.kind in NUMERIC:
        raise AuditError(f"a claim of kind {case.kind} has no threshold, got {threshold!r}; it may have a tolerance")
    if case.reading.holds is None or case.reading.margin is None:
        raise AuditError(f"the threshold {threshold!r} needs holds and margin, which is threshold minus residual")


def _value(case: Case) -> Judgement:
    tolerance = None if case.tolerance is None else decimal_fraction(case.tolerance)
    if tolerance is not None and tolerance <= 0:
        raise AuditError(f"the tolerance must be positive, got {case.tolerance}")
    judgement = judge_value(parse(case.printed), case.reading, tolerance)
    if case.tolerance is None:
        return judgement
    return replace(judgement, reason=f"{judgement.reason} Tolerance ±{case.tolerance}: {case.tolerance_reason}")


def _bound(case: Case) -> Judgement:
    return judge_bound(parse(case.printed), case.reading)


def _statement(case: Case) -> Judgement:
    holds, margin = case.reading.holds, case.reading.margin
    if holds is None:
        raise AuditError(f"a claim of kind {case.kind} needs evidence that says whether it holds")
    by = ""
    if margin is not None:
        if margin != 0 and holds != (margin > 0):
            raise AuditError(f"the evidence contradicts itself: holds is {holds} and the margin is {margin!r}")
        by = f", by a margin of {digits(Fraction(margin), Fraction(0))}"
    if margin is not None and case.reading.threshold is not None:
        allowed = Fraction(case.reading.threshold)
        by = ". Residual {}, allowed {}".format(*apart(allowed - Fraction(margin), allowed, least=3))
    words = "The statement holds" if holds else "The statement does not hold"
    return Judgement(Verdict.CONSISTENT if holds else Verdict.DIFFERS, None, f"{words}{by}.")


def _statistical(case: Case) -> Judgement:
    """By the probability, by whether a qualitative statement holds, or, if both are given, by both."""
    probability = case.reading.probability
    if probability is None:
        if case.reading.holds is None:
            raise AuditError("a statistical claim needs evidence with a probability, or whether it holds")
        return _statement(case)
    if not 0 <= probability <= 1:
        raise AuditError(f"a probability lies between 0 and 1, got {probability!r}")
    probable = probability >= SMALLEST_PROBABILITY
    told = digits(Fraction(probability), Fraction(str(SMALLEST_PROBABILITY)))
    reason = (
        f"A draw at least as extreme as the printed one has probability {told},"
        f" {'not less' if probable else 'less'} than {SMALLEST_PROBABILITY}."
    )
    verdict = Verdict.CONSISTENT if probable else Verdict.DIFFERS
    if case.reading.holds is not None:
        statement = _statement(case)
        reason = f"{reason} {statement.reason}"
        verdict = statement.verdict if probable else verdict
    return Judgement(verdict, None, reason)


_COMPARISONS: dict[Kind, Callable[[Case], Judgement]] = {
    Kind.VALUE: _value,
    Kind.MATRIX: _value,
    Kind.BOUND: _bound,
    Kind.ORDER: _statement,
    Kind.FEASIBLE: _statement,
    Kind.STATISTICAL: _statistical,
}


def _draft(claim: Claim, paper_key: str, evidence: Evidence, code: str, seconds: float) -> ClaimRecord:
    """All of the record but its verdict, which reads `error` until it is judged."""
    printed = evidence.as_printed
    return ClaimRecord(
        id=claim.id,
        paper=paper_key,
        place=claim.place,
        kind=claim.kind,
        statement=claim.statement,
        printed=claim.printed,
        computed=evidence.value,
        lower=evidence.lower,
        upper=evidence.upper,
        proved=evidence.proved,
        deviation_ulp=None,
        tolerance=claim.tolerance,
        tolerance_reason=claim.tolerance_reason,
        verdict=Verdict.ERROR,
        expected_verdict=claim.expected,
        reason="",
        method=evidence.method,
        cross_check=evidence.cross_check,
        code=code,
        seconds=seconds,
        erratum=claim.erratum,
        as_printed=None
        if printed is None
        else Reading(**{name: getattr(printed, name) for name in Reading.__struct_fields__}),
        holds=evidence.holds,
        margin=evidence.margin,
        threshold=evidence.threshold,
        threshold_reason=evidence.threshold_reason,
        probability=evidence.probability,
        quantities=evidence.quantities,
        solvers=evidence.solvers,
        note=evidence.note,
        not_checkable=evidence.not_checkable,
        experiments=claim.uses,
        certificates=(),
        unproved="",
    )
