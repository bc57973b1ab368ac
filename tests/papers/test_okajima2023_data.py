"""The transcription of the multi-rate paper against a second reading, made from the text by another reader."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from papers.okajima2023.printed import DATA, SCHEDULES

SECOND = json.loads((Path(__file__).parent / "okajima2023_second_reading.json").read_text(encoding="utf-8"))
LEVELS, BLOG, TABLE, UNSTABLE = (SECOND[name] for name in ("gamma", "blog", "table_1", "unstable"))


def written(rows: list[list[str]]) -> str:
    return "[" + "; ".join(" ".join(row) for row in rows) + "]"


PAIRS: dict[str, tuple[Any, Any]] = {
    "plant": (DATA["plant"], {name: written(rows) for name, rows in SECOND["plant"].items()}),
    "gains": (DATA["gains"], {number: [*map(written, gains)] for number, gains in SECOND["gains"].items()}),
    "schedules": (set(SCHEDULES), set(SECOND["selections"])),
    **{
        f"schedule {name}": (SCHEDULES[name]["diagonals"], written([[S[0][0], S[1][1]] for S in selections]))
        for name, selections in SECOND["selections"].items()
    },
    "off the diagonals": ({"0"}, {S[i][1 - i] for each in SECOND["selections"].values() for S in each for i in (0, 1)}),
    "table 1": ([*DATA["table-1"].items()], [*zip(TABLE["columns"], TABLE["gamma_prop"], strict=True)]),
    "level": (DATA["level"], LEVELS["gamma_prop"]),
    "cases": (DATA["level-of-case"], {"A": LEVELS["gamma_y1"], "B": LEVELS["gamma_y2"], "C": LEVELS["gamma_N-period"]}),
    "timings": (DATA["level-of-timing"], {n: LEVELS[f"gamma_c{n}"] for n in "123"}),
    "cases of the blog": (
        DATA["blog-methods"],
        {"Proposed": BLOG["gamma_prop"], **{f"Case {name}": BLOG[f"case_{name}"] for name in "ABC"}},
    ),
    "periods of the blog": (DATA["blog-periods"], {each: BLOG[f"gamma_({each})"] for each in ("1,1", "3,3")}),
    "timings of the blog": (DATA["blog-timing"], {n: BLOG[f"case_{n}"] for n in "123"}),
    "cases again": (
        DATA["blog-methods"],
        {"Proposed": DATA["level"], **{f"Case {name}": level for name, level in DATA["level-of-case"].items()}},
    ),
    "periods again": (DATA["blog-periods"], {periods: DATA["table-1"][periods] for periods in DATA["blog-periods"]}),
    "timings again": (DATA["blog-timing"], DATA["level-of-timing"]),
    "sizes": ({"decision_variables": DATA["decision-variables"], "rows": DATA["rows"]}, SECOND["lmi"]),
    "ratios": ([*DATA["simulated-ratio"].values()], [*SECOND["g_sim"].values()]),
    "noise": (
        (DATA["sigma"], str(DATA["last-noise"]), str(DATA["last-summed"])),
        tuple(SECOND[name] for name in ("sigma", "noise_zero_after_k", "sum_to")),
    ),
    "matrix of Sec. IV-C": (DATA["unstable-A"], written(UNSTABLE["A"])),
    "matrix of Sec. IV-A again": (DATA["unstable-A"], DATA["plant"]["A"]),
    "poles": (DATA["poles"], f"({', '.join(UNSTABLE['poles_A'])})"),
    "poles of A_e": (DATA["error-poles"], f"({', '.join(UNSTABLE['poles_A_e'])})"),
}
"""By what they are, the print as it is taken and as the other reader has it, or as it stands elsewhere."""


@pytest.mark.parametrize("name", PAIRS)
def test_both_readers_have_the_same(name: str) -> None:
    ours, second = PAIRS[name]
    assert ours == second


def test_trace_of_the_recovered_plant_is_the_sum_of_the_stated_poles() -> None:
    """A check of the reading by the physics: no slip of a digit in the stated poles would keep their sum at 3.2."""
    real, pair = UNSTABLE["poles_A"]
    assert float(real) + 2 * float(pair.split("±")[0]) == pytest.approx(1.2 + 1.0 + 1.0, abs=1.5e-3)
