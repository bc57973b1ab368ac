"""A delay plant as lines, the small program against integrals and another solver, its gains; the page, its record."""

import copy

import numpy as np
import pytest

from benchmarks.delay_plants import DEGREE as RECORDED
from benchmarks.delay_plants import EXAMPLES, PAGE, measured, random_plant, recorded, tables
from replication.errors import InvalidInputError, SolverError
from replication.estimation.conic.interior import Block, solve
from replication.estimation.delay.exact.loop import plant_terms
from replication.estimation.delay.general.cone import (
    LineForm,
    line_form,
    rates,
)
from replication.estimation.delay.general.synthesis import back_in, scaling_of
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.units import Scaling
from tests.estimation.delay.plants import averaged, delayed_output, tanks
from tests.tolerances import ROUNDING


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
