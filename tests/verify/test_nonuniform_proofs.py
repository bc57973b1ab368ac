"""Condition (8), solutions of (6) on a grid, and the box of output matrices: what proves them, and what does not."""

from __future__ import annotations

import copy
import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
from flint import acb, arb, fmpq, fmpq_mat
from stated import check_stated

from replication.verify.nonuniform import smallgain
from replication.verify.nonuniform import smallgain as output
from replication.verify.nonuniform.system import read_filtered, read_plant
from replication.verify.run import check
from replication.verify.theorem import Refused

FOLDER = Path(__file__).parents[2] / "certificates" / "mustafa"


@cache
def _text(name: str) -> str:
    return (FOLDER / f"{name}.json").read_text(encoding="utf-8")


def load(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(_text(name))
    return found


def own(name: str, *changes: tuple[Any, ...]) -> dict[str, Any]:
    """The certificate with values put at places, about a plant of one's own: (value, step, step, ..)."""
    certificate = {**copy.deepcopy(load(name)), "paper": None, "claims": []}
    for value, *way, last in changes:
        place: Any = certificate
        for step in way:
            place = place[step]
        place[last] = value
    return certificate


def test_condition_8_is_met_in_the_second_example_only() -> None:
    for name, holds in (("condition-8-1", False), ("condition-8-2", True)):
        theorem = check(load(name))
        assert theorem.holds is holds
        (said,) = theorem.says
        assert (said.of.quantity, said.holds) == ("condition (8)", holds)
        assert said.readings == ("constant change", "any change")
    assert "at least 1.4015" in check(load("condition-8-1")).sentence
    assert "at most 0.97900" in check(load("condition-8-2")).sentence


def test_a_solution_on_the_grid_is_none_on_the_range() -> None:
    for name, size in (("own-grid-1", 7), ("own-grid-2", 2)):
        theorem = check(load(name))
        assert theorem.holds is False
        assert f"at all {size} elements of the grid" in theorem.sentence


def test_the_output_matrices_that_keep_the_level_round_to_the_print() -> None:
    theorem = check(load("output-matrix"))
    (low, high), (least, most) = theorem.items
    assert -0.005 < float(low) < 0 < float(high) < 0.005 and 0.995 < float(least) < 1 < float(most) < 1.005
    assert theorem.says[0].items == tuple((str(a), str(b)) for a, b in theorem.items)


POINT = {"turn": "0", "u": ["1", "0"]}
NEGATIVE = [[["-1", "0"], ["0", "-1"]]]
LOWER_ORDER = {"A": [["0"]], "B": [["1"]], "C": [["1"]]}
CHEATS = [
    ("condition-8-1", [("middle", "parameters", "period")], "not more than one"),
    ("condition-8-1", [("h_0", "parameters", "period")], "must be one of"),
    ("condition-8-1", [([["0", "1"], ["16", "-24/5"]], "plant", "A")], "the plant is not Hurwitz"),
    ("condition-8-1", [([["1/10", "0"], ["0", "0"]], "plant", "h_l")], "plant.h_l"),
    ("condition-8-2", [([["1", "0"], ["0", "-1"]], "plant", "A")], "the plant is not Hurwitz"),
    ("condition-8-2", [([], "witness", "P")], "1 to 200 matrices"),
    ("condition-8-2", [([[["1", "0"], ["0", "1"]]], "witness", "P")], "is not proved between the shares"),
    ("condition-8-2", [([[["-1", "0"], ["0", "1"]]], "witness", "P")], "witness.P is not proved positive definite"),
    ("condition-8-2", [([["-1", "1"], ["-1", "-1"]], "plant", "A")], "not real and different"),
    # Less than the square of the trace are the determinant and four, but not four times the determinant.
    ("condition-8-2", [([["-2", "1"], ["-1", "-2"]], "plant", "A")], "not real and different"),
    ("condition-8-2", [(["99/100", "0"], "plant", "h_u")], "is not proved between the shares"),
    # Near to a double eigenvalue all is well until the matrix; near to a period of zero r is one at one end.
    ("condition-8-2", [([["-10", "0"], ["0", "-11"]], "plant", "A"), (NEGATIVE, "witness", "P")], "witness.P is not"),
    ("condition-8-2", [([f"1/{10**60}", "0"], "plant", "h_l")], "in modal coordinates the norm is not proved"),
    ("own-grid-1", [("1/10", "witness", "level")], r"\(6\) is not proved at"),
    ("own-grid-1", [("1/4", "witness", "level")], "the disturbance does not attain 1/4"),
    ("own-grid-1", [([["1"] * 4] * 4, "witness", "P")], "witness.P is not positive definite"),
    ("own-grid-1", [([["1", "0", "0", "0"]] * 4, "witness", "P")], "must be symmetric"),
    ("own-grid-2", [([["0", "1"]], "witness", "pattern")], "pattern"),
    ("own-grid-2", [("2", "witness", "level")], "the disturbance does not attain 2"),
    ("output-matrix", [([[POINT], [POINT]], "witness", "above")], "do not bound C_f"),
    ("output-matrix", [([[POINT]], "witness", "above")], "witness.above must have 2 entries"),
    ("output-matrix", [([["1", "0"], ["0", "1"]], "plant", "L")], "plant.filter.C must have 2 entries"),
    ("output-matrix", [("0", "parameters", "level")], "parameters.level must be positive"),
    ("output-matrix", [(LOWER_ORDER, "plant", "filter")], "equal orders"),
    ("output-matrix", [("1/1000", "parameters", "level")], "no C_f has this level"),
]


@pytest.mark.parametrize(("name", "changes", "reason"), CHEATS)
def test_what_does_not_prove_it_is_refused(name: str, changes: list[tuple[Any, ...]], reason: str) -> None:
    with pytest.raises(Refused, match=reason):
        check_stated(own(name, *changes))


def test_a_wider_level_gives_a_wider_box() -> None:
    narrow, wide = load("output-matrix"), own("output-matrix", ("1/10", "parameters", "level"))
    for (low, high), (least, most) in zip(check(narrow).items, check_stated(wide).items, strict=True):
        assert least is not None and low is not None and least < low
        assert most is not None and high is not None and high < most


def test_both_eigenvalues_are_found() -> None:
    found = smallgain.eigenvalues(fmpq_mat([[-1, 5], [0, -3]]))
    assert [value.real.contains(exact) for value, exact in zip(found, (-1, -3), strict=True)] == [True, True]
    with pytest.raises(Refused, match="for two states"):
        smallgain.eigenvalues(fmpq_mat([[-1, 0, 0], [0, -2, 0], [0, 0, -3]]))


def test_as_many_pieces_as_are_allowed() -> None:
    given = load("condition-8-2")
    count = len(given["witness"]["P"])
    with mock.patch.object(smallgain, "MOST_PIECES", count):
        assert check(given).holds
    with mock.patch.object(smallgain, "MOST_PIECES", count - 1), pytest.raises(Refused, match="must have 1 to"):
        check(given)


def test_the_state_block_of_condition_8_is_that_of_the_bounded_real_lemma() -> None:
    """For A = diag(-1, -2) and P = diag(3, 5) its entries are p - (a f)^2 - p f^2, f = e^(a h_0)."""
    given = {**load("condition-8-2")["plant"], "A": [["-1", "0"], ["0", "-2"]]}
    given |= {"h_l": ["1/2", "0"], "h_u": ["3/2", "0"]}
    state = smallgain._Gain(read_plant(given), fmpq_mat([[3, 0], [0, 5]])).state
    for i, (a, p) in enumerate(((-1, 3), (-2, 5))):
        f = arb(a).exp()
        assert state[i, i].overlaps(p - (a * f) ** 2 - p * f**2)
        assert state[i, i].rad() < 1e-9


HALF, SMALL = fmpq(1, 2), fmpq(1, 8)
AXES = ((1, 0), (0, 1), (-1, 0), (0, -1))
TILTED = ((1, SMALL), (-SMALL, 1), (-1, SMALL), (SMALL, -1))


def box(normals: Sequence[tuple[Any, ...]], limits: Sequence[Any]) -> tuple[Any, ...]:
    """The box by these half-spaces, first those that bound the entries above."""
    spaces = iter([([arb(entry) for entry in normal], arb(end)) for normal, end in zip(normals, limits, strict=True)])
    with mock.patch.object(output, "half_space", lambda *_: next(spaces)):
        return check(load("output-matrix")).items


@pytest.mark.parametrize("scale", [fmpq(1), fmpq(1, 6)])
def test_the_box_of_tilted_half_spaces(scale: fmpq) -> None:
    """All are tilted by 1/4 and the largest limit is 3, so that each is moved by 1/4 times 3 over 3/4."""
    for pair, exact in zip(box(TILTED, [scale * end for end in (3, 1, 1, 2)]), ((-2, 4), (-3, 2)), strict=True):
        for side, end in zip(pair, exact, strict=True):
            assert side is not None and abs(side - scale * end) <= fmpq(1, 2**38)


def test_a_box_of_one_point_is_stated_and_an_empty_one_is_not() -> None:
    assert box(AXES, (1, HALF, -1, -HALF)) == ((1, 1), (HALF, HALF))
    with pytest.raises(Refused, match="no C_f has this level"):
        box(AXES, (1, HALF, 1, -1))


def test_the_points_of_all_entries_are_counted() -> None:
    with mock.patch.object(output, "MAX_ENTRIES", 3):
        assert [len(points) for points in output.read_points([[POINT], [POINT] * 2], "p", 2)] == [1, 2]
        with pytest.raises(Refused, match="p has more than 3 points"):
            output.read_points([[POINT] * 2] * 2, "p", 2)


def test_a_half_space_by_hand() -> None:
    """x' = -x + w, y = x + 3 w, z = x, the filter f+ = y: at z = 1 constants answer a constant w, x = w and f = 4 w."""
    filter_ = {"A": [["0"]], "B": [["1"]], "C": [["1"]]}
    plant = {name: [[entry]] for name, entry in {"A": "-1", "B": "1", "C": "1", "D": "3", "L": "1"}.items()}
    plant |= {"name": "own", "h_l": ["1/2", "0"], "h_u": ["3/2", "0"], "filter": filter_}
    read = read_filtered(plant, "plant")
    assert read.filter is not None
    (normal,), limit = output.half_space(
        read, read.filter, HALF, [output.read_point({"turn": "0", "u": ["2", "0"]}, "p")]
    )
    for found, exact in ((normal, 8), (limit, 3)):
        assert found.contains(exact) and found.rad() < 1e-9


def test_a_point_of_the_unit_circle_has_a_complex_weight() -> None:
    point = output.read_point({"turn": "1/2", "u": ["3", "-4"]}, "p")
    assert point.u == acb(3, -4) and abs(point.z).contains(1)
