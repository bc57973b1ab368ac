"""The transcription of the delay paper against a second reading of its text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from papers.peet2019 import PAPER
from papers.peet2019.experiments.scaling import example_4
from papers.peet2019.printed import COLUMNS, DATA, DELAY_COUNTS, EXAMPLES, STATES

SECOND: dict[str, Any] = json.loads(
    (Path(__file__).parent / "peet2019_second_reading.json").read_text(encoding="utf-8")
)


def bracketed(matrix: list[list[str]]) -> str:
    return f"[{'; '.join(' '.join(row) for row in matrix)}]"


def test_tables_of_the_examples() -> None:
    for number, (gamma, seconds) in enumerate(zip(SECOND["gamma"], SECOND["seconds"], strict=True), 1):
        assert COLUMNS == ("d1", "d2", "d3", "pade")
        assert [DATA[f"gamma-{number}"][column] for column in COLUMNS] == gamma[:4]
        assert [DATA[f"seconds-{number}"][column] for column in COLUMNS] == seconds[:4]
    assert [row[4] for row in SECOND["gamma"][:2]] == [DATA["cited-1"], DATA["cited-2"]]


def test_table_1() -> None:
    assert SECOND["table_1"] == DATA["table-1"]


def test_plants() -> None:
    first, delayed_1, input_1, output_1, second, delayed_2, input_2, third, delayed_3, input_3 = (
        bracketed(matrix) for matrix in SECOND["matrices"]
    )
    c2_1, c2_2, c1_2, c2_3, c1_3 = (bracketed([row]) for row in SECOND["rows"])
    examples = {name: DATA[f"example-{name}"] for name in "123"}
    assert [examples[name]["a0"] for name in "123"] == [first, second, third]
    assert [examples[name]["b"] for name in "123"] == [input_1, input_2, input_3]
    assert [examples[name]["c10"] for name in "123"] == [output_1, c1_2, c1_3]
    assert [examples[name]["c2"] for name in "123"] == [c2_1, c2_2, c2_3]
    assert [examples[name]["a"] for name in "123"] == [delayed_1, delayed_2, delayed_3]


def test_plants_in_numbers_are_the_printed_ones() -> None:
    for name, example in EXAMPLES.items():
        printed = DATA[f"example-{name}"]
        for part in ("a0", "b", "c10", "c2"):
            assert bracketed([[f"{entry:g}" for entry in row] for row in example[part]]) == printed[part]
    matrices = [[[float(entry) for entry in row] for row in matrix] for matrix in SECOND["matrices"]]
    assert [EXAMPLES[name]["a"] for name in "12"] == [[matrices[1]], [matrices[5]]]
    assert np.array_equal(np.sum(EXAMPLES["3"]["a"], axis=0), matrices[8])


def test_numbers_of_the_text() -> None:
    text = SECOND["text"]
    assert text["example 1, gain of Theorem 3"] == DATA["text-1"]
    assert text["example 2, gain of Theorem 3"] == DATA["text-2"]
    assert text["example 1, cited gain"] == DATA["cited-1"]
    assert text["example 2, cited gain"] == DATA["cited-2"]
    assert text["example 2, gain for the sinc"] == DATA["sinc-gain"]
    assert text["fig. 1, gain of the observer"] == DATA["figure-level"]
    assert "<" + text["section X, small gain"] == DATA["small-gain"]
    assert int(text["section IX, lumped states"]) == DATA["lumped-states"]
    assert int(text["section I, product of states and delays"]) == DATA["largest-product"]
    assert int(text["section X, order of the Padé approximation"]) == DATA["pade-order"]
    assert int(text["example 2, degree"]) == DATA["text-2-degree"]


def test_delays() -> None:
    text = SECOND["text"]
    assert [text["example 1, delay"]] == DATA["example-1"]["delays"]
    assert text["example 2, delay, for the original system"] == text["fig. 1, delay [s]"]
    assert [text["fig. 1, delay [s]"]] == DATA["example-2"]["delays"]
    assert text["example 3, delays"] == DATA["example-3"]["delays"]
    for name, example in EXAMPLES.items():
        assert [float(delay) for delay in DATA[f"example-{name}"]["delays"]] == example["delays"]
    assert len(EXAMPLES["3"]["a"]) == int(text["example 3, divisor of the delayed matrix"])


def test_example_4_and_the_heads_of_its_table() -> None:
    text = SECOND["text"]
    assert tuple(int(k) for k in text["table 1, rows"]) == DELAY_COUNTS
    assert tuple(int(n) for n in text["table 1, columns"]) == STATES
    system = example_4(1, 4, jordan=1.0)
    assert system.delays == (0.25, 0.5, 0.75, float(text["example 4, last delay"]))
    assert system.a0.item() == float(text["example 4, first matrix"])
    assert sum(a.item() for a in system.a) == float(text["example 4, sign of the Jordan block"])


def test_the_caption_of_fig_1_names_the_other_system() -> None:
    text = SECOND["text"]
    erratum = next(item for item in PAPER.errata if item.place == "Fig. 1, caption")
    assert text["fig. 1, number of the system"] == text["number of the plant of example 3"]
    assert text["fig. 1, number of the system"] in erratum.printed
    assert text["number of the plant of example 2"] in erratum.meant


def test_the_cited_design_is_named_with_its_epsilon() -> None:
    cited = next(claim for claim in PAPER.claims if claim.printed == SECOND["text"]["example 1, cited gain"])
    assert SECOND["text"]["example 1, epsilon of the cited design"] == DATA["cited-1-epsilon"]
    assert DATA["cited-1-epsilon"] in cited.statement
