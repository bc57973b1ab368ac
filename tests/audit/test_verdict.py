"""Verdicts: the rules of every kind, of errata and of evidence that is none; records are judged again alike."""

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from cases import case, errata_of, judge, recorded, statement_case, value_case
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from tables import rows

from replication.audit.judge.verdict import rejudge
from replication.audit.model import Evidence, Kind, Outcome, Policy, Proof, Reading, Verdict
from replication.audit.store.records import ClaimRecord

PROVED = Proof(holds=True, text="it does")
REFUTED = Proof(holds=False, text="it does not")


# Statements.


@pytest.mark.parametrize("kind", [Kind.ORDER, Kind.FEASIBLE])
@pytest.mark.parametrize(("holds", "margin", "verdict"), rows("statements"))
def test_statement_holds_or_not_and_its_margin_agrees(
    kind: Kind, holds: bool | None, margin: float | None, verdict: str
) -> None:
    judgement = judge(statement_case(kind, holds, margin))
    assert judgement.verdict == verdict
    assert margin != 0.25 or verdict == Verdict.ERROR or "0.25" in judgement.reason


@pytest.mark.parametrize(("probability", "holds", "verdict"), rows("draws"))
def test_statistical(probability: float | None, holds: bool | None, verdict: str) -> None:
    evidence = Evidence(method="computed", probability=probability, holds=holds)
    assert judge(case(Kind.STATISTICAL, evidence)).verdict == verdict


def test_any_kind_may_be_undetermined() -> None:
    for kind in Kind:
        judgement = judge(case(kind, Evidence(method="", not_checkable="taken from elsewhere")))
        assert (judgement.verdict, judgement.reason) == (Verdict.UNDETERMINED, "taken from elsewhere")


# Errata.


@pytest.mark.parametrize(("before", "after", "proof", "verdict"), rows("errata"))
def test_erratum_counts_only_if_needed_and_proved(
    before: float | None, after: float, proof: bool | None, verdict: str
) -> None:
    as_printed = None if before is None else Evidence(method="computed", value=before)
    both = value_case("1.33", after, as_printed=as_printed, erratum="toy.e1", proof_holds=proof)
    assert judge(both).verdict == verdict


def test_erratum_without_a_printed_reading_says_why() -> None:
    judgement = judge(value_case("1.33", 1.33, erratum="toy.e1", proof_holds=True, note="the formula has no value"))
    assert judgement.verdict is Verdict.REPRODUCED_AFTER_ERRATUM
    assert "the formula has no value" in judgement.reason
    draw = Evidence(method="m", probability=0.5, as_printed=Evidence(method="m", probability=0.0))
    tried = case(Kind.STATISTICAL, draw, printed="0.4", erratum="toy.e1", proof_holds=True)
    assert judge(tried).verdict is Verdict.COMPATIBLE


@pytest.mark.parametrize("kind", [Kind.VALUE, Kind.FEASIBLE, Kind.STATISTICAL])
def test_a_text_that_as_printed_gives_nothing_agrees_only_once_corrected(kind: Kind) -> None:
    before = Evidence(method="m", not_checkable="a constant has no value")
    printed = "1.33" if kind is Kind.VALUE else ""
    for number, holds, proof in ((1.33, True, True), (1.33, True, False), (2.0, False, True)):
        after = Evidence(method="m", value=number, holds=holds, as_printed=before)
        judgement = judge(case(kind, after, printed=printed, erratum="toy.e1", proof_holds=proof))
        assert (judgement.verdict is Verdict.REPRODUCED_AFTER_ERRATUM) == (holds and proof)
        assert "a constant has no value" in judgement.reason


