"""The transcription of the nonuniform-sampling paper against a second reading, made from the text by another reader."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from papers.mustafa.printed import DATA, example

SECOND = json.loads((Path(__file__).parent / "mustafa_second_reading.json").read_text(encoding="utf-8"))


def written(rows: list[list[str]]) -> str:
    return "[" + "; ".join(" ".join(row) for row in rows) + "]"


@pytest.mark.parametrize("name", ["A", "B", "C", "L"])
def test_plant_of_example_1(name: str) -> None:
    assert DATA["example-1"][name] == written(SECOND["example_1"][name])


@pytest.mark.parametrize("name", ["B", "C", "L"])
def test_plant_of_example_2(name: str) -> None:
    assert DATA["example-2"][name] == written(SECOND["example_2"][name])


def test_motor() -> None:
    """The entries of A as printed formulas, evaluated with the printed constants, are those of the transcription."""
    second = SECOND["example_2"]
    constants = {name: float(value) for name, value in second["constants"].items()}
    assert constants["K_q"] == constants["K_T"] == float(DATA["K"])
    others = {name: value for name, value in second["constants"].items() if name not in ("K_T", "K_q")}
    assert others == {name: DATA[name] for name in ("b", "J", "R_a", "L_a")}
    values = {**constants, "K_\\theta": constants["K_q"]}
    entries = []
    for row in second["A"]:
        for entry in row:
            over, under = entry.lstrip("-").split("/")
            entries.append((-1 if entry.startswith("-") else 1) * values[over] / values[under])
    assert [entry for row in example(2)["plant"]["A"] for entry in row] == pytest.approx(entries, rel=1e-15)


def test_ranges_and_noise() -> None:
    first, second = SECOND["example_1"], SECOND["example_2"]
    assert (first["D"], second["D"]) == (DATA["example-1"]["D"], DATA["example-2"]["D"])
    assert (first["h_l"], first["h_u"]) == (DATA["h_l-1"], f"\\pi/{DATA['h_u-1-divisor']}")
    assert (second["h_l"], second["h_u"]) == (DATA["h_l-2"], DATA["h_u-2"])


def test_levels_and_grids() -> None:
    first, second = SECOND["example_1"], SECOND["example_2"]
    assert (first["gamma"], second["gamma"]) == (DATA["gamma-1"], DATA["gamma-2"])
    assert {name: first["cited"][name] for name in ("type 1", "type 2")} == DATA["gamma-13"]
    assert second["cited"]["gamma"] == DATA["gamma-14"]
    assert second["grid"] == [DATA["grid-2"]]
    assert (first["grid_size"], DATA["grid-size-1"]) == ("one", "1")
    assert str(len(second["grid"])) == DATA["grid-size-2"]


def test_filter_and_disturbance() -> None:
    second = SECOND["example_2"]
    assert [written(second["filter"][name]) for name in ("A_f", "B_f", "C_f")] == [
        DATA["filter"][name] for name in ("A_f", "B_f", "C_f")
    ]
    columns = [written([[row[i]] for row in second["filter"]["A_f"]]) for i in (0, 1)]
    assert columns == list(DATA["columns-of-A_f"].values())
    size, decay, frequency = (DATA["disturbance"][name] for name in ("size", "decay", "frequency"))
    assert second["disturbance"] == f"{size} \\exp(-{decay}k) \\sin({frequency}\\pi k)"
