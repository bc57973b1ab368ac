"""Certificates of observers of systems with delays: what is proved, and that every tampered one is refused."""

import random
from itertools import product
from typing import Any

import pytest
from byhand import own as theorem_of
from flint import fmpq, fmpq_mat
from tampered import Altered, Json, refusal, refused
from tampered import check_stated as check

from replication.certify.delay import forms as oracle
from replication.certify.delay import levels as maker
from replication.verify.algebra.linear import identity, zeros
from replication.verify.delay import plant as delay_plant
from replication.verify.delay import sos as delay_sos
from replication.verify.theorem import Refused


@pytest.mark.parametrize("row", refused("delay"), ids=str)
def test_an_altered_certificate_is_refused(row: Altered) -> None:
    row.check()


@pytest.mark.parametrize(
    ("sensor", "reason"),
    [
        ([["0", "0"]], "c in C2 = [0 c] has no inverse"),
        ([["1", "1"], ["2", "2"]], "c in C2 = [0 c] has no inverse"),
        ([["1", "0"], ["0", "1"], ["1", "1"]], "C2 has more rows than columns"),
    ],
)
def test_measurements_that_depend_on_each_other_are_refused(sensor: Any, reason: str) -> None:
    plant = delay_plant.read_plant({**hidden_plant(), "C2": sensor})
    with pytest.raises(Refused) as caught:
        delay_plant.measured_last(plant, identity(2))
    assert reason in str(caught.value)


def integers(rng: random.Random, rows: int, columns: int) -> fmpq_mat:
    return fmpq_mat(rows, columns, [rng.randint(-4, 4) for _ in range(rows * columns)])


def some_plant(n: int = 2, delays: int = 2, measured: int = 1) -> delay_plant.DelayPlant:
    """A plant of integers with C2 = [0 I], every matrix full."""
    rng = random.Random(7)
    seen = [[int(j == n - measured + i) for j in range(n)] for i in range(measured)]
    return delay_plant.DelayPlant(
        name="some",
        A0=integers(rng, n, n),
        late=integers(rng, n, n * delays),
        delays=tuple(fmpq(k + 2, 3) for k in range(delays)),
        B=integers(rng, n, n),
        C10=integers(rng, 1, n),
        late_output=integers(rng, 1, n * delays),
        C2=fmpq_mat(seen),
    )


def dynamics(plant: delay_plant.DelayPlant) -> oracle.Dynamics:
    return oracle.Dynamics(plant.A0, plant.late, plant.delays, plant.B, plant.C10, plant.late_output, plant.C2.nrows())


def monomials(points: int, functions: int) -> list[tuple[delay_sos.Form, oracle.Key]]:
    """Every coefficient of a form at powers 0 and 1, alone, with its key."""
    empty = delay_sos.Form(zeros(points, points), {}, {}, {})
    found: list[tuple[delay_sos.Form, oracle.Key]] = []

    def alone(rows: int, columns: int, i: int, j: int) -> fmpq_mat:
        matrix = zeros(rows, columns)
        matrix[i, j] = fmpq(1)
        return matrix

    for i, j in product(range(points), repeat=2):
        form = delay_sos.Form(alone(points, points, i, j), empty.Q, empty.S, empty.R)
        found.append((form, oracle.pair(i, j)))
    for i, k in product(range(points), range(functions)):
        form = delay_sos.Form(empty.P, {1: alone(points, functions, i, k)}, {}, {})
        found.append((form, oracle.pair(i, points + functions + k)))
    for k, m in product(range(functions), repeat=2):
        part = alone(functions, functions, k, m)
        found.append((delay_sos.Form(empty.P, {}, {1: part}, {}), ("local", 1, min(k, m), max(k, m))))
        key = oracle.pair(points + k, points + functions + m)
        found.append((delay_sos.Form(empty.P, {}, {}, {(0, 1): part}), key))
    return found


@pytest.mark.parametrize(("n", "delays", "measured"), [(2, 2, 1), (3, 1, 2)])
def test_what_the_injection_cancels_is_left_out_and_nothing_else(n: int, delays: int, measured: int) -> None:
    plant = some_plant(n, delays, measured)
    system = dynamics(plant)
    for form, key in monomials(system.points, system.functions):
        reached = oracle.cancellable(system, key)
        delay_sos.require_zero(form, plant, cancelled=not reached, what="nothing")
        with pytest.raises(Refused, match=r"it is not zero in [PQRS].*entry \("):
            delay_sos.require_zero(form, plant, cancelled=reached, what="it is not zero")


def hidden_plant() -> Json:
    """x_1' = -x_1 + x_1(t - 1)/2 + x_2 + w_1, z = x_1 + x_1(t - 2)/4, and y = 3 x_2."""
    return {
        "name": "own",
        "A0": [["-1", "1"], ["0", "-1"]],
        "A": [[["1/2", "0"], ["0", "0"]], [["0", "0"], ["0", "1"]]],
        "delays": ["1", "2"],
        "B": [["2", "0"], ["0", "1"]],
        "C10": [["1", "0"]],
        "C1": [[["0", "0"]], [["1/4", "0"]]],
        "C2": [["0", "3"]],
    }