@pytest.mark.parametrize("kind", [Kind.ORDER, Kind.FEASIBLE, Kind.STATISTICAL])
@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [
        (True, False, Verdict.CONSISTENT),
        (False, True, Verdict.REPRODUCED_AFTER_ERRATUM),
        (False, False, Verdict.REFUTED),
    ],
)
def test_statement_with_an_erratum(kind: Kind, before: bool, after: bool, verdict: Verdict) -> None:
    printed = Evidence(method="computed", holds=before)
    both = statement_case(kind, after, as_printed=printed, erratum="toy.e1", proof_holds=True)
    assert judge(both).verdict is verdict


@pytest.mark.parametrize(("value", "proof", "verdict"), rows("meant"))
def test_a_misprinted_result_is_compared_with_what_is_meant(value: float, proof: bool | None, verdict: str) -> None:
    misprinted = value_case("0.8296", value, erratum="toy.e1", meant="0.8926", proof_holds=proof)
    judgement = judge(misprinted)
    assert judgement.verdict == verdict
    assert ("As printed: " in judgement.reason) == (verdict in (Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.DIFFERS))
    inferred = Verdict.COMPATIBLE if verdict == Verdict.REPRODUCED_AFTER_ERRATUM else verdict
    assert judge(misprinted, inferred=True).verdict == inferred


@pytest.mark.parametrize("kind", [Kind.VALUE, Kind.ORDER])
def test_an_erratum_that_is_an_inference_makes_the_claim_compatible(kind: Kind) -> None:
    numbers = (2.0, 1.33) if kind is Kind.VALUE else (None, None)
    before = Evidence(method="m", value=numbers[0], holds=False)
    after = Evidence(method="m", value=numbers[1], holds=True, as_printed=before)
    tried = case(kind, after, printed="1.33", erratum="toy.e1", proof_holds=True)
    assert judge(tried).verdict is Verdict.REPRODUCED_AFTER_ERRATUM
    judgement = judge(tried, inferred=True)
    assert judgement.verdict is Verdict.COMPATIBLE and "is an inference" in judgement.reason
    agreeing = replace(after, as_printed=replace(before, value=numbers[1], holds=True))
    assert judge(case(kind, agreeing, printed="1.33", erratum="toy.e1", proof_holds=True), inferred=True).verdict in (
        Verdict.REPRODUCED,
        Verdict.CONSISTENT,
    )


@pytest.mark.parametrize("inferred", [True, False])
def test_what_fails_once_corrected_names_an_inference_too_and_the_readings_that_count(inferred: bool) -> None:
    before = Evidence(method="m", value=2.0)
    outcomes = tuple(Outcome(reading=reading.name, value=1.5) for reading in (NORM, START))
    tried = value_case("1.33", 1.5, as_printed=before, outcomes=outcomes, erratum="e", proof_holds=True)
    judgement = judge(tried, inferred=inferred, readings=READINGS)
    assert judgement.verdict is Verdict.DIFFERS
    assert judgement.reason.endswith("The erratum is an inference.") is inferred
    assert "under 0 of 2 readings that leave the corrected step valid." in judgement.reason
    plain = judge(value_case("1.33", 1.5, outcomes=outcomes), readings=READINGS)
    assert plain.reason.startswith("It agrees under 0 of 2 readings of the text.")


def test_an_inference_belongs_to_the_correction_and_not_to_the_text_as_printed() -> None:
    """A reading of the text stays in both; one chosen with the print in view is named for the correction alone."""
    for inference in (False, True):
        reading = Reading(name="chosen", place="p", text="t", inference=inference)
        tried = value_case(
            "1.33", 1.33, as_printed=Evidence(method="m", value=1.40), erratum="e", proof_holds=True, reading="chosen"
        )
        corrected, _, printed = judge(tried, readings=[reading]).reason.partition("As printed: ")
        assert "Under the reading chosen" in corrected
        assert ("Under the reading chosen" in printed) is not inference


@pytest.mark.parametrize(("probability", "told"), [(2 / 2001, True), (0.5, False)])
def test_a_rank_shows_no_less_than_its_draws_allow(probability: float, told: bool) -> None:
    ranked = Evidence(method="m", probability=probability, draws=2000)
    reason = judge(case(Kind.STATISTICAL, ranked, printed="0.4")).reason
    assert ("at most" in reason and "the least that a rank among 2000 draws can show" in reason) is told
    alone = replace(ranked, draws=None)
    assert "at most" not in judge(case(Kind.STATISTICAL, alone, printed="0.4")).reason


