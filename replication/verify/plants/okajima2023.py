"""The plants of Okajima, Hosoe and Hagiwara (2023), Sec. IV, alone and with the gains that the paper prints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from replication.verify.linear import identity
from replication.verify.printed import printed_matrix


def plants(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The plant of Sec. IV-A; and `gains-NN`, with the gains L_k of eq. (NN), one matrix per phase."""
    stable = {name: printed_matrix(data[key]) for name, key in {"A": "A", "B_d": "B_D", "C": "C", "D": "D"}.items()}
    stable["W"] = identity(3)
    return {
        "stable": stable,
        **{
            f"gains-{equation}": {**stable, "L": [printed_matrix(text) for text in data[f"GAINS_{equation}"]]}
            for equation in ("33", "38", "39", "40")
        },
    }
