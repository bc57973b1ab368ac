"""Policies that hold for all papers: each decides, treats like cases alike, and names the claims that it touched."""

import math
from pathlib import Path

import pytest
from cases import case, claim, judge, paper, recorded, results_file, value_case
from msgspec.structs import replace
from sample import paper_record
from tables import rows

from benchmarks.readme import results_block
from replication.audit.inspect.headline import counts, headline, sentence
from replication.audit.judge.policies import RULES, by_policy, once, once_corrected, repeated, same_fact
from replication.audit.judge.validate import validate_claims
from replication.audit.model import Evidence, How, Judgement, Kind, Outcome, OverInputs, Policy, Reading, Verdict
from replication.errors import AuditError
from replication.verify.predicate import Predicate, term

ROOT = Path(__file__).resolve().parents[2]
PROVED = {"value": 1.134687, "lower": 1.1346, "upper": 1.1347}
MINCX = Reading(name="mincx", place="Sec. 4", text="It stops early.", policy=Policy.SOLVER, accuracy=0.01)
NORM = Reading(name="norm", place="eq. (3)", text="the Euclidean norm")
OTHER = Reading(name="other", place="eq. (3)", text="the largest entry")
OURS = Reading(name="our plant", place="Sec. 5", text="a plant of ours", policy=Policy.OWN)
RULED_OUT = Reading(name="ruled out", place="Sec. 5", text="the text says otherwise", policy=Policy.RULED_OUT)
CONSTANT = Reading(name="epsilon", place="Theorem 3", text="some positive constant", policy=Policy.CONSTANT)
READINGS = (MINCX, NORM, OTHER, OURS, RULED_OUT, CONSTANT)


def optimum(printed: str, readings: tuple[Reading, ...] = (MINCX,), **evidence: float) -> Judgement:
    return judge(value_case(printed, optimum=True, **(PROVED | evidence)), readings=readings)


ALLOWED = math.sqrt(1.01)
"""By this factor a level is too high where its square is by one per cent."""


@pytest.mark.parametrize(
    ("printed", "lower", "verdict", "words"),
    [
        ("1.14", 1.1346, Verdict.COMPATIBLE, "0.035 % above the optimum, no more than a solver that stops within 1 %"),
        ("1.14", 1.135 / ALLOWED + 1e-9, Verdict.COMPATIBLE, "under the reading mincx"),
        ("1.14", 1.135 / ALLOWED - 1e-9, Verdict.DIFFERS, "more than a solver that stops within 1 %"),
        ("1.16", 1.1346, Verdict.DIFFERS, "1.8 % above the optimum, more than"),
        ("1.13", 1.1346, Verdict.REPRODUCED, ""),
        ("1.12", 1.1346, Verdict.DIFFERS, ""),
    ],
)
def test_a_printed_optimum_may_be_where_a_solver_stopped(
    printed: str, lower: float, verdict: Verdict, words: str
) -> None:
    """From the lower end of the bracket, and never below the optimum."""
    judgement = optimum(printed, lower=lower)
    assert judgement.verdict is verdict and words in judgement.reason
    assert ("above the optimum" in judgement.reason) is bool(words)
    assert (Policy.SOLVER in judgement.policies) is (verdict is Verdict.COMPATIBLE)


def test_a_level_is_not_excused_by_a_solver_that_the_text_does_not_use() -> None:
    assert optimum("1.14", ()).verdict is Verdict.DIFFERS
    assert judge(value_case("1.14", **PROVED), readings=(MINCX,)).verdict is Verdict.DIFFERS
    exact = replace(MINCX, accuracy=1e-8)
    assert optimum("1.14", (exact,)).verdict is Verdict.DIFFERS


def told(printed: str, **outcomes: float) -> Judgement:
    """A family of readings, each with what comes out under it."""
    names = {reading.name.replace(" ", "_"): reading.name for reading in READINGS}
    family = tuple(Outcome(reading=names[name], value=value) for name, value in outcomes.items())
    return judge(value_case(printed, None, outcomes=family), readings=READINGS)


@pytest.mark.parametrize(("outcomes", "verdict", "policies"), rows("policies"))
def test_a_reading_brings_its_policy(outcomes: dict[str, float], verdict: str, policies: tuple[str, ...]) -> None:
    judgement = told("1.33", **outcomes)
    assert judgement.verdict == verdict, judgement.reason
    assert set(judgement.policies) == set(policies)


@pytest.mark.parametrize(("value", "verdict"), [(1.33, Verdict.UNDETERMINED), (1.5, Verdict.DIFFERS)])
def test_a_constant_fitted_to_the_print_alone_is_no_agreement(value: float, verdict: Verdict) -> None:
    judgement = judge(value_case("1.33", value, reading="epsilon"), readings=READINGS)
    assert judgement.verdict is verdict and ("tests nothing" in judgement.reason) is (verdict is Verdict.UNDETERMINED)


