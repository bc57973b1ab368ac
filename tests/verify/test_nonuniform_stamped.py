"""Filters with time stamps: what was made is proved, by hand it comes out the same, and what was altered is refused."""

from fractions import Fraction

import pytest
from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat
from tampered import Altered, Certificate, check_stated, load, refused

from replication.verify.nonuniform import gain, system
from replication.verify.nonuniform import levels as stamped
from replication.verify.run import check
from replication.verify.theorem import Refused

QUARTER, HALF, ONE = fmpq(1, 4), fmpq(1, 2), fmpq(1)


def integrator(*gains: str, D: str = "0", cells: tuple[str, ...] = ("0", "1")) -> Certificate:
    """x' = w, y = x + D w, z = x at periods from 1 to 2 s. With G = [1; 0] and D = 0 the error is h w: the gain is 2.

    gains: the second entry of G in each cell; the first is 1.
    """
    plant = {name: [["1"]] for name in "BCL"} | {"A": [["0"]], "D": [[D]], "h_l": ["1", "0"], "h_u": ["2", "0"]}
    return {
        **load("stamped-1"),
        "plant": {"name": "integrator", **plant},
        "bound": {"lower": "1999/1000", "upper": "2001/1000"},
        "witness": {
            "filter": {"cells": list(cells), "G": [[["1"], [one]] for one in gains]},
            "T": [["1"]],
            "storage": {"cells": list(cells), "before": [[0] * len(gains)], "P": [[["10001/10000"]]] * len(gains)},
            "pattern": [["1", 1]],
            "turn": "0",
            "w": [[["1", "0"]]],
        },
    }


def filter_of(certificate: Certificate) -> tuple[system.Plant, stamped.Stamped]:
    plant = system.read_plant(certificate["plant"])
    return plant, stamped.read_stamped(certificate["witness"]["filter"], "f", plant)


def test_the_gain_for_an_integrator_comes_out() -> None:
    theorem = check(integrator("0"))
    assert theorem.sentence.startswith(
        "The filter with time stamps that stands here has a gain of more than 1.999000000 and at most 2.001000000 "
        "over all periods from 1 to 2 s"
    )


@pytest.mark.parametrize("row", refused("integrator"), ids=str)
def test_beyond_the_gain_nothing_is_proved(row: Altered) -> None:
    row.check(integrator("0"))


def test_an_error_that_does_not_settle_has_no_level() -> None:
    """With G = 0 the error of an integrator only adds up, whatever the storage and however high the level."""
    certificate = integrator("0")
    certificate["witness"]["filter"]["G"] = [[["0"], ["0"]]]
    certificate["bound"]["upper"] = "1000000"
    for P in ("10001/10000", "1000000"):
        certificate["witness"]["storage"]["P"] = [[[P]]]
        with pytest.raises(Refused, match="storage inequality"):
            check(certificate)


def test_the_step_of_the_error_by_hand() -> None:
    """[1, h] (I - G [1, D]) = [1 - s, h - D s] with s = 1 + h g: at h = 2, D = 7 and g = 3."""
    plant, chosen = filter_of(integrator("3", "0", D="7", cells=("0", "1/4", "1")))
    steps = chosen.steps(plant, system.step_at(plant, arb(2)))
    for M, expected in zip(steps, ([-6, -47], [0, -5]), strict=True):
        assert (M.nrows(), M.ncols()) == (1, 2)
        assert all(entry.contains(exact) for entry, exact in zip(M.entries(), expected, strict=True))
    assert chosen.output(plant) == plant.L and chosen.cells == [0, QUARTER, 1]


def test_the_gain_is_that_of_the_period_before() -> None:
    """After a period of 2 s G = [1; 1/4], after one of 1 s [1; 0]: e+ = h w - h e/4 or h w.

    Under periods 1, 2, 1, 2, .. the errors are 2 w_1 before each of 1 s, and w_0 - w_1/2 before each of 2 s.
    """
    plant, chosen = filter_of(integrator("0", "1/4", cells=("0", "1/2", "1")))
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


def test_other_coordinates_change_nothing() -> None:
    certificate = integrator("0")
    certificate["witness"] |= {
        "T": [["-3"]],
        "storage": {"cells": ["0", "1"], "before": [[0]], "P": [[["10001/90000"]]]},
    }
    assert check(certificate).upper == fmpq(2001, 1000)
    certificate["witness"]["T"] = [["-2"]]
    with pytest.raises(Refused, match="storage inequality"):
        check(certificate)


