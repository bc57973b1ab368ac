"""How numbers are written, and how they are drawn against what a print stands for."""

from __future__ import annotations

import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from replication.audit.judge import numerals
from replication.audit.judge.agreement import Interval, Measured
from replication.audit.judge.printed import parse
from replication.audit.report.entries import strip

FINITE = st.floats(allow_nan=False, allow_infinity=False)
POWERS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def read(text: str) -> float:
    """The number that a typeset text stands for."""
    text = text.replace(numerals.MINUS, "-")
    match = re.fullmatch(r"(.*?)×?10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)", text)
    if match is None:
        return float(text)
    sign = {"": "1", "-": "-1"}.get(match[1], match[1])
    return float(f"{sign}e{match[2].translate(POWERS)}")


@given(FINITE)
def test_full_reads_back_exactly(number: float) -> None:
    assert read(numerals.full(number)) == number


@given(FINITE)
def test_short_is_close(number: float) -> None:
    assert read(numerals.short(number)) == pytest.approx(number, rel=1e-5, abs=1e-320)


@given(st.floats(-1e9, 1e9), st.integers(0, 8))
def test_head_and_tail_are_one_number_cut_at_the_last_printed_place(number: float, places: int) -> None:
    head, tail = numerals.at_print(number, Fraction(1, 10**places))
    assert abs(read(head + tail) - number) <= 0.51 * 10.0 ** -(places + numerals.BEYOND) + 1e-15 * abs(number)
    if places:
        assert len(head.partition(".")[2]) == places
        assert len(tail) == numerals.BEYOND


@pytest.mark.parametrize(
    ("number", "unit", "parts"),
    [
        (1.32871, Fraction(1, 100), ("1.32", "8710")),
        (-0.0000123, Fraction(1, 10**4), ("−0.0000", "1230")),
        (73.0, Fraction(1), ("73", "")),
        (72.96, Fraction(1), ("72", ".9600")),
        (66033.5, Fraction(100), ("66033", ".5000")),
        (1e20, Fraction(1), ("10²⁰", "")),
    ],
)
def test_at_print(number: float, unit: Fraction, parts: tuple[str, str]) -> None:
    assert numerals.at_print(number, unit) == parts


@given(st.floats(-1e3, 1e3), st.floats(0, 1e-3), st.floats(0, 1e-3), st.integers(0, 8))
def test_what_is_shown_of_a_number_lies_in_its_bracket(number: float, below: float, above: float, places: int) -> None:
    low, high = number - below, number + above
    head, tail = numerals.at_print(number, Fraction(1, 10**places), 1, Fraction(low), Fraction(high))
    shown = len(tail.replace(".", ""))
    assert low <= read(head + tail) <= high or (shown < 2 and high - low < 10.0 ** (-places - numerals.MORE))


def test_a_number_beside_an_end_of_its_bracket_shows_one_digit_more() -> None:
    bracket = Fraction("1.415803"), Fraction("1.415803967")
    assert numerals.at_print(1.4158039, Fraction(1, 100)) == ("1.41", "5804")
    assert numerals.at_print(1.4158039, Fraction(1, 100), 4, *bracket) == ("1.41", "5803")
    width = Fraction(1, 10**12)
    assert numerals.at_print(1.03087452, Fraction(1, 1000), 4, Fraction(1.03087452), Fraction(1.03087452) + width) == (
        "1.030",
        "8745",
    )
    assert numerals.outward(0.495865, 0.499944) == (0.4958, 0.5)


@given(st.floats(min_value=1e-4, max_value=1e9), st.integers(1, 6))
def test_bounds_in_text_are_rounded_outwards(number: float, digits: int) -> None:
    low, high = (float(bound(number, digits)) for bound in (numerals.at_least, numerals.at_most))
    assert low <= number <= high
    assert high - low <= 2 * number * 10.0 ** (1 - digits)