def with_erratum(kind: Kind, agrees: bool, *, scanned: bool, reading: str, proof: bool | None = True) -> Judgement:
    """A claim that agrees once corrected, and as printed does not."""
    said = {"value": 1.33 if agrees else 1.5} if kind is Kind.VALUE else {"holds": agrees}
    wrong = {"value": 1.5} if kind is Kind.VALUE else {"holds": False}
    evidence = Evidence(method="m", **said, as_printed=Evidence(method="m", **wrong))
    printed = "1.33" if kind is Kind.VALUE else ""
    made = case(kind, evidence, printed=printed, proof_holds=proof, erratum="toy.e", reading=reading)
    return judge(made, scanned=scanned, readings=READINGS)


@pytest.mark.parametrize("kind", [Kind.VALUE, Kind.FEASIBLE, Kind.ORDER, Kind.STATISTICAL])
@pytest.mark.parametrize("reading", ["none", "norm", "our plant"])
def test_a_correction_never_improves_a_verdict_and_nothing_of_ours_is_reproduced(kind: Kind, reading: str) -> None:
    without = {"value": 1.33} if kind is Kind.VALUE else {"holds": True}
    printed = "1.33" if kind is Kind.VALUE else ""
    plain = judge(case(kind, Evidence(method="m", **without), printed=printed, reading=reading), readings=READINGS)
    corrected = with_erratum(kind, True, scanned=False, reading=reading)
    slip = with_erratum(kind, True, scanned=True, reading=reading)
    assert rank(slip.verdict) == rank(plain.verdict) <= rank(corrected.verdict)
    assert corrected.verdict is (Verdict.COMPATIBLE if reading == "our plant" else Verdict.REPRODUCED_AFTER_ERRATUM)
    assert Policy.ERRATUM in corrected.policies and Policy.SCAN in slip.policies
    for judgement in (plain, corrected, slip):
        assert "reproduced" not in judgement.verdict or reading != "our plant"


@pytest.mark.parametrize("kind", [Kind.VALUE, Kind.FEASIBLE])
def test_a_slip_of_the_text_at_hand_excuses_no_more_than_itself(kind: Kind) -> None:
    failing = (Verdict.DIFFERS, Verdict.REFUTED)
    assert with_erratum(kind, False, scanned=True, reading="none").verdict in failing
    assert with_erratum(kind, True, scanned=True, reading="none", proof=False).verdict in failing
    assert with_erratum(kind, True, scanned=True, reading="none", proof=None).verdict is Verdict.ERROR


@pytest.mark.parametrize("verdict", [verdict for verdict in Verdict if verdict is not Verdict.ERROR])
def test_once_corrected_no_verdict_is_better(verdict: Verdict) -> None:
    assert rank(once_corrected(verdict)) >= max(rank(verdict), rank(Verdict.REPRODUCED_AFTER_ERRATUM))


def test_every_policy_has_its_rule_in_the_docs() -> None:
    docs = " ".join((ROOT / "docs" / "verdicts.md").read_text(encoding="utf-8").split())
    assert list(RULES) == list(Policy)
    for policy, rule in RULES.items():
        assert f"**{policy[0].upper()}{policy[1:]}.** {rule}" in docs


def rank(verdict: Verdict) -> int:
    """How far from the best: whether agreement is called reproduced or consistent is a matter of what a claim says."""
    worse = (Verdict.REPRODUCED_AFTER_ERRATUM, Verdict.COMPATIBLE, Verdict.UNDETERMINED)
    agrees = verdict in (Verdict.REPRODUCED, Verdict.CONSISTENT)
    return 0 if agrees else worse.index(verdict) + 1 if verdict in worse else len(worse) + 1


def over(lower: float, upper: float, how: How = How.SEARCH) -> OverInputs:
    return OverInputs(lower=lower, upper=upper, how=how)


@pytest.mark.parametrize("how", list(How))
def test_the_rounding_of_inputs_makes_compatible_what_it_may_explain(how: How) -> None:
    judgement = judge(value_case("1.33", 1.34, over_inputs=over(1.3349, 1.35, how)))
    assert judgement.verdict is Verdict.COMPATIBLE
    assert str(how) in judgement.reason and "may explain the print" in judgement.reason
    narrow = judge(value_case("1.33", 1.34, over_inputs=over(1.3351, 1.35, how)))
    assert narrow.verdict is Verdict.DIFFERS and "may explain" not in narrow.reason
    assert judge(value_case("1.33", 1.34)).verdict is Verdict.DIFFERS
    assert judgement.deviation_ulp == narrow.deviation_ulp == pytest.approx(1)
    assert judge(value_case("1.33", 1.331, over_inputs=over(1.2, 1.5))).verdict is Verdict.REPRODUCED


