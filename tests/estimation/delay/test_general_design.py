"""Designs for general delay plants: levels against exact ones, refusals; plants as lines, small program and page."""

import copy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from benchmarks.delay_plants import DEGREE as RECORDED
from benchmarks.delay_plants import EXAMPLES, PAGE, late_sensor, measured, random_plant, recorded, tables
from replication.errors import InfeasibleError, InvalidInputError, ReplicationError, SolverError
from replication.estimation.conic.interior import Block, solve
from replication.estimation.delay import (
    DelayPlant,
    DelayResult,
    analyse,
    design,
    exact_gain,
    limit,
)
from replication.estimation.delay.exact.central import scaling_of
from replication.estimation.delay.exact.response import right_roots
from replication.estimation.delay.exact.terms import plant_terms
from replication.estimation.delay.general import design as designs
from replication.estimation.delay.general.cone import (
    LineForm,
    line_form,
    rates,
)
from replication.estimation.delay.general.synthesis import _Program, back_in, degree_of, least_level
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.units import Scaling, converted
from replication.estimation.linear.norms import continuous_norm
from replication.ownplant.files import read_plant
from tests.estimation.delay.plants import averaged, delayed_output, late, made_up, tanks, two_late
from tests.tolerances import ROUNDING

WITHIN = {"late": 1e-5, "echo": 1e-4}


def of_file(name: str) -> DelayPlant:
    path = Path(__file__).parents[3] / "docs" / "examples" / f"{name}.toml"
    return DelayPlant(**{key.lower(): value for key, value in read_plant(path, "delay").values.items()})


@cache
def of_degree_3() -> DelayResult:
    result = design(two_late(), degree=3)
    assert isinstance(result, DelayResult)
    return result


@pytest.mark.parametrize(("name", "published", "degree"), EXAMPLES)
def test_public_examples_reach_the_exact_level(name: str, published: str, degree: int) -> None:
    plant = of_file(name)
    exact, least = limit(plant), least_level(plant, degree)
    assert exact.settled
    assert -1e-6 * exact.level <= least.level - exact.level <= WITHIN[name]
    digits = len(published.split(".")[1])
    assert exact.level <= float(published) + 10.0**-digits
    assert least_level(plant, 1).level > exact.level + 10 * WITHIN[name]  # a low degree does not


@pytest.mark.parametrize("plant", [delayed_output, two_late, averaged])
def test_a_design_keeps_its_level(plant) -> None:  # type: ignore[no-untyped-def]
    result = design(plant(), degree=4, margin=0.02)
    assert isinstance(result, DelayResult)
    bracket = result.bracket
    assert bracket.lower <= result.fact("exact gain, upper end").value <= bracket.upper
    assert result.fact("no estimator below").value <= result.fact("least level of any observer").value * (1 + 1e-9)
    assert result.fact("least level of any observer").value <= bracket.lower * (1 + 1e-6)
    # A model that shares no code with the exact loop: each line by its moments.
    assert continuous_norm(*result.gains_of.error_model(40)).lower == pytest.approx(bracket.lower, rel=1e-5)
    wrong = replace(result.gains_of, l0=-10.0 * result.gains_of.l0)
    assert right_roots(wrong.error)[1] or exact_gain(wrong, 1e-3).lower > bracket.upper


QUANTITIES: dict[str, Any] = {
    "least level": lambda plant: limit(plant).level,
    "level of a degree": lambda plant: least_level(plant, 3).level,
    "gain of the estimate zero": lambda plant: exact_gain(made_up(plant, 0.0)).lower,
    "rms by the Kalman filter": lambda plant: design(plant, goal="h2").fact("rms error of z").value,
}
HOUR, ONE = 3600.0, np.ones(1)


@cache
def own(make: Any, quantity: str) -> float:
    """As the plant is written down."""
    return float(QUANTITIES[quantity](make()))


MIXED = np.random.default_rng(5).standard_normal((2, 2)) @ np.diag([1e2, 1.0])


def converted_by(change: Any, time: float, sensor: float, noise: float) -> Any:
    """In other states, time and sensors, and with disturbances that are divided by `noise`."""
    rows = {"n": lambda part: time * change @ part, "q": lambda part: sensor * part}
    columns = {"n": lambda part: part @ np.linalg.inv(change), "r": lambda part: part / noise}
    return lambda plant: converted(plant, rows, columns, time)


