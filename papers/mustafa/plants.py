"""The plants of Sec. VI in exact numbers, with their ranges of sampling periods; and the printed filter.

A time is a pair (a, b) that stands for a + b pi seconds.
"""

from collections.abc import Mapping
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import decimal, printed_matrix

OUR_FILTER = {
    "A": fmpq_mat([[fmpq(-555129, 2**24), fmpq(959481, 2**24)], [fmpq(-6722817, 2**24), fmpq(5809691, 2**23)]]),
    "B": fmpq_mat([[fmpq(16780017, 2**24)], [fmpq(-4314437, 2**23)]]),
    "C": fmpq_mat([[1, 0]]),
}
"""Our filter next to the nominal optimum of the first example, which prints none; rounded to 24 bits."""


def plants(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """`example-1`, `example-2`; `our-filter`, `printed-filter`: each with a filter, ours and the one that is printed.

    h_u of the first is pi over a printed number; A of the second is [-b/J, K/J; -K/L_a, -R_a/L_a].
    """
    b, J, K, R_a, L_a = (decimal(data[name]) for name in ("b", "J", "K", "R_a", "L_a"))
    first, second = _matrices(data["example-1"]), _matrices(data["example-2"])
    first |= {"h_l": [decimal(data["h_l-1"]), fmpq(0)], "h_u": [fmpq(0), 1 / decimal(data["h_u-1-divisor"])]}
    second |= {"A": fmpq_mat([[-b / J, K / J], [-K / L_a, -R_a / L_a]])}
    second |= {end: [decimal(data[f"{end}-2"]), fmpq(0)] for end in ("h_l", "h_u")}
    filter_ = {name: printed_matrix(data["filter"][f"{name}_f"]) for name in "ABC"}
    filtered = {"our-filter": {**first, "filter": OUR_FILTER}, "printed-filter": {**second, "filter": filter_}}
    return {"example-1": first, "example-2": second, **filtered}


def _matrices(printed: Mapping[str, str]) -> dict[str, Any]:
    """The printed matrices by name; D is printed as a number."""
    return {
        name: fmpq_mat([[decimal(text)]]) if name == "D" else printed_matrix(text) for name, text in printed.items()
    }
