"""The transcription of the delay paper against a second reading of its text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from papers.peet2019 import PAPER
from papers.peet2019.experiments.scaling import example_4
from papers.peet2019.printed import COLUMNS, DATA, DELAY_COUNTS, EXAMPLES, STATES

SECOND: dict[str, Any] = json.loads(
    (Path(__file__).parent / "peet2019_second_reading.json").read_text(encoding="utf-8")
)


def bracketed(matrix: list[list[str]]) -> str:
    return f"[{'; '.join(' '.join(row) for row in matrix)}]"


TEXT = SECOND["text"]
PRINTED = {name: DATA[f"example-{name}"] for name in "123"}
A0_1, A_1, B_1, C10_1, A0_2, A_2, B_2, A0_3, A_3, B_3 = map(bracketed, SECOND["matrices"])
C2_1, C2_2, C10_2, C2_3, C10_3 = (bracketed([row]) for row in SECOND["rows"])
CAPTION = next(item for item in PAPER.errata if item.place == "Fig. 1, caption")
EXAMPLE_4 = example_4(1, 4, jordan=1.0)
PAIRS: dict[str, tuple[Any, Any]] = {
    "table of gains": (
        [[DATA[f"gamma-{number}"][column] for column in COLUMNS] for number in "123"],
        [row[:4] for row in SECOND["gamma"]],
    ),
    "table of seconds": (
        [[DATA[f"seconds-{number}"][column] for column in COLUMNS] for number in "123"],
        [row[:4] for row in SECOND["seconds"]],
    ),
    "columns": (COLUMNS, ("d1", "d2", "d3", "pade")),
    "cited gains": ([DATA["cited-1"], DATA["cited-2"]], [row[4] for row in SECOND["gamma"][:2]]),
    "table 1": (DATA["table-1"], SECOND["table_1"]),
    "rows and columns of table 1": (
        (DELAY_COUNTS, STATES),
        (tuple(map(int, TEXT["table 1, rows"])), tuple(map(int, TEXT["table 1, columns"]))),
    ),
    **{
        f"{name} of the examples": ([printed[name] for printed in PRINTED.values()], second)
        for name, second in {
            "a0": [A0_1, A0_2, A0_3], "a": [A_1, A_2, A_3], "b": [B_1, B_2, B_3], "c10": [C10_1, C10_2, C10_3],
            "c2": [C2_1, C2_2, C2_3],
            "delays": [[TEXT["example 1, delay"]], [TEXT["fig. 1, delay [s]"]], TEXT["example 3, delays"]],
        }.items()
    },
    "delay of the original system": (TEXT["fig. 1, delay [s]"], TEXT["example 2, delay, for the original system"]),
    "divisor of the delayed matrix": (len(EXAMPLES["3"]["a"]), int(TEXT["example 3, divisor of the delayed matrix"])),
    **{
        what: (str(DATA[name]), TEXT[what])
        for name, what in {
            "text-1": "example 1, gain of Theorem 3", "text-2": "example 2, gain of Theorem 3",
            "cited-1": "example 1, cited gain", "cited-2": "example 2, cited gain",
            "cited-1-epsilon": "example 1, epsilon of the cited design", "sinc-gain": "example 2, gain for the sinc",
            "figure-level": "fig. 1, gain of the observer", "lumped-states": "section IX, lumped states",
            "largest-product": "section I, product of states and delays",
            "pade-order": "section X, order of the Padé approximation", "text-2-degree": "example 2, degree",
        }.items()
    },
    "small gain": (DATA["small-gain"], "<" + TEXT["section X, small gain"]),
    "example 4": (
        (EXAMPLE_4.delays, EXAMPLE_4.a0.item(), sum(a.item() for a in EXAMPLE_4.a)),
        ((0.25, 0.5, 0.75, float(TEXT["example 4, last delay"])), float(TEXT["example 4, first matrix"]),
         float(TEXT["example 4, sign of the Jordan block"])),
    ),
    "the system that the caption names": (
        TEXT["number of the plant of example 3"], TEXT["fig. 1, number of the system"],
    ),
}  # fmt: skip
"""By what they are, the print as it is taken and as the other reader has it."""


@pytest.mark.parametrize("name", PAIRS)
def test_both_readers_have_the_same(name: str) -> None:
    ours, second = PAIRS[name]
    assert ours == second


def test_plants_in_numbers_are_the_printed_ones() -> None:
    for name, example in EXAMPLES.items():
        for part in ("a0", "b", "c10", "c2"):
            assert bracketed([[f"{entry:g}" for entry in row] for row in example[part]]) == PRINTED[name][part]
        assert [float(delay) for delay in PRINTED[name]["delays"]] == example["delays"]
    matrices = [[[float(entry) for entry in row] for row in matrix] for matrix in SECOND["matrices"]]
    assert [EXAMPLES[name]["a"] for name in "12"] == [[matrices[1]], [matrices[5]]]
    assert np.array_equal(np.sum(EXAMPLES["3"]["a"], axis=0), matrices[8])


def test_what_is_corrected_and_what_is_cited_hold_these_words() -> None:
    assert TEXT["fig. 1, number of the system"] in CAPTION.printed
    assert TEXT["number of the plant of example 2"] in CAPTION.meant
    cited = next(claim for claim in PAPER.claims if claim.printed == TEXT["example 1, cited gain"])
    assert DATA["cited-1-epsilon"] in cited.statement
