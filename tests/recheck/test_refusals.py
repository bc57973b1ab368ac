"""What the second verifier requires is required: a certificate that breaks this alone is refused by these words."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from replication.recheck import run as second
from replication.recheck.reading import Unproved

ROOT = Path(__file__).parents[2]
Change = Callable[[Any], Any]


def negative(value: Any) -> Any:
    """All numbers of a matrix with the other sign."""
    if isinstance(value, list):
        return [negative(one) for one in value]
    return value[1:] if value.startswith("-") else value if value == "0" else f"-{value}"


def first_negative(values: Any) -> Any:
    """The first of several matrices with the other sign."""
    return [negative(values[0]), *values[1:]]


def second_sensor(plant: Any) -> Any:
    """A plant with its sensor twice, and a filter that takes both."""
    own = {**plant["filter"], "B": [[*row, "0"] for row in plant["filter"]["B"]]}
    return {**plant, "C": plant["C"] * 2, "D": plant["D"] * 2, "filter": own}


def to(value: Any) -> Change:
    """Another value, whatever stood there."""
    return lambda _: value


REFUSALS: list[tuple[str, tuple[Any, ...], Change, str]] = [
    ("peet2019/ex1-unstable", ("witness", "left"), to("1000000"), "the ends are crossed"),
    ("peet2019/ex1-lower", ("witness", "state", 1, 0), to("1"), "y sees the state"),
    ("peet2019/ex1-pade-upper", ("witness", "P"), negative, "P is not positive"),
    ("peet2019/ex2-d1-lower", ("witness", "functional", "Q", 0, 6, 1), to("1"), "Z reaches a weight"),
    ("peet2019/ex4-not-unstable", ("parameters", "eigenvalues"), to(["3/2"]), "lies outside"),
    ("okajima2023/gains-38", ("witness", "P"), first_negative, "is not positive"),
    ("mustafa/our-filter-upper", ("witness", "storage", "P"), first_negative, "a matrix is not positive"),
    ("mustafa/floor-1", ("plant", "A"), negative, "A is not Hurwitz"),
    ("mustafa/condition-8-1", ("plant", "A"), negative, "A is not Hurwitz"),
    ("mustafa/condition-8-2", ("plant", "A"), negative, "A is not Hurwitz"),
    ("mustafa/condition-8-2", ("witness", "P"), first_negative, "one that is not positive"),
    ("mustafa/stable-2", ("plant", "A"), negative, "A is not Hurwitz"),
    ("mustafa/output-matrix", ("witness", "above"), to([[], []]), "no point"),
    ("mustafa/output-matrix", ("plant",), second_sensor, "one disturbance, measurement and output"),
    ("mustafa/output-matrix", ("plant", "filter"), to({part: [["0"]] for part in "ABC"}), "another order"),
    ("mustafa/output-matrix", ("plant", "A"), negative, "A is not Hurwitz"),
    ("shao/radius-motor-apo", ("bound", "upper"), to("1/1000000"), "crossed"),
    ("shao/estimate-2-one-correction", ("parameters", "than"), to("single_correction"), "surely the smaller"),
    ("shao/counterexample", ("plant", "L"), to([["3"]]), "the loop is another one"),
    ("shao/coordinates", ("plant", "A", 2, 2), to("1"), "the rates differ"),
    ("shao/coordinates", ("plant", "B", 2, 0), to("1"), "B is another one"),
    ("shao/coordinates", ("plant", "C", 0, 0), to("2"), "C does not give theta"),
    ("shao/feedforward-printed", ("parameters", "orders"), to([21, 21, 21]), "orders above 20"),
    ("shao/output-bounds", ("parameters", "weights", "CA"), to("1/2"), "is too small"),
    ("shao/condition", ("witness", "lyapunov", "high"), to("1/1000000"), "high is not above"),
    ("shao/condition", ("witness", "lyapunov", "least"), lambda rows: [["0"] for _ in rows], "a vector is zero"),
    ("shao/prediction-bound", ("parameters", "longest"), to("1000"), "may hold from there"),
    ("shao/errors-pmi-fast-instants", ("witness", "errors", 0, "upper"), to("1/1000"), "larger at an instant"),
    ("shao/errors-pmi-fast-instants", ("witness", "errors", 0, "time"), to("1/100"), "is no fast instant"),
    ("shao/errors-pmi-fast-instants", ("witness", "errors", 0, "phase"), to(9), "outside the period"),
    ("okajima2023/section-4c-poles", ("parameters", "diagonal", 0), to("1/5"), "no pole, or several"),
    ("okajima2023/section-4c-poles", ("plant", "poles"), lambda poles: poles[:1], "other poles too"),
    ("okajima2023/gains-38", ("parameters", "sensors"), to([0, 0]), "sensors that are none, or twice"),
    ("okajima2023/gains-38", ("parameters", "sensors"), to([0, 7]), "sensors that are none, or twice"),
    ("okajima2023/shorter-periods", ("parameters", "shorter"), to([6, 7]), "the longer periods are no longer ones"),
    ("okajima2023/shorter-periods", ("parameters", "shorter"), to([4, 2]), "common factor"),
    ("okajima2023/lost-samples-2-3", ("parameters", "together"), to(2), "together is 0 or 1"),
    ("okajima2023/lost-samples-2-3", ("witness", "at", 0), to(1), "not that of the start"),
    ("okajima2023/lost-samples-2-3", ("witness", "P"), first_negative, "is not positive"),
    ("mustafa/upper-end-1", ("plant", "A"), to([["1", "0"], ["0", "1"]]), "mu"),
    ("mustafa/own-grid-2", ("witness", "passes"), lambda passes: passes[:1], "not covered after these passes"),
    ("mustafa/own-grid-2", ("witness", "passes", 1), to([]), "each new element needs its bracket"),
    ("mustafa/own-grid-2", ("witness", "passes", 0, 0, "P"), negative, "P is not positive"),
    ("mustafa/own-grid-2", ("witness", "P"), negative, "P is not positive"),
    ("mustafa/stall-1", ("witness", "upper"), to("46"), "the bounded real lemma does not hold"),
    ("mustafa/stall-1", ("witness", "lower"), to("47"), "the response is no larger"),
    ("mustafa/stall-1", ("witness", "P"), negative, "P is not positive"),
    ("mustafa/range-1-upper", ("witness", "storage", "cells", 0), to("1/1000"), "do not cover the range"),
    ("mustafa/our-filter-lower", ("parameters", "from"), to("h_u"), "the range is empty"),
    ("peet2019/ex1-total-upper", ("parameters", "degree"), to(2), "has another size"),
    ("peet2019/ex1-pade-upper", ("bound", "upper"), to("0"), "the level is not positive"),
]


@pytest.mark.parametrize(("name", "place", "change", "words"), REFUSALS)
def test_a_broken_requirement_is_refused_by_its_words(
    name: str, place: tuple[Any, ...], change: Change, words: str
) -> None:
    certificate = json.loads((ROOT / "certificates" / f"{name}.json").read_bytes())
    holder = certificate
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = change(holder[place[-1]])
    # As if the paper were about that plant: what it is about is compared elsewhere.
    with patch.object(second, "wanted", return_value={}), pytest.raises(Unproved, match=words):
        second.proof(certificate)
