"""The transcriptions of the papers against second readings, made from the texts by another reader."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from papers.mustafa.printed import DATA as MUSTAFA
from papers.mustafa.printed import example
from papers.okajima2023.printed import DATA as OKAJIMA
from papers.okajima2023.printed import SCHEDULES
from papers.peet2019 import PAPER
from papers.peet2019.experiments.scaling import example_4
from papers.peet2019.printed import COLUMNS, DELAY_COUNTS, EXAMPLES, STATES
from papers.peet2019.printed import DATA as PEET
from papers.shao import printed as shao

IRREGULAR, SLOW, LATE, DUAL = (
    json.loads((Path(__file__).parent / f"{key}_second_reading.json").read_text(encoding="utf-8"))
    for key in ("mustafa", "okajima2023", "peet2019", "shao")
)
FIRST_EXAMPLE, SECOND_EXAMPLE = IRREGULAR["example_1"], IRREGULAR["example_2"]
CONSTANTS, FILTER = SECOND_EXAMPLE["constants"], SECOND_EXAMPLE["filter"]
SIZE, DECAY, FREQUENCY = (MUSTAFA["disturbance"][name] for name in ("size", "decay", "frequency"))
LEVELS, BLOG, TABLE, UNSTABLE = (SLOW[name] for name in ("gamma", "blog", "table_1", "unstable"))
PRINTED, TEXT = LATE["printed"], LATE["text"]


def written(rows: list[list[str]]) -> str:
    return "[" + "; ".join(" ".join(row) for row in rows) + "]"


def words(value: Any) -> Any:
    """Whole numbers as the text has them."""
    return str(value) if isinstance(value, int) else [words(one) for one in value] if isinstance(value, list) else value


OF_MUSTAFA: dict[str, tuple[Any, Any]] = {
    **{
        f"{name} of Example 1": (MUSTAFA["example-1"][name], written(FIRST_EXAMPLE[name]))
        for name in ("A", "B", "C", "L")
    },
    **{f"{name} of Example 2": (MUSTAFA["example-2"][name], written(SECOND_EXAMPLE[name])) for name in "BCL"},
    "D": ((MUSTAFA["example-1"]["D"], MUSTAFA["example-2"]["D"]), (FIRST_EXAMPLE["D"], SECOND_EXAMPLE["D"])),
    "K": ((MUSTAFA["K"], MUSTAFA["K"]), (CONSTANTS["K_T"], CONSTANTS["K_q"])),
    "constants": (
        {name: MUSTAFA[name] for name in ("b", "J", "R_a", "L_a")},
        {name: value for name, value in CONSTANTS.items() if name not in ("K_T", "K_q")},
    ),
    "range of Example 1": (
        (MUSTAFA["h_l-1"], f"\\pi/{MUSTAFA['h_u-1-divisor']}"),
        (FIRST_EXAMPLE["h_l"], FIRST_EXAMPLE["h_u"]),
    ),
    "range of Example 2": ((MUSTAFA["h_l-2"], MUSTAFA["h_u-2"]), (SECOND_EXAMPLE["h_l"], SECOND_EXAMPLE["h_u"])),
    "levels": ((MUSTAFA["gamma-1"], MUSTAFA["gamma-2"]), (FIRST_EXAMPLE["gamma"], SECOND_EXAMPLE["gamma"])),
    "levels of [13]": (MUSTAFA["gamma-13"], {name: FIRST_EXAMPLE["cited"][name] for name in ("type 1", "type 2")}),
    "level of [14]": (MUSTAFA["gamma-14"], SECOND_EXAMPLE["cited"]["gamma"]),
    "grids": (
        ("one", MUSTAFA["grid-size-1"], [MUSTAFA["grid-2"]], MUSTAFA["grid-size-2"]),
        (FIRST_EXAMPLE["grid_size"], "1", SECOND_EXAMPLE["grid"], str(len(SECOND_EXAMPLE["grid"]))),
    ),
    "filter": (MUSTAFA["filter"], {name: written(FILTER[name]) for name in ("A_f", "B_f", "C_f")}),
    "columns": (
        [*MUSTAFA["columns-of-A_f"].values()],
        [written([[row[i]] for row in FILTER["A_f"]]) for i in (0, 1)],
    ),
    "disturbance": (f"{SIZE} \\exp(-{DECAY}k) \\sin({FREQUENCY}\\pi k)", SECOND_EXAMPLE["disturbance"]),
}
OF_OKAJIMA: dict[str, tuple[Any, Any]] = {
    "plant": (OKAJIMA["plant"], {name: written(rows) for name, rows in SLOW["plant"].items()}),
    "gains": (OKAJIMA["gains"], {number: [*map(written, gains)] for number, gains in SLOW["gains"].items()}),
    "schedules": (set(SCHEDULES), set(SLOW["selections"])),
    **{
        f"schedule {name}": (SCHEDULES[name]["diagonals"], written([[S[0][0], S[1][1]] for S in selections]))
        for name, selections in SLOW["selections"].items()
    },
    "off the diagonals": ({"0"}, {S[i][1 - i] for each in SLOW["selections"].values() for S in each for i in (0, 1)}),
    "table 1": ([*OKAJIMA["table-1"].items()], [*zip(TABLE["columns"], TABLE["gamma_prop"], strict=True)]),
    "level": (OKAJIMA["level"], LEVELS["gamma_prop"]),
    "cases": (
        OKAJIMA["level-of-case"],
        {"A": LEVELS["gamma_y1"], "B": LEVELS["gamma_y2"], "C": LEVELS["gamma_N-period"]},
    ),
    "timings": (OKAJIMA["level-of-timing"], {n: LEVELS[f"gamma_c{n}"] for n in "123"}),
    "cases of the blog": (
        OKAJIMA["blog-methods"],
        {"Proposed": BLOG["gamma_prop"], **{f"Case {name}": BLOG[f"case_{name}"] for name in "ABC"}},
    ),
    "periods of the blog": (OKAJIMA["blog-periods"], {each: BLOG[f"gamma_({each})"] for each in ("1,1", "3,3")}),
    "timings of the blog": (OKAJIMA["blog-timing"], {n: BLOG[f"case_{n}"] for n in "123"}),
    "cases again": (
        OKAJIMA["blog-methods"],
        {
            "Proposed": OKAJIMA["level"],
            **{f"Case {name}": level for name, level in OKAJIMA["level-of-case"].items()},
        },
    ),
    "periods again": (
        OKAJIMA["blog-periods"],
        {periods: OKAJIMA["table-1"][periods] for periods in OKAJIMA["blog-periods"]},
    ),
    "timings again": (OKAJIMA["blog-timing"], OKAJIMA["level-of-timing"]),
    "sizes": ({"decision_variables": OKAJIMA["decision-variables"], "rows": OKAJIMA["rows"]}, SLOW["lmi"]),
    "ratios": ([*OKAJIMA["simulated-ratio"].values()], [*SLOW["g_sim"].values()]),
    "noise": (
        (OKAJIMA["sigma"], str(OKAJIMA["last-noise"]), str(OKAJIMA["last-summed"])),
        tuple(SLOW[name] for name in ("sigma", "noise_zero_after_k", "sum_to")),
    ),
    "matrix of Sec. IV-C": (OKAJIMA["unstable-A"], written(UNSTABLE["A"])),
    "matrix of Sec. IV-A again": (OKAJIMA["unstable-A"], OKAJIMA["plant"]["A"]),
    "poles": (OKAJIMA["poles"], f"({', '.join(UNSTABLE['poles_A'])})"),
    "poles of A_e": (OKAJIMA["error-poles"], f"({', '.join(UNSTABLE['poles_A_e'])})"),
}
"""By what they are, the print as it is taken and as the other reader has it, or as it stands elsewhere."""
OF_PEET = {name: (words(PEET.get(name)), PRINTED.get(name)) for name in sorted({*PEET, *PRINTED})}
OF_SHAO: dict[str, tuple[Any, Any]] = {
    "text": (
        {
            name: " ".join([value] if isinstance(value, str) else value.values() if isinstance(value, dict) else value)
            for name, value in shao.DATA.items()
            if name != "table-1"
        },
        DUAL["text"],
    ),
    "references": (shao.REFERENCES, tuple(DUAL["table_1"]["references"])),
    "frequencies": (shao.FREQUENCIES, tuple(DUAL["table_1"]["frequencies"])),
    **{name: (shao.table_1(name), tuple(DUAL["table_1"][name])) for name in ("SRC", "DRC-PMI", "DRC-APO")},
}
PAIRS = {
    f"{key}: {name}": pair
    for key, pairs in {"mustafa": OF_MUSTAFA, "okajima2023": OF_OKAJIMA, "peet2019": OF_PEET, "shao": OF_SHAO}.items()
    for name, pair in pairs.items()
}


@pytest.mark.parametrize("name", PAIRS)
def test_both_readers_have_the_same(name: str) -> None:
    ours, second = PAIRS[name]
    assert ours == second


def test_the_motor_of_the_nonuniform_paper() -> None:
    """The entries of A as printed formulas, evaluated with the printed constants, are those of the transcription."""
    values = {name: float(value) for name, value in CONSTANTS.items()}
    values["K_\\theta"] = values["K_q"]
    entries = []
    for entry in (entry for row in SECOND_EXAMPLE["A"] for entry in row):
        over, under = entry.lstrip("-").split("/")
        entries.append((-1 if entry.startswith("-") else 1) * values[over] / values[under])
    assert [entry for row in example(2)["plant"]["A"] for entry in row] == pytest.approx(entries, rel=1e-15)


def test_trace_of_the_recovered_plant_is_the_sum_of_the_stated_poles() -> None:
    """A check of the reading by the physics: no slip of a digit in the stated poles would keep their sum at 3.2."""
    real, pair = UNSTABLE["poles_A"]
    assert float(real) + 2 * float(pair.split("±")[0]) == pytest.approx(1.2 + 1.0 + 1.0, abs=1.5e-3)


def test_plants_of_the_delay_paper_in_numbers_are_the_printed_ones() -> None:
    for name, plant in EXAMPLES.items():
        printed = PRINTED[f"example-{name}"]
        for part in ("a0", "b", "c10", "c2"):
            assert f"[{'; '.join(' '.join(f'{x:g}' for x in row) for row in plant[part])}]" == printed[part]
        assert plant["delays"] == [float(delay) for delay in printed["delays"]]
        mean = np.array([row.split() for row in printed["a"].strip("[]").split(";")], float)
        assert np.array_equal(np.sum(plant["a"], axis=0), mean)
    assert len(EXAMPLES["3"]["a"]) == int(TEXT["example 3, divisor of the delayed matrix"])


def test_example_4_and_the_heads_of_the_tables_of_the_delay_paper() -> None:
    assert COLUMNS == ("d1", "d2", "d3", "pade")
    assert (list(map(str, DELAY_COUNTS)), list(map(str, STATES))) == ([*PRINTED["table-1"]], PRINTED["states"])
    system = example_4(1, 4, jordan=1.0)
    assert system.delays == (0.25, 0.5, 0.75, float(TEXT["example 4, last delay"]))
    assert system.a0.item() == float(TEXT["example 4, first matrix"])
    assert sum(a.item() for a in system.a) == float(TEXT["example 4, sign of the Jordan block"])


def test_names_of_systems_and_designs() -> None:
    erratum = next(item for item in PAPER.errata if item.place == "Fig. 1, caption")
    assert TEXT["fig. 1, number of the system"] == TEXT["number of the plant of example 3"]
    assert TEXT["fig. 1, number of the system"] in erratum.printed
    assert TEXT["number of the plant of example 2"] in erratum.meant
    cited = next(claim for claim in PAPER.claims if claim.printed == PRINTED["cited-1"])
    assert PRINTED["cited-1-epsilon"] in cited.statement
