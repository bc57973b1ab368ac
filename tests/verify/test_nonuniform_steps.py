"""The steps of the nonuniform-sampling verifier one by one, against numbers that can be had by hand."""

from dataclasses import replace
from typing import Any

import pytest
from flint import arb, arb_mat, fmpq, fmpq_mat
from tampered import check_stated as check
from tampered import load

from replication.verify.nonuniform import gain, system
from replication.verify.nonuniform import levels as floor
from replication.verify.reading import rational
from replication.verify.theorem import Refused

ZERO, ONE, TWO = fmpq(0), fmpq(1), fmpq(2)
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
    half, pairs = fmpq(1, 2), [(0, 0), (0, 1)]
    fails = recorded({(ZERO, ONE): pairs[1:], (half, ONE): pairs[1:]}, seen)
    gain.require_everywhere(fails, ZERO, ONE, pairs, 2)
    quarters = [(half, fmpq(3, 4), pairs[1:]), (fmpq(3, 4), ONE, pairs[1:])]
    assert seen == [(ZERO, ONE, pairs), (ZERO, half, pairs[1:]), (half, ONE, pairs[1:]), *quarters]


@pytest.mark.parametrize("half", [(ZERO, fmpq(1, 2)), (fmpq(1, 2), ONE)])
def test_a_piece_that_fails_after_the_last_halving_is_refused(half: tuple[fmpq, fmpq]) -> None:
    fails = recorded({(ZERO, ONE): [(2, 3)], half: [(2, 3)]}, [])
    with pytest.raises(
        Refused, match=rf"from P\[2\] to P\[3\] is not proved between the shares {half[0]} and {half[1]}"
    ):
        gain.require_everywhere(fails, ZERO, ONE, [(2, 3)], 1)
    with pytest.raises(Refused, match="between the shares 0 and 1"):
        gain.require_everywhere(fails, ZERO, ONE, [(2, 3)], 0)
    assert gain.HALVINGS == 24, "the documentation says how often"


def test_storage_that_does_not_cover_the_errors_is_refused() -> None:
    certificate = load("printed-filter-upper")
    P = certificate["witness"]["storage"]["P"][0]
    certificate["witness"]["storage"]["P"] = [[[str(half(entry)) for entry in row] for row in P]]
    with pytest.raises(Refused, match="storage inequality"):
        check(certificate)


def half(entry: str) -> fmpq:
    numerator, _, denominator = entry.partition("/")
    return fmpq(int(numerator), 2 * int(denominator or 1))


def test_without_storage_nothing_is_proved() -> None:
    certificate = load("printed-filter-upper")
    certificate["witness"]["storage"] |= {"P": [], "before": []}
    with pytest.raises(Refused, match="P must not be empty"):
        check(certificate)


@pytest.mark.parametrize("weight", ["samples", "duration"])
def test_the_size_of_a_disturbance_does_not_matter(weight: str) -> None:
    certificate = load("printed-filter-lower")
    certificate["parameters"]["weight"] = weight
    certificate["witness"]["w"] = [[["1/1000000000", "1/1000000000"]]]
    assert check(certificate).lower is not None
    certificate["bound"]["lower"] = "1/10"
    with pytest.raises(Refused, match="the disturbance does not attain 1/10"):
        check(certificate)


def test_a_ratio_must_be_exceeded() -> None:
    gain.require_ratio(arb(5), arb(1), TWO, "it")
    with pytest.raises(Refused, match="it does not attain 2"):
        gain.require_ratio(arb(4), arb(1), TWO, "it")
    with pytest.raises(Refused, match="it must not be zero"):
        gain.require_ratio(arb(4), arb(0), TWO, "it")


def test_pattern_is_a_way_between_the_ends() -> None:
    ends = ((ONE, ZERO), (ZERO, TWO))
    shares = gain.read_pattern([["1/4", 2], ["1", 1]], "p")
    assert [system.along(*ends, share) for share in shares] == [(fmpq(3, 4), fmpq(1, 2))] * 2 + [(ZERO, TWO)]


def test_energy_before_solves_its_equation() -> None:
    J = arb_mat([[0, fmpq(1, 2), 1], [0, 0, fmpq(1, 3)], [fmpq(1, 4), 0, 0]])
    Q = arb_mat([[1, 0, 0], [0, 2, 0], [0, 0, 3]])
    X = floor.energy_before(J, Q)
    assert all(entry.contains(0) and entry.rad() < 1e-10 for entry in (X - Q - J.transpose() * X * J).entries())
    assert floor.energy_before(arb_mat([[fmpq(1, 2)]]), arb_mat([[3]]))[0, 0].contains(4)


