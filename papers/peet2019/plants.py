"""The systems with delays of Peet and Gu (2019): Examples 1-3, the same with one disturbance, and three of our own."""

from collections.abc import Mapping
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import decimal, printed_matrix, zeros

OWN: dict[str, dict[str, Any]] = {
    "own-1": {
        "a0": "[-1 2; 0.5 -0.5]",
        "a": ("[-0.5 0.3; 0.4 -1]",),
        "delays": ("0.8",),
        "b": "[1 0; 0 1]",
        "c10": "[1 0]",
        "c2": "[1 1]",
        "c1": ("[0.3 0]",),
    },
    "own-2": {
        "a0": "[0.2 1; -1 -0.5]",
        "a": ("[0.3 0; 0.2 -0.4]", "[-0.6 0.2; 0.1 -0.3]"),
        "delays": ("0.4", "1.1"),
        "b": "[1 0; 0 1]",
        "c10": "[1 0; 0 0.5]",
        "c2": "[0.3 1]",
    },
    "own-3": {
        "a0": "[0 1; -1 0.1]",
        "a": ("[0 0; 0.2 -0.4]", "[-0.3 0.2; 0.1 -0.3]", "[0.2 0; 0.1 -0.1]"),
        "delays": ("0.3", "0.7", "1"),
        "b": "[1 0; 0 1]",
        "c10": "[1 0]",
        "c2": "[0 1]",
    },
}
"""Systems of ours in which the observer matters, since y sees every state; the paper prints none of them."""


def plants(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """`ex1`..`ex3`; `ex1-single`.. with B a column of ones; `own-1`..`own-3`.

    A0 (n, n), A one (n, n) and C1 one (p, n) per delay, delays, B (n, r), C10 (p, n), C2 (q, n).
    """
    systems: dict[str, dict[str, Any]] = {}
    for example in ("1", "2", "3"):
        printed = data[f"example-{example}"]
        count = len(printed["delays"])
        delayed = printed_matrix(printed["a"]) * fmpq(1, count)  # of the mean of the delayed states
        system = _system(printed, [delayed] * count)
        ones = fmpq_mat([[fmpq(1)]] * system["A0"].nrows())
        systems |= {f"ex{example}": system, f"ex{example}-single": {**system, "B": ones}}
    return systems | {name: _system(row, [printed_matrix(text) for text in row["a"]]) for name, row in OWN.items()}


def _system(numbers: Mapping[str, Any], delayed: list[fmpq_mat]) -> dict[str, Any]:
    output = printed_matrix(numbers["c10"])
    undelayed = [zeros(output.nrows(), output.ncols()) for _ in delayed]
    return {
        "A0": printed_matrix(numbers["a0"]),
        "A": delayed,
        "delays": [decimal(delay) for delay in numbers["delays"]],
        "B": printed_matrix(numbers["b"]),
        "C10": output,
        "C1": [printed_matrix(text) for text in numbers["c1"]] if "c1" in numbers else undelayed,
        "C2": printed_matrix(numbers["c2"]),
    }
