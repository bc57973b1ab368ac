"""Computed against printed numbers: the digits decide, exactly; brackets and bounds."""

import math
import re
from decimal import Decimal
from fractions import Fraction
from typing import Any

import pytest
from cases import case, judge, value_case
from hypothesis import assume, given
from hypothesis import strategies as st
from tables import decimal, rows

from replication.audit.inspect.headline import moved
from replication.audit.judge.agreement import ACCURACY
from replication.audit.judge.printed import parse
from replication.audit.model import Evidence, Kind, Verdict

FINITE = st.floats(allow_nan=False, allow_infinity=False)

# The digits decide: printed values of the source papers' forms, each moved by one unit in its last place.

PRINTED = [
    "1.33", "0.64", "0.580", ".580", "-0.0000", "9.99", "1.00", "73", "66,033", "1.2e-3", "-5E2", "−0.1250",
    "1.085±0.240i", "1.0-2.5i", "(1.031, 1.085±0.240i)", "(0.1270, -0.0000, -0.0002)", "[0.228 0.294; -0.125 0.267]",
]  # fmt: skip


def decimal_text(digits: int, places: int) -> str:
    """`digits` with the point before the last `places` of them."""
    return f"{Decimal(digits).scaleb(-places):.{places}f}"


def as_printed_numbers(text: str) -> Any:
    """The printed numbers themselves, in their layout."""
    printed = parse(text)
    cells = [tuple(float(entry.value) for entry in cell) for cell in printed.cells]
    found = printed.arranged([cell[0] if len(cell) == 1 else cell for cell in cells])
    rows = found if isinstance(found, list) else None
    return found if rows is None else tuple(tuple(row) if isinstance(row, list) else row for row in rows)


@pytest.mark.parametrize("text", PRINTED)
def test_one_unit_in_the_last_place_of_any_entry_flips_the_verdict(text: str) -> None:
    numbers, printed = as_printed_numbers(text), parse(text)
    assert judge(value_case(text, numbers)).verdict is Verdict.REPRODUCED
    others = list(moved(printed))
    assert len(others) >= len(printed.entries)
    for other in others:
        pairs = zip(parse(other).entries, printed.entries, strict=True)
        ((now, was),) = ((now, was) for now, was in pairs if now.value != was.value)
        judgement = judge(value_case(other, numbers))
        assert abs(now.value - was.value) == was.unit and judgement.verdict is Verdict.DIFFERS
        assert judgement.deviation_ulp == pytest.approx(float((was.value - now.value) / now.unit), abs=1e-9)


@given(st.integers(-(10**6), 10**6), st.integers(0, 6), FINITE, st.floats(-2, 2))
def test_verdict_is_the_exact_comparison_and_that_of_the_mirrored_number(
    digits: int, places: int, anywhere: float, beside: float
) -> None:
    printed, unit = Fraction(digits, 10**places), Fraction(1, 10**places)
    for value in (anywhere, float(printed + Fraction(beside) * unit)):
        off = abs(Fraction(value) - printed) - unit / 2
        assume(off <= 0 or off > 2 * ACCURACY * abs(Fraction(value)))
        one, mirrored = (judge(value_case(decimal_text(sign * digits, places), sign * value)) for sign in (1, -1))
        assert one.verdict is mirrored.verdict is (Verdict.REPRODUCED if off <= 0 else Verdict.DIFFERS)
        assert one.deviation_ulp is not None and mirrored.deviation_ulp == -one.deviation_ulp


@pytest.mark.parametrize(
    ("printed", "value"),
    [
        *(("0.29", value) for value in (0.285, 0.295, math.nextafter(0.285, 0))),
        *((printed, 30.85) for printed in ("30.8", "30.9")),
        *((printed, sum([30.5, 31.3, 30.7, 30.9, 31.1] * 2 + [30.6] * 10) / 20) for printed in ("30.7", "30.8")),
        *((printed, -0.285) for printed in ("-0.28", "-0.29")),
        ("1.01", 1.005), ("2.68", 2.675), ("0.15", 0.145), ("0.30000000000000004", 0.1 + 0.2),
        ("0.29±0.15i", (0.285, -0.145)),
        ("≤0.3", 0.1 + 0.2), ("≥0.3", 0.3), ("<0.3", 0.1 + 0.2 - 2**-53),
    ],
)  # fmt: skip
def test_a_number_half_way_between_two_prints_agrees_with_both(printed: str, value: Any) -> None:
    kind = Kind.BOUND if printed[0] in "<≤≥" else Kind.VALUE
    judgement = judge(case(kind, Evidence(method="computed", value=value), printed=printed))
    assert judgement.verdict is Verdict.REPRODUCED, judgement.reason
    assert printed[0] == "<" or len(printed) > 15 or not re.search("99999|00000", judgement.reason)


@pytest.mark.parametrize("value", [3.5 * (1 + 2**-49), 3.500000001])
def test_reason_has_digits_enough_to_tell_the_number_from_the_end(value: float) -> None:
    reason = judge(value_case("3", value)).reason
    assert "Computed 3.500000" in reason and "[2.5, 3.5]" in reason and "place: 0.5)" not in reason


# Brackets.