# Readings.

NORM = Reading(name="norm", place="eq. (3)", text="the Euclidean norm")
START = Reading(name="start", place="Section V", text="from rest")
FITTED = Reading(name="fitted", place="Table 2", text="the sum over both noises", inference=True)
READINGS = (NORM, START, FITTED)


@pytest.mark.parametrize(("reading", "value", "verdict"), rows("readings"))
def test_a_reading_is_named_and_an_inference_only_compatible(reading: str, value: float, verdict: str) -> None:
    judgement = judge(value_case("1.33", value, reading=reading), readings=READINGS)
    assert judgement.verdict == verdict
    assert (f"reading {reading}:" in judgement.reason) is (reading in ("norm", "fitted"))
    assert ("inference" in judgement.reason) is (verdict == Verdict.COMPATIBLE)
    statement = judge(statement_case(Kind.ORDER, True, 0.5, reading="fitted"), readings=READINGS)
    assert statement.verdict is Verdict.CONSISTENT and statement.reason.startswith("Under the reading fitted: ")


@pytest.mark.parametrize(("values", "verdict"), rows("families"))
def test_a_number_under_a_family_of_readings(values: dict[str, float | None], verdict: str) -> None:
    outcomes = tuple(Outcome(reading=name, value=value) for name, value in values.items())
    judgement = judge(value_case("1.33", None, outcomes=outcomes), readings=READINGS)
    assert judgement.verdict == verdict
    if verdict != Verdict.ERROR:
        assert all(name in judgement.reason for name in values)
        nearest = min((value for value in values.values() if value), key=lambda value: abs(value - 1.33))
        assert judgement.deviation_ulp == pytest.approx((nearest - 1.33) / 0.01)
        assert judge(value_case("1.33", 1.35, outcomes=outcomes), readings=READINGS).deviation_ulp == pytest.approx(2)


def test_an_undecided_outcome_leaves_a_family_undetermined_unless_another_agrees() -> None:
    wide = Outcome(reading="norm", value=1.33, lower=1.3, upper=1.4)
    other, agreeing = Outcome(reading="start", value=2.0), Outcome(reading="start", value=1.33)
    assert judge(value_case("1.33", None, outcomes=(wide, other)), readings=READINGS).verdict is Verdict.UNDETERMINED
    assert judge(value_case("1.33", None, outcomes=(wide, agreeing)), readings=READINGS).verdict is Verdict.COMPATIBLE


@pytest.mark.parametrize(
    ("holds", "statement", "draw"),
    [
        ((True, True), Verdict.CONSISTENT, Verdict.COMPATIBLE),
        ((False, False), Verdict.REFUTED, Verdict.DIFFERS),
        ((True, False), Verdict.UNDETERMINED, Verdict.COMPATIBLE),
        ((True, None), Verdict.ERROR, Verdict.ERROR),
    ],
)
def test_a_statement_or_a_printed_draw_under_a_family_of_readings(
    holds: tuple[bool | None, bool], statement: Verdict, draw: Verdict
) -> None:
    outcomes = tuple(Outcome(reading=name, holds=held) for name, held in zip(("norm", "start"), holds, strict=True))
    evidence = Evidence(method="m", outcomes=outcomes)
    for kind in (Kind.ORDER, Kind.FEASIBLE, Kind.STATISTICAL):
        judgement = judge(case(kind, evidence), readings=READINGS)
        assert judgement.verdict is statement
        assert judgement.policies == ((Policy.SOME,) if holds == (True, False) else ())
    assert judge(case(Kind.STATISTICAL, evidence, printed="0.4"), readings=READINGS).verdict is draw


