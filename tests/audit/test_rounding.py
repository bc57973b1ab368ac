"""Parameters moved within their rounding, and the room that a claim has."""

from fractions import Fraction
from typing import Any

import pytest
from cases import recorded, results_file
from msgspec.structs import replace
from sample import paper_record

from replication.audit.judge.printed import sensitivities, spread
from replication.audit.model import Evidence
from replication.audit.parts import Sensitivity
from replication.audit.report.sections.lineage import rooms
from replication.audit.store.records import ResultsFile
from replication.errors import AuditError, InfeasibleError


def total(numbers: Any) -> dict[str, float]:
    return {"toy.sum": sum(numbers["A"][0]) + 10 * numbers["A"][1][1] + numbers["b"] + sum(numbers["c"])}


def test_each_printed_number_with_decimals_is_moved_alone() -> None:
    found = spread({"A": "[0.5 -1; 0 .25]", "b": "3.0", "c": "(1, 2.50)"}, total)
    assert found["base"] == {"toy.sum": 0.5 - 1 + 2.5 + 3 + 3.5}
    assert [(row["parameter"], row["printed"]) for row in found["rows"]] == [
        ("A(1,1)", "0.5"), ("A(2,2)", ".25"), ("b", "3.0"), ("c(2)", "2.50"),
    ]  # fmt: skip
    moves = [row["high"]["toy.sum"] - found["base"]["toy.sum"] for row in found["rows"]]
    assert moves == pytest.approx([0.05, 0.05, 0.05, 0.005])
    assert [row["low"]["toy.sum"] for row in found["rows"]] == pytest.approx(
        [found["base"]["toy.sum"] - move for move in moves]
    )


def test_a_parameter_without_a_result_is_told_and_other_errors_are_not_hidden() -> None:
    def fragile(numbers: Any) -> dict[str, float]:
        if numbers["a"] > 0.5:
            raise InfeasibleError("too large")
        return {"toy.a": numbers["a"]}

    (row,) = spread({"a": "0.5"}, fragile)["rows"]
    assert row["high"] is None
    assert row["low"] == {"toy.a": pytest.approx(0.45)}
    with pytest.raises(ZeroDivisionError):
        spread({"a": "0.5"}, lambda numbers: {"x": 1 / 0})


def file_with(printed: str, value: float, *ends: tuple[float | None, float | None]) -> ResultsFile:
    claim = recorded(Evidence(method="m", value=value), printed=printed)
    moves = tuple(
        Sensitivity(claim=claim.id, parameter=f"p{i}", printed="0.5", base=value, low=low, high=high)
        for i, (low, high) in enumerate(ends)
    )
    paper = replace(paper_record((claim.id,)), sensitivity=moves)
    return replace(results_file(claim), papers=(paper,))


def test_room_is_the_part_of_the_rounding_that_the_claim_bears() -> None:
    (found,) = rooms(file_with("1.33", 1.33, (1.329, 1.331), (1.32, 1.331), (1.33, 1.35)))
    assert [(room.moves.parameter, room.share) for room in found.rooms] == [
        ("p2", pytest.approx(0.25)), ("p1", pytest.approx(0.5)), ("p0", 1.0),
    ]  # fmt: skip
    assert found.agrees
    assert [room.moves.parameter for room in found.breaking] == ["p2", "p1"]


def test_no_result_is_no_room() -> None:
    (found,) = rooms(file_with("1.33", 1.33, (1.33, None)))
    assert found.agrees
    assert found.breaking == found.rooms
    assert found.rooms[0].share == 0.0


def test_a_claim_that_differs_may_be_reached_by_rounding() -> None:
    (found,) = rooms(file_with("1.33", 1.35, (1.349, 1.351), (1.334, 1.36), (1.36, 1.30), (1.35, None)))
    assert not found.agrees and found.breaking == ()
    # The first to decide leads; what never reaches the print, or moves nothing, comes last.
    assert [(room.moves.parameter, room.share) for room in found.rooms] == [
        ("p2", pytest.approx(0.3)), ("p1", pytest.approx(0.9375)), ("p0", None), ("p3", None),
    ]  # fmt: skip
    assert [room.moves.parameter for room in found.reaching] == ["p2", "p1"]


def test_an_unknown_claim_is_an_error() -> None:
    file = file_with("1.33", 1.33, (1.33, 1.33))
    with pytest.raises(AuditError, match="which is no claim"):
        rooms(replace(file, claims=()))


def test_records_come_from_the_spread() -> None:
    found = sensitivities(spread({"A": "[0.5 -1; 0 .25]", "b": "3.0", "c": "(1, 2.50)"}, total))
    assert len(found) == 4
    assert {move.claim for move in found} == {"toy.sum"}
    assert Fraction(found[0].base) == Fraction(8.5)
