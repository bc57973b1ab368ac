"""Printed and computed digits of a claim: which agree, which do not, and how they stand below each other."""

from __future__ import annotations

from fractions import Fraction

import pytest
from sample import claim

from replication.audit.judge.agreement import Target
from replication.audit.model import Evidence, Kind, Verdict
from replication.audit.report.entries import EntryView, side_by_side
from replication.audit.store.records import ClaimRecord


def entries(printed: str, value: object, kind: Kind = Kind.VALUE) -> tuple[EntryView, ...]:
    evidence = Evidence(method="Evaluated directly", value=value)  # type: ignore[arg-type]
    return seen(claim("case", kind, Verdict.REPRODUCED, printed, evidence))


def seen(record: ClaimRecord) -> tuple[EntryView, ...]:
    return side_by_side(Target.judged(record.claim, record.judgement), record.evidence)[0]


@pytest.mark.parametrize(
    ("printed", "value", "agreed", "off", "tail"),
    [
        ("1.33", 1.32871, "1.32", "", "8710"),
        ("1.14", 1.134687, "1.1", "3", "4687"),
        ("1.3511", 1.35116518, "1.3511", "6", "518"),
        ("0.1270", 0.12771501, "0.127", "7", "1501"),
        ("13.89", 43.62701, "", "43.62", "7010"),
        ("1", 7, "", "7", ""),
        ("2", 2.6, "2", "", ".6000"),
        (".2357", 0.23570226, "0.2357", "", "0226"),
        ("-0.0000", -0.0000123, "−0.0000", "", "1230"),
    ],
)
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


def test_every_number_outside_shows_a_digit_that_is_off() -> None:
    for value in (1.3249, 1.3351, 1.33500001, 9.0, -1.33, 13.3):
        (entry,) = entries("1.33", value)
        assert not entry.inside
        assert dict(entry.digits)["off"]


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
