"""What Mustafa, Chen and Fujioka print, as strings and as the numbers that the computations take; times in seconds.

The first plant is an academic example taken over from an earlier paper, the second a DC motor; the unit printed for its
inertia and the two names of its motor constant are not consistent (see the errata).
"""

from math import pi
from pathlib import Path
from typing import Any

from replication.audit.data import read_printed
from replication.audit.judge.printed import number, parse

Matrix = list[list[float]]

DATA = read_printed(Path(__file__).with_suffix(".toml"))
EXAMPLES = (1, 2)
GAMMA = {e: DATA[f"gamma-{e}"] for e in EXAMPLES}
"""The levels of both examples."""


def upper_end(printed: str) -> float:
    """The largest number that rounds to a printed one."""
    (entry,) = parse(printed).entries
    return float(entry.value + entry.unit / 2)


def example(e: int) -> dict[str, Any]:
    """Plant and range of sampling periods of Example 1 or 2 as numbers, the latter with K_T = K_q = K_theta."""
    plant = number(DATA[f"example-{e}"])
    plant["D"] = [[plant["D"]]]
    h_l = float(DATA[f"h_l-{e}"])
    if e == 1:
        return {"plant": plant, "periods": [h_l, pi / float(DATA["h_u-1-divisor"])]}
    b, J, K, R_a, L_a = (float(DATA[name]) for name in ("b", "J", "K", "R_a", "L_a"))
    A = [[-b / J, K / J], [-K / L_a, -R_a / L_a]]
    return {"plant": {"A": A, **plant}, "periods": [h_l, float(DATA["h_u-2"])]}


def middle(e: int) -> float:
    """The middle of the range of sampling periods of an example (s)."""
    h_l, h_u = example(e)["periods"]
    return float(h_l + h_u) / 2


def printed_filter() -> dict[str, Matrix]:
    """The filter of Example 2 as printed."""
    return {name: number(DATA["filter"][f"{name}_f"]) for name in "ABC"}


def sizes() -> tuple[tuple[int, int], tuple[int, int]]:
    """(n, r) of Example 2, and the size of its printed B_f = -Y^-1 F, which is that of F."""
    filter_ = printed_filter()
    return (len(filter_["A"]), len(number(DATA["example-2"]["C"]))), (len(filter_["B"]), len(filter_["B"][0]))
