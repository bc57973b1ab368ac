"""What Peet and Gu print, from the file beside, the plants as numbers, and what is tried where the text is open."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from papers.peet2019.plants import OWN
from replication.audit.data import PrintedValue, read_printed
from replication.audit.judge.printed import number

DATA = read_printed(Path(__file__).with_suffix(".toml"))
COLUMNS = tuple(DATA["gamma-1"])
"""Columns of the tables below Examples 1-3: degrees as d1, d2, d3, and pade."""
DEGREES = tuple(int(column[1:]) for column in COLUMNS if column != "pade")
STATES = tuple(DATA["states"])
DELAY_COUNTS = tuple(map(int, DATA["table-1"]))


def seconds(states: int, delays: int) -> PrintedValue:
    """The entry of Table I for these numbers of states and delays; "N/A" for the largest."""
    text = DATA["table-1"][str(delays)][STATES.index(states)]
    return PrintedValue(text, f"Table I, n = {states}, K = {delays}", text.unit, text.note)


def published() -> list[tuple[int, int, PrintedValue]]:
    """(n, K, seconds) of every cell of Table I that holds a number, row by row."""
    cells = [(n, k, seconds(n, k)) for k in DELAY_COUNTS for n in STATES]
    return [cell for cell in cells if cell[2] != "N/A"]


def plant(printed: Mapping[str, Any]) -> dict[str, Any]:
    """A plant in numbers. Where `a` is one matrix, it is that of the mean of the delayed states."""
    numbers: dict[str, Any] = number(printed)
    if isinstance(printed["a"], str):
        count = len(numbers["delays"])
        numbers["a"] = [[[entry / count for entry in row] for row in numbers["a"]]] * count
    return numbers


EXAMPLES = {name: plant(DATA[f"example-{name}"]) for name in ("1", "2", "3")}
OWN_SYSTEMS = {name: plant(numbers) for name, numbers in OWN.items()}

# The numbers of the readings of told.toml.

JORDAN = {"jordan-negative": -1.0, "jordan-zero": 0.0, "jordan-one": 1.0, "jordan-large": 8.0}
"""Eigenvalues of the Jordan block of Example 4 that are tried."""
ACCURATE = {"lumps-1-percent": 0.01, "lumps-10-percent": 0.1}
"""Relative errors of the H∞ norm that count as accurate."""
SAME = {"cost-factor-1.5": 1.5, "cost-factor-2": 2.0}
"""Printed seconds whose ratio is below this count as approximately the same."""
MEMORY, DAY = 16.0, 86400.0
"""A desktop computer: memory in GB, and seconds that a run may take."""
