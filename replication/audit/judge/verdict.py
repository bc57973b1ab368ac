"""Verdicts: the one place where a claim and its evidence become a verdict, and are stored with it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import msgspec

from replication.audit.judge.agreement import BY_DIGITS, Target, judge_uncertain, judge_value
from replication.audit.judge.agreement import SMALLEST_PROBABILITY as SMALLEST_PROBABILITY
from replication.audit.judge.numerals import digits, short
from replication.audit.judge.policies import once_corrected, under_some, with_excess, with_inputs, with_own
from replication.audit.judge.proofs import with_proofs
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
from replication.audit.store.records import CertificateRecord, ClaimRecord, ErratumRecord, shared
from replication.errors import AuditError, one_of

SMALLEST_PROBABILITY_REASON = (
    "A single draw can only be contradicted by being improbable; at this level one true print in a hundred would be."
)

TESTS_NOTHING = "A constant fitted to the print alone meets it, which tests nothing"


@dataclass(frozen=True)
class Case:
    """All that a verdict depends on: see `judge`. target: what the claim prints, if anything; or why it cannot be read.

    printed: whether the evidence is for the text as printed, without the correction of the erratum.
    """

    claim: StatedClaim
    evidence: Evidence
    erratum: ErratumRecord | None
    readings: Mapping[str, Reading]
    target: Target | AuditError | None
    printed: bool = False


def judge(
    claim: StatedClaim,
    evidence: Evidence,
    erratum: ErratumRecord | None = None,
    target: Target | None = None,
    *,
    readings: Iterable[Reading] = (),
) -> Judgement:
    """The verdict on `claim`, with its reason, deviation and rounding intervals; `ERROR` for what cannot be compared.

    erratum: that of the claim, with the outcome of its proof. target: the printed value, if it was read. readings:
    those of the paper.
    """
    known = {reading.name: reading for reading in readings}
    case = Case(claim, evidence, erratum, known, target or _target(claim, evidence))
    rested = {claim.reading, *(outcome.reading for outcome in evidence.outcomes)}
    try:
        judgement = with_own(claim, [known[name] for name in known if name in rested], _judge(case))
    except AuditError as error:
        judgement = Judgement(verdict=Verdict.ERROR, reason=str(error))
    untraced = f"Not traced: {', '.join(evidence.untraced)}." if evidence.untraced else ""
    intervals = case.target.written if isinstance(case.target, Target) else ()
    return judgement.further(untraced, intervals=intervals)


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
    """As printed if that agrees; else as corrected, which counts only if the proof of the erratum holds."""
    evidence, meant = case.evidence, case.claim.meant
    mended = case
    if meant:
        claim = msgspec.structs.replace(case.claim, printed=meant)
        mended = replace(case, claim=claim, target=_target(claim, evidence))
    proof = case.erratum if case.erratum is not None and not case.erratum.error else None
    if _is_slip(proof):
        sentence = f"Read with {erratum}, a slip that may be of the text at hand."
        return _found(mended).further(sentence, policies=[Policy.SCAN])
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
    corrected = _found(mended)
    reason = f"With erratum {erratum}: {corrected.reason} {before}"
    if proof is not None and proof.holds and proof.inference:
        reason = f"{reason} The erratum is an inference."
    if corrected.verdict not in AGREES:
        return corrected.further(reason=reason)
    if proof is None:
        raise AuditError(f"the proof of erratum {erratum} could not be run, so its correction does not count")
    if not proof.holds:
        return corrected.further(verdict=verdict, reason=f"The proof of the erratum does not hold. {reason}")
    verdict = Verdict.COMPATIBLE if proof.inference else once_corrected(corrected.verdict)
    return corrected.further(verdict=verdict, reason=reason, policies=[Policy.ERRATUM])


def _is_slip(proof: ErratumRecord | None) -> bool:
    """Whether it is shown to be a slip that may be of the text at hand alone."""
    return proof is not None and proof.scan and proof.holds and not proof.inference


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
    reading = case.readings[one_of("reading of the paper", case.claim.reading, case.readings)]
    if case.printed and reading.inference:
        # Chosen with the print in view, it is a part of the correction.
        return judgement
    judgement = judgement.further(reason=f"Under the reading {reading.name}: {judgement.reason}")
    if reading.policy is Policy.CONSTANT and judgement.verdict in AGREES:
        judgement = judgement.further(f"{TESTS_NOTHING}: {reading.name}.", verdict=Verdict.UNDETERMINED)
    if reading.inference and judgement.verdict is Verdict.REPRODUCED:
        chosen = "The reading is an inference, chosen with printed numbers in view."
        judgement = judgement.further(chosen, verdict=Verdict.COMPATIBLE)
    return judgement


def _family(case: Case) -> Judgement:
    """The verdict on a claim whose answer is known under each reading of a family."""
    evidence = case.evidence
    named = (one_of("reading of the paper", outcome.reading, case.readings) for outcome in evidence.outcomes)
    readings = [case.readings[name] for name in named]
    if len({reading.name for reading in readings}) != len(readings):
        raise AuditError(f"the evidence has two outcomes for one reading: {[reading.name for reading in readings]}")
    _require_fitting(case)
    if evidence.over_inputs is not None:
        raise AuditError("the evidence has outcomes under several readings and over_inputs; a range needs one reading")
    judgements = {outcome.reading: _compare(replace(case, evidence=outcome.evidence)) for outcome in evidence.outcomes}
    ruled_out = [reading.name for reading in readings if reading.policy is Policy.RULED_OUT]
    fitted = [reading.name for reading in readings if reading.policy is Policy.CONSTANT]
    left = [reading for reading in readings if reading.name not in (*ruled_out, *fitted)]
    verdicts = [judgements[reading.name].verdict for reading in left]
    if not verdicts:
        raise AuditError(
            f"the family has no reading that decides: ruled out are {ruled_out}, and fitted to the print {fitted}"
        )
    agreeing, numbers = sum(verdict in AGREES for verdict in verdicts), _compares_numbers(case.claim)
    met = [name for name in fitted if judgements[name].verdict in AGREES]
    decided: tuple[Policy, ...] = ()
    if agreeing == len(verdicts):
        chosen = numbers and (case.claim.kind is Kind.STATISTICAL or all(reading.inference for reading in left))
        verdict = Verdict.COMPATIBLE if chosen else verdicts[0]
    elif all(verdict in DISAGREES for verdict in verdicts) and not met:
        verdict = Verdict.DIFFERS if numbers else Verdict.REFUTED
    else:
        verdict, decided = under_some(agreeing, len(verdicts), numbers)
    text = "; ".join(f"{name}: {judgement.reason.rstrip('.')}" for name, judgement in judgements.items())
    # What would fit the print and break the step does not count, so that these are the valid ones.
    mended = case.claim.erratum is not None and not case.printed and not _is_slip(case.erratum)
    which = "that leave the corrected step valid" if verdict is Verdict.DIFFERS and mended else "of the text"
    reasons = [f"It {'agrees' if numbers else 'holds'} under {agreeing} of {len(verdicts)} readings {which}. {text}."]
    if ruled_out:
        reasons.append(f"The text rules out and the verdict leaves out: {', '.join(ruled_out)}.")
    if met:
        reasons.append(f"{TESTS_NOTHING}: {', '.join(met)}.")
    elif fitted:
        reasons.append(f"No constant fitted to the print meets it, which is not counted: {', '.join(fitted)}.")
    shown = [_compare(case)] if evidence.value is not None and case.claim.kind in NUMERIC else judgements.values()
    deviations = [judgement.deviation_ulp for judgement in shown if judgement.deviation_ulp is not None]
    return Judgement(
        verdict=verdict,
        reason=" ".join(reasons),
        deviation_ulp=min(deviations, key=abs, default=None),
        policies=tuple(dict.fromkeys((*decided, *(each for entry in judgements.values() for each in entry.policies)))),
        readings=(agreeing, len(verdicts)),
    )


def _compare(case: Case) -> Judgement:
    claim, evidence = case.claim, case.evidence
    _require_fitting(case)
    if claim.kind not in NUMERIC:
        return _statistical(case) if claim.kind is Kind.STATISTICAL else _statement(case)
    if case.target is None:
        raise AuditError(f"a claim of kind {claim.kind} needs its printed value")
    if isinstance(case.target, AuditError):
        raise case.target
    printed = case.target.printed
    if printed.relation and claim.kind is not Kind.BOUND:
        raise AuditError(f"printed value {printed.text!r} is a relation; a claim of kind bound compares those")
    if claim.kind is Kind.BOUND and not printed.relation:
        raise AuditError(f"printed value {printed.text!r} has no relation; a bound is printed like <0.001 or ≥2")
    if any(entry.spread for entry in printed.entries):
        judgement = judge_uncertain(case.target, evidence, claim.uncertainty)
    else:
        judgement = judge_value(case.target, evidence)
    if claim.uncertainty in BY_DIGITS:
        alone = "" if isinstance(evidence.value, tuple) else "What is printed beside it was not compared."
        judgement = judgement.further(BY_DIGITS[claim.uncertainty], alone)
    if claim.tolerance is not None:
        judgement = judgement.further(f"Tolerance ±{claim.tolerance}: {claim.tolerance_reason}")
    solver = next((reading for reading in case.readings.values() if reading.policy is Policy.SOLVER), None)
    judgement = with_excess(claim, case.target, evidence, judgement, solver)
    return with_inputs(claim, case.target, evidence, judgement)


def _require_fitting(case: Case) -> None:
    """Raise AuditError for what a claim of this kind does not have, and for a number without its reason."""
    claim, evidence, kind = case.claim, case.evidence, case.claim.kind
    threshold, reason, numeric = evidence.threshold, evidence.threshold_reason, kind in NUMERIC
    if claim.tolerance is not None and not claim.tolerance_reason:
        raise AuditError(f"the tolerance {claim.tolerance} has no tolerance_reason; half a printed unit needs none")
    if claim.tolerance is not None and kind not in (Kind.VALUE, Kind.MATRIX):
        raise AuditError(f"a claim of kind {kind} has no tolerance, got {claim.tolerance}; leave it out")
    if claim.uncertainty and kind not in (Kind.VALUE, Kind.MATRIX):
        raise AuditError(f"a claim of kind {kind} has no uncertainty, got {claim.uncertainty!r}; leave it out")
    if not numeric and (claim.optimum or evidence.over_inputs is not None):
        raise AuditError(f"a claim of kind {kind} compares no number: neither optimum nor over_inputs")
    if kind is not Kind.STATISTICAL and (evidence.probability, evidence.draws) != (None, None):
        raise AuditError(
            f"a claim of kind {kind} has no probability, got {evidence.probability!r}; make it one of kind "
            "statistical, or say by holds and margin whether the probability is what the text says of it"
        )
    if kind in (Kind.ORDER, Kind.FEASIBLE) and isinstance(case.target, Target) and evidence.value is not None:
        raise AuditError(
            f"a claim of kind {kind} compares no number, but {claim.printed!r} is printed and {evidence.value!r} "
            "computed; make it one of kind value or bound, or leave one of the two out"
        )
    if threshold is None and reason:
        raise AuditError(f"the evidence has a threshold_reason and no threshold: {reason!r}; give the number too")
    if threshold is not None and not reason:
        raise AuditError(f"the threshold {threshold!r} has no threshold_reason; say in words why that much is allowed")
    if threshold is not None and numeric:
        raise AuditError(f"a claim of kind {kind} has no threshold, got {threshold!r}; it may have a tolerance")
    if threshold is not None and None in (evidence.holds, evidence.margin):
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
    text = f"about {short(probability, 1)}" if clear else digits(Fraction(probability), Fraction("0.01"))
    draws = case.evidence.draws
    # The two-sided probability of a value beyond all draws.
    if draws is not None and probability <= 2 / (draws + 1):
        text = f"at most {text}, the least that a rank among {draws} draws can show"
    judgement = Judgement(
        verdict=Verdict.COMPATIBLE if probable else Verdict.DIFFERS,
        reason=f"A draw at least as extreme as the printed one has probability {text},"
        f" {'not less' if probable else 'less'} than {SMALLEST_PROBABILITY}.",
    )
    if case.evidence.holds is None:
        return judgement
    statement = _statement(case)
    refuted = probable and statement.verdict is Verdict.REFUTED
    return judgement.further(statement.reason, verdict=statement.verdict if refuted else judgement.verdict)


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

    evidence: what the claim answered, None after a failure. erratum, readings: as for `judge`. code: file:line of the
    answer. seconds: of its experiments. error: the failure, or empty. certificates: those that support the claim, whose
    proofs take the place of what was computed. unproved: why no theorem is possible. untraced: what nothing can follow.
    """
    stated = StatedClaim(**shared(StatedClaim, claim))
    try:
        if error:
            raise AuditError(error)
        (usable, proved, supported), failure = with_proofs(stated, plain(evidence), certificates), ""
    except AuditError as unusable:
        # No number of a failed or malformed answer is kept, so that judging the record again gives an error too.
        where = f" [{code}]" if code and not error else ""
        usable, proved, supported, failure = Evidence(method=""), False, "", f"{unusable}{where}"
    paths = tuple(certificate.path for certificate in certificates)
    usable = msgspec.structs.replace(usable, code=code, seconds=seconds, certificates=paths, untraced=tuple(untraced))
    judgement = judge(stated, usable, erratum, readings=readings)
    if failure:
        judgement = Judgement(verdict=Verdict.ERROR, reason=failure, intervals=judgement.intervals)
    judgement = judgement.further(proved=proved, supported=supported, unproved=unproved)
    return ClaimRecord(claim=stated, evidence=usable, judgement=judgement)