def test_schur_by_energy() -> None:
    floor.require_schur(arb_mat([[fmpq(99, 100), 5], [0, fmpq(-99, 100)]]))
    with pytest.raises(Refused, match="outside the unit circle"):
        floor.require_schur(arb_mat([[fmpq(101, 100), 5], [0, fmpq(-99, 100)]]))


def test_hidden_impulse() -> None:
    plant = integrator()
    floor.require_no_filter_below(plant, (TWO, ZERO), fmpq(199, 100), [ONE])
    with pytest.raises(Refused, match="does not attain 2"):
        floor.require_no_filter_below(plant, (TWO, ZERO), TWO, [ONE])


def lag(D: Any) -> system.Plant:
    """x' = w - x, y = x + D w, z = x: Phi(1) = 1/e, Gamma(1) = 1 - 1/e."""
    return replace(integrator(D), A=fmpq_mat([[-1]]))


def test_hidden_motion_of_a_lag() -> None:
    """D = -1/4, h = 1: x_{k+1} = F x_k with F = 4 - 3/e, about 2.896, and w_k = 4 x_k: the ratio is F/4."""
    plant = lag([[fmpq(-1, 4)]])
    floor.require_no_filter_below(plant, (ONE, ZERO), fmpq(7240, 10000), [TWO])
    with pytest.raises(Refused, match="does not attain 7241/10000"):
        floor.require_no_filter_below(plant, (ONE, ZERO), fmpq(7241, 10000), [TWO])
    with pytest.raises(Refused, match="outside the unit circle"):
        floor.require_no_filter_below(lag([[2]]), (ONE, ZERO), fmpq(1, 100), [TWO])
    with pytest.raises(Refused, match="the plant is not Hurwitz"):
        floor.require_no_filter_below(integrator([[2]]), (ONE, ZERO), fmpq(1, 100), [TWO])
    with pytest.raises(Refused, match=r"Phi - Gamma D.-1 C is not proved invertible"):
        floor.require_no_filter_below(lag([[NEARLY]]), (ONE, ZERO), ONE, [TWO])


def test_a_direct_term_must_be_zero_or_invertible() -> None:
    two = fmpq_mat([[1], [1]])
    tall = system.Plant(fmpq_mat([[0]]), fmpq_mat([[1]]), two, two, fmpq_mat([[1]]), (ONE, ZERO), (TWO, ZERO))
    with pytest.raises(Refused, match="neither zero nor square"):
        floor.require_no_filter_below(tall, (ONE, ZERO), ONE, [ONE])
    row, singular = fmpq_mat([[1, 1]]), fmpq_mat([[1, 0], [0, 0]])
    odd = system.Plant(fmpq_mat([[0]]), row, two, singular, fmpq_mat([[1]]), (ONE, ZERO), (TWO, ZERO))
    with pytest.raises(Refused, match="neither zero nor invertible"):
        floor.require_no_filter_below(odd, (ONE, ZERO), ONE, [ONE])


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


def test_a_plant_has_no_other_fields() -> None:
    with pytest.raises(Refused, match="plant has the unknown field extra"):
        system.read_plant({**load("floor-1")["plant"], "extra": "1"})


def test_the_shortest_period_is_that_of_the_lower_end() -> None:
    filter_ = system.Filter(fmpq_mat([[0]]), fmpq_mat([[0]]), fmpq_mat([[0]]))
    case = system.Case(ends=((ONE, ZERO), (TWO, ONE)), weight="samples", filter=filter_, level=ZERO)
    assert case.least == "1"
    assert case.scope == "over all periods from 1 to 2 + 1 pi s"


def test_error_system_by_blocks() -> None:
    plant = integrator([[7]])
    filter_ = system.Filter(fmpq_mat([[2]]), fmpq_mat([[3]]), fmpq_mat([[5]]))
    (M,) = filter_.steps(plant, system.step_at(plant, arb(4)))
    assert all(M[i, j].contains(entry) for i, row in enumerate([[1, 0, 4], [3, 2, 21]]) for j, entry in enumerate(row))
    assert filter_.output(plant) == fmpq_mat([[1, -5]])


def test_times_are_exact() -> None:
    plant = system.read_plant(load("floor-1")["plant"])
    assert plant.period("middle") == (fmpq(1, 200), fmpq(1, 50))
    assert system.seconds((ONE, TWO)).contains(1 + 2 * arb.pi())
    assert system.along((ONE, TWO), (fmpq(3), fmpq(6)), fmpq(1, 4)) == (fmpq(3, 2), fmpq(3))


def test_a_range_has_two_ends() -> None:
    plant = load("floor-1")["plant"]
    with pytest.raises(Refused, match=r"plant.h_u must exceed"):
        system.read_plant({**plant, "h_l": ["1/1024", "0"], "h_u": ["1/1024", "0"]})


def test_a_plant_is_an_object() -> None:
    with pytest.raises(Refused, match="plant must be an object"):
        system.read_plant([])


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
