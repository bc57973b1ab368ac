"""Nonuniform sampling: certificates altered are refused; steps, intervals and cells against numbers by hand."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any
from unittest import mock

import pytest
from byhand import WIDE, stamped
from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat
from tampered import Altered, committed, load, refused
from tampered import check_stated as check

from papers.mustafa import certificates
from replication.verify import run
from replication.verify.nonuniform import gain, grid, identities, levels, smallgain, system
from replication.verify.reading import rational
from replication.verify.theorem import Refused

ZERO, ONE, TWO, HALF, QUARTER = fmpq(0), fmpq(1), fmpq(2), fmpq(1, 2), fmpq(1, 4)
SECTIONS = ("nonuniform", "nonuniform_theory", "nonuniform_stamped")


@pytest.mark.parametrize("row", [row for section in SECTIONS for row in refused(section)], ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


# Condition (8), solutions of (6) on a grid, and the box of output matrices: what proves them, and what does not.


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


AXES = ((1, 0), (0, 1), (-1, 0), (0, -1))
TILTED = ((1, fmpq(1, 8)), (fmpq(-1, 8), 1), (-1, fmpq(1, 8)), (fmpq(1, 8), -1))


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


def test_a_box_of_one_point_is_stated_and_an_empty_one_is_not() -> None:
    assert box(AXES, (1, HALF, -1, -HALF)) == ((1, 1), (HALF, HALF))
    with pytest.raises(Refused, match="no C_f has this level"):
        box(AXES, (1, HALF, 1, -1))


def test_a_half_space_by_hand() -> None:
    """x' = -x + w, y = x + 3 w, z = x, the filter f+ = y: at z = 1 constants answer a constant w, x = w and f = 4 w."""
    filter_ = {"A": [["0"]], "B": [["1"]], "C": [["1"]]}
    plant = {name: [[entry]] for name, entry in {"A": "-1", "B": "1", "C": "1", "D": "3", "L": "1"}.items()}
    plant |= {"name": "own", "h_l": ["1/2", "0"], "h_u": ["3/2", "0"], "filter": filter_}
    read = system.read_plant(plant)
    assert read.filter is not None
    (normal,), limit = smallgain.half_space(
        read, read.filter, HALF, [smallgain.read_point({"turn": "0", "u": ["2", "0"]}, "p")]
    )
    for found, exact in ((normal, 8), (limit, 3)):
        assert found.contains(exact) and found.rad() < 1e-9


def test_the_points_of_all_entries_are_counted() -> None:
    with mock.patch.object(smallgain, "MAX_ENTRIES", 3):
        assert [len(points) for points in smallgain.read_points([[POINT], [POINT] * 2], "p", 2)] == [1, 2]
        with pytest.raises(Refused, match="p has more than 3 points"):
            smallgain.read_points([[POINT] * 2] * 2, "p", 2)


# Intervals and Algorithm 1.


def test_algorithm_1_does_not_stall_where_the_root_leaves_a_gap() -> None:
    certificate = load("stall-1")
    certificate["plant"] |= {"h_l": ["1/100", "0"], "h_u": ["2", "0"]}
    certificate |= certificates.stall(certificate)
    with pytest.raises(Refused, match="step 4 adds an element"):
        check(certificate)


def test_a_cell_that_does_not_force_the_level_is_refused() -> None:
    certificate = load("same-level-1")
    plant, periods = certificates._problem(certificate)
    problem = certificates.modal(plant)
    half = (periods.h_u - periods.h_l) / (2 * certificate["parameters"]["cells"])
    failing = []
    for cell in (0, 1, 2):
        alpha, response = certificates._response(problem, periods.h_l + (2 * cell + 1) * half)
        exact = Fraction(alpha) * Fraction(999_999, 1_000_000)
        certificate["witness"] |= {"cell": cell, "alpha": str(exact), "response": response}
        try:
            assert check(certificate).holds
        except Refused as refusal:
            assert "of the filter is not below" in str(refusal)
            failing.append(cell)
    assert 0 not in failing and failing != []


def interval(lower: int, upper: int) -> grid.Interval:
    return grid.Interval(arb(lower), arb(upper))


