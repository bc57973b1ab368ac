"""Policies that hold for all papers: each of them decides, and no longer does once its input is perturbed."""

from __future__ import annotations

import pytest
from cases import judge, paper, recorded, results_file, statement_case, value_case
from msgspec.structs import replace
from sample import paper_record

from replication.audit.declare import Part
from replication.audit.declare import paper as declared
from replication.audit.inspect.headline import counts, headline, sentence
from replication.audit.judge.policies import CHOSEN, EXCESS, EXCESS_REASON, once
from replication.audit.judge.validate import validate_claims
from replication.audit.model import Evidence, How, Kind, Outcome, OverInputs, Reading, Verdict
from replication.audit.publish.readme import results_block

PROVED = {"value": 1.134687, "lower": 1.1346, "upper": 1.1347}


def optimum(printed: str, **evidence: float) -> tuple[Verdict, str]:
    judgement = judge(value_case(printed, optimum=True, **(PROVED | evidence)))
    return judgement.verdict, judgement.reason


def test_the_excess_of_a_printed_optimum_is_told_and_the_verdict_stays() -> None:
    verdict, reason = optimum("1.14")
    assert verdict is Verdict.DIFFERS
    assert "0.0353 % above the optimum. " + EXCESS_REASON in reason
    assert reason.endswith(CHOSEN)
    plain = judge(value_case("1.14", **PROVED))
    assert plain.verdict is Verdict.DIFFERS and "above the optimum" not in plain.reason


@pytest.mark.parametrize(
    ("printed", "words"),
    [
        ("1.13", ""),
        ("1.12", ""),
        ("1.16", "% above the optimum, more than a solver that stops early explains (1 %)"),
    ],
)
def test_an_excess_is_not_told_of_a_print_that_agrees_or_is_too_low(printed: str, words: str) -> None:
    _, reason = optimum(printed)
    assert words in reason and EXCESS_REASON not in reason
    assert ("above the optimum" in reason) is bool(words)


def test_the_excess_counts_from_the_lower_end_of_the_bracket() -> None:
    assert EXCESS_REASON in optimum("1.14", lower=1.135 / (1 + EXCESS) + 1e-9)[1]
    assert EXCESS_REASON not in optimum("1.14", lower=1.135 / (1 + EXCESS) - 1e-9)[1]


def test_an_optimum_is_one_number() -> None:
    for tried in (
        value_case("(1.1, 1.2)", (1.1, 1.2), optimum=True),
        statement_case(Kind.ORDER, True, optimum=True),
    ):
        judgement = judge(tried)
        assert judgement.verdict is Verdict.ERROR and "optimum" in judgement.reason


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


def test_what_agrees_at_the_printed_inputs_stays_reproduced() -> None:
    assert judge(value_case("1.33", 1.331, over_inputs=over(1.2, 1.5))).verdict is Verdict.REPRODUCED


@pytest.mark.parametrize(("lower", "verdict"), [(0.49, Verdict.COMPATIBLE), (0.5, Verdict.DIFFERS)])
def test_a_bound_has_a_range_over_inputs_too(lower: float, verdict: Verdict) -> None:
    claim, evidence, proof = value_case("<0.5", 0.6, over_inputs=over(lower, 0.7))
    assert judge((replace(claim, kind=Kind.BOUND), evidence, proof)).verdict is verdict


NORM = Reading(name="norm", place="eq. (3)", text="the Euclidean norm")


@pytest.mark.parametrize(
    ("tried", "words"),
    [
        (value_case("1.33", 1.34, over_inputs=over(1.36, 1.35)), "empty"),
        (value_case("1.33", 1.34, over_inputs=over(1.35, 1.36)), "does not hold its own value"),
        (value_case("(1.1, 1.2)", (1.1, 1.3), over_inputs=over(1.0, 1.4)), "one number"),
        (
            value_case("1.33", 1.34, over_inputs=over(1.3, 1.4), outcomes=(Outcome(reading="norm", value=1.34),)),
            "one reading",
        ),
    ],
)
def test_a_range_over_inputs_that_says_nothing_is_an_error(tried: tuple[object, ...], words: str) -> None:
    judgement = judge(tried, readings=(NORM,))  # type: ignore[arg-type]
    assert judgement.verdict is Verdict.ERROR and words in judgement.reason


def test_a_repeated_number_is_counted_once() -> None:
    first = recorded(Evidence(method="m", value=1.33))
    again = recorded(Evidence(method="m", value=1.33), id="toy.again", repeats="toy.value")
    other = recorded(Evidence(method="m", value=1.33), id="toy.other")
    assert once((first, again, other)) == (first, other)
    assert counts((first, again))[Verdict.REPRODUCED] == 1
    assert counts((first, other))[Verdict.REPRODUCED] == 2
    assert sentence((first, again)).startswith("Of 1 claim, 1 agrees")
    file = results_file(first, again)
    assert (headline(file).total, headline(file).repeated) == (1, 1)
    more = results_file(first, again, other)
    assert (headline(more).total, headline(more).repeated) == (2, 1)
    page = replace(paper_record(()), key="toy")
    assert "toy: 1 of 1 agree" in results_block(replace(file, papers=(page,)))


def test_a_repeat_that_moves_is_told_though_it_is_not_counted() -> None:
    moved = recorded(Evidence(method="m", value=1.4), id="toy.again", repeats="toy.value")
    assert headline(results_file(recorded(Evidence(method="m", value=1.33)), moved)).unexpected == (moved,)


def test_a_repeat_is_declared_under_the_short_name() -> None:
    part = Part("p", reading="none")
    part.value("a", "1.33", place="Table 1", statement="A level.")(lambda results: Evidence(method="m"))
    part.value("b", "1.33", place="Sec. 2", statement="It again.", repeats="a")(lambda results: Evidence(method="m"))
    about = {name: getattr(paper(), name) for name in ("title", "authors", "year", "venue", "doi", "summary", "bibtex")}
    made = declared(key="toy", parts=[part], experiments=(), **about)
    assert [claim.repeats for claim in made.claims] == ["", "toy.a"]
    validate_claims([made])
