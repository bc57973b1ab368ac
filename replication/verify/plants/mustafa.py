"""The plants of Mustafa, Chen and Fujioka, Sec. VI, with their ranges of sampling periods; and the printed filter.

A time is a pair (a, b) that stands for a + b pi seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.decimals import decimal, printed_matrix


def plants(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """`example-1`, `example-2`, and `printed-filter`: the second one with the filter that is printed for it."""
    return {
        "example-1": {**_matrices(data, 1, printed_matrix(data["A_1"])), **_range_1(data)},
        "example-2": _second(data),
        "printed-filter": {
            **_second(data),
            "filter": {name: printed_matrix(data[f"{name}_F"]) for name in "ABC"},
        },
    }


def _matrices(data: Mapping[str, Any], example: int, A: fmpq_mat) -> dict[str, fmpq_mat]:
    direct = fmpq_mat([[decimal(data[f"D_{example}"])]])
    return {"A": A, "D": direct, **{name: printed_matrix(data[f"{name}_{example}"]) for name in "BCL"}}


def _range_1(data: Mapping[str, Any]) -> dict[str, list[fmpq]]:
    """h_u is pi over a printed number."""
    return {"h_l": [decimal(data["H_L_1"]), fmpq(0)], "h_u": [fmpq(0), 1 / decimal(data["H_U_1_DIVISOR"])]}


def _second(data: Mapping[str, Any]) -> dict[str, Any]:
    """The motor, A = [-b/J, K/J; -K/L_a, -R_a/L_a]."""
    b, J, K, R_a, L_a = (decimal(data["MOTOR"][name]) for name in ("b", "J", "K", "R_a", "L_a"))
    A = fmpq_mat([[-b / J, K / J], [-K / L_a, -R_a / L_a]])
    ends = {"h_l": [decimal(data["H_L_2"]), fmpq(0)], "h_u": [decimal(data["H_U_2"]), fmpq(0)]}
    return {**_matrices(data, 2, A), **ends}