def test_gaps_are_what_open_intervals_leave() -> None:
    start, stop = arb(0), arb(10)
    found = grid.gaps([interval(6, 8), interval(1, 3), interval(2, 4)], start, stop)
    assert [(float(a), float(b)) for a, b in found] == [(0, 1), (4, 6), (8, 10)]
    assert grid.gaps([interval(-1, 5), interval(3, 11)], start, stop) == []
    assert [(float(a), float(b)) for a, b in grid.gaps([interval(-1, 9), interval(3, 5)], start, stop)] == [(9, 10)]
    with pytest.raises(Refused, match="not told apart"):
        grid.gaps([interval(-1, 5), interval(5, 11)], start, stop)
    with pytest.raises(Refused, match="not told apart"):
        grid.gaps([interval(1, 5), interval(1, 11)], start, stop)


def test_interval_by_the_cases_l3_and_u3() -> None:
    one, two = arb(1), arb(2)
    found = grid.covered(two, one, two, two, two)
    assert found.lower.contains(arb(2) - arb(fmpq(3, 2)).log())
    assert found.upper.contains(arb(2) + arb(2).log() / 2)
    with pytest.raises(Refused, match="not in case"):
        grid.covered(two, arb(0), two, two, two)
    with pytest.raises(Refused, match="not in case"):
        grid.covered(two, one, -two, two, two)
    with pytest.raises(Refused, match="no value"):
        grid.covered(two, one, two, -two, two)


@pytest.mark.parametrize(("h_u", "met"), [("22/25", True), ("9/10", False)])
def test_case_u3_is_met_where_alpha_exceeds_the_norm(h_u: str, met: bool) -> None:
    """A = -I: alpha = 1/(e^h - 1) is above one for h < log 2, about 0.693; the middles are 0.69 and 0.70 s."""
    certificate = load("upper-end-2")
    certificate["plant"] |= {"A": [["-1", "0"], ["0", "-1"]], "h_l": ["1/2", "0"], "h_u": [h_u, "0"]}
    if met:
        assert "below the centre" in check(certificate).sentence
    else:
        with pytest.raises(Refused, match="case U3 is not met"):
            check(certificate)


SCALAR = {"turn": "0", "direction": [["1", "0"]], "P": [["1/2"]], "lower": "9999/10000", "upper": "10001/10000"}
"""A = -1, Phi = 1/2: alpha = 1, attained at z = 1."""


def test_small_gain_of_one_state() -> None:
    A, Phi = fmpq_mat([[-1]]), arb_mat([[fmpq(1, 2)]])
    found = grid.small_gain(A, Phi, grid.read_alpha(SCALAR, "w", 1))
    assert found.overlaps(arb(fmpq(9999, 10000))) and found.overlaps(arb(fmpq(10001, 10000)))
    assert found.rad() < 2e-4
    for change in ({"P": [["9/20"]]}, {"P": [["11/20"]]}, {"upper": "1"}):
        with pytest.raises(Refused, match="the bounded real lemma"):
            grid.small_gain(A, Phi, grid.read_alpha({**SCALAR, **change}, "w", 1))
    with pytest.raises(Refused, match="does not attain 1"):
        grid.small_gain(A, Phi, grid.read_alpha({**SCALAR, "lower": "1"}, "w", 1))


def test_modal_coordinates_have_the_same_eigenvalues() -> None:
    A = fmpq_mat([[0, 1], [-16, fmpq(-24, 5)]])
    modal = grid.modal(A)
    assert modal == fmpq_mat([[fmpq(-12, 5), fmpq(16, 5)], [fmpq(-16, 5), fmpq(-12, 5)]])
    assert modal.charpoly() == A.charpoly()
    for other in ([[0, 1], [-15, fmpq(-24, 5)]], [[-1, 0], [0, -2]], [[-1, 0], [0, -1]]):
        with pytest.raises(Refused, match="not rational, or real"):
            grid.modal(fmpq_mat(other))
    for of_two_states in (grid.modal, identities.logarithmic_norm):
        with pytest.raises(Refused, match="two states"):
            of_two_states(fmpq_mat([[-1]]))
    slow = fmpq_mat([[0, fmpq(1, 2)], [fmpq(-1, 2), 0]])
    assert grid.modal(slow) == slow


# The storage inequality on pieces of the range, and hidden motions.


NEARLY = fmpq(171828182845904523536028747135, 10**29)
"""e - 1, to more digits than the balls of these tests have."""


