"""Gains under nonuniform sampling: the verifier proves what was made, and refuses each tampered certificate."""

import copy
import json
from collections.abc import Sequence
from fractions import Fraction

import pytest
from flint import fmpq, fmpq_mat
from nonuniform_cases import FOLDER, Certificate, Tamper, load, put, remove, scaled
from stated import check_stated as check

from replication.verify.nonuniform.system import Case, Filter
from replication.verify.theorem import Refused


def exchange_periods(certificate: Certificate) -> None:
    """h_u for h_l in the pattern, and the other way round."""
    for run in certificate["witness"]["pattern"]:
        run[0] = {"0": "1", "1": "0"}[run[0]]


LESS, MORE = "99999/100000", "100001/100000"
STORAGE = ("witness", "storage")
MANY = len(load("range-2-upper")["witness"]["storage"]["P"])
REFUSED = [
    (
        "nominal-1-upper",
        scaled("upper", LESS),
        "storage inequality from P.0. to P.0. is not proved between the shares 0 and 1/16777216",
    ),
    ("nominal-1-upper", scaled("upper", "-1"), "bound.upper must be positive"),
    ("nominal-1-upper", put("1/1000", *STORAGE, "P", 0, 0, 0), r"P\[0\] is not positive definite"),
    ("nominal-1-upper", put("1/1000", *STORAGE, "P", 0, 0, 1), r"P\[0\] must be symmetric"),
    ("nominal-1-upper", put("1/7", "witness", "filter", "B", 0, 0), "storage inequality"),
    ("nominal-1-upper", put("1", "plant", "D", 0, 0), "storage inequality"),
    ("nominal-1-upper", put("h_u", "parameters", "to"), "storage inequality"),
    ("nominal-1-upper", put("h_m", "parameters", "to"), "parameters.to must be one of h_l, middle, h_u"),
    ("nominal-1-upper", put("energy", "parameters", "weight"), "the weight must be samples or duration"),
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
    ("printed-filter-lower", scaled("lower", MORE), "the disturbance does not attain"),
    ("printed-filter-lower", scaled("lower", "-1"), "bound.lower must be positive"),
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
    ("printed-filter-lower", put("energy", "parameters", "weight"), "the weight must be samples or duration"),
    (
        "printed-filter-lower",
        put([["2", "0"], ["0", "1/2"]], "plant", "filter", "A"),
        "the poles of the filter are not",
    ),
    ("printed-filter-lower", put([["2", "0"], ["0", "-1"]], "plant", "A"), "the plant is not Hurwitz"),
    ("range-1-lower", scaled("lower", MORE), "the disturbance does not attain"),
    ("range-1-lower", exchange_periods, "the disturbance does not attain"),
    ("range-1-lower", put("1", "witness", "turn"), "the disturbance does not attain"),
    ("range-1-lower", remove("witness", "w", 0), r"witness.w must have \d+ entries"),
    ("range-2-lower", put("3", "parameters", "level"), "is below the level 3"),
    ("range-1-no-filter", put("1/7", "parameters", "level"), "is below the level 1/7"),
    ("floor-1", scaled("lower", MORE), "the hidden disturbance does not attain"),
    ("floor-1", scaled("lower", "-1"), "bound.lower must be positive"),
    ("floor-1", put(["0", "0"], "witness", "start"), "the hidden disturbance must not be zero"),
    ("floor-1", put(["1"], "witness", "start"), "witness.start must be a state"),
    (
        "floor-1",
        put([["1"]], "plant", "D"),
        "the energy of the zeros of w -> y, which must lie outside the unit circle, is not proved positive definite",
    ),
    ("floor-2", scaled("lower", MORE), "the hidden disturbance does not attain"),
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
    ("range-2-upper", scaled("upper", "998/1000"), "storage inequality"),
    ("printed-filter-upper", scaled("upper", LESS), "storage inequality"),
    ("printed-filter-level", scaled("upper", "99/100"), "storage inequality"),
    ("range-2-lower", scaled("lower", MORE), "the disturbance does not attain"),
    ("range-1-no-filter", scaled("lower", MORE), "the hidden disturbance does not attain"),
    ("range-2-upper", put(5, *STORAGE, "before", 0, 0), "storage inequality"),
    ("robust-design-1", put("1/7", "witness", "filter", "A", 0, 0), "storage inequality"),
    ("robust-design-1", put(["0", "1/5"], "plant", "h_u"), "storage inequality"),
]


@pytest.mark.parametrize(("name", "tamper", "reason"), REFUSED)
def test_a_tampered_certificate_is_refused(name: str, tamper: Tamper, reason: str) -> None:
    certificate = copy.deepcopy(load(name))
    tamper(certificate)
    with pytest.raises(Refused, match=reason):
        check(certificate)


def test_the_plant_of_the_paper_is_the_only_one() -> None:
    certificate = json.loads((FOLDER / "floor-2.json").read_text(encoding="utf-8"))
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