def test_the_error_in_other_coordinates_is_the_same() -> None:
    """C-bar A-bar^k B-bar for two states, one after the other, in those of the plant and in others."""
    plant = system.read_plant(load("stamped-2")["plant"])
    chosen = stamped.read_stamped(load("stamped-2")["witness"]["filter"], "f", plant)
    moved, other = stamped.in_coordinates(plant, chosen, fmpq_mat([[2, 1], [3, QUARTER]]))
    found = []
    for one, error in ((plant, chosen), (moved, other)):
        M = error.steps(one, system.step_at(one, arb(fmpq(1, 50))))[3].tolist()
        A, B = arb_mat([row[:2] for row in M]), arb_mat([row[2:] for row in M])
        found.append([arb_mat(error.output(one)) * B, arb_mat(error.output(one)) * A * B])
        assert one.C.nrows() == plant.C.nrows() and one.D == plant.D
    assert moved.C * fmpq_mat([[2, 1], [3, QUARTER]]) == plant.C
    assert all(
        a.overlaps(b) for both in zip(*found, strict=True) for a, b in zip(*(x.entries() for x in both), strict=True)
    )
    assert moved.A != plant.A and all(x.rad() < 1e-9 for one in found for M in one for x in M.entries())


def test_where_cells_meet_the_latter_counts() -> None:
    cells = [fmpq(0), QUARTER, HALF, ONE]
    shares = (fmpq(0), fmpq(1, 8), QUARTER, fmpq(1, 3), HALF, fmpq(3, 4), ONE)
    assert [system.cell_of(cells, share) for share in shares] == [0, 0, 1, 1, 2, 2, 2]
    assert system.cell_of(system.ONE_CELL, ONE) == 0 and system.ONE_CELL == (0, 1)


def test_transitions_go_from_each_gain_to_the_one_that_follows() -> None:
    """Two gains, two states, three cells, of which the last two lie in the second of the filter's."""
    one = [["1"]]
    value = {"cells": ["0", "1/4", "1/2", "1"], "before": [[0, 1, 1], [1, 0, 0]], "P": [one] * 4}
    storage = gain.read_storage(value, "s", 1, [fmpq(0), QUARTER, ONE])
    assert storage.transitions(0) == [(0, 0), (1, 1), (2, 0), (3, 1)]
    assert storage.transitions(1) == storage.transitions(2) == [(1, 2), (0, 3), (3, 2), (2, 3)]


def finer(certificate: Certificate) -> None:
    """Each matrix twice, for two states, and the first cell of the storage cut."""
    storage = certificate["witness"]["storage"]
    storage["cells"].insert(1, "1/16")
    storage["P"] = [matrix for matrix in storage["P"] for _ in range(2)]
    storage["before"] = [[0] * 9, [1, 0] * 4 + [1]]


def test_storage_may_tell_more_apart_than_the_filter_does() -> None:
    certificate = load("stamped-2")
    finer(certificate)
    assert check(certificate).upper is not None
    certificate["witness"]["storage"]["P"][5] = certificate["witness"]["storage"]["P"][-1]
    with pytest.raises(Refused, match="storage inequality"):
        check(certificate)


@pytest.mark.parametrize("row", refused("nonuniform_stamped"), ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


def test_a_gain_outside_its_cell_is_refused() -> None:
    """The gains of `stamped-2` differ, so that a range of which nearly all has one of them has a higher level."""
    certificate = load("stamped-2")
    for part in ("filter", "storage"):
        certificate["witness"][part]["cells"][1:8] = [str(Fraction(93 + i, 100)) for i in range(7)]
    with pytest.raises(Refused, match="storage inequality"):
        check(certificate)


def test_a_filter_with_time_stamps_is_none_of_form_4() -> None:
    """It must not stand where a statement speaks of filters of form (4)."""
    certificate = load("robust-design-2")
    certificate["witness"]["filter"] = load("stamped-2")["witness"]["filter"]
    with pytest.raises(Refused, match=r"witness\.filter lacks the field A, B, C"):
        check_stated(certificate)
