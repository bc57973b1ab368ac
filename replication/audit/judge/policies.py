"""Policies that hold for all papers alike: each rule in words, and the function that applies it.

A policy that spares one paper spares all. A judgement names those that touched it, and the report lists them.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

import msgspec

from replication.audit.data import words
from replication.audit.judge.agreement import Target, judge_value, measure
from replication.audit.judge.numerals import exact, short
from replication.audit.model import DISAGREES, Claim, Evidence, Judgement, Kind, Policy, Reading, StatedClaim, Verdict
from replication.audit.store.records import ClaimRecord
from replication.errors import AuditError

RULES: Mapping[Policy, str] = {Policy(name): text for name, text in words("policies").items()}
OF_READINGS = (Policy.SOLVER, Policy.CONSTANT, Policy.RULED_OUT, Policy.OWN)
"""Policies that a reading brings with it."""


def with_excess(
    claim: StatedClaim, target: Target, evidence: Evidence, judgement: Judgement, solver: Reading | None
) -> Judgement:
    """The judgement on a claim that prints a least level; `compatible` if it is too high by what a solver leaves open.

    solver: the reading of the paper that its levels are where a solver stopped; None if it obtains them otherwise.
    Raises AuditError if the claim does not print one real number.
    """
    if not claim.optimum:
        return judgement
    if claim.kind is not Kind.VALUE or len(target.printed.entries) != 1:
        raise AuditError(f"an optimum is one printed number, a claim of kind value; got {claim.printed!r}")
    if judgement.verdict is not Verdict.DIFFERS:
        return judgement
    (number,) = measure(target, evidence)
    least, low = target.intervals[0].ends[0], number.bracket.low
    if low <= 0 or number.bracket.high >= least:
        return judgement
    relative = least / Fraction(low) - 1
    rounded = exact(round(number.value / number.entry.unit) * number.entry.unit)
    words = (
        f"The optimum rounds to {rounded}. The least number that rounds to the print is {_percent(relative)} above the "
        "optimum"
    )
    if solver is None or solver.accuracy is None:
        return judgement.further(f"{words}, and the text names no means that would explain it.")
    accuracy = Fraction(str(solver.accuracy))
    allowed = f"a solver that stops within {_percent(accuracy)} of the square of the level"
    if (1 + relative) ** 2 - 1 > accuracy:
        return judgement.further(f"{words}, more than {allowed} explains.")
    words += f", no more than {allowed} explains; so under the reading {solver.name} it agrees."
    return judgement.further(words, verdict=Verdict.COMPATIBLE, policies=[Policy.SOLVER])


def _percent(share: Fraction) -> str:
    return f"{short(float(100 * share), 2)} %"


def with_inputs(claim: StatedClaim, target: Target, evidence: Evidence, judgement: Judgement) -> Judgement:
    """The judgement with the rounding of printed inputs in view: `compatible` for `differs` where it may explain it.

    Inputs here are printed results, such as gains or poles; parameters that a text chooses are exact. Raises AuditError
    if the range over all inputs that round to their prints is not that of one number, or leaves it out.
    """
    over = evidence.over_inputs
    if over is None:
        return judgement
    if len(target.printed.entries) != 1:
        raise AuditError("the range over printed inputs is that of one number; a list has no such range")
    if over.lower > over.upper:
        raise AuditError(f"the range over printed inputs is empty: [{over.lower!r}, {over.upper!r}]")
    ranged = judge_value(target, Evidence(method="", value=evidence.value, lower=over.lower, upper=over.upper))
    if judgement.verdict is not Verdict.DIFFERS:
        return judgement
    sentence = f"Over all inputs that round to their prints ({over.how}): {ranged.reason}"
    if ranged.verdict is Verdict.DIFFERS:
        return judgement.further(sentence, policies=[Policy.INPUTS])
    sentence += " So the rounding of the inputs may explain the print."
    return judgement.further(sentence, verdict=Verdict.COMPATIBLE, policies=[Policy.INPUTS])


def under_some(agreeing: int, among: int, numbers: bool) -> tuple[Verdict, tuple[Policy, ...]]:
    """The verdict where readings disagree, from how many agree, and the policy that decides it if some do."""
    if not 0 < agreeing < among:
        return Verdict.UNDETERMINED, ()
    return Verdict.COMPATIBLE if numbers else Verdict.UNDETERMINED, (Policy.SOME,)


def once_corrected(verdict: Verdict) -> Verdict:
    """The verdict on what agrees only once a misprint is corrected, from that on the corrected text: never a better."""
    as_it_stands = verdict in (Verdict.REPRODUCED, Verdict.CONSISTENT)
    return Verdict.REPRODUCED_AFTER_ERRATUM if as_it_stands else verdict


def with_own(claim: StatedClaim, readings: Sequence[Reading], judgement: Judgement) -> Judgement:
    """The judgement with what the readings that it rests on and its kind bring: nothing of ours is reproduced."""
    brought = {reading.policy for reading in readings} - {Policy.SOLVER}
    touched = [policy for policy in Policy if policy in brought or (claim.ours and policy is Policy.REMARK)]
    best = (Verdict.REPRODUCED, Verdict.REPRODUCED_AFTER_ERRATUM)
    if brought - {Policy.RULED_OUT} != {Policy.OWN} or judgement.verdict not in best:
        return judgement.further(policies=touched)
    ours = "It rests on what is ours, so it is not reproduced."
    return judgement.further(ours, verdict=Verdict.COMPATIBLE, policies=touched)


def repeated(claims: Iterable[Claim]) -> list[Claim]:
    """The claims of a paper, each that says the same as an earlier one linked to the first that does."""
    first: dict[str, str] = {}
    linked = []
    for claim in claims:
        fact = json.dumps(sorted(json.dumps(fields, sort_keys=True) for fields in msgspec.to_builtins(claim.says)))
        original = first.setdefault(fact, claim.id) if claim.says and not claim.ours else claim.id
        linked.append(msgspec.structs.replace(claim, repeats="" if original == claim.id else original))
    return linked


def same_fact(record: ClaimRecord, first: Judgement | None) -> ClaimRecord:
    """The record with `first`, the verdict of the claim that says the same; an error if the two contradict."""
    second = record.judgement
    if first is None or Verdict.ERROR in (second.verdict, first.verdict):
        return record
    wrong = {verdict in DISAGREES for verdict in (second.verdict, first.verdict)}
    text = f"It says the same as {record.claim.repeats}, which is {first.verdict}"
    reason, verdict = f"{text}. {second.reason}", first.verdict
    if len(wrong) > 1:
        reason = f"{text}; on its own evidence it would be {second.verdict}: one of the two is wrong. {second.reason}"
        verdict = Verdict.ERROR
    judgement = second.further(verdict=verdict, reason=reason, policies=[Policy.FACT])
    return msgspec.structs.replace(record, judgement=judgement)


def once(claims: Iterable[ClaimRecord]) -> tuple[ClaimRecord, ...]:
    """The claims that totals count: a fact that a text says twice counts where it is first, and remarks of ours not."""
    return tuple(claim for claim in claims if claim.counted)


def by_policy(claims: Sequence[ClaimRecord]) -> tuple[tuple[Policy, str, tuple[ClaimRecord, ...]], ...]:
    """Each policy with its rule and the claims that it touched."""
    return tuple(
        (policy, rule, tuple(claim for claim in claims if policy in claim.judgement.policies))
        for policy, rule in RULES.items()
    )