IN_MIXED_STATES = converted_by(MIXED, 20.0, 50.0, 1.0)
CHANGES = (
    (converted_by(np.diag([1e3, 1e-4]), 1.0, 1e6, 1.0), 1.0),
    (IN_MIXED_STATES, 1.0),
    (converted_by(np.eye(2), 1 / HOUR, 1.0, 1.0), 1.0),
    (converted_by(np.eye(2), 1.0, 1.0, 16.0), 1 / 16.0),
)


@pytest.mark.parametrize(
    ("make", "quantity", "change", "factor"),
    [
        *(
            (delayed_output if "rms" in quantity else two_late, quantity, *change)
            for quantity in QUANTITIES
            for change in CHANGES
        ),
        *((make, "least level", IN_MIXED_STATES, 1.0) for make in (averaged, delayed_output)),
    ],
)
def test_units_and_coordinates_do_not_matter(make: Any, quantity: str, change: Any, factor: float) -> None:
    plant = make()
    other = change(plant)
    # A mean square is one over the unit of time; levels are not.
    time = (other.delays[0] / plant.delays[0]) ** (-0.5 if "rms" in quantity else 0.0)
    assert QUANTITIES[quantity](other) == pytest.approx(factor * own(make, quantity) * time, rel=1e-5)


def test_where_a_degree_proves_nothing_the_level_is_open() -> None:
    """An unstable mode that doubles several times before it is seen: one moment of the delay is too few."""
    plant = replace(late_sensor(2.0), a0=[[1.0]])
    with pytest.raises(SolverError, match=r"stays open \(least level of any observer: .*; raise the degree"):
        design(plant, degree=1)
    assert design(plant, degree=4).value >= limit(plant).level


def test_without_delayed_terms_it_is_an_ordinary_filter() -> None:
    plant = DelayPlant([[-1.0]], (0.5,), [[1.0, 0.0]], [[1.0]], [[1.0]], d21=[[0.0, 0.5]])  # type: ignore[arg-type]
    result = design(plant, degree=1, margin=1e-3)
    # |G_z null(G_y)| at rest: w_1 and w_2 that leave y at zero have the ratio 1 to 2.
    assert result.value == pytest.approx(1.001 / np.sqrt(5.0), rel=1e-6)
    assert set(result.gains) == {"L0", "Lz"}


LATE_SENSOR, PREDICTED = late_sensor(0.5), late(0.0, 1.0, 1.0)
# One disturbance drives the state and the sensor: y tells it, and the least level is zero.
REVEALING = DelayPlant([[-1.0]], (0.5,), [[1.0]], [[1.0]], [[1.0]], a=([[-0.3]],), d21=[[0.5]])  # type: ignore[arg-type]
DEPENDENT: dict[str, Any] = {"a0": [[-1.0]], "delays": [0.4], "b": [[1.0, 0, 0]], "c10": [[1.0]], "c2": [[1.0], [2.0]]}
UNSEEN = DelayPlant([[1, 0], [0, -1]], [1.0], np.eye(2, 3), [[1, 0]], [[0, 1]], d21=[[0, 0, 1]])  # type: ignore[arg-type]
SILENT = DelayPlant([[-1]], [1.0], [[1, 0]], [[1]], [[1], [2]], d21=[[0, 1], [0, 2]])  # type: ignore[arg-type]
ECHO = DelayPlant([[-1]], [1.0], [[1, 0]], [[1]], [[1]], d21=[[0, 1]], d21_delayed=[[[0, 1]]])  # type: ignore[arg-type]
FEWER = DelayPlant([[-1.0]], [1.0], [[1.0]], [[1.0]], [[1.0], [2.0]], d21=[[1.0], [1.0]])  # type: ignore[arg-type]
REFUSED: list[tuple[DelayPlant, dict[str, Any], type[ReplicationError], str]] = [
    (late_sensor(1.0), {"level": 0.9}, InfeasibleError, "no estimator, not even one that knows the future"),
    (late_sensor(1.0), {"level": 1.2}, SolverError, "is open"),
    (REVEALING, {}, InfeasibleError, "cannot be told from zero"),
    (DelayPlant(**DEPENDENT), {}, InvalidInputError, "full row rank"),
    (replace(LATE_SENSOR, d21=0.0 * LATE_SENSOR.d21), {}, InvalidInputError, "free of noise at high frequencies"),
    (replace(LATE_SENSOR, d21_delayed=(-LATE_SENSOR.d21,)), {}, InvalidInputError, "free of noise at high frequencies"),
    (FEWER, {}, InvalidInputError, "free of noise at high frequencies"),
    (replace(LATE_SENSOR, c2_delayed=([[0.0]],)), {}, InvalidInputError, "not detectable"),  # type: ignore[arg-type]
    (LATE_SENSOR, {"rule": "tensor"}, InvalidInputError, "rule must be bessel"),
    (LATE_SENSOR, {"measured": 1}, InvalidInputError, r"belong to a control\.StateSpace"),
    (LATE_SENSOR, {"degree": 99}, InvalidInputError, "degree must be at most"),
    (averaged(), {"degree": 1}, InvalidInputError, "degree must be at least 2"),
    (PREDICTED, {"goal": "h3"}, InvalidInputError, "goal must be one of"),
    (PREDICTED, {"goal": "h2", "level": 2.0}, InvalidInputError, "level belongs to"),
    (PREDICTED, {"goal": "h2", "margin": 0.1}, InvalidInputError, "margin belong to the goal hinf"),
    (PREDICTED, {"goal": "h2", "rule": "tensor"}, InvalidInputError, "belong to the goal hinf"),
    (PREDICTED, {"goal": "h2", "degree": 40}, InvalidInputError, "degree"),
    (PREDICTED, {"goal": "mixed", "level": -1.0}, InvalidInputError, "level"),
    (tanks(), {"goal": "h2"}, InvalidInputError, "noise in y"),
    (DelayPlant([[0]], [1.0], [[1]], [[1]], [[1]]), {"goal": "mixed"}, InvalidInputError, "noise in y"),  # type: ignore[arg-type]
    (averaged(), {"goal": "h2"}, InvalidInputError, "infinite mean square"),
    (UNSEEN, {"goal": "h2"}, InvalidInputError, "not detectable"),
    # Of two sensors with one noise; at 1/2, 3/2 .. turns of the delay.
    (SILENT, {"goal": "h2"}, InvalidInputError, "free of noise"),
    (ECHO, {"goal": "h2"}, InvalidInputError, "free of noise"),
]


