"""Levels over a range, piece by piece: what is off is allowed for, pieces leave nothing out, storages read the periods.

Where a step has another one decide, a stand-in answers; so it is seen what is asked.
Classes go by their module, so that a fault seeded there is met here.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import combinations_with_replacement, product
from math import ceil
from pathlib import Path
from typing import Any
from unittest.mock import Mock, patch

import byhand
import numpy as np
import pytest

from replication.recheck import interval
from replication.recheck.exact import times, turned, unit
from replication.recheck.nonuniform import levels
from replication.recheck.nonuniform.levels import PLACES
from replication.recheck.nonuniform.sampled import Case, Filter, case_of, read_plant
from replication.recheck.nonuniform.stamped import read_stamped
from replication.recheck.reading import Certificate, Proof, Unproved

ROOT = Path(__file__).parents[2]
HALF = Fraction(1, 2)


def certificate(name: str) -> Any:
    return json.loads((ROOT / "certificates" / "mustafa" / f"{name}.json").read_bytes())


def filtered(by_duration: bool = False) -> Case:
    """A filter beside its plant: two states of either, one disturbance; the rows of the filter are off by rounding."""
    plant = read_plant(certificate("our-filter-upper")["plant"])
    own = Filter(unit(2, HALF), [[Fraction(3)], [Fraction(1, 7)]], [[Fraction(2), Fraction(-1)]])
    return case_of(plant, own, plant.low, plant.high, by_duration)


def stamped(rate: str = "-1/3") -> Case:
    """One state, and corrections that are no integers."""
    made = byhand.stamped("1", byhand.STORED, rate=rate)
    return read_stamped(made["witness"]["filter"], [["1"]], read_plant(made["plant"]))


def inequality(case: Case, cuts: tuple[Fraction, ...] = (Fraction(0), Fraction(1)), level: Fraction = HALF) -> Any:
    """One state of the storage, with a matrix for each cell of the filter."""
    cells = len(case.F)
    storage = levels.Storage(
        list(cuts), [[0] * (len(cuts) - 1)], [unit(len(case.output[0]))] * cells, [0] * (len(cuts) - 1)
    )
    return levels.Inequality(case, level, storage)


def asked(one: Any, rest: int) -> tuple[Any, Any]:
    """The matrix whose definiteness is asked for, and how far around."""
    with patch.object(levels, "surely_positive") as definite:
        one.holds(Fraction(0), rest, 0, 1)
    return definite.call_args.args


def left_less_right(one: Any, columns: Any, weight: int) -> Any:
    """x' P_c x + w g^2 |w|^2 - w |e|^2 - x+' P_d x+ for columns of M and a weight."""
    size, count = one.size, len(columns)
    pushed = [[sum(p * x for p, x in zip(row, column, strict=True)) for row in one.P[1]] for column in columns]
    found = [[-sum(x * y for x, y in zip(a, b, strict=True)) for b in columns] for a in pushed]
    for i, j in product(range(count), repeat=2):
        if i < size and j < size:
            found[i][j] += one.P[0][i][j] * 4**PLACES - weight * one.seen[i][j] * 2**PLACES
        elif i == j:
            found[i][j] += weight * one.level2 * 2**PLACES
    return found


def drawn(rng: np.random.Generator, rows: int, columns: int, size: int) -> Any:
    return [[int(x) * size for x in row] for row in rng.integers(-9, 10, (rows, columns))]


LARGE, SMALL = 1 << PLACES, 1 << 20
KINDS = list(product((0, LARGE), (0, 3, SMALL, LARGE), (0, 3, SMALL, LARGE), ("mixed", "positive", "across", "none")))
"""Sizes of M, of what all entries are off, of what those of Phi and Gamma are off besides; and the signs of P."""


@pytest.mark.parametrize("case", [filtered(), stamped()], ids=["filtered", "stamped"])
def test_what_is_off_is_allowed_for(case: Case) -> None:
    """At all corners of what may be off, aligned with an entry or drawn, the matrix lies within the radius."""
    rng = np.random.default_rng(10)
    for large, off, rest, signs in KINDS:
        one = inequality(case)
        n, rows, count = one.n, one.n + len(case.R), len(case.F[0][0])
        root = drawn(rng, rows, rows, 1)
        p = [[root[max(i, j)][min(i, j)] for j in range(rows)] for i in range(rows)]
        if signs == "positive":
            p = [[abs(entry) + 1 for entry in row] for row in p]
        elif signs == "across":
            p = [[entry if (i < n) != (j < n) else 0 for j, entry in enumerate(row)] for i, row in enumerate(p)]
        one.P = [p, p if signs != "none" else [[0] * rows] * rows]
        one.seen = [[3 * entry for entry in row] for row in p]
        columns, weight = drawn(rng, count, rows, large), int(rng.integers(0, 9)) * large
        one.steps = Mock(return_value=(columns, weight, off))
        middle, radius = asked(one, rest)
        assert middle == left_less_right(one, columns, weight)
        bounds = [[off + (rest * moved if k < n else 0) for k in range(rows)] for moved in columns_of(case.F[0])]
        for moved, added in corners(rng, one, columns, bounds, off):
            found = left_less_right(one, moved, weight + added)
            for i, j in product(range(count), repeat=2):
                assert abs(found[i][j] - middle[i][j]) <= radius[i][j], (large, off, rest, signs, i, j)


def columns_of(factor: Any) -> list[Fraction]:
    """By how much entries of a column of [Phi, Gamma] F change at most, where those of [Phi, Gamma] change by one."""
    return [sum((abs(entry) for entry in column), Fraction(0)) for column in turned(factor)]


def corners(rng: np.random.Generator, one: Any, columns: Any, bounds: Any, off: int) -> Iterator[tuple[Any, int]]:
    """Columns that are off as far as they may, and how far the weight is."""
    rows = len(bounds[0])
    pushed = [[sum(p * x for p, x in zip(row, column, strict=True)) for row in one.P[1]] for column in columns]
    for i, j in combinations_with_replacement(range(len(columns)), 2):
        # Both columns move so that each moves the entry the same way.
        signs = [[1] * rows for _ in columns]
        signs[j] = [1 if x >= 0 else -1 for x in pushed[i]]
        if i != j:
            signs[i] = [1 if x >= 0 else -1 for x in pushed[j]]
        for turn in (1, -1):
            yield shifted(columns, bounds, signs, turn), turn * off
    for _ in range(6):
        yield shifted(columns, bounds, rng.choice([-1, 1], (len(columns), rows)).tolist(), 1), off


def shifted(columns: Any, bounds: Any, signs: Any, turn: int) -> Any:
    """Each entry moved by its bound, in the direction of its sign."""
    both = zip(columns, bounds, signs, strict=True)
    return [[x + turn * s * far for x, far, s in zip(*rows, strict=True)] for rows in both]


def test_by_its_formula_alone_it_is_no_wider() -> None:
    """Where M is zero and P positive, the corners reach what is allowed for; and so where the level alone is left."""
    one = inequality(stamped())
    one.P, off, rest = [[[0]], [[2]]], 0, 1 << 40
    one.steps = Mock(return_value=([[0], [0]], 0, off))
    moved = [ceil(rest * far) for far in columns_of(one.case.F[0])]
    assert asked(one, rest)[1] == [[2 * a * b for b in moved] for a in moved]
    one.P, one.seen, one.level2 = [[[0]], [[0]]], [[-7]], 5
    one.steps = Mock(return_value=([[0], [0]], 0, 11))
    assert asked(one, rest)[1] == [[77 << PLACES, 0], [0, 55 << PLACES]]


@pytest.mark.parametrize("by_duration", [False, True])
def test_entries_and_weights_lie_within_what_they_are_off(by_duration: bool) -> None:
    """Of a period and a step that are enclosed more or less narrowly, each in turn the wider."""
    case, spare = filtered(by_duration), levels.BITS - PLACES
    for wide, weight in ((0, 0), (1, 1), (1 << 200, 0), (0, 1 << 200), (1 << 200, 1 << 190), (1 << 190, 1 << 200)):
        one = inequality(case)
        step = [
            [interval.Interval(j * 7**110 - 5**100, j * 7**110 - 5**100 + wide) for j in range(3)] for _ in range(2)
        ]
        step[0][0] = interval.Interval(3**200, 3**200)
        h = interval.Interval(5**130, 5**130 + weight)
        one.at = Mock(return_value=(h, step))
        columns, found, off = one._steps(Fraction(0), 0)
        exact = [[interval.Interval.of(entry) for entry in row] for row in case.step_after(0, step)]
        held = [
            *(pair for rows in zip(columns, turned(exact), strict=True) for pair in zip(*rows, strict=True)),
            (found, interval.Interval.of(case.weight(h))),
        ]
        assert all(x << spare <= entry.low and entry.high <= x + off << spare for x, entry in held)
        assert off == (max(entry.high - entry.low for _, entry in held) >> spare) + 2


@pytest.mark.parametrize("case", [filtered(), stamped()], ids=["filtered", "stamped"])
def test_the_curvature_bounds_the_second_derivative(case: Case) -> None:
    """N^2 exp(hN) over the piece, by the largest entry at its start and the norm of the first two powers."""
    one = inequality(case)
    n, whole = one.n, one.case.plant.generator
    for start, stop in (
        (Fraction(0), Fraction(1, 100)),
        (HALF, Fraction(51, 100)),
        (Fraction(9, 10), Fraction(91, 100)),
    ):
        x = one.length(start, stop) * one.rate
        assert x < levels.LONG
        bent = [second_derivative(whole, one.at(share)[0])[:n] for share in (start, (start + stop) / 2, stop)]
        entries = [max(abs(entry).ends()[1] for row in at for entry in row) for at in bent]
        found = one.curvature(start, stop)
        assert all(entry <= found for entry in entries)
        wanted = entries[0] + interval.norm_above(bent[0]) * (x + x * x)
        assert abs(found / wanted - 1) < Fraction(1, 10**60)


def second_derivative(whole: Any, h: Any) -> Any:
    grown = interval.exponential([[h * entry for entry in row] for row in whole])
    return times(whole, times(whole, interval.enclosed(grown)))


@pytest.mark.parametrize("case", [filtered(), stamped()], ids=["filtered", "stamped"])
def test_a_step_from_another_share_is_that_of_the_period(case: Case) -> None:
    one, share = inequality(case), Fraction(5, 8)
    h, direct = one.at(share)
    one = inequality(case)
    one.reached[share] = (HALF, Fraction(1, 8))
    again, found = one.at(share)
    assert (again.low, again.high) == (h.low, h.high)
    for entry, other in zip(sum(found, []), sum(direct, []), strict=True):  # noqa: RUF017 - a few rows
        assert entry.low <= other.high and other.low <= entry.high and entry.high - entry.low < 1 << 100


def test_a_piece_that_is_too_long_has_no_curvature() -> None:
    one = inequality(stamped())
    # |N| = 1 + 1/3.
    one.length = lambda left, right: right - left
    limit = levels.LONG / one.rate
    assert one.curvature(Fraction(0), limit * Fraction(99, 100)) is not None
    assert one.curvature(Fraction(0), limit * Fraction(101, 100)) is None


Decision = Callable[[Fraction, int, int, int], bool]
CUTS = (Fraction(0), Fraction(1, 4), Fraction(1))
CURVE = Fraction(7, 3)


def required(
    decided: Decision, *, single: bool = False, curve: Fraction | None = CURVE
) -> list[tuple[Fraction, int, int, int]]:
    """What is asked at which ends, where the length of a piece is that of its shares."""
    case = stamped()
    case = replace(case, stop=case.start) if single else case
    one, listed = inequality(case, CUTS), []

    def holds(*question: Any) -> bool:
        listed.append(question)
        return decided(*question)

    one.holds, one.length = holds, lambda left, right: right - left
    one.curvature = lambda left, right: curve if right - left < HALF else None
    one.require()
    return listed


def allowance(length: Fraction) -> int:
    """length^2/8 times the curvature in units, rounded up."""
    return ceil(length * length / 8 * CURVE * (1 << PLACES))


def test_the_pieces_tile_every_cell_and_allow_for_the_chord() -> None:
    length = Fraction(1, 16)
    listed = required(lambda end, rest, *_: rest <= allowance(length) or end < Fraction(1, 4))
    lengths = [Fraction(1, 2**i) for i in (2, 3, 4)] + [Fraction(3, 2**i) for i in (3, 4, 5, 6)]
    assert {rest for _, rest, *_ in listed} == set(map(allowance, lengths))
    # From 1/4 on in pieces of 3/64: the first that are short enough.
    piece = Fraction(3, 64)
    ends = {end for end, rest, *_ in listed if rest == allowance(piece)}
    assert ends == {Fraction(1, 4) + i * piece for i in range(17)}
    assert {(c, d) for *_, c, d in listed} == {(0, 0), (1, 0)}


@pytest.mark.parametrize("far", ["0", "1/4", "1", "1/3"])
def test_it_is_refused_where_it_fails_at_a_place(far: str) -> None:
    """At an end of a cell, or about a point within one, however short the piece."""
    place = Fraction(far)

    def far_off(end: Fraction, rest: int, *_: int) -> bool:
        # The length of the piece from its allowance.
        length = float(rest * 8 / CURVE / (1 << PLACES)) ** 0.5
        return abs(float(end - place)) > length * 1.01

    with pytest.raises(Unproved, match="not decided"):
        required(far_off)


def test_a_piece_is_halved_so_often_and_no_more() -> None:
    shortest = Fraction(3, 4) / 2**levels.HALVINGS
    assert required(lambda end, rest, *_: end < 1 or rest <= allowance(shortest))
    with pytest.raises(Unproved, match="not decided"):
        required(lambda end, rest, *_: end < 1 or rest <= allowance(shortest / 2))


def test_a_single_period_is_asked_for_once_and_exactly() -> None:
    listed = required(lambda *_: True, single=True)
    assert sorted(set(listed)) == sorted((cut, 0, c, 0) for cut in CUTS[:-1] for c in (0, 1))
    with pytest.raises(Unproved, match=r"^the inequality fails$"):
        required(lambda *_: False, single=True)


def test_the_states_of_a_storage_read_the_periods() -> None:
    """Two states, two cells: after a period in a cell state d goes back to that which stands there."""
    before, after = [[0, 1], [1, 0]], [1, 0]
    storage = levels.Storage([Fraction(0), HALF, Fraction(1)], before, [unit(1)] * 4, after)
    assert [storage.step(place) for place in range(4)] == [0, 0, 1, 1]
    for cell in (0, 1):
        wanted = {(2 * step + before[d][cell], 2 * after[cell] + d) for d in (0, 1) for step in (0, 1)}
        assert set(storage.pairs(cell)) == wanted


@pytest.mark.parametrize(
    ("cells", "words"),
    [
        ([], "do not cover"),
        (["0"], "do not cover"),
        (["1"], "do not cover"),
        (["0", "1/2"], "do not cover"),
        (["1/2", "1"], "do not cover"),
        (["0", "2"], "do not cover"),
        (["0", "1/2", "1/2", "1"], "do not follow"),
        (["0", "3/4", "1/2", "1"], "do not follow"),
        (["0", "-1", "1"], "do not follow"),
    ],
)
def test_cells_cover_the_range_in_order(cells: list[str], words: str) -> None:
    with pytest.raises(Unproved, match=words):
        levels.read_cells(cells, "the cells")
    assert levels.read_cells(["0", "1/3", "1"], "the cells") == [0, Fraction(1, 3), 1]


GOOD = {"cells": ["0", "1/2", "1"], "before": [[0, 1], [1, 0]], "P": [[["1"]], [["2"]], [["3"]], [["4"]]]}
KNOWN = [Fraction(0), HALF, Fraction(1)]


@pytest.mark.parametrize(
    ("changes", "known", "words"),
    [
        ({"before": [[0, 2], [1, 0]]}, KNOWN, "a state is none"),
        ({"before": [[0, 1], [3, 0]]}, KNOWN, "a state is none"),
        ({"before": [[2, 2], [2, 2]]}, KNOWN, "a state is none"),
        ({"before": [], "P": []}, KNOWN, "a state is none"),
        ({"P": [[["1"]], [["-2"]], [["3"]], [["4"]]]}, KNOWN, "a matrix is not positive"),
        ({"P": [[["0"]], [["2"]], [["3"]], [["4"]]]}, KNOWN, "a matrix is not positive"),
        ({"P": [[["1"]]] * 3}, KNOWN, "not one matrix for each"),
        ({"P": [[["1"]]] * 5}, KNOWN, "not one matrix for each"),
        ({}, [Fraction(0), Fraction(1, 3), Fraction(1)], "ends within one"),
    ],
)
def test_a_storage_is_whole(changes: Any, known: list[Fraction], words: str) -> None:
    assert levels.read_storage(GOOD, 1, KNOWN).after == [0, 1]
    # A storage may have more cells than the filter.
    whole = levels.read_storage(GOOD | {"P": GOOD["P"][:2]}, 1, [Fraction(0), Fraction(1)])
    assert whole.after == [0, 0] and len(whole.pairs(0)) == 2
    with pytest.raises(Unproved, match=words):
        levels.read_storage(GOOD | changes, 1, known)


def test_a_level_is_positive() -> None:
    for level in (0, -1):
        with pytest.raises(Unproved, match="the level is not positive"):
            levels.require_level(stamped(), Fraction(level), byhand.stamped("1", byhand.STORED)["witness"]["storage"])


def test_a_filter_keeps_a_level_that_is_its_bound() -> None:
    read = certificate("our-filter-upper")
    upper = Fraction(read["bound"]["upper"])

    def kept(level: Fraction) -> Proof:
        parameters = read["parameters"] | {"level": str(level)}
        return levels.keeps_level(
            Certificate(
                None, "own", "nonuniform.keeps-level", read["plant"], parameters, {"upper": upper}, read["witness"]
            )
        )

    assert kept(upper) == kept(2 * upper) == Proof(upper=upper, holds=True)
    with pytest.raises(Unproved, match="above the level"):
        kept(upper * Fraction(999, 1000))
