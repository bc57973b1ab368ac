"""Gains under nonuniform sampling: the verifier proves what was made, and refuses each tampered certificate."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any
from unittest import mock

import pytest
from flint import arb, fmpq, fmpq_mat
from tampered import Altered, committed, load, refused
from tampered import check_stated as check

from replication.verify import run
from replication.verify.nonuniform import smallgain
from replication.verify.nonuniform.system import Case, Filter
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


HALF = fmpq(1, 2)
AXES = ((1, 0), (0, 1), (-1, 0), (0, -1))


def box(normals: Sequence[tuple[Any, ...]], limits: Sequence[Any]) -> tuple[Any, ...]:
    """The box by these half-spaces, first those that bound the entries above."""
    spaces = iter([([arb(entry) for entry in normal], arb(end)) for normal, end in zip(normals, limits, strict=True)])
    with mock.patch.object(smallgain, "half_space", lambda *_: next(spaces)):
        return run.check(committed("mustafa/output-matrix")).items


def test_a_box_of_one_point_is_stated_and_an_empty_one_is_not() -> None:
    assert box(AXES, (1, HALF, -1, -HALF)) == ((1, 1), (HALF, HALF))
    with pytest.raises(Refused, match="no C_f has this level"):
        box(AXES, (1, HALF, 1, -1))


def test_the_points_of_all_entries_are_counted() -> None:
    with mock.patch.object(smallgain, "MAX_ENTRIES", 3):
        assert [len(points) for points in smallgain.read_points([[POINT], [POINT] * 2], "p", 2)] == [1, 2]
        with pytest.raises(Refused, match="p has more than 3 points"):
            smallgain.read_points([[POINT] * 2] * 2, "p", 2)