def test_a_reading_has_one_outcome() -> None:
    twice = (Outcome(reading="norm", value=1.33), Outcome(reading="norm", value=1.4))
    judgement = judge(value_case("1.33", None, outcomes=twice), readings=READINGS)
    assert judgement.verdict is Verdict.ERROR and "two outcomes" in judgement.reason


# What is no evidence.


def found(said: dict[str, Any] | None) -> Evidence:
    return msgspec.convert({"method": "computed"} | (said or {}), Evidence)


@pytest.mark.parametrize(("kind", "stated", "said", "words"), rows("no evidence"))
def test_what_cannot_be_compared_is_an_error(
    kind: str, stated: dict[str, Any] | None, said: dict[str, Any] | None, words: str
) -> None:
    judgement = judge(case(Kind(kind), found(said), **(stated or {})), readings=READINGS)
    assert judgement.verdict is Verdict.ERROR
    assert judgement.deviation_ulp is None
    assert words in judgement.reason


def test_another_tolerance_is_used_and_its_reason_shown() -> None:
    judgement = judge(value_case("1.33", 1.41, tolerance="0.1", tolerance_reason="read off a plot"))
    assert judgement.verdict is Verdict.REPRODUCED
    assert "±0.1: read off a plot" in judgement.reason
    for printed, value, allowed, verdict in (
        ("1.33", 1.44, "0.1", Verdict.DIFFERS),
        ("0.5", 0.75, "0.25", judgement.verdict),
    ):
        tried = value_case(printed, value, tolerance=allowed, tolerance_reason="read off a plot")
        assert judge(tried).verdict is verdict, "an end belongs to its interval"


@pytest.mark.parametrize(
    ("holds", "margin", "words"),
    [
        (True, 1e-12 - 5e-15, "The statement holds. Residual 5×10⁻¹⁵, allowed 10⁻¹²."),
        (False, 1e-12 - 3.25, "The statement does not hold. Residual 3.25, allowed 10⁻¹²."),
        (True, 1e-22, "Residual 9.999999999×10⁻¹³, allowed 10⁻¹²."),
    ],
)
def test_a_threshold_is_told_with_the_residual(holds: bool, margin: float, words: str) -> None:
    evidence = Evidence(method="m", holds=holds, margin=margin, threshold=1e-12, threshold_reason="rounding")
    judgement = judge(case(Kind.ORDER, evidence))
    assert judgement.verdict is (Verdict.CONSISTENT if holds else Verdict.REFUTED)
    assert judgement.reason.endswith(words)


@pytest.mark.parametrize(("kind", "said", "words"), rows("unfit evidence"))
def test_evidence_has_what_its_kind_compares_and_reasons(kind: str, said: dict[str, Any], words: str) -> None:
    value = 1.33 if kind == Kind.VALUE else None
    good = Evidence(method="m", holds=True, margin=0.1, value=value, as_printed=found(said))
    for tried in (
        case(Kind(kind), found(said), printed="1.33"),
        case(Kind(kind), good, printed="1.33", erratum="toy.e1", proof_holds=True),
    ):
        judgement = judge(tried)
        assert judgement.verdict is Verdict.ERROR
        assert words in judgement.reason


# Records.


@pytest.mark.parametrize(
    ("evidence", "error", "words"),
    [
        (None, "", "no evidence"),
        (None, "ValueError: singular", "ValueError: singular"),
        (Evidence(method="m", value=1.33), "ValueError: singular", "ValueError: singular"),
        (1.33, "", "1.33"),
        (Evidence(method="", value=1.33), "", "no evidence"),
        (Evidence(method="m"), "", "no value"),
        (Evidence(method="m", value=math.nan), "", "the evidence.value is nan"),
        (Evidence(method="m", value=1.33, quantities={"norm": math.inf}), "", "the evidence.quantities.norm is inf"),
        (Evidence(method="m", value="1.33"), "", "value"),  # type: ignore[arg-type]
        (Evidence(method="m", value=1.33 + 0j), "", "complex"),  # type: ignore[arg-type]
    ],
)
def test_claim_without_usable_evidence_is_an_error_also_when_judged_again(
    evidence: Any, error: str, words: str
) -> None:
    record = recorded(evidence, error=error)
    assert record.verdict is Verdict.ERROR
    assert words in record.judgement.reason
    assert rejudge(through_json(record), {}).verdict is Verdict.ERROR


