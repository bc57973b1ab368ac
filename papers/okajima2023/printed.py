"""What the multi-rate paper prints: the strings of printed.toml, and the numbers that computations start from."""

from replication.audit.data import read_printed
from replication.audit.judge.numerals import layout
from replication.audit.judge.printed import number, parse

Matrix = list[list[float]]


def poles(printed: str) -> Matrix:
    """Printed poles as (real, imaginary); one of each conjugate pair."""
    return [[float(entry.value) for entry in cell] + [0.0] * (2 - len(cell)) for cell in parse(printed).cells]


def bracketed(rows: Matrix) -> str:
    """A computed matrix of few digits, written as the printed ones are."""
    return layout(tuple(map(tuple, rows)), "{:g}".format)


DATA = read_printed(__file__)
PRINTED_PLANT = {name: DATA["plant"][name] for name in ("A", "B_d", "C", "D")}
PLANT = number(PRINTED_PLANT)
GAINS = number(DATA["gains"])
"""Printed gains by equation: phase, state, sensor."""
TABLE_1 = {tuple(map(int, column.split(","))): printed for column, printed in DATA["table-1"].items()}
"""Optimal levels by periods (N_1, N_2)."""
SCHEDULES = {name.removeprefix("schedule-"): sensing for name, sensing in DATA.items() if name.startswith("schedule-")}
"""Periods, offsets and diagonals of S_k of each example."""
