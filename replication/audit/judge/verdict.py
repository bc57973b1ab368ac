"""Verdicts: the one place where a claim and its evidence become a verdict, and are stored with it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import msgspec

from replication.audit.judge.agreement import Target, judge_bound, judge_uncertain, judge_value
from replication.audit.judge.numerals import digits, short
from replication.audit.judge.policies import (
    once_corrected,
    slipped,
    touched,
    under_some,
    with_excess,
    with_inputs,
    with_own,
)
from replication.audit.judge.proofs import with_proofs
from replication.audit.judge.uncertainty import BY_DIGITS
from replication.audit.judge.uncertainty import SMALLEST_PROBABILITY as SMALLEST_PROBABILITY
from replication.audit.model import (
    AGREES,
    DISAGREES,
    NO_READING,
    NUMERIC,
    Claim,
    Evidence,
    Judgement,
    Kind,
    Policy,
    Reading,
    StatedClaim,
    Verdict,
)
from replication.audit.store.cache import require_json
from replication.audit.store.records import CertificateRecord, ClaimRecord, ErratumRecord
from replication.errors import AuditError

SMALLEST_PROBABILITY_REASON = (
    "A single draw can only be contradicted by being improbable; at this level one true print in a hundred would be."
)

TESTS_NOTHING = "A constant fitted to the print alone meets it, which tests nothing"


@dataclass(frozen=True)
class Case:
    """All that a verdict depends on.

    erratum: that of the claim, with the outcome of its proof. readings: those of the paper. target: the printed value,
    if the claim has one; or why it cannot be read.
    printed: whether the evidence is for the text as printed, without the correction of the erratum.
    """

    claim: StatedClaim
    evidence: Evidence
    erratum: ErratumRecord | None
    readings: Mapping[str, Reading]
    target: Target | AuditError | None
    printed: bool = False

    def reading(self, name: str) -> Reading:
        """The reading of the paper with this name; AuditError if there is none."""
        if name not in self.readings:
            raise AuditError(f"the reading {name!r} is not one of the paper's, which are {list(self.readings)}")
        return self.readings[name]

    @property
    def rested(self) -> tuple[Reading, ...]:
        """The readings that the verdict may rest on: that of the claim, and those of its outcomes."""
        names = [self.claim.reading, *(outcome.reading for outcome in self.evidence.outcomes)]
        return tuple(self.readings[name] for name in dict.fromkeys(names) if name in self.readings)


def judge(
    claim: StatedClaim,
    evidence: Evidence,
    erratum: ErratumRecord | None = None,
    target: Target | None = None,
    *,
    readings: Iterable[Reading] = (),
) -> Judgement:
    """The verdict on `claim`, with its reason, deviation and rounding intervals; never raises.

    Evidence that cannot be compared (no number, wrong layout, not finite, contradictory) gives `Verdict.ERROR`.
    erratum: that of the claim, with the outcome of its proof. target: the printed value, if it was read. readings:
    those of the paper.
    """
    known = {reading.name: reading for reading in readings}
    case = Case(claim, evidence, erratum, known, target or _target(claim, evidence))
    try:
        judgement = with_own(claim, case.rested, _judge(case))
    except AuditError as error:
        judgement = Judgement(verdict=Verdict.ERROR, reason=str(error))
    if isinstance(case.target, Target):
        return msgspec.structs.replace(judgement, intervals=case.target.written)
    return judgement


def _target(claim: StatedClaim, evidence: Evidence) -> Target | AuditError | None:
    """What the claim prints; nothing, or something that is no number, is an error only where numbers are compared."""
    try:
        values = (evidence.value, *(outcome.value for outcome in evidence.outcomes))
        return Target.of(claim, any(isinstance(value, tuple) for value in values)) if claim.printed else None
    except AuditError as error:
        return error


def _judge(case: Case) -> Judgement:
    claim, evidence = case.claim, case.evidence
    require_json("the evidence", msgspec.to_builtins(evidence))
    if evidence.not_checkable:
        return Judgement(verdict=Verdict.UNDETERMINED, reason=evidence.not_checkable)
    if not evidence.method:
        raise AuditError("there is no evidence: name the method by which the answer was computed")
    if claim.kind is Kind.CITED:
        raise AuditError("a cited claim cannot be checked and must say why: set not_checkable in its evidence")
    if claim.erratum is None:
        if evidence.as_printed is not None:
            raise AuditError("the evidence has as_printed but the claim names no erratum; set one or leave it out")
        return _found(case)
    return _with_erratum(case, claim.erratum)


def _with_erratum(case: Case, erratum: str) -> Judgement:
    """As printed if that agrees; else as corrected, which counts only if the proof of the erratum holds.

    What rests on a slip of the text at hand alone is judged as the paper must have it.
    """
    evidence, meant = case.evidence, case.claim.meant
    proof = case.erratum if case.erratum is not None and not case.erratum.error else None
    if _is_slip(proof):
        return slipped(erratum, _found(_corrected(case) if meant else case))
    verdict = Verdict.DIFFERS if _compares_numbers(case.claim) else Verdict.UNDETERMINED
    if meant and evidence.as_printed is not None:
        raise AuditError(f"one answer is compared with the print and with {meant!r}; leave out as_printed")
    as_printed = evidence if meant else evidence.as_printed
    if as_printed is not None and as_printed.not_checkable and not meant:
        before = f"As printed: {as_printed.not_checkable}"
    elif as_printed is not None:
        printed = _found(replace(case, evidence=as_printed, printed=True))
        before, verdict = f"As printed: {printed.reason}", printed.verdict
        if printed.verdict in AGREES:
            return printed
    elif evidence.note:
        before = f"As printed: {evidence.note}"
    else:
        raise AuditError(f"erratum {erratum}: the evidence has no as_printed, and no note that says why")
    corrected = _found(_corrected(case) if meant else case)
    reason = f"With erratum {erratum}: {corrected.reason} {before}"
    if proof is not None and proof.holds and proof.inference:
        reason = f"{reason} The erratum is an inference."
    if corrected.verdict not in AGREES:
        return msgspec.structs.replace(corrected, reason=reason)
    if proof is None:
        raise AuditError(f"the proof of erratum {erratum} could not be run, so its correction does not count")
    if not proof.holds:
        reason = f"The proof of the erratum does not hold. {reason}"
    elif proof.inference:
        verdict = Verdict.COMPATIBLE
    else:
        verdict = once_corrected(corrected.verdict)
    if proof.holds:
        corrected = touched(corrected, Policy.ERRATUM)
    return msgspec.structs.replace(corrected, verdict=verdict, reason=reason)


def _is_slip(proof: ErratumRecord | None) -> bool:
    """Whether it is shown to be a slip that may be of the text at hand alone."""
    return proof is not None and proof.scan and proof.holds and not proof.inference


def _corrected(case: Case) -> Case:
    """The case with what must be meant in the place of a misprinted result."""
    claim = msgspec.structs.replace(case.claim, printed=case.claim.meant)
    return replace(case, claim=claim, target=_target(claim, case.evidence))


def _compares_numbers(claim: StatedClaim) -> bool:
    """Whether the verdict of disagreement is `differs`; that of a statement without a number is `refuted`."""
    return claim.kind in NUMERIC or (claim.kind is Kind.STATISTICAL and bool(claim.printed))


def _found(case: Case) -> Judgement:
    """What the evidence gives under the reading of the claim, or under each of a family."""
    if case.evidence.outcomes:
        return _family(case)
    judgement = _compare(case)
    if case.claim.reading in ("", NO_READING):
        return judgement
    reading = case.reading(case.claim.reading)
    if case.printed and reading.inference:
        # Chosen with the print in view, it is a part of the correction.
        return judgement
    verdict, reason = judgement.verdict, f"Under the reading {reading.name}: {judgement.reason}"
    if reading.policy is Policy.CONSTANT and verdict in AGREES:
        verdict, reason = Verdict.UNDETERMINED, f"{reason} {TESTS_NOTHING}: {reading.name}."
    if reading.inference and verdict is Verdict.REPRODUCED:
        verdict = Verdict.COMPATIBLE
        reason = f"{reason} The reading is an inference, chosen with printed numbers in view."
    return msgspec.structs.replace(judgement, verdict=verdict, reason=reason)


def _family(case: Case) -> Judgement:
    """The verdict on a claim whose answer is known under each reading of a family."""
    evidence = case.evidence
    readings = [case.reading(outcome.reading) for outcome in evidence.outcomes]
    if len({reading.name for reading in readings}) != len(readings):
        raise AuditError(f"the evidence has two outcomes for one reading: {[reading.name for reading in readings]}")
    _require_fitting(case)
    if evidence.over_inputs is not None:
        raise AuditError("the evidence has outcomes under several readings and over_inputs; a range needs one reading")
    found = {outcome.reading: _compare(replace(case, evidence=outcome.evidence)) for outcome in evidence.outcomes}
    ruled_out = [reading.name for reading in readings if reading.policy is Policy.RULED_OUT]
    fitted = [reading.name for reading in readings if reading.policy is Policy.CONSTANT]
    left = [reading for reading in readings if reading.name not in (*ruled_out, *fitted)]
    verdicts = [found[reading.name].verdict for reading in left]
    if not verdicts:
        raise AuditError(
            f"the family has no reading that decides: ruled out are {ruled_out}, and fitted to the print {fitted}"
        )
    agreeing, numbers = sum(verdict in AGREES for verdict in verdicts), _compares_numbers(case.claim)
    met = [name for name in fitted if found[name].verdict in AGREES]
    decided: tuple[Policy, ...] = ()
    if agreeing == len(verdicts):
        chosen = numbers and (case.claim.kind is Kind.STATISTICAL or all(reading.inference for reading in left))
        verdict = Verdict.COMPATIBLE if chosen else verdicts[0]
    elif all(verdict in DISAGREES for verdict in verdicts) and not met:
        verdict = Verdict.DIFFERS if numbers else Verdict.REFUTED
    else:
        verdict, decided = under_some(agreeing, len(verdicts), numbers)
    said = "; ".join(f"{name}: {judgement.reason.rstrip('.')}" for name, judgement in found.items())
    # What would fit the print and break the step does not count, so that these are the valid ones.
    mended = case.claim.erratum is not None and not case.printed and not _is_slip(case.erratum)
    which = "that leave the corrected step valid" if verdict is Verdict.DIFFERS and mended else "of the text"
    reason = f"It {'agrees' if numbers else 'holds'} under {agreeing} of {len(verdicts)} readings {which}. {said}."
    if ruled_out:
        reason = f"{reason} The text rules out and the verdict leaves out: {', '.join(ruled_out)}."
    if met:
        reason = f"{reason} {TESTS_NOTHING}: {', '.join(met)}."
    elif fitted:
        reason = f"{reason} No constant fitted to the print meets it, which is not counted: {', '.join(fitted)}."
    shown = [_compare(case)] if evidence.value is not None and case.claim.kind in NUMERIC else found.values()
    deviations = [judgement.deviation_ulp for judgement in shown if judgement.deviation_ulp is not None]
    applied = tuple(dict.fromkeys((*decided, *(each for one in found.values() for each in one.policies))))
    nearest = min(deviations, key=abs, default=None)
    counts = agreeing, len(verdicts)
    return Judgement(verdict=verdict, reason=reason, deviation_ulp=nearest, policies=applied, readings=counts)


def _compare(case: Case) -> Judgement:
    claim = case.claim
    if claim.tolerance is not None and not claim.tolerance_reason:
        raise AuditError(f"the tolerance {claim.tolerance} has no tolerance_reason; half a printed unit needs none")
    if claim.tolerance is not None and claim.kind not in (Kind.VALUE, Kind.MATRIX):
        raise AuditError(f"a claim of kind {claim.kind} has no tolerance, got {claim.tolerance}; leave it out")
    if claim.uncertainty and claim.kind not in (Kind.VALUE, Kind.MATRIX):
        raise AuditError(f"a claim of kind {claim.kind} has no uncertainty, got {claim.uncertainty!r}; leave it out")
    _require_fitting(case)
    if claim.kind not in NUMERIC:
        if claim.optimum or case.evidence.over_inputs is not None:
            raise AuditError(f"a claim of kind {claim.kind} compares no number: neither optimum nor over_inputs")
        return _statistical(case) if claim.kind is Kind.STATISTICAL else _statement(case)
    if case.target is None:
        raise AuditError(f"a claim of kind {claim.kind} needs its printed value")
    if isinstance(case.target, AuditError):
        raise case.target
    if claim.kind is not Kind.BOUND and any(entry.spread for entry in case.target.printed.entries):
        judgement = judge_uncertain(case.target, case.evidence, claim.uncertainty)
    else:
        judgement = (judge_bound if claim.kind is Kind.BOUND else judge_value)(case.target, case.evidence)
    if claim.uncertainty in BY_DIGITS:
        alone = "" if isinstance(case.evidence.value, tuple) else " What is printed beside it was not compared."
        reason = f"{judgement.reason} {BY_DIGITS[claim.uncertainty]}{alone}"
        judgement = msgspec.structs.replace(judgement, reason=reason)
    if claim.tolerance is not None:
        reason = f"{judgement.reason} Tolerance ±{claim.tolerance}: {claim.tolerance_reason}"
        judgement = msgspec.structs.replace(judgement, reason=reason)
    solver = next((reading for reading in case.readings.values() if reading.policy is Policy.SOLVER), None)
    judgement = with_excess(claim, case.target, case.evidence, judgement, solver)
    return with_inputs(claim, case.target, case.evidence, judgement)


def _require_fitting(case: Case) -> None:
    """Raise AuditError for a number that a claim of this kind would leave unseen, or a threshold without reason."""
    kind, evidence = case.claim.kind, case.evidence
    if kind is not Kind.STATISTICAL and (evidence.probability, evidence.draws) != (None, None):
        raise AuditError(
            f"a claim of kind {kind} has no probability, got {evidence.probability!r}; make it one of kind "
            "statistical, or say by holds and margin whether the probability is what the text says of it"
        )
    if kind in (Kind.ORDER, Kind.FEASIBLE) and isinstance(case.target, Target) and evidence.value is not None:
        raise AuditError(
            f"a claim of kind {kind} compares no number, but {case.claim.printed!r} is printed and {evidence.value!r} "
            "computed; make it one of kind value or bound, or leave one of the two out"
        )
    threshold, reason = case.evidence.threshold, case.evidence.threshold_reason
    if threshold is None and not reason:
        return
    if threshold is None:
        raise AuditError(f"the evidence has a threshold_reason and no threshold: {reason!r}; give the number too")
    if not reason:
        raise AuditError(f"the threshold {threshold!r} has no threshold_reason; say in words why that much is allowed")
    if case.claim.kind in NUMERIC:
        raise AuditError(
            f"a claim of kind {case.claim.kind} has no threshold, got {threshold!r}; it may have a tolerance"
        )
    if case.evidence.holds is None or case.evidence.margin is None:
        raise AuditError(f"the threshold {threshold!r} needs holds and margin, which is threshold minus residual")


def _statement(case: Case) -> Judgement:
    holds, margin = case.evidence.holds, case.evidence.margin
    if holds is None:
        raise AuditError(f"a claim of kind {case.claim.kind} needs evidence that says whether it holds")
    by = ""
    if margin is not None:
        if margin != 0 and holds != (margin > 0):
            raise AuditError(f"the evidence contradicts itself: holds is {holds} and the margin is {margin!r}")
        by = f", by a margin of {short(margin, 3)}"
    if margin is not None and case.evidence.threshold is not None:
        allowed = Fraction(case.evidence.threshold)
        residual = allowed - Fraction(margin)
        by = f". Residual {digits(residual, allowed, least=3)}, allowed {digits(allowed, residual, least=3)}"
    words = "The statement holds" if holds else "The statement does not hold"
    if case.claim.kind is Kind.STATISTICAL and case.claim.printed and case.evidence.probability is None:
        words = f"A draw as extreme has probability {'at least' if holds else 'under'} {SMALLEST_PROBABILITY}"
    return Judgement(verdict=Verdict.CONSISTENT if holds else Verdict.REFUTED, reason=f"{words}{by}.")


def _statistical(case: Case) -> Judgement:
    """By the probability, by whether a qualitative statement holds, or, if both are given, by both."""
    probability = case.evidence.probability
    if probability is None:
        if case.evidence.holds is None:
            raise AuditError("a statistical claim needs evidence with a probability, or whether it holds")
        return _statement(case)
    if not 0 <= probability <= 1:
        raise AuditError(f"a probability lies between 0 and 1, got {probability!r}")
    probable = probability >= SMALLEST_PROBABILITY
    # A rank among draws carries one digit, far from the least probability.
    clear = probability >= 2 * SMALLEST_PROBABILITY
    told = f"about {short(probability, 1)}" if clear else digits(Fraction(probability), Fraction("0.01"))
    draws = case.evidence.draws
    if draws is not None and probability <= least_rank(draws):
        told = f"at most {told}, the least that a rank among {draws} draws can show"
    reason = (
        f"A draw at least as extreme as the printed one has probability {told},"
        f" {'not less' if probable else 'less'} than {SMALLEST_PROBABILITY}."
    )
    verdict = Verdict.COMPATIBLE if probable else Verdict.DIFFERS
    if case.evidence.holds is not None:
        statement = _statement(case)
        reason = f"{reason} {statement.reason}"
        verdict = statement.verdict if probable and statement.verdict is Verdict.REFUTED else verdict
    return Judgement(verdict=verdict, reason=reason)


def least_rank(draws: int) -> float:
    """The two-sided probability of a value beyond all of so many draws: what a rank among them shows at least."""
    return 2 / (draws + 1)


# Records of claims: `make_record` stores a claim with all that its verdict depends on, and judges what it stored.
#
# `rejudge` judges a stored record anew. Both go through `judge`, so a verdict set by hand is found out.


OUTCOMES = (
    'outcomes are a list with one entry for each reading of the paper: [{"reading": "logarithms", "value": 48.3}], or '
    '{"reading": ..., "holds": True} where no number is printed'
)


def make_record(
    claim: Claim,
    evidence: Evidence | None,
    erratum: ErratumRecord | None = None,
    *,
    readings: Iterable[Reading] = (),
    code: str = "",
    seconds: float = 0.0,
    error: str = "",
    certificates: Sequence[CertificateRecord] = (),
    unproved: str = "",
    untraced: Sequence[str] = (),
) -> ClaimRecord:
    """The record of `claim` with its verdict; never raises.

    evidence: what the claim answered, None after a failure. erratum: that of the claim, with the outcome of its proof.
    readings: those of the paper. code: file:line of the answer. seconds: of its experiments. error: the failure, or
    empty.
    certificates: those that support the claim; what they prove takes the place of what was computed.
    unproved: why no theorem is possible. untraced: what its experiments did that nothing can follow.
    """
    stated = StatedClaim(**{name: getattr(claim, name) for name in StatedClaim.__struct_fields__})
    try:
        if error:
            raise AuditError(error)
        (usable, proved, supported), failure = with_proofs(stated, plain(evidence), certificates), ""
    except AuditError as unusable:
        # No number of a failed or malformed answer is kept, so that judging the record again gives an error too.
        where = f" [{code}]" if code and not error else ""
        usable, proved, supported, failure = Evidence(method=""), False, "", f"{unusable}{where}"
    change = msgspec.structs.replace
    paths = tuple(certificate.path for certificate in certificates)
    usable = change(usable, code=code, seconds=seconds, certificates=paths, untraced=tuple(untraced))
    judgement = _with_untraced(judge(stated, usable, erratum, readings=readings), usable)
    if failure:
        judgement = Judgement(verdict=Verdict.ERROR, reason=failure, intervals=judgement.intervals)
    judgement = change(judgement, proved=proved, supported=supported, unproved=unproved)
    return ClaimRecord(claim=stated, evidence=usable, judgement=judgement)


def rejudge(
    record: ClaimRecord,
    errata: Mapping[str, ErratumRecord],
    target: Target | None = None,
    *,
    readings: Iterable[Reading] = (),
) -> Judgement:
    """Judge a stored record again from its numbers and the stored proofs alone; its judgement is not looked at.

    errata: by id. target: the printed value, if it was read. readings: those of the paper.

    What its certificates prove is taken from its judgement, which `check` compares with them.
    """
    erratum = errata.get(record.claim.erratum or "")
    judgement = judge(record.claim, record.evidence, erratum, target, readings=readings)
    kept = record.judgement
    told = {name: getattr(kept, name) for name in ("proved", "supported", "unproved")}
    return msgspec.structs.replace(_with_untraced(judgement, record.evidence), **told)


def _with_untraced(judgement: Judgement, evidence: Evidence) -> Judgement:
    if not evidence.untraced:
        return judgement
    return msgspec.structs.replace(judgement, reason=f"{judgement.reason} Not traced: {', '.join(evidence.untraced)}.")


def plain(evidence: Evidence | None) -> Evidence:
    """The evidence with plain finite numbers; raises AuditError naming the field that is not."""
    if not isinstance(evidence, Evidence):
        raise AuditError(f"there is no evidence: it answered {evidence!r:.80}; return Evidence(method=..., value=...)")
    try:
        fields = msgspec.to_builtins(evidence, enc_hook=_from_numpy)
        plain = msgspec.convert(fields, Evidence)
    except (TypeError, msgspec.ValidationError) as error:
        if "$.outcomes" in str(error):
            raise AuditError(f"{error}; {OUTCOMES}") from None
        raise AuditError(f"the evidence is not made of plain numbers: {error}") from None
    require_json("the evidence", fields)
    return plain


def _from_numpy(value: Any) -> Any:
    """NumPy scalars and arrays as numbers and lists, known by their `tolist`."""
    if not hasattr(value, "tolist"):
        raise TypeError(f"{value!r} is a {type(value).__name__}")
    return value.tolist()
