"""The transcription of the delay paper against a second reading of its text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from papers.peet2019 import data, names
from papers.peet2019.claims.levels import CLAIMS
from papers.peet2019.errata import ERRATA
from papers.peet2019.scaling import example_4

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


def test_numbers_of_the_text() -> None:
    text = SECOND["text"]
    assert text["example 1, gain of Theorem 3"] == data.TEXT_GAIN_1
    assert text["example 2, gain of Theorem 3"] == data.TEXT_GAIN_2
    assert text["example 1, cited gain"] == data.CITED_1
    assert text["example 2, cited gain"] == data.CITED_2
    assert text["example 2, gain for the sinc"] == data.SINC_GAIN
    assert text["fig. 1, gain of the observer"] == data.FIGURE_LEVEL
    assert "<" + text["section X, small gain"] == data.SMALL_GAIN
    assert text["section IX, lumped states"] == data.LUMPED_STATES
    assert text["section I, product of states and delays"] == data.LARGEST_PRODUCT
    assert int(text["section X, order of the Padé approximation"]) == data.PADE_ORDER
    assert int(text["example 2, degree"]) == names.FIGURE_DEGREE


def test_delays() -> None:
    text = SECOND["text"]
    assert [float(text["example 1, delay"])] == data.EXAMPLES["1"]["delays"]
    assert text["example 2, delay, for the original system"] == text["fig. 1, delay [s]"]
    assert [float(text["fig. 1, delay [s]"])] == data.EXAMPLES["2"]["delays"]
    assert [float(delay) for delay in text["example 3, delays"]] == data.EXAMPLES["3"]["delays"]
    assert len(data.EXAMPLES["3"]["a"]) == int(text["example 3, divisor of the delayed matrix"])


def test_example_4_and_the_heads_of_its_table() -> None:
    text = SECOND["text"]
    assert tuple(int(k) for k in text["table 1, rows"]) == data.DELAY_COUNTS
    assert tuple(int(n) for n in text["table 1, columns"]) == data.STATES
    system = example_4(1, 4, jordan=1.0)
    assert system.delays == (0.25, 0.5, 0.75, float(text["example 4, last delay"]))
    assert system.a0.item() == float(text["example 4, first matrix"])
    assert sum(a.item() for a in system.a) == float(text["example 4, sign of the Jordan block"])


def test_the_caption_of_fig_1_names_the_other_system() -> None:
    text = SECOND["text"]
    erratum = next(item for item in ERRATA if item.place == "Fig. 1, caption")
    assert text["fig. 1, number of the system"] == text["number of the plant of example 3"]
    assert text["fig. 1, number of the system"] in erratum.printed
    assert text["number of the plant of example 2"] in erratum.meant


def test_the_cited_design_is_named_with_its_epsilon() -> None:
    cited = next(claim for claim in CLAIMS if claim.printed == SECOND["text"]["example 1, cited gain"])
    assert SECOND["text"]["example 1, epsilon of the cited design"] in cited.statement
