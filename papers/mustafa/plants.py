"""The plants of Sec. VI in exact numbers, with their ranges of sampling periods; and the printed filter.

A time is a pair (a, b) that stands for a + b pi seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.decimals import decimal, printed_matrix


def plants(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """`example-1`, `example-2`, and `printed-filter`: the second one with the filter that is printed for it.

    h_u of the first is pi over a printed number; A of the second is [-b/J, K/J; -K/L_a, -R_a/L_a].
    """
    b, J, K, R_a, L_a = (decimal(data[name]) for name in ("b", "J", "K", "R_a", "L_a"))
    first, second = _matrices(data["example-1"]), _matrices(data["example-2"])
    first |= {"h_l": [decimal(data["h_l-1"]), fmpq(0)], "h_u": [fmpq(0), 1 / decimal(data["h_u-1-divisor"])]}
    second |= {"A": fmpq_mat([[-b / J, K / J], [-K / L_a, -R_a / L_a]])}
    second |= {end: [decimal(data[f"{end}-2"]), fmpq(0)] for end in ("h_l", "h_u")}
    filter_ = {name: printed_matrix(data["filter"][f"{name}_f"]) for name in "ABC"}
    return {"example-1": first, "example-2": second, "printed-filter": {**second, "filter": filter_}}


def _matrices(printed: Mapping[str, str]) -> dict[str, Any]:
    """The printed matrices by name; D is printed as a number."""
    return {
        name: fmpq_mat([[decimal(text)]]) if name == "D" else printed_matrix(text) for name, text in printed.items()
    }
