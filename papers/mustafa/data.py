"""What Mustafa, Chen and Fujioka print, as strings: the digits are the tolerance. Section VI unless said otherwise.

Periods and times are in seconds. The first plant is an academic example taken over from an earlier paper, the second a
DC motor; the unit printed for its inertia and the two names of its motor constant are not consistent (see the errata).
The text names neither year nor venue: its latest reference is of 2010.
"""

from __future__ import annotations

from math import pi
from typing import Any

from replication.audit.judge.printed import parse

Matrix = list[list[float]]

# Section VI-A.
A_1 = "[0 1; -16 -4.8]"
B_1 = "[0; 16]"
C_1 = "[1 0]"
D_1 = "0.1"
L_1 = "[1 0]"
H_L_1 = "0.01"
H_U_1_DIVISOR = "25"  # h_u = pi / 25
GAMMA_1 = "0.1017"
GAMMA_13 = {"type 1": "0.4647", "type 2": "0.4876"}

# Section VI-B: A = [-b/J, K_T/J; -K/L_a, -R_a/L_a].
MOTOR = {"b": "0.1", "J": "0.01", "K": "0.01", "R_a": "1", "L_a": "0.5"}
# Printed units of b and J as symbols with their powers, and those symbols in powers of (kg, m, s).
UNITS = {"b": {"N": 1, "m": 1, "s": 1}, "J": {"kg": 1, "m": 2, "s": -2}}
SI = {"kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2)}
B_2 = "[2; 2]"
C_2 = "[1 0]"
D_2 = "0"
L_2 = "[0 1]"
H_L_2 = "0.001"
H_U_2 = "0.099"
GAMMA_14 = "1.8174"
GAMMA_2 = "0.0952"
GRID_2 = "0.05"
A_F = "[-0.0440 0.0373; -1.0674 0.9048]"
A_F_FIRST_COLUMN = "[-0.0440; -1.0674]"
A_F_SECOND_COLUMN = "[0.0373; 0.9048]"
B_F = "[0.6505; 1.0666]"
C_F = "[0 1]"

PRINTED_1 = {"A": A_1, "B": B_1, "C": C_1, "D": D_1, "L": L_1, "h_l": H_L_1}
PRINTED_FILTER = {"A_f": A_F, "B_f": B_F, "C_f": C_F, "h": GRID_2}

# The disturbance of Figs. 2 and 3: w_k = 2 exp(-0.01 k) sin(0.02 pi k).
W_SIZE, W_DECAY, W_FREQUENCY = "2", "0.01", "0.02"

# Section VI: elements of the grid in both examples ("only one element"; a grid of one printed period).
GRID_SIZE = "1"

# Algorithm 1: what each step reads. The sentence before Sec. V says of one that it avoids numerical issues with
# a large grid.
STEPS = {1: ("grid", "N_0"), 2: ("grid", "(10)"), 3: ("grid", "(9)", "alpha"), 4: ("grid", "(9)", "root of alpha")}
STEP_AGAINST_LARGE_GRIDS = 2

# Theorem 3: eq. (10) is printed in two halves, columns 1-4 and columns 5-6; * stands for symmetry.
LMI_LEFT = (
    "-Z, -Z, 0, ZΦ",
    "*, -Y, 0, YΦ+FC+Q",
    "*, *, -I, L-G",
    "*, *, *, -Z",
    "*, *, *, *",
    "*, *, *, *",
)
LMI_RIGHT = ("ZΦ, ZΓ", "YΦ+FC, YΓ+FD", "L, 0", "-Z, 0", "-Z, 0", "-Y, 0", "*, -γ²I")


def matrix(printed: str) -> Matrix:
    """The numbers of a printed matrix, row by row; a single number is a 1 x 1 matrix."""
    parsed = parse(printed)
    values = [float(entry.value) for cell in parsed.cells for entry in cell]
    columns = parsed.shape[1] if parsed.shape else 1
    return [values[i : i + columns] for i in range(0, len(values), columns)]


def upper_end(printed: str) -> float:
    """The largest number that rounds to a printed one."""
    (entry,) = parse(printed).entries
    return float(entry.value + entry.unit / 2)


def dimension(unit: dict[str, int]) -> tuple[int, ...]:
    """Powers of (kg, m, s) of a unit."""
    return tuple(sum(power * SI[symbol][i] for symbol, power in unit.items()) for i in range(3))


def example_1() -> dict[str, Any]:
    """Plant and range of sampling periods of Example 1 as numbers."""
    plant = {name: matrix(text) for name, text in zip("ABCDL", (A_1, B_1, C_1, D_1, L_1), strict=True)}
    return {"plant": plant, "periods": [float(H_L_1), pi / float(H_U_1_DIVISOR)]}


def example_2() -> dict[str, Any]:
    """Plant and range of sampling periods of Example 2 as numbers, K_T = K_q = K_theta."""
    b, J, K, R_a, L_a = (float(MOTOR[name]) for name in ("b", "J", "K", "R_a", "L_a"))
    A = [[-b / J, K / J], [-K / L_a, -R_a / L_a]]
    rest = {name: matrix(text) for name, text in zip("BCDL", (B_2, C_2, D_2, L_2), strict=True)}
    return {"plant": {"A": A, **rest}, "periods": [float(H_L_2), float(H_U_2)]}


def printed_filter() -> dict[str, Matrix]:
    """The filter of Example 2 as printed."""
    return {"A": matrix(A_F), "B": matrix(B_F), "C": matrix(C_F)}
