"""Printed values: every form, exact values and units, and what is refused."""

import re
from decimal import Decimal
from fractions import Fraction

import pytest
from cases import altered
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from tables import rows, tupled

from replication.audit.judge.printed import decimal_fraction, has_uncertainty, number, parse
from replication.audit.parts import Sensitivity
from replication.audit.report.sections import rooms
from replication.audit.store.records import ResultsFile
from replication.errors import AuditError


@pytest.mark.parametrize(("text", "shape", "values", "units"), rows("several"))
def test_several_numbers_are_read_in_their_layout(
    text: str, shape: tuple[int, ...] | None, values: tuple[str, ...], units: tuple[str, ...]
) -> None:
    printed = parse(text)
    assert printed.shape == (shape or ())
    assert [entry.value for entry in printed.entries] == [*map(Fraction, values)]
    assert [str(entry.unit) for entry in printed.entries] == [*units]
    assert [entry.absolute for entry in printed.entries] == [
        "±" in text and label.startswith("imag") for label in printed.labels
    ]


def test_each_of_several_numbers_has_a_label_and_a_place() -> None:
    pair, matrix = parse("(1.031, 1.085±0.240i)"), parse("[1 2; 3 4]")
    assert pair.labels == ("entry 1", "real part of entry 2", "imaginary part of entry 2")
    assert pair.align("value", (1.0, (2.0, -3.0))) == (1.0, 2.0, -3.0)
    assert matrix.labels == ("entry (1,1)", "entry (1,2)", "entry (2,1)", "entry (2,2)")
    assert matrix.align("value", ((1.0, 2.0), (3.0, 4.0))) == (1.0, 2.0, 3.0, 4.0)


@pytest.mark.parametrize(("text", "offending"), rows("no prints"))
def test_refused_with_the_offending_text(text: str, offending: str) -> None:
    with pytest.raises(AuditError) as caught:
        parse(text)
    assert offending in str(caught.value)


@pytest.mark.parametrize(("text", "advice"), rows("advice"))
def test_a_print_of_another_form_is_refused_with_what_to_write(text: str, advice: str) -> None:
    with pytest.raises(AuditError, match=advice):
        parse(text)


@pytest.mark.parametrize(("text", "value", "unit", "spread"), rows("prints"))
def test_one_number_in_the_forms_of_all_fields(text: str, value: str, unit: str, spread: str | None) -> None:
    printed = parse(text)
    (entry,) = printed.entries
    assert (entry.value, entry.unit, entry.absolute) == (Fraction(value), Fraction(unit), False)
    sign = re.search(r"<=|>=|\\leq|[<≤>≥]", text)
    assert (printed.shape, printed.text) == ((), text)
    assert printed.relation == ("" if sign is None else {"<=": "≤", ">=": "≥", r"\leq": "≤"}.get(sign[0], sign[0]))
    assert entry.spread == (None if spread is None else (Fraction(spread), Fraction(spread)))
    assert parse(parse(text).plain).entries[0].value == entry.value


@pytest.mark.parametrize(("text", "below", "above"), rows("two sides"))
def test_an_uncertainty_may_reach_further_down_than_up(text: str, below: str, above: str) -> None:
    (entry,) = parse(text).entries
    assert (entry.value, entry.spread) == (Fraction("0.75"), (Fraction(below), Fraction(above)))
    assert has_uncertainty(text) and not has_uncertainty("0.75")


@pytest.mark.parametrize(
    "text", ["0.75 [0.80, 0.90]", "0.75 (0.60 to 0.70)", "0.75^{+0.10}_{-0}", "<1.23(4)", "1.23(0)", "1.23 ± 0.0"]
)
def test_an_uncertainty_that_does_not_fit_its_number_is_refused(text: str) -> None:
    with pytest.raises(AuditError, match=r"limits that do not hold it|uncertainty of zero|without uncertainty"):
        parse(text)


@pytest.mark.parametrize(("text", "numbers"), rows("layouts"))
def test_other_layout_is_refused(text: str, numbers: object) -> None:
    with pytest.raises(AuditError, match="layout"):
        parse(text).align("computed value", numbers)  # type: ignore[arg-type]


@given(st.integers(-(10**12), 10**12), st.integers(0, 9), st.booleans())
def test_value_and_unit_of_any_decimal(digits: int, places: int, typographic: bool) -> None:
    text = str(Decimal(digits).scaleb(-places).quantize(Decimal(1).scaleb(-places)))
    (entry,) = parse(text.replace("-", "−") if typographic else text).entries
    assert entry.value == Fraction(digits, 10**places)
    assert entry.unit == Fraction(1, 10**places)


@given(st.text(max_size=12))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    try:
        printed = parse(text)
    except AuditError:
        return
    assert printed.entries and all(entry.unit > 0 for entry in printed.entries)


def test_decimal_fraction_of_a_tolerance() -> None:
    assert decimal_fraction("0.005") == Fraction(1, 200)
    with pytest.raises(AuditError, match="half"):
        decimal_fraction("half")


@pytest.mark.parametrize(("printed", "meant"), rows("inputs"))
def test_number_of_a_print_in_any_form(printed: object, meant: object) -> None:
    assert tupled(number(printed)) == tupled(meant)


@pytest.mark.parametrize("printed", ["<0.5", "1.0+0.2i", {"a": "≥2"}, "half"])
def test_what_is_no_real_number_is_no_input(printed: object) -> None:
    with pytest.raises(AuditError, match="printed value"):
        number(printed)


def test_what_a_print_stands_for_comes_from_the_judgement(made: ResultsFile) -> None:
    first, *others = made.claims
    move = Sensitivity(claim=first.id, parameter="p", printed="0.5", base=1.33, low=1.32, high=1.34)
    file = replace(made, papers=(replace(made.papers[0], sensitivity=(move,)),))
    (room,) = rooms(file)
    assert room.agrees
    elsewhere = altered(first, intervals=(("2/1", "3/1"),))
    (room,) = rooms(replace(file, claims=(elsewhere, *others)))
    assert not room.agrees
