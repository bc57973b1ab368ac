"""The transcription of the multi-rate paper against a second reading, made from the text by another reader."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from papers.okajima2023 import data

SECOND = json.loads((Path(__file__).parent / "okajima2023_second_reading.json").read_text(encoding="utf-8"))


def written(rows: list[list[str]]) -> str:
    return "[" + "; ".join(" ".join(row) for row in rows) + "]"


@pytest.mark.parametrize("name", ["A", "B_d", "C", "D"])
def test_plant(name: str) -> None:
    assert getattr(data, name.upper()) == written(SECOND["plant"][name])


@pytest.mark.parametrize("equation", ["33", "38", "39", "40", "42"])
def test_gains(equation: str) -> None:
    assert list(getattr(data, f"GAINS_{equation}")) == [written(gain) for gain in SECOND["gains"][equation]]


@pytest.mark.parametrize("name", list(data.SELECTION))
def test_schedules(name: str) -> None:
    _, _, diagonals = data.SELECTION[name]
    assert list(diagonals) == [S[0][0] + S[1][1] for S in SECOND["selections"][name]]
    assert all(S[0][1] == S[1][0] == "0" for S in SECOND["selections"][name])


def test_table_1() -> None:
    columns = [tuple(map(int, column.split(","))) for column in SECOND["table_1"]["columns"]]
    assert dict(zip(columns, SECOND["table_1"]["gamma_prop"], strict=True)) == data.TABLE_1


def test_levels() -> None:
    levels = SECOND["gamma"]
    assert levels["gamma_prop"] == data.GAMMA_PROPOSED
    assert {"A": levels["gamma_y1"], "B": levels["gamma_y2"], "C": levels["gamma_N-period"]} == data.GAMMA_CASES
    assert {theta: levels[f"gamma_c{theta + 1}"] for theta in range(3)} == data.GAMMA_TIMING


def test_blog_repeats_the_levels() -> None:
    blog: dict[str, Any] = SECOND["blog"]
    assert blog["gamma_prop"] == data.GAMMA_PROPOSED
    assert {name: blog[f"case_{name}"] for name in "ABC"} == data.GAMMA_CASES
    assert (blog["gamma_(1,1)"], blog["gamma_(3,3)"]) == (data.TABLE_1[1, 1], data.TABLE_1[3, 3])
    assert {theta: blog[f"case_{theta + 1}"] for theta in range(3)} == data.GAMMA_TIMING


def test_sizes_and_simulation() -> None:
    assert SECOND["lmi"] == {"decision_variables": data.DECISION_VARIABLES, "rows": data.BLOCK_SIZE}
    assert list(SECOND["g_sim"].values()) == list(data.G_SIM.values())
    assert SECOND["sigma"] == data.SIGMA
    assert (SECOND["noise_zero_after_k"], SECOND["sum_to"]) == (str(data.LAST_NOISE), str(data.LAST_SUMMED))


def test_unstable_plant() -> None:
    assert written(SECOND["unstable"]["A"]) == data.A_41
    assert f"({', '.join(SECOND['unstable']['poles_A'])})" == data.POLES_A
    assert f"({', '.join(SECOND['unstable']['poles_A_e'])})" == data.POLES_A_E


def test_trace_of_the_recovered_plant_is_the_sum_of_the_stated_poles() -> None:
    """A check of the reading by the physics: no slip of a digit in the stated poles would keep their sum at 3.2."""
    real, pair = SECOND["unstable"]["poles_A"]
    assert float(real) + 2 * float(pair.split("±")[0]) == pytest.approx(1.2 + 1.0 + 1.0, abs=1.5e-3)
