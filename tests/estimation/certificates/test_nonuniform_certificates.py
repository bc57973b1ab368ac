"""Certificates under nonuniform sampling for plants of one's own: made, proved, and as tight as what they round."""

from fractions import Fraction
from typing import Any

import pytest
from flint import fmpq

from replication.certify import nonuniform
from replication.certify.nonuniform import storage_matrix
from replication.errors import SolverError
from replication.estimation.nonuniform.bounds.guarantee import guaranteed_level
from replication.estimation.nonuniform.filters import periodic_gain
from replication.verify.run import check

RANGE = {"from": "h_l", "to": "h_u", "weight": "samples"}
PLANT = {
    "name": "two-masses",
    "A": [["0", "1", "0"], ["-4", "-1", "2"], ["0", "0", "-3"]],
    "B": [["0", "0"], ["1", "0"], ["0", "1"]],
    "C": [["1", "0", "0"]],
    "D": [["1/10", "1/5"]],
    "L": [["0", "1", "0"], ["1", "0", "1"]],
    "h_l": ["1/20", "0"],
    "h_u": ["0", "1/30"],
    "filter": {
        "A": [["1/2", "0", "0"], ["0", "3/4", "0"], ["1/8", "0", "1/4"]],
        "B": [["1/2"], ["-1/4"], ["1/8"]],
        "C": [["0", "1", "0"], ["1", "0", "1"]],
    },
}
"""Three states, two disturbances and two estimates."""


def own(statement: str, **parameters: Any) -> dict[str, Any]:
    return {
        "format": "replication-certificate/1",
        "paper": None,
        "name": "own",
        "claims": [],
        "statement": f"nonuniform.{statement}",
        "plant": PLANT,
        "parameters": parameters,
    }


@pytest.mark.parametrize("weight", ["samples", "duration"])
@pytest.mark.parametrize(("start", "stop"), [("h_l", "h_u"), ("middle", "middle")])
def test_upper_bound_of_a_plant_of_ones_own(weight: str, start: str, stop: str) -> None:
    theorem = own("gain-upper", **{"from": start, "to": stop, "weight": weight})
    proved = check({**theorem, **nonuniform.gain_upper(theorem, leaves=4)}).upper
    system, periods = nonuniform.problem_of(PLANT, theorem["parameters"])
    filter_ = nonuniform.filter_of(PLANT["filter"])
    duration = weight == "duration"
    wanted = (
        periodic_gain(system, filter_, [periods.h_l], per_duration=duration).upper
        if start == stop
        else guaranteed_level(system, filter_, periods, max_leaves=4, per_duration=duration).level
    )
    assert 1 <= float(Fraction(str(proved))) / wanted < 1 + 1e-5


def test_levels_below_the_gain_have_no_storage() -> None:
    system, _ = nonuniform.problem_of(PLANT, RANGE)
    gain = periodic_gain(system, nonuniform.filter_of(PLANT["filter"]), [1 / 20]).lower
    with pytest.raises(SolverError, match="too low; raise it"):
        storage_matrix(PLANT, PLANT["filter"], "h_l", fmpq(*(gain * 0.999).as_integer_ratio()))
