"""The transcriptions of the papers against second readings, made from the texts by another reader."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from papers.mustafa.printed import DATA as MUSTAFA
from papers.mustafa.printed import example
from papers.okajima2023.printed import DATA as OKAJIMA
from papers.peet2019 import PAPER
from papers.peet2019.experiments.scaling import example_4
from papers.peet2019.printed import COLUMNS, DELAY_COUNTS, EXAMPLES, STATES
from papers.peet2019.printed import DATA as PEET
from papers.shao import printed as shao

IRREGULAR, SLOW, LATE, DUAL = (
    json.loads((Path(__file__).parent / f"{key}_second_reading.json").read_text(encoding="utf-8"))
    for key in ("mustafa", "okajima2023", "peet2019", "shao")
)
PRINTED, TEXT = LATE["printed"], LATE["text"]
NOT_READ = {
    "mustafa": {"constants", "steps", "step-against-large-grids", "lmi"},
    "okajima2023": {"common-period", "blog-idle-instants"},
}
"""What is printed in words, of which there is no second reading."""


def words(value: Any) -> Any:
    """Whole numbers as the text has them; of a schedule its matrices."""
    if isinstance(value, dict) and "diagonals" in value:
        return value["diagonals"]
    return str(value) if isinstance(value, int) else [words(one) for one in value] if isinstance(value, list) else value


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
    **{
        f"{key}: {name}": (words(ours.get(name)), second["printed"].get(name))
        for key, ours, second in (
            ("mustafa", MUSTAFA, IRREGULAR), ("okajima2023", OKAJIMA, SLOW), ("peet2019", PEET, LATE),
        )
        for name in sorted({*ours, *second["printed"]} - NOT_READ.get(key, set()))
    },
    **{f"shao: {name}": pair for name, pair in OF_SHAO.items()},
}  # fmt: skip
"""By what they are, the print as it is taken and as the other reader has it."""


@pytest.mark.parametrize("name", PAIRS)
def test_both_readers_have_the_same(name: str) -> None:
    ours, second = PAIRS[name]
    assert ours == second


def test_the_motor_of_the_nonuniform_paper() -> None:
    """The entries of A as printed formulas, evaluated with the printed constants, are those of the transcription."""
    text, printed = IRREGULAR["text"], IRREGULAR["printed"]
    assert text["K_T"] == text["K_q"]
    values = {name: float(printed[name]) for name in ("b", "J", "R_a", "L_a")}
    values |= dict.fromkeys(("K_T", "K_\\theta"), float(text["K_q"]))
    entries = []
    for entry in (entry for row in text["A of example 2"] for entry in row):
        over, under = entry.lstrip("-").split("/")
        entries.append((-1 if entry.startswith("-") else 1) * values[over] / values[under])
    assert [entry for row in example(2)["plant"]["A"] for entry in row] == pytest.approx(entries, rel=1e-15)


def test_trace_of_the_recovered_plant_is_the_sum_of_the_stated_poles() -> None:
    """A check of the reading by the physics: no slip of a digit in the stated poles would keep their sum at 3.2."""
    real, pair = SLOW["printed"]["poles"].strip("()").split(", ")
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