@pytest.mark.parametrize(("plant", "given", "error", "says"), REFUSED)
def test_what_is_refused_and_why(
    plant: DelayPlant, given: dict[str, Any], error: type[ReplicationError], says: str
) -> None:
    with pytest.raises(error, match=says):
        design(plant, **given)


def test_what_is_next_to_it_is_not_refused() -> None:
    assert design(late_sensor(1.0), level=1.5).value == pytest.approx(1.5)
    # Its gain is but rounding, whose spectrum takes long to integrate.
    with patch.object(designs, "_mean", return_value=()):
        assert design(REVEALING, level=0.1).bracket.lower <= 0.1
    assert design(DelayPlant(**DEPENDENT, d21=[[0, 0.1, 0], [0, 0, 0.1]])).value < 1.0  # type: ignore[arg-type]


def test_a_gain_that_stays_open_is_said_to_be_open() -> None:
    """Where roots next to the axis cannot be counted, the level rests on the storage function alone."""
    failure = SolverError("a root of the error lies next to the imaginary axis")
    with patch("replication.estimation.delay.general.design.exact_gain", side_effect=failure):
        result = design(two_late(), degree=3)
    assert result.fact("exact gain, upper end").value == "open"
    exact = of_degree_3()
    assert result.value == exact.value
    assert 0.99 * exact.bracket.lower <= result.bracket.lower <= exact.bracket.lower * (1 + 1e-6)


def test_what_a_plant_with_noise_does_alone() -> None:
    plant = replace(late_sensor(0.5), a0=np.array([[-1.0]]))
    facts = {fact.what: fact.value for fact in analyse(plant).evidence}
    assert facts["unstable roots"] == 0
    upper, lower = facts["gain from w to z"], facts["gain from w to z, lower end"]
    assert lower <= 1.0 * (1 + 1e-12) <= upper * (1 + 1e-12) and upper <= lower * (1 + 1e-4)
    assert facts["rms of z"] == pytest.approx(np.sqrt(0.5), rel=1e-6)
    assert facts["least level of any observer"] == pytest.approx(limit(plant).level)
    direct = {fact.what: fact.value for fact in analyse(replace(plant, d11=[[2.0, 0.0]])).evidence}  # type: ignore[arg-type]
    assert direct["gain from w to z"] == pytest.approx(3.0, rel=1e-3) and direct["rms of z"] == "infinite"
    assert len(analyse(plant).plot().axes) == 1
    growing = {fact.what: fact.value for fact in analyse(replace(plant, a0=np.array([[0.3]]))).evidence}
    assert growing["unstable roots"] == 1 and growing["gain from w to z"] == "infinite"
    assert {fact.what: fact.value for fact in analyse(late_sensor(0.5)).evidence}["unstable roots"] == "open"


