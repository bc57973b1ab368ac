"""What Okajima, Hosoe and Hagiwara (IEEE Access 11, 2023) print, as strings: the digits are the tolerance.

Places refer to the paper; the author's blog post of 2026-03-04 repeats most levels. The values are of this example
only: no physical plant stands behind them, and no unit is printed.
"""

from __future__ import annotations

from replication.audit.judge.printed import parse

# Section IV-A, before eq. (33): the plant; W is the identity.
A = "[0.95 0.5 0.2; -0.1 0.9 -0.2; 0 0.1 0.85]"
B_D = "[0.1; 0.3; 0.2]"
C = "[1 0.5 0; 1 2.5 0.2]"
D = "[1 0; 0 0.5]"

# Optimal levels: Sec. IV-A for the proposed observer and the three dual-rate ones, Table 1, Sec. IV-B.
GAMMA_PROPOSED = "1.33"
GAMMA_CASES = {"A": "1.67", "B": "1.68", "C": "2.10"}
TABLE_1 = {
    (1, 1): "1.00",
    (1, 2): "1.10",
    (1, 3): "1.13",
    (2, 1): "1.14",
    (3, 1): "1.19",
    (3, 2): "1.36",
    (2, 3): "1.33",
    (3, 3): "1.43",
}
GAMMA_TIMING = {0: "1.43", 1: "1.41", 2: "1.42"}  # by theta_2; Cases 1, 2, 3

# Section IV-A: size of the matrix inequality.
DECISION_VARIABLES = "73"
BLOCK_SIZE = "9"

# Gains L_k = P_k^-1 Y_k, one matrix per phase.
_ZERO = "[0 0; 0 0; 0 0]"
GAINS_33 = (
    "[0.228 0.294; -0.125 0.267; 0.084 0.110]",
    _ZERO,
    "[0.356 0; 0.099 0; 0.160 0]",
    "[0 0.341; 0 0.245; 0 0.128]",
    "[0.227 0; -0.065 0; 0.101 0]",
    _ZERO,
)
GAINS_38 = ("[0.276 0.248; -0.166 0.307; 0.113 0.076]", _ZERO, _ZERO)
GAINS_39 = ("[0.348 0; 0.083 0; 0.155 0]", "[0 0.315; 0 0.265; 0 0.111]", _ZERO)
GAINS_40 = ("[0.246 0; -0.099 0; 0.111 0]", _ZERO, "[0 0.342; 0 0.248; 0 0.119]")
GAINS_42 = (
    "[-0.943 1.424; 2.944 -1.887; -2.058 2.086]",
    _ZERO,
    "[0.142 0; 1.490 0; -0.458 0]",
    "[0 0.257; 0 0.964; 0 0.110]",
    "[-0.421 0; 2.291 0; -1.170 0]",
    _ZERO,
)

# Section IV-A: the simulation, and eq. (34) with its four values.
SIGMA = "0.2"
LAST_NOISE = 500
LAST_SUMMED = 600
G_SIM = {"proposed": "0.428", "A": "0.735", "B": "0.463", "C": "0.594"}

# Section IV-C: eq. (41) repeats A; the poles that the text states for it, and those of A_e with the gains (42).
A_41 = A
POLES_A = "(1.031, 1.085±0.240i)"
POLES_A_E = "(0.1270, -0.0000, -0.0002)"

# Eqs. (7)-(8), (11)-(12), the unnumbered S_k of Sec. IV-A, and Cases 1-3 of Sec. IV-B: diagonals (s_1, s_2) by phase.
SELECTION = {
    "eqs-7-8": ((3, 6), (0, 0), ("11", "00", "00", "10", "00", "00")),
    "eqs-11-12": ((3, 6), (0, 1), ("10", "01", "00", "10", "00", "00")),
    "sec-4a": ((2, 3), (0, 0), ("11", "00", "10", "01", "10", "00")),
    "case-1": ((3, 3), (0, 0), ("11", "00", "00")),
    "case-2": ((3, 3), (0, 1), ("10", "01", "00")),
    "case-3": ((3, 3), (0, 2), ("10", "00", "01")),
}


def matrix(printed: str) -> list[list[float]]:
    """The numbers of a printed matrix, row by row."""
    parsed = parse(printed)
    rows, columns = parsed.shape
    values = [float(entry.value) for entry in parsed.entries]
    return [values[i * columns : (i + 1) * columns] for i in range(rows)]


def gains(printed: tuple[str, ...]) -> list[list[list[float]]]:
    """The numbers of printed gains: phase, state, sensor."""
    return [matrix(text) for text in printed]


def plant() -> dict[str, list[list[float]]]:
    """The plant of Sec. IV-A as inputs of an experiment."""
    return {"A": matrix(A), "B_d": matrix(B_D), "C": matrix(C), "D": matrix(D)}


def printed_plant() -> dict[str, str]:
    """The plant of Sec. IV-A as printed."""
    return {"A": A, "B_d": B_D, "C": C, "D": D}


def bracketed(rows: list[list[float]]) -> str:
    """A computed matrix of few digits, written as the printed ones are."""
    return "[" + "; ".join(" ".join(f"{entry:g}" for entry in row) for row in rows) + "]"


def selection_matrix(diagonals: tuple[str, ...]) -> str:
    """The printed S_k of one example, stacked: one row of all diagonals per phase, as a printed matrix."""
    return "[" + "; ".join(" ".join(row) for row in diagonals) + "]"
