"""Policies that hold for all papers alike: excess of a printed optimum, rounding of printed inputs, repeats."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import msgspec

from replication.audit.judge.agreement import Target, judge_bound, judge_value, measure
from replication.audit.judge.numerals import short
from replication.audit.model import Evidence, Judgement, Kind, OverInputs, Verdict
from replication.audit.store.records import ClaimRecord, StatedClaim
from replication.errors import AuditError

EXCESS = 0.01
"""By this much, relatively, a printed optimum may be too high because a solver stopped early."""
EXCESS_REASON = (
    "Solvers of matrix inequalities stop once the level is near the optimum; one in common use, mincx, does so by"
    " default within 1 per cent"
)


CHOSEN = "The parameters are the text's own choice and count as exact: no rounding of theirs is taken to explain it."
"""Of the inputs of an optimum: a plant and a schedule are what a text computes with, not results that it rounds."""


@dataclass(frozen=True)
class Excess:
    """How far the least number that rounds to the print lies above the optimum, relative to it, and at most so far."""

    relative: Fraction

    @property
    def explained(self) -> bool:
        """Whether a solver that stops early may end there."""
        return self.relative <= Fraction(str(EXCESS))


def excess(target: Target, evidence: Evidence) -> Excess | None:
    """The excess of a printed least level over the true one; None if it is not too high.

    Where the optimum is known by a bracket, its lower end counts.
    """
    (number,) = measure(target, evidence)
    assert number.interval is not None
    least, _ = number.interval.ends
    low, high = number.bracket.low, number.bracket.high
    if low is None or high is None or low <= 0 or high >= least:
        return None
    return Excess((least - low) / low)


def with_excess(claim: StatedClaim, target: Target, evidence: Evidence, judgement: Judgement) -> Judgement:
    """The judgement on a claim that prints an optimum; if the print is too high, its reason says by how much.

    The verdict stays `differs`: the text calls the number an optimum, and that is what its digits are compared with.
    Raises AuditError if the claim does not print one real number.
    """
    if not claim.optimum:
        return judgement
    if claim.kind is not Kind.VALUE or len(target.printed.entries) != 1:
        raise AuditError(f"an optimum is one printed number, a claim of kind value; got {claim.printed!r}")
    found = excess(target, evidence) if judgement.verdict is Verdict.DIFFERS else None
    if found is None:
        return judgement
    share = f"{short(float(100 * found.relative), 3)} %"
    words = f"The least number that rounds to the print is {share} above the optimum"
    if found.explained:
        words = f"{words}. {EXCESS_REASON}; the print is still not the optimum that the text speaks of."
    else:
        words = f"{words}, more than a solver that stops early explains ({short(100 * EXCESS)} %)."
    chosen = f" {CHOSEN}" if evidence.over_inputs is None else ""
    return msgspec.structs.replace(judgement, reason=f"{judgement.reason} {words}{chosen}")


def with_inputs(claim: StatedClaim, target: Target, evidence: Evidence, judgement: Judgement) -> Judgement:
    """The judgement with the rounding of printed inputs in view: `compatible` for `differs` where it may explain it.

    Inputs here are printed results, such as gains, poles or a filter, which the text had with more digits; parameters
    that it chooses are exact. The outcome over all inputs that round to the print is a range. Where it meets what the
    printed number stands for, the text does not tell the two apart. Raises AuditError if it is not the range of one
    number, or leaves it out.
    """
    over = evidence.over_inputs
    if over is None:
        return judgement
    if len(target.printed.entries) != 1:
        raise AuditError("the range over printed inputs is that of one number; a list has no such range")
    if over.lower > over.upper:
        raise AuditError(f"the range over printed inputs is empty: [{over.lower!r}, {over.upper!r}]")
    judge = judge_bound if claim.kind is Kind.BOUND else judge_value
    ranged = judge(target, _as_bracket(evidence, over))
    if judgement.verdict is not Verdict.DIFFERS:
        return judgement
    meets = ranged.verdict is not Verdict.DIFFERS
    said = f"Over all inputs that round to their prints ({over.how}): {ranged.reason}"
    reason = f"{judgement.reason} {said}{' So the rounding of the inputs may explain the print.' if meets else ''}"
    return msgspec.structs.replace(judgement, verdict=Verdict.COMPATIBLE if meets else judgement.verdict, reason=reason)


def _as_bracket(evidence: Evidence, over: OverInputs) -> Evidence:
    return Evidence(method=evidence.method, value=evidence.value, lower=over.lower, upper=over.upper)


def once(claims: Iterable[ClaimRecord]) -> tuple[ClaimRecord, ...]:
    """The claims that totals count: a number that a text repeats counts where it is answered first."""
    return tuple(claim for claim in claims if not claim.claim.repeats)
