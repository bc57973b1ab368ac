"""The transcription of the multi-rate paper against a second reading, made from the text by another reader."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from papers.okajima2023.printed import DATA, SCHEDULES

SECOND = json.loads((Path(__file__).parent / "okajima2023_second_reading.json").read_text(encoding="utf-8"))


def written(rows: list[list[str]]) -> str:
    return "[" + "; ".join(" ".join(row) for row in rows) + "]"


def test_plant() -> None:
    assert DATA["plant"] == {name: written(rows) for name, rows in SECOND["plant"].items()}


def test_gains() -> None:
    assert DATA["gains"] == {number: [written(gain) for gain in gains] for number, gains in SECOND["gains"].items()}


def test_schedules_are_those_of_the_second_reading() -> None:
    assert SCHEDULES.keys() == SECOND["selections"].keys()


@pytest.mark.parametrize("name", SCHEDULES)
def test_schedules(name: str) -> None:
    selections = SECOND["selections"][name]
    assert SCHEDULES[name]["diagonals"] == written([[S[0][0], S[1][1]] for S in selections])
    assert all(S[0][1] == S[1][0] == "0" for S in selections)


def test_table_1() -> None:
    table = SECOND["table_1"]
    assert list(DATA["table-1"].items()) == list(zip(table["columns"], table["gamma_prop"], strict=True))


def test_levels() -> None:
    levels = SECOND["gamma"]
    assert levels["gamma_prop"] == DATA["level"]
    assert DATA["level-of-case"] == {
        "A": levels["gamma_y1"],
        "B": levels["gamma_y2"],
        "C": levels["gamma_N-period"],
    }
    assert DATA["level-of-timing"] == {n: levels[f"gamma_c{n}"] for n in "123"}


def test_levels_of_the_blog() -> None:
    blog = SECOND["blog"]
    cases = {f"Case {name}": blog[f"case_{name}"] for name in "ABC"}
    assert DATA["blog-methods"] == {"Proposed": blog["gamma_prop"], **cases}
    assert DATA["blog-periods"] == {periods: blog[f"gamma_({periods})"] for periods in ("1,1", "3,3")}
    assert DATA["blog-timing"] == {n: blog[f"case_{n}"] for n in "123"}


def test_blog_repeats_the_levels() -> None:
    assert DATA["blog-methods"] == {
        "Proposed": DATA["level"], **{f"Case {name}": level for name, level in DATA["level-of-case"].items()}
    }  # fmt: skip
    assert all(DATA["table-1"][periods] == level for periods, level in DATA["blog-periods"].items())
    assert DATA["blog-timing"] == DATA["level-of-timing"]


def test_sizes_and_simulation() -> None:
    assert SECOND["lmi"] == {"decision_variables": DATA["decision-variables"], "rows": DATA["rows"]}
    assert list(SECOND["g_sim"].values()) == list(DATA["simulated-ratio"].values())
    assert SECOND["sigma"] == DATA["sigma"]
    assert (SECOND["noise_zero_after_k"], SECOND["sum_to"]) == (str(DATA["last-noise"]), str(DATA["last-summed"]))


def test_unstable_plant() -> None:
    assert written(SECOND["unstable"]["A"]) == DATA["unstable-A"] == DATA["plant"]["A"]
    assert f"({', '.join(SECOND['unstable']['poles_A'])})" == DATA["poles"]
    assert f"({', '.join(SECOND['unstable']['poles_A_e'])})" == DATA["error-poles"]


def test_trace_of_the_recovered_plant_is_the_sum_of_the_stated_poles() -> None:
    """A check of the reading by the physics: no slip of a digit in the stated poles would keep their sum at 3.2."""
    real, pair = SECOND["unstable"]["poles_A"]
    assert float(real) + 2 * float(pair.split("±")[0]) == pytest.approx(1.2 + 1.0 + 1.0, abs=1.5e-3)
