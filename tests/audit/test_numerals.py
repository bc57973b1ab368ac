"""Numbers: how they are written, drawn against what a print stands for, and set below it digit by digit."""

import re
from fractions import Fraction
from typing import Any
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from sample import claim
from tables import number as read
from tables import rows

from replication.audit.judge import numerals
from replication.audit.judge.agreement import Interval, Measured, Target
from replication.audit.judge.printed import parse
from replication.audit.model import Evidence, Kind, Outcome, Policy, Proof, Verdict
from replication.audit.parts import CELL, Table
from replication.audit.report import entries as shown
from replication.audit.report.claim import targets, views
from replication.audit.report.entries import EntryView, side_by_side, strip
from replication.audit.report.paper import named, table_view
from replication.audit.store.records import ClaimRecord

FINITE = st.floats(allow_nan=False, allow_infinity=False)


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


@pytest.mark.parametrize(("number", "unit", "parts"), rows("cut"))
def test_at_print(number: float, unit: str, parts: tuple[str, str]) -> None:
    assert numerals.at_print(number, Fraction(unit)) == parts


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


@pytest.mark.parametrize(("by", "arguments", "text"), rows("written"))
def test_how_a_number_is_written(by: str, arguments: tuple[Any, ...], text: str) -> None:
    assert getattr(numerals, by)(*arguments) == text
    assert (numerals.exact(Fraction("1.325")), numerals.exact(Fraction(-1, 20000))) == ("1.325", "−0.00005")


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


def entries(printed: str, value: object, kind: Kind = Kind.VALUE) -> tuple[EntryView, ...]:
    evidence = Evidence(method="Evaluated directly", value=value)  # type: ignore[arg-type]
    return seen(claim("case", kind, Verdict.REPRODUCED, printed, evidence))


def seen(record: ClaimRecord) -> tuple[EntryView, ...]:
    return side_by_side(Target.judged(record.claim, record.judgement), record.evidence)


@pytest.mark.parametrize(("printed", "value", "agreed", "off", "tail"), rows("digits"))
def test_digits_say_how_far_the_print_agrees(printed: str, value: float, agreed: str, off: str, tail: str) -> None:
    (entry,) = entries(printed, value)
    parts = dict(entry.digits)
    assert parts["agreed"] + parts.get("off", parts.get("head", "")) + parts["tail"] == entry.head + entry.tail
    if entry.inside:
        assert parts == {"agreed": agreed, "head": "", "tail": tail}
    elif off:
        assert parts == {"agreed": agreed, "off": off, "tail": tail}
    else:
        assert parts == {"agreed": agreed, "off": tail[:2], "tail": tail[2:]}
    assert entry.inside or parts["off"], "a number outside shows a digit that is off"


def test_relations_have_no_digits_that_agree() -> None:
    (entry,) = entries("<0.001", 0.00041, Kind.BOUND)
    assert (entry.agreed, entry.interval, entry.inside) == (0, None, True)
    (fails,) = entries("≤2", 2.5, Kind.BOUND)
    assert dict(fails.digits)["off"] == "2"


def test_decimal_points_of_a_claim_stand_below_each_other() -> None:
    made = entries("[9.5; -0.25; 100.1]", ((10.2,), (0.31,), (100.1,)), Kind.MATRIX)
    points = {pad + text.index(".") for e in made for pad, text in zip(e.pads, (e.printed, e.head), strict=True)}
    assert points == {3}


def test_the_ladder_sets_bounds_below_the_print_in_all_digits() -> None:
    evidence = Evidence(method="Bisection", value=1.13468738, lower=1.13468737, upper=1.2)
    (entry,) = seen(claim("case", Kind.VALUE, Verdict.DIFFERS, "1.14", evidence))
    assert entry.ladder == (
        ("Printed", 0, "1.14", ""),
        ("Computed", 0, "1.1", "3468738"),
        ("Lower bound", 0, "1.1", "3468737"),
        ("Upper bound", 0, "1.", "2"),
    )
    assert entry.interval == (Fraction("1.135"), Fraction("1.145"))


def test_each_number_has_the_band_of_its_own_last_place() -> None:
    evidence = Evidence(method="Evaluated directly", value=(1.0, 2.0))
    wide = {"tolerance": "0.2", "tolerance_reason": "a test"}
    record = claim("case", Kind.VALUE, Verdict.REPRODUCED, "(1.0, 2.00)", evidence, **wide)
    with mock.patch.object(shown, "strip") as drawn:
        seen(record)
    assert [call.args[1] for call in drawn.call_args_list] == [(-2.0, 2.0), (-20.0, 20.0)]


@pytest.mark.parametrize(("printed", "value", "literal"), rows("literal"))
def test_a_print_of_more_than_digits_is_shown_as_it_stands(printed: str, value: float, literal: str) -> None:
    (entry,) = entries(printed, value)
    assert entry.literal == literal
    assert entry.ladder[0][0] == ("In digits" if literal else "Printed")
    assert not literal or entry.pads == (0, 0)