def test_the_degree_follows_the_size() -> None:
    assert degree_of(late_sensor(0.5)) == 6
    rng = np.random.default_rng(0)
    n = 20
    plant = DelayPlant(-np.eye(n), (0.5,), np.eye(n, 2), np.eye(1, n), np.eye(1, n), a=(rng.normal(size=(n, n)),))
    assert degree_of(plant) == 1


def test_a_proof_within_rounding_is_none() -> None:
    plant, proved = late(0.0, 1.0, 1.0), _Program.proved

    def hardly(*given):  # type: ignore[no-untyped-def]
        return replace(proved(*given), slack=1e-16, rounding=1e-15)

    level = 1.2 * float(design(plant).fact("least level").value)
    with patch.object(_Program, "proved", hardly), pytest.raises(SolverError, match="rounding"):
        design(plant, level=level)


LATE: dict[str, Any] = {
    "delays": [0.5], "b": [[1.0, 0.0]], "c10": [[1.0]], "c2": [[0.0]], "c2_delayed": [[[1.0]]], "d21": [[0.0, 1.0]]
}  # fmt: skip
GOALS = ("hinf", "h2", "mixed")


def test_over_ranges_an_integrator_is_left_open_with_the_reason() -> None:
    found = design(DelayPlant(a0=[[0.0]], ranges=[(0.49, 0.51)], **LATE))
    worst = found.fact("worst gain over the ranges")
    assert worst.value == "open" and "imaginary axis" in worst.method
    assert np.isfinite(found.value)


@pytest.mark.parametrize("goal", GOALS)
def test_every_goal_says_what_its_gains_are_worth_over_the_ranges(goal: str) -> None:
    found = design(DelayPlant(a0=[[-1.0]], ranges=[(0.4, 0.6)], **LATE), goal=goal)
    worst, attained = (found.fact(name).value for name in ("worst gain over the ranges", "attained there"))
    assert isinstance(worst, float) and isinstance(attained, float)
    # The nominal delay lies in the range, where the gain is at least as large as the lower end of the bracket.
    assert found.bracket.lower * (1 - 2e-3) <= worst and attained <= worst
    alone, over = (found.fact(f"level without sensors{where}").value for where in ("", " over the ranges"))
    assert over > alone * (1 - 1e-3)


@pytest.mark.parametrize("goal", GOALS)
def test_the_unit_of_the_disturbance_scales_the_level_and_nothing_else(goal: str) -> None:
    def level(unit: float) -> float:
        scaled = {**LATE, "b": [[unit, 0.0]], "d21": [[0.0, unit]]}
        return design(DelayPlant(a0=[[-1.0]], **scaled), goal=goal).value

    assert [level(unit) / unit for unit in (1e-9, 1e6)] == pytest.approx([level(1.0)] * 2, rel=1e-6)


# The plant as lines, and its small program


def values(form: LineForm, s: complex) -> np.ndarray:
    """[x'; z; y] of (x, w) at s by the lines, moments by quadrature."""
    total = form.now.astype(complex)
    points, weights = legendre.gauss(60)
    for line in form.lines:
        total += line.end @ line.carry * np.exp(-s * line.delay)
        basis = legendre.evaluate(max(len(line.moments), 1), points)
        for c, effect in enumerate(line.moments):
            total += effect @ line.carry * np.sum(weights * basis[:, c] * np.exp(s * line.delay * points))
    return total


@pytest.mark.parametrize("seed", range(12))
def test_lines_carry_the_whole_plant(seed: int) -> None:
    plant = random_plant(np.random.default_rng(seed))
    form = line_form(plant)
    s = 0.3 + 2.1j
    expected = plant_terms(plant).terms.at(np.array([s]))[0]
    assert values(form, s) == pytest.approx(expected, abs=ROUNDING * np.abs(expected).max())
    assert all(np.linalg.matrix_rank(line.carry) == line.width > 0 for line in form.lines)