def integrator(D: Any = ((0,),)) -> system.Plant:
    """x' = w, y = x + D w, z = x: Phi(h) = 1, Gamma(h) = h."""
    one = fmpq_mat([[1]])
    return system.Plant(fmpq_mat([[0]]), one, one, fmpq_mat(D), one, (ONE, ZERO), (TWO, ZERO))


def recorded(failing: dict[tuple[fmpq, fmpq], list[gain.Pair]], seen: list[Any]) -> gain.Fails:
    def fails(a: fmpq, b: fmpq, transitions: list[gain.Pair]) -> list[gain.Pair]:
        seen.append((a, b, transitions))
        return failing.get((a, b), [])

    return fails


def test_pieces_that_fail_are_halved() -> None:
    seen: list[Any] = []
    half, pairs = HALF, [(0, 0), (0, 1)]
    fails = recorded({(ZERO, ONE): pairs[1:], (half, ONE): pairs[1:]}, seen)
    gain.require_everywhere(fails, ZERO, ONE, pairs, 2)
    quarters = [(half, fmpq(3, 4), pairs[1:]), (fmpq(3, 4), ONE, pairs[1:])]
    assert seen == [(ZERO, ONE, pairs), (ZERO, half, pairs[1:]), (half, ONE, pairs[1:]), *quarters]


def lag(D: Any) -> system.Plant:
    """x' = w - x, y = x + D w, z = x: Phi(1) = 1/e, Gamma(1) = 1 - 1/e."""
    return replace(integrator(D), A=fmpq_mat([[-1]]))


def test_hidden_motion_of_a_lag() -> None:
    """D = -1/4, h = 1: x_{k+1} = F x_k with F = 4 - 3/e, about 2.896, and w_k = 4 x_k: the ratio is F/4."""
    plant = lag([[fmpq(-1, 4)]])
    levels.require_no_filter_below(plant, (ONE, ZERO), fmpq(7240, 10000), [TWO])
    with pytest.raises(Refused, match="does not attain 7241/10000"):
        levels.require_no_filter_below(plant, (ONE, ZERO), fmpq(7241, 10000), [TWO])
    with pytest.raises(Refused, match="outside the unit circle"):
        levels.require_no_filter_below(lag([[2]]), (ONE, ZERO), fmpq(1, 100), [TWO])
    with pytest.raises(Refused, match="the plant is not Hurwitz"):
        levels.require_no_filter_below(integrator([[2]]), (ONE, ZERO), fmpq(1, 100), [TWO])
    with pytest.raises(Refused, match=r"Phi - Gamma D.-1 C is not proved invertible"):
        levels.require_no_filter_below(lag([[NEARLY]]), (ONE, ZERO), ONE, [TWO])


def test_the_curve_is_its_chord_less_a_part_of_its_bend() -> None:
    plant = system.read_plant(load("floor-1")["plant"])
    start, length = arb(fmpq(1, 100)), arb(fmpq(1, 100))
    spread = system.flow(plant, arb(0).union(length))
    bend = system.bend(plant, system.flow(plant, start), spread, length)
    first, last = (system.step_at(plant, start + length * i) for i in (0, 1))
    for share in (fmpq(1, 10), fmpq(1, 2), fmpq(4, 5)):
        chord, inside = first + (last - first) * arb(share), system.step_at(plant, start + length * arb(share))
        assert (chord - bend * arb(4 * share * (1 - share))).contains(inside)
        for wrong in (3 * share * (1 - share), -4 * share * (1 - share)):
            assert not (chord - bend * arb(wrong)).overlaps(inside)
    widest = max(float(entry.rad() / abs(entry).mid()) for entry in bend.entries() if not entry.contains(0))
    assert 0 < widest < 1 / 2