def test_numpy_numbers_are_stored_as_plain_ones() -> None:
    evidence = Evidence(
        method="m",
        value=np.array([[1.0, 2.0], [3.0, 4.0]]),  # type: ignore[arg-type]
        margin=np.float64(0.5),
        holds=np.bool_(True),  # type: ignore[arg-type]
    )
    record = recorded(evidence, printed="[1 2; 3 4]")
    assert record.verdict is Verdict.REPRODUCED
    assert record.evidence.value == ((1.0, 2.0), (3.0, 4.0))
    assert through_json(record) == record


def test_record_carries_claim_evidence_and_verdict() -> None:
    evidence = Evidence(method="m", cross_check="c", value=1.3268, lower=1.3267, upper=1.3269, note="n")
    record = recorded(evidence, uses=("toy-run",), expected=Verdict.DIFFERS)
    stored, judgement = record.evidence, record.judgement
    assert (record.id, record.paper, stored.code, stored.seconds) == ("toy.value", "toy", "papers/toy.py:1", 0.5)
    assert (record.verdict, record.claim.expected, record.unexpected) == (Verdict.REPRODUCED, Verdict.DIFFERS, True)
    assert judgement.deviation_ulp == pytest.approx(-0.32)
    assert judgement.intervals == (("53/40", "267/200"),)
    assert (stored.value, stored.lower, stored.upper, judgement.proved) == (1.3268, 1.3267, 1.3269, False)
    assert (stored.method, stored.cross_check, stored.note, record.claim.uses) == ("m", "c", "n", ("toy-run",))


def through_json(record: ClaimRecord) -> ClaimRecord:
    return msgspec.json.decode(msgspec.json.encode(record), type=ClaimRecord)


ANY_FLOAT = st.none() | st.floats(0, 3) | st.floats()
EVIDENCE = st.builds(
    Evidence,
    method=st.sampled_from(["", "m"]),
    value=ANY_FLOAT,
    lower=ANY_FLOAT,
    upper=ANY_FLOAT,
    holds=st.none() | st.booleans(),
    margin=ANY_FLOAT,
    threshold=ANY_FLOAT,
    threshold_reason=st.sampled_from(["", "why"]),
    probability=ANY_FLOAT,
    not_checkable=st.sampled_from(["", "", "", "cited"]),
    note=st.sampled_from(["", "n"]),
    as_printed=st.none() | st.builds(Evidence, method=st.just("m"), value=ANY_FLOAT, holds=st.none() | st.booleans()),
)


@given(
    EVIDENCE,
    st.sampled_from(list(Kind)),
    st.sampled_from(["1.33", "<1.5", "≥0", "(1, 2)", "1±2i", "", "?"]),
    st.sampled_from([None, "0.1", "-1", "?"]),
    st.sampled_from(["", "why"]),
    st.sampled_from([None, "toy.e1"]),
    st.sampled_from([None, PROVED, REFUTED]),
)
def test_judging_a_stored_record_again_gives_its_verdict(
    evidence: Evidence,
    kind: Kind,
    printed: str,
    tolerance: str | None,
    why: str,
    erratum: str | None,
    proof: Proof | None,
) -> None:
    record = recorded(
        evidence, proof, kind=kind, printed=printed, tolerance=tolerance, tolerance_reason=why, erratum=erratum
    )
    again = rejudge(through_json(record), errata_of(record, proof))
    assert replace(again, reason="") == replace(record.judgement, reason="")
    if record.verdict is not Verdict.ERROR:
        assert again == record.judgement
