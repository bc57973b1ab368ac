"""The transcription of the nonuniform-sampling paper against a second reading, made from the text by another reader."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from papers.mustafa.printed import DATA, example

SECOND = json.loads((Path(__file__).parent / "mustafa_second_reading.json").read_text(encoding="utf-8"))
FIRST_EXAMPLE, SECOND_EXAMPLE = SECOND["example_1"], SECOND["example_2"]
CONSTANTS, FILTER = SECOND_EXAMPLE["constants"], SECOND_EXAMPLE["filter"]
SIZE, DECAY, FREQUENCY = (DATA["disturbance"][name] for name in ("size", "decay", "frequency"))


def written(rows: list[list[str]]) -> str:
    return "[" + "; ".join(" ".join(row) for row in rows) + "]"


PAIRS: dict[str, tuple[Any, Any]] = {
    **{
        f"{name} of Example 1": (DATA["example-1"][name], written(FIRST_EXAMPLE[name])) for name in ("A", "B", "C", "L")
    },
    **{f"{name} of Example 2": (DATA["example-2"][name], written(SECOND_EXAMPLE[name])) for name in "BCL"},
    "D": ((DATA["example-1"]["D"], DATA["example-2"]["D"]), (FIRST_EXAMPLE["D"], SECOND_EXAMPLE["D"])),
    "K": ((DATA["K"], DATA["K"]), (CONSTANTS["K_T"], CONSTANTS["K_q"])),
    "constants": (
        {name: DATA[name] for name in ("b", "J", "R_a", "L_a")},
        {name: value for name, value in CONSTANTS.items() if name not in ("K_T", "K_q")},
    ),
    "range of Example 1": (
        (DATA["h_l-1"], f"\\pi/{DATA['h_u-1-divisor']}"),
        (FIRST_EXAMPLE["h_l"], FIRST_EXAMPLE["h_u"]),
    ),
    "range of Example 2": ((DATA["h_l-2"], DATA["h_u-2"]), (SECOND_EXAMPLE["h_l"], SECOND_EXAMPLE["h_u"])),
    "levels": ((DATA["gamma-1"], DATA["gamma-2"]), (FIRST_EXAMPLE["gamma"], SECOND_EXAMPLE["gamma"])),
    "levels of [13]": (DATA["gamma-13"], {name: FIRST_EXAMPLE["cited"][name] for name in ("type 1", "type 2")}),
    "level of [14]": (DATA["gamma-14"], SECOND_EXAMPLE["cited"]["gamma"]),
    "grids": (
        ("one", DATA["grid-size-1"], [DATA["grid-2"]], DATA["grid-size-2"]),
        (FIRST_EXAMPLE["grid_size"], "1", SECOND_EXAMPLE["grid"], str(len(SECOND_EXAMPLE["grid"]))),
    ),
    "filter": (DATA["filter"], {name: written(FILTER[name]) for name in ("A_f", "B_f", "C_f")}),
    "columns": (
        [*DATA["columns-of-A_f"].values()],
        [written([[row[i]] for row in FILTER["A_f"]]) for i in (0, 1)],
    ),
    "disturbance": (f"{SIZE} \\exp(-{DECAY}k) \\sin({FREQUENCY}\\pi k)", SECOND_EXAMPLE["disturbance"]),
}
"""By what they are, the print as it is taken and as the other reader has it."""


@pytest.mark.parametrize("name", PAIRS)
def test_both_readers_have_the_same(name: str) -> None:
    ours, second = PAIRS[name]
    assert ours == second


def test_motor() -> None:
    """The entries of A as printed formulas, evaluated with the printed constants, are those of the transcription."""
    values = {name: float(value) for name, value in CONSTANTS.items()}
    values["K_\\theta"] = values["K_q"]
    entries = []
    for entry in (entry for row in SECOND_EXAMPLE["A"] for entry in row):
        over, under = entry.lstrip("-").split("/")
        entries.append((-1 if entry.startswith("-") else 1) * values[over] / values[under])
    assert [entry for row in example(2)["plant"]["A"] for entry in row] == pytest.approx(entries, rel=1e-15)
