"""Lemmas, intervals and Algorithm 1 of the nonuniform-sampling paper: proved as made, refused when tampered with."""

from unittest.mock import patch

import pytest
from flint import arb, arb_mat, fmpq, fmpq_mat
from tampered import Altered, load, refused
from tampered import check_stated as check

from papers.mustafa import certificates
from replication.verify.kernel import Hurwitz, Obligation
from replication.verify.nonuniform import grid
from replication.verify.theorem import Refused, require


@pytest.mark.parametrize("row", refused("nonuniform_theory"), ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


def test_the_printed_order_of_the_map_has_a_value_only_for_other_sizes() -> None:
    certificate = load("map-1")
    certificate["plant"] |= {"B": [["0", "1"], ["16", "0"]], "D": [["1", "0"]]}
    with pytest.raises(Refused, match="the printed order of the factors has a value"):
        check(certificate)
    certificate = load("map-1")
    certificate["plant"]["L"] = [["1", "0"], ["0", "1"]]
    with pytest.raises(Refused, match="the printed order of the factors has a value"):
        check(certificate)


"""A range around the middle of Example 1 that one element covers."""


def test_algorithm_1_does_not_stall_where_the_root_leaves_a_gap() -> None:
    certificate = load("stall-1")
    certificate["plant"] |= {"h_l": ["1/100", "0"], "h_u": ["2", "0"]}
    certificate |= certificates.stall(certificate)
    with pytest.raises(Refused, match="step 4 adds an element"):
        check(certificate)


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
    with pytest.raises(Refused, match="two states"):
        grid.modal(fmpq_mat([[-1]]))
    slow = fmpq_mat([[0, fmpq(1, 2)], [fmpq(-1, 2), 0]])
    assert grid.modal(slow) == slow


def test_one_interval_needs_a_stable_plant() -> None:
    def planted(obligation: Obligation) -> None:
        require(not isinstance(obligation, Hurwitz), "as planted")

    with patch.object(grid, "decide", planted), pytest.raises(Refused, match="as planted"):
        check(load("one-interval-1"))