def test_scaling_is_undone_exactly() -> None:
    plant = averaged()
    scaling = Scaling(np.array([4.0, 0.5]), np.array([8.0]), 2.0, 4.0)
    there = line_form(scaling.plant(plant))
    s = 0.3 + 2.1j
    expected = plant_terms(plant).terms.at(np.array([s]))[0]
    assert values(back_in(scaling, there), s) == pytest.approx(expected, abs=ROUNDING)
    assert scaling_of(delayed_output()).gain == 1.0


# The page on delays with noise: its tables are those of the record, and the record meets what is promised


ROWS_OF = recorded()
PROMISED = 1e-5
"""How near the least level of a degree comes, relatively; the page counts levels that are farther off."""
RANDOM = {name: row for name, row in ROWS_OF.items() if name.startswith("random")}


def test_the_page_shows_the_record() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for place, table in tables(ROWS_OF).items():
        assert f"<!-- {place}: begin -->\n\n{table}\n\n<!-- {place}: end -->" in text
    changed = copy.deepcopy(ROWS_OF)
    changed["late 1.0"]["least"] *= 1.01
    assert tables(changed)["late"] not in text


def test_what_was_measured_is_within_what_is_promised() -> None:
    assert len(RANDOM) >= 100
    for name, row in list(RANDOM.items())[::25]:
        plant = random_plant(np.random.default_rng(int(name.split()[1])))
        assert (plant.states, plant.delay_count, plant.measurements) == (row["n"], row["K"], row["q"])
    done = [row for row in RANDOM.values() if "gain" in row]
    assert len(RANDOM) - len(done) <= 0.03 * len(RANDOM)
    excess = np.array([row["least"] / row["limit"] - 1.0 for row in done])
    assert np.median(excess) < 1e-3
    assert excess.min() > -PROMISED
    assert all(row["gain"] <= row["proved"] for row in done)
    assert {row["n"] for row in done} == {1, 2, 3, 4}
    for name, _, degree in EXAMPLES:
        assert ROWS_OF[f"example {name}"]["degree"] == degree
    big = [row for name, row in ROWS_OF.items() if name in ("size (10, 2, 1)", "size (20, 1, 1)")]
    assert [sum(row[key] for key in row if key.endswith("seconds")) < 20.0 for row in big] == [True, True]


@pytest.mark.parametrize("seed", [6, 9, 11, 12])
def test_a_measurement_comes_out_again(seed: int) -> None:
    """Of plants with a small storage; among them unstable ones and late outputs."""
    found, row = measured(random_plant(np.random.default_rng(seed)), RECORDED, 0.05), ROWS_OF[f"random {seed}"]
    # Rounding, which differs between processors, ends the method: the levels are told to this, as the page does.
    assert found["least"] == pytest.approx(row["least"], rel=PROMISED)
    assert found["limit"] * (1 - PROMISED) <= found["least"] <= found["limit"] * 1.002
    assert found["limit"] == pytest.approx(row["limit"], rel=1e-6)
    assert found["limit"] * (1 - 1e-3) <= found["gain"] <= found["proved"]


# The small program: its inequalities, its gains, its solver


def test_measurements_without_noise_are_refused() -> None:
    with pytest.raises(InvalidInputError, match=r"free of noise.*add noise to row 0 of d21"):
        _ = rates(line_form(tanks()), 2).innovation
    with pytest.raises(InvalidInputError, match="degree must be at least 2"):
        rates(line_form(averaged()), 1)


def test_the_solver_on_a_program_with_a_known_answer() -> None:
    """Least t with [[t, w'], [w, W]] >= 0 and W <= diag: max over W of a linear cost has a closed form."""
    a = np.array([[2.0, 0.3], [0.3, 1.0]])
    eye = np.eye(2)
    # t I - W >= 0, W - a >= 0: the least t is the largest eigenvalue of a.
    upper = Block(np.zeros((2, 2)), eye[None], -eye / 2.0, eye)
    lower = Block(-a, np.zeros((1, 2, 2)), eye / 2.0, eye)
    point = solve((upper, lower), 2, np.array([-1.0]))
    assert point.y[0] == pytest.approx(np.linalg.eigvalsh(a)[-1], abs=1e-7)
    assert np.linalg.eigvalsh(upper.at(point.w, point.y))[0] > 0.0
    # Besides t <= 1, which is below that eigenvalue: nothing is feasible.
    cap = Block(np.ones((1, 1)), -np.ones((1, 1, 1)))
    with pytest.raises(SolverError, match="found no point"):
        solve((upper, lower, cap), 2, np.array([-1.0]))
