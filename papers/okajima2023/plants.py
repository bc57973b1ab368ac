"""The plants of Sec. IV in exact numbers, alone and with the gains that the paper prints, for the verifier."""

from collections.abc import Mapping
from typing import Any

from replication.verify.algebra.linear import half_unit, identity, printed_matrix, printed_poles


def plants(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The plant of Sec. IV-A; `gains-NN`, with the gains L_k of eq. (NN), one matrix per phase; and Sec. IV-C.

    `section-4c` has the A of eq. (41), the C of Sec. IV-A, the gains (42), and the poles stated there: those of A as
    real and imaginary part, one of each pair, with half a unit in their last place. data: the values of printed.toml.
    """
    stable = {name: printed_matrix(data["plant"][name]) for name in ("A", "B_d", "C", "D")}
    stable["W"] = identity(3)
    gains = {equation: [printed_matrix(text) for text in printed] for equation, printed in data["gains"].items()}
    return {
        "stable": stable,
        **{f"gains-{equation}": {**stable, "L": gains[equation]} for equation in ("33", "38", "39", "40")},
        "section-4c": {
            "A": printed_matrix(data["unstable-A"]),
            "C": stable["C"],
            "L": gains["42"],
            "poles": printed_poles(data["poles"]),
            "half_unit": half_unit(data["poles"]),
            "error_poles": [real for real, _ in printed_poles(data["error-poles"])],
        },
    }