def own(statement: str, plant: Json, bound: Json, witness: Json, parameters: Json | None = None) -> Json:
    return theorem_of(statement, plant=plant, parameters=parameters or {}, bound=bound, witness=witness)


def lower(bound: str, frequency: str, plant: Json | None = None, state: Any = None) -> Json:
    witness = {"frequency": frequency, "state": state or [["1"], ["0"]]}
    return own("delay.gain-lower", plant or hidden_plant(), {"lower": bound}, witness)


def test_the_gain_at_zero_frequency_is_that_of_the_steady_state() -> None:
    # At rest 0 = -x_1 + x_1/2 + 2 w_1 and z = 5/4 x_1: the gain is 5.
    assert check(lower("4999999999/1000000000", "0")).lower == fmpq(4999999999, 1000000000)
    assert check(lower("5", "0")).lower == 5
    assert "not proved to reach 5.000" in refusal(lower("5000000001/1000000000", "0"))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"state": [["0"], ["1"]]}, "is seen by y"),
        ({"state": [["1"], ["1"]]}, "is seen by y"),
        ({"state": [["0"], ["0"]]}, "does not move z"),
        ({"plant": {"B": [["2", "0"], ["1", "0"]]}}, "B has no inverse"),
        ({"plant": {"B": [["2"], ["1"]]}}, "B has no inverse"),
        ({"plant": {"A0": [["-1", "1"]]}}, "plant.A0 must be square"),
        ({"plant": {"delays": ["2", "1"]}}, "plant.delays must increase"),
        ({"plant": {"delays": ["1", "1"]}}, "plant.delays must increase"),
        ({"plant": {"delays": ["1"]}}, "plant.A must have 1 entries"),
        ({"plant": {"delays": []}}, "plant.delays is empty"),
        ({"plant": {"delays": ["0", "1"]}}, "must be positive"),
        ({"plant": {"B": [["2", "0"]]}}, "plant.B must have 2 entries"),
        ({"plant": {"C2": [["3"]]}}, "plant.C2 must have 2 columns"),
        ({"plant": {"C10": [["1"]]}}, "plant.C10 must have 2 columns"),
        ({"plant": {"C1": [[["0", "0"]], [["1/4", "0"], ["0", "0"]]]}}, "plant.C1[1] must have 1 entries"),
        ({"frequency": "NaN"}, "must be a rational"),
    ],
)
def test_a_disturbance_that_does_not_fit_is_refused(change: Json, reason: str) -> None:
    plant = {**hidden_plant(), **change.get("plant", {})}
    given = lower("1", change.get("frequency", "0"), plant, change.get("state"))
    assert reason in refusal(given)


def roots(left: str, right: str, a: str = "2") -> Json:
    """x_1' = a x_1 - x_1(t - 1) + x_2(t - 2), x_2' = -x_2: det M = (s - a + exp(-s)) (s + 1)."""
    plant = {
        "name": "own",
        "A0": [[a, "0"], ["0", "-1"]],
        "A": [[["-1", "0"], ["0", "0"]], [["0", "1"], ["0", "0"]]],
        "delays": ["1", "2"],
        "B": [["1"], ["0"]],
        "C10": [["1", "0"]],
        "C1": [[["0", "0"]], [["0", "0"]]],
        "C2": [["0", "1"]],
    }
    return own("delay.unstable", plant, {}, {"left": left, "right": right})


def test_a_positive_root_is_enclosed() -> None:
    # s = 2 - exp(-s) at 1.8414056604..
    theorem = check(roots("18414/10000", "18415/10000"))
    assert theorem.holds is True
    assert "between 1.841400 and 1.841500" in theorem.sentence


@pytest.mark.parametrize(
    ("left", "right", "reason"),
    [
        ("18415/10000", "18416/10000", "does not change its sign"),
        ("18413/10000", "18414/10000", "does not change its sign"),
        ("18415/10000", "18414/10000", "must be below"),
        ("18414/10000", "18414/10000", "must be below"),
        ("0", "18415/10000", "must be positive"),
    ],
)
def test_an_interval_without_a_positive_root_is_refused(left: str, right: str, reason: str) -> None:
    assert reason in refusal(roots(left, right))


def test_a_plant_of_ones_own_is_certified_from_both_sides() -> None:
    plant = hidden_plant()
    theorem = own("delay.gain-upper", plant, {}, {}, {"degree": 1})
    made = {**theorem, **maker.gain_upper(theorem)}
    below = own("delay.gain-lower", plant, {}, {})
    hidden = {**below, **maker.gain_lower(below)}
    upper, least = check(made).upper, check(hidden).lower
    assert upper is not None and least is not None
    assert 0 < upper / least - 1 < fmpq(1, 100)
