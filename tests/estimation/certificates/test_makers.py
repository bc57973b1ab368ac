"""Makers of certificates, with delays and under nonuniform sampling: exact where it matters, clear where it fails."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import pytest
from flint import fmpq

from papers.mustafa.certificates import make as optimal
from papers.peet2019.method import open_loop_gain
from replication.certify import exact, nonuniform, rational
from replication.certify.delay import levels as delay
from replication.certify.nonuniform import storage_matrix
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.nonuniform.filters import periodic_gain
from replication.estimation.nonuniform.guarantee import guaranteed_level
from replication.verify.run import check


def scalar(a: str, c2: list[list[str]], delay_matrix: str = "-1/2") -> dict[str, Any]:
    """Two independent states with the rate `a`, seen by c2."""
    return {
        "name": "own",
        "A0": [[a, "0"], ["0", a]],
        "A": [[[delay_matrix, "0"], ["0", delay_matrix]]],
        "delays": ["1"],
        "B": [["1", "0"], ["0", "1"]],
        "C10": [["1", "0"]],
        "C1": [[["0", "0"]]],
        "C2": c2,
    }


def theorem(system: Mapping[str, Any], **parameters: Any) -> dict[str, Any]:
    return {"plant": system, "parameters": parameters}


def test_what_cannot_be_made_says_why() -> None:
    stable = scalar("-1", [["0", "1"]])
    with pytest.raises(InvalidInputError, match="not real and positive"):
        delay.unstable(theorem(stable))
    with pytest.raises(InvalidInputError, match="exactly one state may be unmeasured, got 0"):
        delay.gain_lower(theorem(scalar("-1", [["1", "0"], ["0", "1"]])))
    with pytest.raises(InvalidInputError, match="dependent; drop redundant"):
        delay.change_of({"C2": [["1", "1", "0"], ["2", "2", "0"]]})
    with pytest.raises(InvalidInputError, match="full row rank"):
        delay.gain_upper(theorem(scalar("-1", [["1", "1"], ["2", "2"]]), degree=1))
    with pytest.raises(InvalidInputError, match="must be even, got 3"):
        delay.section(3)
    with pytest.raises(InfeasibleError):
        delay.grams(stable, "1/10", 1)


def test_matrices_that_rounding_left_indefinite_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a level a little higher is tried, instead of a certificate that no verifier accepts."""
    plant = scalar("-1", [["0", "1"]])
    assert delay.grams(plant, "2", 1)["dissipation"]
    indefinite = exact([["1", "2"], ["2", "1"]])
    monkeypatch.setattr(
        delay, "exact_grams", lambda *given, **rule: dict.fromkeys(("storage", "dissipation"), [indefinite] * 2)
    )
    with pytest.raises(InfeasibleError, match="no room for rounding at the level 2"):
        delay.grams(plant, "2", 1)


def test_the_hidden_gain_is_that_of_the_part_that_is_not_seen() -> None:
    system = scalar("-1", [["0", "1"]])
    alone = {**{key: [[rows[0][0]]] for key, rows in system.items() if key in ("A0", "B", "C10")}, "C2": [["1"]]}
    alone |= {"A": [[["-1/2"]]], "C1": [[["0"]]], "delays": ["1"]}
    lower = float(fmpq_float(delay.hidden_gain(system)[0]))
    bracket = open_loop_gain(delay.floating(alone))
    assert bracket.lower * (1.0 - 1e-7) < lower < bracket.upper


def fmpq_float(text: str) -> float:
    number = rational(text)
    return int(number.p) / int(number.q)


# Under nonuniform sampling, for plants of one's own


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
    assert system.weighted is (weight == "duration")
    wanted = (
        periodic_gain(system, filter_, [periods.h_l]).upper
        if start == stop
        else guaranteed_level(system, filter_, periods, max_leaves=4).level
    )
    assert 1 <= float(Fraction(str(proved))) / wanted < 1 + 1e-5


def test_levels_below_the_gain_have_no_storage() -> None:
    system, _ = nonuniform.problem_of(PLANT, RANGE)
    gain = periodic_gain(system, nonuniform.filter_of(PLANT["filter"]), [1 / 20]).lower
    with pytest.raises(SolverError, match="too low; raise it"):
        storage_matrix(PLANT, PLANT["filter"], "h_l", fmpq(*(gain * 0.999).as_integer_ratio()))


def test_a_storage_of_eigenvalues_that_doubles_do_not_see_is_found_on_every_processor() -> None:
    assert check(made := optimal("nominal-2-upper")).upper == rational(made["bound"]["upper"])