@pytest.mark.parametrize(("lower", "verdict"), [(0.49, Verdict.COMPATIBLE), (0.5, Verdict.DIFFERS)])
def test_a_bound_has_a_range_over_inputs_too(lower: float, verdict: Verdict) -> None:
    claim, evidence, proof = value_case("<0.5", 0.6, over_inputs=over(lower, 0.7))
    assert judge((replace(claim, kind=Kind.BOUND), evidence, proof)).verdict is verdict


def test_a_fact_is_counted_once_and_a_remark_of_ours_not() -> None:
    first = recorded(Evidence(method="m", value=1.33))
    again = recorded(Evidence(method="m", value=1.33), id="toy.again", repeats="toy.value")
    other = recorded(Evidence(method="m", value=1.33), id="toy.other")
    ours = recorded(Evidence(method="m", value=1.33), id="toy.ours", ours=True)
    assert once((first, again, other, ours)) == (first, other)
    assert counts((first, again, ours))[Verdict.REPRODUCED] == 1
    assert counts((first, other))[Verdict.REPRODUCED] == 2
    assert sentence((first, again)).startswith("Of 1 claim, 1 agrees")
    file = results_file(first, again, ours)
    assert (headline(file).total, headline(file).repeated) == (1, 1)
    more = results_file(first, again, other)
    assert (headline(more).total, headline(more).repeated) == (2, 1)
    page = replace(paper_record(()), key="toy", brief=None)
    assert "toy: 1 holds" in results_block(replace(file, papers=(page,)))
    touched = {policy: claims for policy, _, claims in by_policy(file.claims)}
    assert touched[Policy.REMARK] == (ours,) and touched[Policy.FACT] == ()
    moved = recorded(Evidence(method="m", value=1.4), id="toy.again", repeats="toy.value")
    assert headline(results_file(first, moved)).unexpected == (moved,), "told though it is not counted"


def says(**setting: int) -> Predicate:
    return Predicate(of=term("gain", "toy", **setting), relation="is", to="1.33", unit="1", reading="none")


def test_claims_that_say_the_same_as_data_are_one_fact() -> None:
    """By the predicates, in any order, and not by print or words; a claim that says nothing repeats none."""
    both = (says(a=1), says(a=2))
    claims = repeated(
        claim(id=f"toy.{name}", says=said, ours=ours)
        for name, said, ours in zip(
            "abcdefg",
            (both, both[:1], both[::-1], (), (), both, both[:1]),
            (False, False, False, False, False, True, False),
            strict=True,
        )
    )
    assert [one.repeats for one in claims] == ["", "", "toy.a", "", "", "", "toy.b"]


@pytest.mark.parametrize(("own", "first", "verdict"), rows("facts"))
def test_one_fact_has_one_verdict(own: str, first: str, verdict: str) -> None:
    record = recorded(Evidence(method="m", value=1.33), id="toy.again", repeats="toy.value")
    record = replace(record, judgement=replace(record.judgement, verdict=Verdict(own)))
    judged = same_fact(record, Judgement(verdict=Verdict(first), reason="r")).judgement
    assert judged.verdict == verdict and "toy.value" in judged.reason and Policy.FACT in judged.policies
    assert same_fact(record, None) is record


def test_equal_predicates_pin_equal_verdicts() -> None:
    claims = repeated([claim(says=(says(),)), claim(id="toy.b", says=(says(),), expected=Verdict.DIFFERS)])
    with pytest.raises(AuditError, match="one fact has one verdict"):
        validate_claims([paper(*claims)])
    with pytest.raises(AuditError, match="leave repeats to `paper`"):
        validate_claims([paper(claim(), claim(id="toy.b", repeats="toy.value"))])


@pytest.mark.parametrize(
    ("reading", "words"),
    [
        (replace(NORM, policy=Policy.SOLVER), "an accuracy belongs to a solver's level"),
        (replace(NORM, accuracy=0.1), "an accuracy belongs to a solver's level"),
        (replace(NORM, policy=Policy.FACT), "of no reading"),
    ],
)
def test_a_policy_of_no_reading_is_a_mistake(reading: Reading, words: str) -> None:
    with pytest.raises(AuditError, match=words):
        validate_claims([paper(claim(reading="norm"), readings=(reading,))])
    with pytest.raises(AuditError, match="two readings of the level"):
        validate_claims([paper(claim(), readings=(MINCX, replace(MINCX, name="again")))])