@pytest.mark.parametrize(("printed", "value", "lower", "upper", "verdict"), rows("brackets"))
def test_a_bracket_decides_or_the_value_where_there_is_none(
    printed: str, value: Any, lower: Any, upper: Any, verdict: str
) -> None:
    kind = Kind.BOUND if printed[0] in "<≤>≥" else Kind.VALUE
    evidence = Evidence(method="computed", value=value, lower=lower, upper=upper)
    assert judge(case(kind, evidence, printed=printed)).verdict == verdict


LOWER, UPPER = ((0.99, 1.8), (2.99, 4.2)), ((1.01, 2.2), (3.01, 4.3))


@pytest.mark.parametrize(
    ("printed", "value", "bracket", "verdict", "words"),
    [
        ("[1.0 2.0; 3.0 4.0]", ((1.0, 2.0), (3.0, 4.25)), (LOWER, UPPER), Verdict.DIFFERS,
         "1 of 4 entries disagree: entry (2,2): "),
        ("[1.0 2.0; 3.0 4.2]", ((1.0, 2.0), (3.0, 4.21)), (LOWER, UPPER), Verdict.UNDETERMINED,
         "2 of 4 entries undecided: "),
        ("[1.0 2.0; 3.0 4.2]", ((1.0, 2.0), (3.0, 4.21)), (None, None), Verdict.REPRODUCED, "All 4 entries agree: "),
        # The entry that is farthest away is named.
        ("(1.0, 2.0)", (1.1, 2.5), (None, None), Verdict.DIFFERS, "entry 2: computed 2.5"),
        ("(1.0, 2.0)", (1.5, 2.1), (None, None), Verdict.DIFFERS, "entry 1: computed 1.5"),
    ],
)  # fmt: skip
def test_several_numbers_differ_if_any_entry_does_and_the_farthest_is_named(
    printed: str, value: Any, bracket: tuple[Any, Any], verdict: Verdict, words: str
) -> None:
    judgement = judge(value_case(printed, value, *bracket))
    assert judgement.verdict is verdict and words in judgement.reason


@pytest.mark.parametrize("value", [True, "1", (1.0,)])
def test_what_is_no_number_in_the_layout_of_the_print_is_an_error(value: Any) -> None:
    assert judge(value_case("1", 1)).verdict is Verdict.REPRODUCED
    assert judge(value_case("1", value)).verdict is Verdict.ERROR
    assert judge(case(Kind.BOUND, Evidence(method="computed", value=0.5), printed="0.5")).verdict is Verdict.ERROR


@given(st.floats(-1e3, 1e3), st.floats(1e-12, 1e-2))
def test_a_bracket_in_a_reason_shows_its_width_and_is_rounded_outwards(value: float, width: float) -> None:
    lower, upper = value - width, value + width
    reason = judge(value_case("1.33", value, lower, upper)).reason
    found = re.search(r"racket \[(.*?), (.*?)\]", reason)
    assert found is not None
    low, high = (Fraction(decimal(end)) for end in found.groups())
    exact = Fraction(lower), Fraction(upper)
    assert low <= exact[0] < exact[1] <= high
    assert low < high <= low + 3 * (exact[1] - exact[0])


@pytest.mark.parametrize(
    ("printed", "value", "words"),
    [
        ("0.50", 0.5 + 1e-16 * 2, "units of its last place: 0)"),
        ("1.33", 71.33, "units of its last place: 7000)"),
        ("1.33", 1.3268, "units of its last place: −0.32)"),
    ],
)
def test_reasons_hold_no_raw_exponents(printed: str, value: float, words: str) -> None:
    reason = judge(value_case(printed, value)).reason
    assert words in reason
    assert re.search(r"[0-9]e[+-]?[0-9]", reason) is None


@pytest.mark.parametrize(("printed", "uncertainty", "value", "verdict", "words"), rows("uncertainties"))
def test_a_printed_uncertainty_is_weighed_by_what_it_is(
    printed: str, uncertainty: str, value: Any, verdict: str, words: str
) -> None:
    judgement = judge(value_case(printed, value, uncertainty=uncertainty))
    assert (judgement.verdict, words in judgement.reason) == (verdict, True), judgement.reason
    across = judge(value_case("1.23(4)", 1.33, 1.32, 1.34, uncertainty="1 sigma"))
    assert across.verdict is Verdict.UNDETERMINED, "a bracket that reaches over the limit decides nothing"


@pytest.mark.parametrize(("printed", "uncertainty", "words"), rows("no uncertainties"))
def test_an_uncertainty_that_cannot_be_is_an_error(printed: str, uncertainty: str, words: str) -> None:
    judgement = judge(value_case(printed, 1.23, uncertainty=uncertainty))
    assert judgement.verdict is Verdict.ERROR and re.search(words, judgement.reason), judgement.reason


def test_a_print_has_its_uncertainty_or_the_claim_a_tolerance() -> None:
    both = judge(value_case("1.23(4)", 1.23, tolerance="0.1", tolerance_reason="why"))
    assert both.verdict is Verdict.ERROR and "leave the tolerance out" in both.reason
    data = value_case("33.0 ± 5.1", 30.85, uncertainty="sd", tolerance="3", tolerance_reason="why")
    assert judge(data).verdict is Verdict.REPRODUCED
