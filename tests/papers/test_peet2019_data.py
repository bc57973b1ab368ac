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

READ: dict[str, Any] = json.loads((Path(__file__).parent / "peet2019_second_reading.json").read_text(encoding="utf-8"))
SECOND, TEXT = READ["printed"], READ["text"]


def words(value: Any) -> Any:
    """Whole numbers as the text has them."""
    return str(value) if isinstance(value, int) else [words(one) for one in value] if isinstance(value, list) else value


@pytest.mark.parametrize("name", sorted({*DATA, *SECOND}))
def test_what_is_printed_was_read_twice(name: str) -> None:
    assert words(DATA[name]) == SECOND[name]


def test_plants_in_numbers_are_the_printed_ones() -> None:
    for name, example in EXAMPLES.items():
        printed = SECOND[f"example-{name}"]
        for part in ("a0", "b", "c10", "c2"):
            assert f"[{'; '.join(' '.join(f'{x:g}' for x in row) for row in example[part])}]" == printed[part]
        assert example["delays"] == [float(delay) for delay in printed["delays"]]
        mean = np.array([row.split() for row in printed["a"].strip("[]").split(";")], float)
        assert np.array_equal(np.sum(example["a"], axis=0), mean)
    assert len(EXAMPLES["3"]["a"]) == int(TEXT["example 3, divisor of the delayed matrix"])


def test_example_4_and_the_heads_of_the_tables() -> None:
    assert COLUMNS == ("d1", "d2", "d3", "pade")
    assert (list(map(str, DELAY_COUNTS)), list(map(str, STATES))) == ([*SECOND["table-1"]], SECOND["states"])
    system = example_4(1, 4, jordan=1.0)
    assert system.delays == (0.25, 0.5, 0.75, float(TEXT["example 4, last delay"]))
    assert system.a0.item() == float(TEXT["example 4, first matrix"])
    assert sum(a.item() for a in system.a) == float(TEXT["example 4, sign of the Jordan block"])


def test_names_of_systems_and_designs() -> None:
    erratum = next(item for item in PAPER.errata if item.place == "Fig. 1, caption")
    assert TEXT["fig. 1, number of the system"] == TEXT["number of the plant of example 3"]
    assert TEXT["fig. 1, number of the system"] in erratum.printed
    assert TEXT["number of the plant of example 2"] in erratum.meant
    cited = next(claim for claim in PAPER.claims if claim.printed == SECOND["cited-1"])
    assert SECOND["cited-1-epsilon"] in cited.statement
