"""The motor of Shao et al. with its printed gains and rates, and the scalar loop that refutes their Sec. IV."""

from collections.abc import Mapping
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import decimal

LONGER = (1005, 1006)
"""Ratios M between which the restarted predictor's loop turns unstable at the period of `scalar`."""
PARAMETERS = {
    "R": "resistance",
    "Psi": "flux",
    "Lq": "inductance",
    "p": "pole_pairs",
    "Bw": "friction",
    "J": "inertia",
    "KT": "torque_constant",
}
"""Symbols of the manuscript for the names of the printed data."""


def plants(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """`parameters`: the motor's, with its A, B, C. `motor`: the loop of Sec. V. `scalar`: a loop of ours;
    `scalar-M`: at other ratios.

    A loop has A, B, C of eq. (1), K of (8), L of (3), the fast period T in s and the ratio M of the rates;
    `motor-from-start` has x(0) too.
    """
    motor = {symbol: decimal(data[name]) for symbol, name in PARAMETERS.items()}
    R, Psi, Lq, p, Bw, J, KT = motor.values()
    last = [fmpq(0), -(R * Bw + KT * p * Psi) / (J * Lq), -R / Lq - Bw / J]
    loop = {
        "A": fmpq_mat([[0, 1, 0], [0, 0, 1], last]),
        "B": fmpq_mat([[0], [0], [KT / (J * Lq)]]),
        "C": fmpq_mat([[1, 0, 0]]),
        "K": fmpq_mat([[decimal(entry) for entry in data["feedback"]]]),
        "L": fmpq_mat([[decimal(entry)] for entry in data["injection"]]),
        "T": decimal(data["period"]),
        "M": decimal(data["ratio"]),
    }
    unit = fmpq_mat([[1]])
    scalar = {"A": unit, "B": unit, "C": unit, "K": -2 * unit, "L": 2 * unit, "T": fmpq(1, 1000), "M": fmpq(5)}
    return {
        "parameters": {**motor, **{name: loop[name] for name in "ABC"}},
        "motor": loop,
        "motor-from-start": {**loop, "start": fmpq_mat([[decimal(entry)] for entry in data["start"]])},
        "scalar": scalar,
        **{f"scalar-{ratio}": {**scalar, "M": fmpq(ratio)} for ratio in LONGER},
    }