@pytest.mark.parametrize(
    ("written", "text"),
    [
        (numerals.short(12.3, 1), "12"),
        (numerals.short(-322.6, 2), "−323"),
        (numerals.short(999999.6, 6), "10⁶"),
        (numerals.short(1.1e19, 2), "1.1×10¹⁹"),
        (numerals.short(2e-7, 1), "2×10⁻⁷"),
        (numerals.short(True), "yes"),
        (numerals.signed(0.125), "+0.125"),
        (numerals.signed(-12.34), "−12.3"),
        (numerals.signed(0.0), "0"),
        (numerals.signed(7005.0), "+7005"),
        (numerals.signed(1.5e9), "+1.5×10⁹"),
        (numerals.seconds(0.0), "0.00"),
        (numerals.seconds(1.234), "1.23"),
        (numerals.seconds(0.004), "0.004"),
        (numerals.at_most(0.5), "0.5"),
        (numerals.at_least(0.5), "0.5"),
        (numerals.at_least(84.92), "84"),
        (numerals.at_most(96.08), "97"),
        (numerals.at_most(3.119e-9, 1), "4×10⁻⁹"),
        (numerals.layout(1.5), "1.5"),
        (numerals.layout((1.0, -2.0)), "(1, −2)"),
        (numerals.layout(((1.0, 2.0), (3.0, 4.0))), "[1 2; 3 4]"),
        (numerals.exact(Fraction(1325, 1000)), "1.325"),
        (numerals.exact(Fraction(-1, 20000)), "−0.00005"),
    ],
)
def test_how_a_number_is_written(written: str, text: str) -> None:
    assert written == text


BAND = (-0.5, 0.5)


def beside(units: float, *bracket: float) -> Measured:
    """A number so many units beside a printed 0, perhaps with a bracket."""
    low, high = map(Fraction, bracket or (units, units))
    return Measured(parse("0").entries[0], "", None, Fraction(units), Interval(low, high), bool(bracket))


@given(st.floats(-1.4, 1.4))
def test_the_dot_lies_in_the_band_exactly_if_the_number_does(units: float) -> None:
    text = strip(beside(units), BAND)
    band = re.search(r'class="band" x="([\d.]+)" y="2" width="([\d.]+)"', text)
    dot = re.search(r'class="(in|out)" cx="([\d.]+)"', text)
    assert band is not None and dot is not None
    start, width, place = float(band[1]), float(band[2]), float(dot[2])
    drawn_inside = start - 0.02 <= place <= start + width + 0.02
    assert (dot[1] == "in") == (abs(units) <= 0.5)
    assert drawn_inside or abs(units) > 0.5


@pytest.mark.parametrize(("units", "tip"), [(7.0, "M131,"), (-7.0, "M1,")])
def test_off_the_scale_is_an_arrow_and_a_bracket_ends_at_the_edge(units: float, tip: str) -> None:
    text = strip(beside(units), BAND)
    assert f'<path class="out" d="{tip}' in text and "<circle" not in text
    assert "<circle" in strip(beside(units), BAND, span=10.0)
    assert 'class="bracket" d="M7,5v8M7,9H125m' in strip(beside(0.0, -abs(units), abs(units)), BAND)


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (beside(0.4, 0.3, 0.6), "bracket not within"),
        (beside(0.4, 0.3, 0.5), "bracket within"),
        (beside(0.7), "computed value not within"),
    ],
)
def test_a_bracket_decides_and_its_words_say_so(number: Measured, words: str) -> None:
    assert f'aria-label="{words} what the print allows"' in strip(number, BAND)


@pytest.mark.parametrize(
    ("printed", "computed", "common"),
    [
        ("1.33", "1.3287", "1.3"),
        ("1.14", "1.13", "1.1"),
        ("1.14", "1.14", "1.14"),
        ("1.14", "1.1400", "1.14"),
        ("−0.0000", "−0.0000", "−0.0000"),
        ("−0.5", "0.5", ""),
        ("13.89", "43.62", ""),
        ("1.5", "15.1", ""),
        (".2357", "0.2357", "0.2357"),
        ("−.25", "−0.24", "−0.2"),
        ("<0.001", "0.000", ""),
        ("73", "7", ""),
        ("1.2e-3", "0.0012", ""),
    ],
)
def test_agreement_is_the_common_beginning_with_the_points_aligned(printed: str, computed: str, common: str) -> None:
    assert computed[: numerals.agreement(printed, computed)] == common
