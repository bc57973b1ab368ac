"""Condition (8), solutions of (6) on a grid, and the box of output matrices: what proves them, and what does not."""

from __future__ import annotations

import copy
import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from stated import check_stated

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
CHEATS = [
    ("condition-8-1", [("middle", "parameters", "period")], "not more than one"),
    ("condition-8-1", [("h_0", "parameters", "period")], "must be one of"),
    ("condition-8-1", [([["0", "1"], ["16", "-24/5"]], "plant", "A")], "the plant is not Hurwitz"),
    ("condition-8-1", [([["1/10", "0"], ["0", "0"]], "plant", "h_l")], "plant.h_l"),
    ("condition-8-2", [([], "witness", "P")], "1 to 200 matrices"),
    ("condition-8-2", [([[["1", "0"], ["0", "1"]]], "witness", "P")], "is not proved between the shares"),
    ("condition-8-2", [([[["-1", "0"], ["0", "1"]]], "witness", "P")], "witness.P is not proved positive definite"),
    ("condition-8-2", [([["-1", "1"], ["-1", "-1"]], "plant", "A")], "not real and different"),
    ("condition-8-2", [(["99/100", "0"], "plant", "h_u")], "is not proved between the shares"),
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
