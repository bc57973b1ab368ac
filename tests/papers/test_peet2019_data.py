"""The transcription of the delay paper against a second reading of its text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from papers.peet2019 import data

SECOND: dict[str, Any] = json.loads(
    (Path(__file__).parent / "peet2019_second_reading.json").read_text(encoding="utf-8")
)
COLUMNS = ("1", "2", "3", "pade")


def numbers(matrix: list[list[str]]) -> list[list[float]]:
    return [[float(entry) for entry in row] for row in matrix]


def test_tables_of_the_examples() -> None:
    for number, (gamma, seconds) in enumerate(zip(SECOND["gamma"], SECOND["seconds"], strict=True), 1):
        assert [data.GAMMA[str(number)][column] for column in COLUMNS] == gamma[:4]
        assert [data.SECONDS[str(number)][column] for column in COLUMNS] == seconds[:4]
    assert [row[4] for row in SECOND["gamma"][:2]] == [data.CITED_1, data.CITED_2]


def test_table_1() -> None:
    assert {int(k): tuple(row) for k, row in SECOND["table_1"].items()} == data.TABLE_1


def test_plants() -> None:
    first, delayed_1, input_1, output_1, second, delayed_2, input_2, third, delayed_3, input_3 = (
        numbers(matrix) for matrix in SECOND["matrices"]
    )
    c2_1, c2_2, c1_2, c2_3, c1_3 = ([[float(entry) for entry in row]] for row in SECOND["rows"])
    examples = data.EXAMPLES
    assert [examples[name]["a0"] for name in "123"] == [first, second, third]
    assert [examples[name]["b"] for name in "123"] == [input_1, input_2, input_3]
    assert [examples[name]["c10"] for name in "123"] == [output_1, c1_2, c1_3]
    assert [examples[name]["c2"] for name in "123"] == [c2_1, c2_2, c2_3]
    assert [examples[name]["a"] for name in "12"] == [[delayed_1], [delayed_2]]
    assert np.array_equal(np.sum(examples["3"]["a"], axis=0), delayed_3)
