"""Gains under nonuniform sampling: the verifier proves what was made, and refuses each tampered certificate."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any
from unittest import mock

import pytest
from flint import acb, arb, arb_mat, fmpq, fmpq_mat
from tampered import Altered, committed, load, put, refused
from tampered import check_stated as check

from replication.verify import run
from replication.verify.nonuniform import grid, smallgain
from replication.verify.nonuniform.system import Case, Filter, read_filtered
from replication.verify.theorem import Refused


@pytest.mark.parametrize("row", refused("nonuniform"), ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


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


def test_the_output_matrices_that_keep_the_level_round_to_the_print() -> None:
    theorem = run.check(committed("mustafa/output-matrix"))
    (low, high), (least, most) = theorem.items
    assert -0.005 < float(low) < 0 < float(high) < 0.005 and 0.995 < float(least) < 1 < float(most) < 1.005
    assert theorem.says[0].items == tuple((str(a), str(b)) for a, b in theorem.items)


POINT = {"turn": "0", "u": ["1", "0"]}


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
