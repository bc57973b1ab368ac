"""The systems with delays of Peet and Gu (2019): Examples 1-3, the same with one disturbance, and three of our own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import zeros


def plants(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """`ex1`..`ex3`; `ex1-single`.. with B a column of ones; `own-1`..`own-3`.

    A0 (n, n), A one (n, n) and C1 one (p, n) per delay, delays, B (n, r), C10 (p, n), C2 (q, n).
    """
    found: dict[str, dict[str, Any]] = {}
    for example, printed in data["EXAMPLES"].items():
        system = _system(printed)
        found[f"ex{example}"] = system
        found[f"ex{example}-single"] = {**system, "B": fmpq_mat([[fmpq(1)] for _ in printed["a0"]])}
    return found | {name: _system(printed) for name, printed in data["OWN_SYSTEMS"].items()}


def _system(printed: Mapping[str, Any]) -> dict[str, Any]:
    output = fmpq_mat(printed["c10"])
    undelayed = [zeros(output.nrows(), output.ncols()) for _ in printed["a"]]
    return {
        "A0": fmpq_mat(printed["a0"]),
        "A": [fmpq_mat(matrix) for matrix in printed["a"]],
        "delays": list(printed["delays"]),
        "B": fmpq_mat(printed["b"]),
        "C10": output,
        "C1": [fmpq_mat(matrix) for matrix in printed["c1"]] if "c1" in printed else undelayed,
        "C2": fmpq_mat(printed["c2"]),
    }