def rejudge(
    record: ClaimRecord,
    errata: Mapping[str, ErratumRecord],
    target: Target | None = None,
    *,
    readings: Iterable[Reading] = (),
) -> Judgement:
    """Judge a stored record again from its numbers and the stored proofs alone; errata: by id; the rest as `judge`.

    What its certificates prove is taken from its judgement, which `check` compares with them.
    """
    erratum = errata.get(record.claim.erratum or "")
    judgement, proofs = judge(record.claim, record.evidence, erratum, target, readings=readings), record.judgement
    return judgement.further(proved=proofs.proved, supported=proofs.supported, unproved=proofs.unproved)


def plain(evidence: Evidence | None) -> Evidence:
    """The evidence with plain finite numbers; raises AuditError naming the field that is not."""
    if not isinstance(evidence, Evidence):
        raise AuditError(f"there is no evidence: it answered {evidence!r:.80}; return Evidence(method=..., value=...)")
    try:
        fields = msgspec.to_builtins(evidence, enc_hook=_from_numpy)
        plain = msgspec.convert(fields, Evidence)
    except (TypeError, msgspec.ValidationError) as error:
        if "$.outcomes" in str(error):
            raise AuditError(
                f"{error}; outcomes are a list with one entry for each reading of the paper: "
                '[{"reading": "logarithms", "value": 48.3}], '
                'or {"reading": ..., "holds": True} where no number is printed'
            ) from None
        raise AuditError(f"the evidence is not made of plain numbers: {error}") from None
    require_json("the evidence", fields)
    return plain


def _from_numpy(value: Any) -> Any:
    """NumPy scalars and arrays as numbers and lists, known by their `tolist`."""
    if not hasattr(value, "tolist"):
        raise TypeError(f"{value!r} is a {type(value).__name__}")
    return value.tolist()