def test_a_heading_of_numbers_alone_gets_the_name_of_what_it_counts() -> None:
    assert named("N₁, N₂", "2, 1") == "N₁, N₂ = 2, 1" and named("K", "10") == "K = 10"
    assert named("Example", "1") == "Example 1"
    assert named("Reference", "sin(3t/2)") == "sin(3t/2)" and named("", "2") == "2"


def judged(record: ClaimRecord, verdict: Verdict) -> ClaimRecord:
    return replace(record, judgement=replace(record.judgement, verdict=verdict))


@pytest.mark.parametrize(("printed", "value", "off"), rows("distance"))
def test_the_distance_from_the_print_is_a_part_of_the_print(printed: str, value: float, off: tuple[float, str]) -> None:
    record = claim("case", Kind.VALUE, Verdict.DIFFERS, printed, Evidence(method="Evaluated directly", value=value))
    (view,) = views([record], targets([record]))
    assert view.off == (pytest.approx(off[0], rel=1e-3), off[1])
    whole = claim("whole", Kind.VALUE, Verdict.DIFFERS, "1", Evidence(method="Counted", value=7.0))
    assert views([whole], targets([whole]))[0].off is None, "a count is its own measure"
    unsettled = judged(record, Verdict.UNDETERMINED)
    assert views([unsettled], targets([unsettled]))[0].off is None


@pytest.mark.parametrize(("proof", "shown"), [(True, [("269", "268", "")]), (False, [])])
def test_what_is_meant_is_set_beside_the_computed_number_if_it_comes_out(proof: bool, shown: list[object]) -> None:
    more = {"erratum": "doe1999.e", "meant": "269", "proof": Proof(holds=proof, text="t")}
    evidence = Evidence(method="ln 2 / k", value=268.6617)
    verdict = Verdict.REPRODUCED_AFTER_ERRATUM if proof else Verdict.DIFFERS
    record = claim("case", Kind.VALUE, verdict, "296", evidence, **more)
    assert record.verdict is verdict
    (view,) = views([record], targets([record]))
    found = [entry for row in view.meant for cell in row for entry in cell]
    assert [
        (e.printed, dict(e.digits)["agreed"], dict(e.digits)["off" if not e.inside else "head"]) for e in found
    ] == shown
    assert view.rows[0][0][0].printed == "296"


def test_a_table_counts_its_entries_by_their_verdicts() -> None:
    verdicts = [
        *(Verdict.REPRODUCED, Verdict.DIFFERS, Verdict.COMPATIBLE, Verdict.REPRODUCED_AFTER_ERRATUM),
        *(Verdict.REFUTED, Verdict.CONSISTENT, Verdict.UNDETERMINED, Verdict.ERROR),
    ]
    tried = Evidence(method="Tried", value=1.33)
    records = [
        judged(claim(f"case-{n}", Kind.VALUE, verdict, "1.33", tried), verdict) for n, verdict in enumerate(verdicts)
    ]
    records[2] = replace(records[2], judgement=replace(records[2].judgement, policies=(Policy.ERRATUM,)))
    # A draw, of which there is a probability and no digit.
    records[5] = replace(records[5], evidence=Evidence(method="Drawn", probability=0.4))
    # A run time of another computer, which nothing here can confirm.
    seconds = replace(records[6].claim, id="case-8", kind=Kind.CITED, unit="s")
    records.append(replace(records[6], claim=seconds))
    known = {view.record.id: view for view in views(records, targets(records))}
    rows = tuple((str(n), f"{CELL}{record.id}", "N/A") for n, record in enumerate(records))
    made = table_view(Table(place="Table 1", caption="All", header=("K \\ n", "1", ""), rows=rows), known)
    assert made.numbers == dict.fromkeys(Verdict, 1) and made.drawn == 0, "the run time is no number of these"
    assert made.counts == dict.fromkeys(Verdict, 1) and made.timed == 1, "as the marks of the table say"
    assert [row[1].headings for row in made.rows] == [(f"K = {n}", "n = 1") for n in range(len(records))]
    assert {row[2].text for row in made.rows} == {"N/A"}


@pytest.mark.parametrize(
    ("printed", "own", "other", "told"),
    [
        ("0.0952", 0.09512, 0.09519, ("0.09519000", "at-output")),
        ("(1.0, 2.0)", (1.2, 2.0), (1.0, 2.01), ("all 2 agree", "at-output")),
        ("0.0952", 0.09519, 0.09512, None),  # the value that is shown agrees itself
        ("0.0952", 0.09512, 0.09513, None),  # nothing does
    ],
)
def test_what_agrees_under_another_reading_stands_beside_the_verdict(
    printed: str, own: object, other: object, told: tuple[str, str] | None
) -> None:
    outcomes = tuple(
        Outcome(reading=name, value=value)
        for name, value in (("at-rest", own), ("at-output", other))  # type: ignore[arg-type]
    )
    evidence = Evidence(method="m", value=own, outcomes=outcomes)  # type: ignore[arg-type]
    kind = Kind.MATRIX if printed.startswith("(") else Kind.VALUE
    record = claim("case", kind, Verdict.COMPATIBLE, printed, evidence, reading="at-rest")
    (view,) = views([record], targets([record]))
    assert view.elsewhere == told
