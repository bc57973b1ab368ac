"""The plants of Okajima, Hosoe and Hagiwara (2023), Sec. IV, alone and with the gains that the paper prints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from replication.verify.algebra.decimals import half_unit, printed_matrix, printed_poles
from replication.verify.algebra.linear import identity


def plants(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The plant of Sec. IV-A; `gains-NN`, with the gains L_k of eq. (NN), one matrix per phase; and Sec. IV-C.

    `section-4c` has the A of eq. (41), the C of Sec. IV-A, the gains (42), and the poles stated there: those of A as
    real and imaginary part, one of each pair, with half a unit in their last place.
    """
    stable = {name: printed_matrix(data[key]) for name, key in {"A": "A", "B_d": "B_D", "C": "C", "D": "D"}.items()}
    stable["W"] = identity(3)
    return {
        "stable": stable,
        **{f"gains-{equation}": {**stable, "L": _gains(data, equation)} for equation in ("33", "38", "39", "40")},
        "section-4c": {
            "A": printed_matrix(data["A_41"]),
            "C": stable["C"],
            "L": _gains(data, "42"),
            "poles": printed_poles(data["POLES_A"]),
            "half_unit": half_unit(data["POLES_A"]),
            "error_poles": [real for real, _ in printed_poles(data["POLES_A_E"])],
        },
    }


def _gains(data: Mapping[str, Any], equation: str) -> list[Any]:
    return [printed_matrix(text) for text in data[f"GAINS_{equation}"]]
