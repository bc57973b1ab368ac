"""Gains under nonuniform sampling: the verifier proves what was made, and refuses each tampered certificate."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any
from unittest import mock

import pytest
from flint import acb, arb, arb_mat, fmpq, fmpq_mat
from tampered import Certificate, Tamper, committed, load, put, remove, scaled
from tampered import check_stated as check

from replication.verify import run
from replication.verify.nonuniform import grid, smallgain
from replication.verify.nonuniform.system import Case, Filter, read_filtered
from replication.verify.theorem import Refused


def exchange_periods(certificate: Certificate) -> None:
    """h_u for h_l in the pattern, and the other way round."""
    for part in certificate["witness"]["pattern"]:
        part[0] = {"0": "1", "1": "0"}[part[0]]


LESS, MORE = "99999/100000", "100001/100000"
STORAGE = ("witness", "storage")
MANY = len(load("range-2-upper")["witness"]["storage"]["P"])
REFUSED = [
    (
        "nominal-1-upper",
        scaled(LESS, "bound", "upper"),
        "storage inequality from P.0. to P.0. is not proved between the shares 0 and 1/16777216",
    ),
    ("nominal-1-upper", scaled("-1", "bound", "upper"), "bound.upper must be positive"),
    ("nominal-1-upper", put("1/1000", *STORAGE, "P", 0, 0, 0), r"P\[0\] is not positive definite"),
    ("nominal-1-upper", put("1/1000", *STORAGE, "P", 0, 0, 1), r"P\[0\] must be symmetric"),
    ("nominal-1-upper", put("1/7", "witness", "filter", "B", 0, 0), "storage inequality"),
    ("nominal-1-upper", put("1", "plant", "D", 0, 0), "storage inequality"),
    ("nominal-1-upper", put("h_u", "parameters", "to"), "storage inequality"),
    ("nominal-1-upper", put("h_m", "parameters", "to"), "parameters.to must be one of h_l, middle, h_u"),
    ("nominal-1-upper", put("energy", "parameters", "weight"), "weight must be one of samples, duration"),
    ("nominal-1-upper", put("duration", "parameters", "weight"), "storage inequality"),
    ("range-2-upper", put("0", *STORAGE, "before", 0, 0), "must be an integer"),
    (
        "range-2-upper",
        put(MANY, *STORAGE, "before", 0, 0),
        rf"before points at P\[{MANY}\], but there are {MANY} matrices",
    ),
    ("range-2-upper", remove(*STORAGE, "before", 0), f"must have {MANY} entries"),
    ("range-2-upper", put("1/8", *STORAGE, "cells", 0), "cells must rise from 0 to 1"),
    ("range-2-upper", put("7/8", *STORAGE, "cells", 2), "cells must rise from 0 to 1"),
    ("range-2-upper", put("2", *STORAGE, "cells", 1), "cells must rise from 0 to 1"),
    ("range-2-upper", put("1", *STORAGE, "cells", 1), "cells must rise from 0 to 1"),
    ("printed-filter-level", put("119/1251", "parameters", "level"), "the bound .* exceeds the level 119/1251"),
    ("printed-filter-lower", scaled(MORE, "bound", "lower"), "the disturbance does not attain"),
    ("printed-filter-lower", scaled("-1", "bound", "lower"), "bound.lower must be positive"),
    ("printed-filter-lower", put([[["0", "0"]]], "witness", "w"), "the disturbance must not be zero"),
    ("printed-filter-lower", put([["2", 1]], "witness", "pattern"), "a share from 0 to 1"),
    ("printed-filter-lower", put([["-1", 1]], "witness", "pattern"), "a share from 0 to 1"),
    ("printed-filter-lower", put([["1", 0]], "witness", "pattern"), "must be at least 1"),
    (
        "printed-filter-lower",
        put([["1", 999999999]] * 20, "witness", "pattern"),
        "19999999980 samples, more than 40000",
    ),
    ("printed-filter-lower", put([["1", 40000]], "witness", "pattern"), "witness.w must have 40000 entries"),
    ("printed-filter-lower", put([["1", 20000], ["0", 20001]], "witness", "pattern"), "40001 samples, more than 40000"),
    ("printed-filter-upper", put([["1"] * 51] * 51, "plant", "A"), "plant.A has 51 states, more than 50"),
    ("printed-filter-upper", put([["1"] * 51] * 51, "plant", "filter", "A"), "filter.A has 51 states, more than 50"),
    ("printed-filter-lower", put([["1"]], "witness", "pattern"), "must be .share, samples"),
    (
        "printed-filter-lower",
        put("energy", "parameters", "weight"),
        "weight must be one of samples, duration",
    ),
    (
        "printed-filter-lower",
        put([["2", "0"], ["0", "1/2"]], "plant", "filter", "A"),
        "the poles of the filter are not",
    ),
    ("printed-filter-lower", put([["2", "0"], ["0", "-1"]], "plant", "A"), "the plant is not Hurwitz"),
    ("range-1-lower", scaled(MORE, "bound", "lower"), "the disturbance does not attain"),
    ("range-1-lower", exchange_periods, "the disturbance does not attain"),
    ("range-1-lower", put("1", "witness", "turn"), "the disturbance does not attain"),
    ("range-1-lower", remove("witness", "w", 0), r"witness.w must have \d+ entries"),
    ("range-2-lower", put("3", "parameters", "level"), "is below the level 3"),
    ("range-1-no-filter", put("1/7", "parameters", "level"), "is below the level 1/7"),
    ("floor-1", scaled(MORE, "bound", "lower"), "the hidden disturbance does not attain"),
    ("floor-1", scaled("-1", "bound", "lower"), "bound.lower must be positive"),
    ("floor-1", put(["0", "0"], "witness", "start"), "the hidden disturbance must not be zero"),
    ("floor-1", put(["1"], "witness", "start"), "witness.start must be a state"),
    (
        "floor-1",
        put([["1"]], "plant", "D"),
        "the energy of the zeros of w -> y, which must lie outside the unit circle, is not proved positive definite",
    ),
    ("floor-2", scaled(MORE, "bound", "lower"), "the hidden disturbance does not attain"),
    ("floor-2", put(["1", "1"], "witness", "start"), "witness.start must be a disturbance"),
    ("floor-2", put([["1/10"]], "plant", "D"), "witness.start must be a state"),
    ("stable-1", put({"upper": "1"}, "bound"), "bound has the unknown field upper"),
    ("stable-1", put({"P": []}, "witness"), "witness has the unknown field P"),
    ("stable-1", remove("plant", "filter"), "parameters lacks the field filter"),
    ("stable-2", put({}, "plant", "filter"), "plant.filter lacks the field A, B, C"),
    ("stable-2", put([["1", "0"], ["0", "1/2"]], "plant", "filter", "A"), "the poles of the filter are not"),
    ("stable-2", put([["1/2", "0"]], "plant", "filter", "A"), "plant.filter.A must be square"),
    ("stable-2", put([["-1", "0"]], "plant", "A"), "plant.A must be square"),
    ("stable-2", put([["0", "0"], ["0", "-1"]], "plant", "A"), "the plant is not Hurwitz"),
    ("stable-2", put(["0", "0"], "plant", "h_l"), "plant.h_l must be positive"),
    ("stable-2", put(["1/1000", "0"], "plant", "h_u"), "plant.h_u must exceed plant.h_l"),
    ("stable-2", remove("plant", "h_u"), "plant lacks the field h_u"),
    ("range-2-upper", scaled("998/1000", "bound", "upper"), "storage inequality"),
    ("printed-filter-upper", scaled(LESS, "bound", "upper"), "storage inequality"),
    ("printed-filter-level", scaled("99/100", "bound", "upper"), "storage inequality"),
    ("range-2-lower", scaled(MORE, "bound", "lower"), "the disturbance does not attain"),
    ("range-1-no-filter", scaled(MORE, "bound", "lower"), "the hidden disturbance does not attain"),
    ("range-2-upper", put(5, *STORAGE, "before", 0, 0), "storage inequality"),
    ("robust-design-1", put("1/7", "witness", "filter", "A", 0, 0), "storage inequality"),
    ("robust-design-1", put(["0", "1/5"], "plant", "h_u"), "storage inequality"),
]


@pytest.mark.parametrize(("name", "tamper", "reason"), REFUSED)
def test_a_tampered_certificate_is_refused(name: str, tamper: Tamper, reason: str) -> None:
    with pytest.raises(Refused, match=reason):
        check(load(name, tamper))


def test_the_plant_of_the_paper_is_the_only_one() -> None:
    certificate = committed("mustafa/floor-2")
    assert check(certificate).lower is not None
    certificate["plant"]["h_u"] = ["1/10", "0"]
    with pytest.raises(Refused, match="plant is not that of the wanted theorem"):
        check(certificate)


def test_verdicts_of_levels() -> None:
    assert check(load("printed-filter-level")).holds is True
    assert check(load("range-1-no-filter")).holds is False
    assert check(load("stable-2")).holds is True
    assert check(load("printed-filter-upper")).holds is None


@pytest.mark.parametrize("name", [*sorted({name for name, _, _ in REFUSED}), "duration-1-lower"])
def test_what_was_made_is_proved(name: str) -> None:
    certificate = load(name)
    theorem = check(certificate)
    assert {side: str(getattr(theorem, side)) for side in certificate["bound"]} == certificate["bound"]


@pytest.mark.parametrize(("start", "stop"), [("middle", "h_l"), ("h_u", "h_l"), ("h_u", "middle")])
def test_a_range_that_runs_backwards_is_refused(start: str, stop: str) -> None:
    certificate = load("range-2-upper")
    certificate["parameters"] |= {"from": start, "to": stop}
    with pytest.raises(Refused, match=r"parameters\.from exceeds parameters\.to"):
        check(certificate)


@pytest.mark.parametrize(
    ("name", "side", "holds"),
    [("printed-filter-level", "upper", True), ("range-2-lower", "lower", False), ("range-1-no-filter", "lower", False)],
)
def test_a_level_that_is_the_bound_is_decided(name: str, side: str, holds: bool) -> None:
    certificate = load(name)
    certificate["parameters"]["level"] = certificate["bound"][side]
    assert check(certificate).holds is holds


def test_sentences_say_for_which_periods_they_hold() -> None:
    first, middle, last = (Fraction(1, 100), 0), (Fraction(1, 200), Fraction(1, 50)), (0, Fraction(1, 25))
    for ends, words in (
        ((first, last), "over all periods from 1/100 to 1/25 pi s"),
        ((middle, last), "over all periods from 1/200 + 1/50 pi to 1/25 pi s"),
        ((last, last), "at the constant period 1/25 pi s"),
    ):
        assert case(ends, "samples").scope == words
        assert case(ends, "duration").scope == f"{words}, both norms weighted by the periods,"


def case(ends: Sequence[Sequence[Fraction | int]], weight: str) -> Case:
    low, high = (tuple(fmpq(*Fraction(part).as_integer_ratio()) for part in end) for end in ends)
    nothing = fmpq_mat(1, 1)
    return Case(ends=(low, high), weight=weight, filter=Filter(nothing, nothing, nothing), level=fmpq(1))


# Condition (8), solutions of (6) on a grid, and the box of output matrices: what proves them, and what does not.


def test_condition_8_is_met_in_the_second_example_only() -> None:
    for name, holds in (("condition-8-1", False), ("condition-8-2", True)):
        theorem = run.check(committed(f"mustafa/{name}"))
        assert theorem.holds is holds
        (said,) = theorem.says
        assert (said.of.quantity, said.holds) == ("condition (8)", holds)
        assert said.readings == ("constant change", "any change")
    assert "at least 1.4015" in run.check(committed("mustafa/condition-8-1")).sentence
    assert "at most 0.97900" in run.check(committed("mustafa/condition-8-2")).sentence


def test_a_solution_on_the_grid_is_none_on_the_range() -> None:
    for name, size in (("own-grid-1", 7), ("own-grid-2", 2)):
        theorem = run.check(committed(f"mustafa/{name}"))
        assert theorem.holds is False
        assert f"at all {size} elements of the grid" in theorem.sentence


def test_the_output_matrices_that_keep_the_level_round_to_the_print() -> None:
    theorem = run.check(committed("mustafa/output-matrix"))
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
        check(load(name, *(put(*change) for change in changes)))


def test_a_wider_level_gives_a_wider_box() -> None:
    narrow, wide = committed("mustafa/output-matrix"), load("output-matrix", put("1/10", "parameters", "level"))
    for (low, high), (least, most) in zip(run.check(narrow).items, check(wide).items, strict=True):
        assert least is not None and low is not None and least < low
        assert most is not None and high is not None and high < most


def test_both_eigenvalues_are_found() -> None:
    found = smallgain.eigenvalues(fmpq_mat([[-1, 5], [0, -3]]))
    assert [value.real.contains(exact) for value, exact in zip(found, (-1, -3), strict=True)] == [True, True]
    with pytest.raises(Refused, match="for two states"):
        smallgain.eigenvalues(fmpq_mat([[-1, 0, 0], [0, -2, 0], [0, 0, -3]]))


def test_as_many_pieces_as_are_allowed() -> None:
    given = committed("mustafa/condition-8-2")
    count = len(given["witness"]["P"])
    with mock.patch.object(smallgain, "MOST_PIECES", count):
        assert run.check(given).holds
    with mock.patch.object(smallgain, "MOST_PIECES", count - 1), pytest.raises(Refused, match="must have 1 to"):
        run.check(given)


def test_the_bounded_real_lemma_block_by_block() -> None:
    P, A, B, C, supplied = (arb_mat([[number]]) for number in (3, 2, 5, 7, 11))
    wanted = [[3 - 7 * 7 - 2 * 3 * 2, -2 * 3 * 5], [-2 * 3 * 5, 11 - 5 * 3 * 5]]
    assert grid.bounded_real(P, A, B, C, supplied).tolist() == arb_mat(wanted).tolist()


HALF, SMALL = fmpq(1, 2), fmpq(1, 8)
AXES = ((1, 0), (0, 1), (-1, 0), (0, -1))
TILTED = ((1, SMALL), (-SMALL, 1), (-1, SMALL), (SMALL, -1))


def box(normals: Sequence[tuple[Any, ...]], limits: Sequence[Any]) -> tuple[Any, ...]:
    """The box by these half-spaces, first those that bound the entries above."""
    spaces = iter([([arb(entry) for entry in normal], arb(end)) for normal, end in zip(normals, limits, strict=True)])
    with mock.patch.object(smallgain, "half_space", lambda *_: next(spaces)):
        return run.check(committed("mustafa/output-matrix")).items


@pytest.mark.parametrize("scale", [fmpq(1), fmpq(1, 6)])
def test_the_box_of_tilted_half_spaces(scale: fmpq) -> None:
    """All are tilted by 1/4 and the largest limit is 3, so that each is moved by 1/4 times 3 over 3/4."""
    for pair, exact in zip(box(TILTED, [scale * end for end in (3, 1, 1, 2)]), ((-2, 4), (-3, 2)), strict=True):
        for side, end in zip(pair, exact, strict=True):
            assert side is not None and abs(side - scale * end) <= fmpq(1, 2**38)


def test_a_box_is_rounded_outwards() -> None:
    for low, high in box(AXES, [fmpq(1, 3)] * 4):
        assert low < fmpq(-1, 3) and high > fmpq(1, 3)


def test_a_box_of_one_point_is_stated_and_an_empty_one_is_not() -> None:
    assert box(AXES, (1, HALF, -1, -HALF)) == ((1, 1), (HALF, HALF))
    with pytest.raises(Refused, match="no C_f has this level"):
        box(AXES, (1, HALF, 1, -1))


def test_the_points_of_all_entries_are_counted() -> None:
    with mock.patch.object(smallgain, "MAX_ENTRIES", 3):
        assert [len(points) for points in smallgain.read_points([[POINT], [POINT] * 2], "p", 2)] == [1, 2]
        with pytest.raises(Refused, match="p has more than 3 points"):
            smallgain.read_points([[POINT] * 2] * 2, "p", 2)


def test_a_half_space_by_hand() -> None:
    """x' = -x + w, y = x + 3 w, z = x, the filter f+ = y: at z = 1 constants answer a constant w, x = w and f = 4 w."""
    filter_ = {"A": [["0"]], "B": [["1"]], "C": [["1"]]}
    plant = {name: [[entry]] for name, entry in {"A": "-1", "B": "1", "C": "1", "D": "3", "L": "1"}.items()}
    plant |= {"name": "own", "h_l": ["1/2", "0"], "h_u": ["3/2", "0"], "filter": filter_}
    read = read_filtered(plant, "plant")
    assert read.filter is not None
    (normal,), limit = smallgain.half_space(
        read, read.filter, HALF, [smallgain.read_point({"turn": "0", "u": ["2", "0"]}, "p")]
    )
    for found, exact in ((normal, 8), (limit, 3)):
        assert found.contains(exact) and found.rad() < 1e-9


def test_a_point_of_the_unit_circle_has_a_complex_weight() -> None:
    point = smallgain.read_point({"turn": "1/2", "u": ["3", "-4"]}, "p")
    assert point.u == acb(3, -4) and abs(point.z).contains(1)
