"""The transcription of the nonuniform-sampling paper against a second reading, made from the text by another reader."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from papers.mustafa import data

SECOND = json.loads((Path(__file__).parent / "mustafa_second_reading.json").read_text(encoding="utf-8"))


def written(rows: list[list[str]]) -> str:
    return "[" + "; ".join(" ".join(row) for row in rows) + "]"


@pytest.mark.parametrize("name", ["A", "B", "C", "L"])
def test_plant_of_example_1(name: str) -> None:
    assert getattr(data, f"{name}_1") == written(SECOND["example_1"][name])


@pytest.mark.parametrize("name", ["B", "C", "L"])
def test_plant_of_example_2(name: str) -> None:
    assert getattr(data, f"{name}_2") == written(SECOND["example_2"][name])


def test_motor() -> None:
    """The entries of A as printed formulas, evaluated with the printed constants, are those of the transcription."""
    second = SECOND["example_2"]
    constants = {name: float(value) for name, value in second["constants"].items()}
    assert constants["K_q"] == constants["K_T"] == float(data.MOTOR["K"])
    assert {k: v for k, v in second["constants"].items() if k not in ("K_T", "K_q")} == {
        k: v for k, v in data.MOTOR.items() if k != "K"
    }
    values = {**constants, "K_\\theta": constants["K_q"]}
    entries = []
    for row in second["A"]:
        for entry in row:
            over, under = entry.lstrip("-").split("/")
            entries.append((-1 if entry.startswith("-") else 1) * values[over] / values[under])
    assert [entry for row in data.example_2()["plant"]["A"] for entry in row] == pytest.approx(entries, rel=1e-15)


def test_ranges_and_noise() -> None:
    first, second = SECOND["example_1"], SECOND["example_2"]
    assert (first["D"], second["D"]) == (data.D_1, data.D_2)
    assert (first["h_l"], first["h_u"]) == (data.H_L_1, f"\\pi/{data.H_U_1_DIVISOR}")
    assert (second["h_l"], second["h_u"]) == (data.H_L_2, data.H_U_2)


def test_levels_and_grids() -> None:
    first, second = SECOND["example_1"], SECOND["example_2"]
    assert (first["gamma"], second["gamma"]) == (data.GAMMA_1, data.GAMMA_2)
    assert {name: first["cited"][name] for name in ("type 1", "type 2")} == data.GAMMA_13
    assert second["cited"]["gamma"] == data.GAMMA_14
    assert second["grid"] == [data.GRID_2]
    assert (first["grid_size"], str(len(second["grid"]))) == ("one", data.GRID_SIZE)


def test_filter_and_disturbance() -> None:
    second = SECOND["example_2"]
    assert [written(second["filter"][name]) for name in ("A_f", "B_f", "C_f")] == [data.A_F, data.B_F, data.C_F]
    columns = [written([[row[i]] for row in second["filter"]["A_f"]]) for i in (0, 1)]
    assert columns == [data.A_F_FIRST_COLUMN, data.A_F_SECOND_COLUMN]
    size, decay, frequency = data.W_SIZE, data.W_DECAY, data.W_FREQUENCY
    assert second["disturbance"] == f"{size} \\exp(-{decay}k) \\sin({frequency}\\pi k)"