def test_a_piece_fails_where_the_inequality_holds_at_its_ends_alone() -> None:
    """An oscillator, whose held input moves it most after half a turn, between the ends."""
    zero, one = fmpq_mat([[0]]), fmpq_mat([[1, 0]])
    ends = (fmpq(13, 5), ZERO), (fmpq(18, 5), ZERO)
    plant = system.Plant(fmpq_mat([[0, 1], [-1, 0]]), fmpq_mat([[0], [1]]), one, zero, one, *ends)
    case = system.Case(ends=ends, weight="samples", filter=system.Filter(zero, zero, zero), level=ZERO)
    small = fmpq_mat([[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    for level, holding, left in ((fmpq(21, 10), [True, False, True], [(0, 1)]), (fmpq(11, 5), [True] * 3, [])):
        inequality = gain._Inequality(plant, case, level, [arb_mat(small * 10), arb_mat(small)])
        found = []
        for share in (ZERO, fmpq(1, 2), ONE):
            found.append(inequality.holds_at_end((0, 1), share))
        assert found == holding
        assert inequality.fails(ZERO, ONE, [(0, 1)]) == [(0, 1)]
        assert inequality.fails(ZERO, fmpq(1, 2), [(0, 1)]) == left


@pytest.mark.parametrize("bad", range(5))
def test_every_corner_of_a_piece_counts(bad: int) -> None:
    """Both ends, and both less their bend: a pair fails where one of the four does."""
    plant = integrator()
    nothing = fmpq_mat([[0]])
    case = system.Case(
        ends=(plant.h_l, plant.h_u), weight="samples", filter=system.Filter(nothing, nothing, nothing), level=ONE
    )
    answers = [place != bad for place in range(4)]
    inequality: Any = gain._Inequality(plant, case, ONE, [arb_mat(2, 2)])
    inequality.holds_at_end = lambda pair, share: answers[int(share)]
    inequality.holds = mock.Mock(side_effect=answers[2:])
    assert inequality.fails(ZERO, ONE, [(0, 0)]) == ([(0, 0)] if bad < 4 else [])


def test_precision_is_as_documented() -> None:
    assert system.PRECISION == 128


def test_both_ends_of_a_piece_count() -> None:
    """At the period of the design the inequality holds, 1e-8 s later it does not."""
    certificate = load("nominal-1-upper")
    certificate["plant"] |= {"h_l": ["1/200", "1/50"], "h_u": ["500001/100000000", "1/50"]}
    certificate["parameters"] |= {"from": "h_l", "to": "h_l"}
    assert check(certificate).upper is not None
    plant = system.read_plant(certificate["plant"])
    filter_ = system.read_filter(certificate["witness"]["filter"], "filter", plant)
    storage = gain.read_storage(certificate["witness"]["storage"], "storage", 4)
    level = rational(certificate["bound"]["upper"], "upper")
    for ends in ((plant.h_l, plant.h_u), (plant.h_u, plant.h_l)):
        with pytest.raises(Refused, match="storage inequality"):
            gain.require_level(
                plant, system.Case(ends=ends, weight="samples", filter=filter_, level=level), level, storage
            )


# Filters with time stamps.


def test_the_gain_is_that_of_the_period_before() -> None:
    """After a period of 2 s G = [1; 1/4], after one of 1 s [1; 0]: e+ = h w - h e/4 or h w.

    Under periods 1, 2, 1, 2, .. the errors are 2 w_1 before each of 1 s, and w_0 - w_1/2 before each of 2 s.
    """
    certificate = stamped("1", WIDE, ((Fraction(1), Fraction(0)), (Fraction(1), Fraction(1, 4))))
    plant = system.read_plant(certificate["plant"])
    chosen = levels.read_stamped(certificate["witness"]["filter"], "f", plant)
    case = system.Case(ends=(plant.h_l, plant.h_u), weight="samples", filter=chosen, level=ONE)
    w = [acb_mat([[acb(one)]]) for one in (-1, 3)]
    ratio = Fraction(6**2 * 4 + 5**2, 10 * 4)
    for shift, fits in ((-1, True), (1, False)):
        level = system.seconds((fmpq(ratio.numerator, ratio.denominator), fmpq(0))).sqrt() + arb(shift) / 1000
        exact = fmpq(int((level * 10**6).floor().unique_fmpz()), 10**6)
        if fits:
            gain.require_motion(plant, case, exact, [fmpq(0), ONE], fmpq(0), w)
        else:
            with pytest.raises(Refused, match="does not attain"):
                gain.require_motion(plant, case, exact, [fmpq(0), ONE], fmpq(0), w)


def test_where_cells_meet_the_latter_counts() -> None:
    cells = [fmpq(0), QUARTER, HALF, ONE]
    shares = (fmpq(0), fmpq(1, 8), QUARTER, fmpq(1, 3), HALF, fmpq(3, 4), ONE)
    assert [system.cell_of(cells, share) for share in shares] == [0, 0, 1, 1, 2, 2, 2]
    assert system.cell_of(system.ONE_CELL, ONE) == 0 and system.ONE_CELL == (0, 1)
