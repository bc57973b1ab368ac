"""Which observers the paper designs: names of the experiments, and their inputs."""

from __future__ import annotations

from typing import Any

from papers.okajima2023 import data
from papers.okajima2023.experiments import design, norm_of_gains
from replication.audit.model import Experiment

KEY = "okajima2023"

LARGEST_PERIOD = 6
PERIOD_TABLE = tuple(f"{KEY}.period-table-{first}" for first in range(1, LARGEST_PERIOD + 1))
"""Names of the experiments that compute the optimum for all periods up to the largest, one for each N_1."""

CASES: dict[str, dict[str, Any]] = {
    "proposed": {"periods": [2, 3], "offsets": [0, 0], "sensors": [0, 1]},
    "A": {"periods": [2], "offsets": [0], "sensors": [0]},
    "B": {"periods": [3], "offsets": [0], "sensors": [1]},
    "C": {"periods": [6, 6], "offsets": [0, 0], "sensors": [0, 1]},
}
"""Sec. IV-A: the multi-rate observer, y_1 alone, y_2 alone, and both at their common period."""

GAIN_SETS = {
    "33": ([2, 3], [0, 0], data.GAINS_33),
    "38": ([3, 3], [0, 0], data.GAINS_38),
    "39": ([3, 3], [0, 1], data.GAINS_39),
    "40": ([3, 3], [0, 2], data.GAINS_40),
}
"""Printed gains of the stable plant by equation number: periods, offsets, gains."""

HALF_UNIT_OF_GAINS = 0.0005
"""Half a unit in the last printed place of the gains."""


def pair(periods: tuple[int, int], second_offset: int = 0) -> str:
    """Name of the experiment that designs the two-sensor observer for these periods and theta_2."""
    return f"{KEY}.design.{periods[0]}-{periods[1]}" + (f"-theta{second_offset}" if second_offset else "")


def case(name: str) -> str:
    """Name of the experiment that designs one of `CASES`."""
    return pair((2, 3)) if name == "proposed" else f"{KEY}.design.case-{name.lower()}"


def gain_set(equation: str) -> str:
    """Name of the experiment that evaluates the gains printed in an equation."""
    return f"{KEY}.gains.{equation}"


def experiments() -> tuple[Experiment, ...]:
    """The designs of Table 1, Cases A-C, the timing cases, and the printed gains."""
    both = {"sensors": [0, 1]}
    inputs: dict[str, dict[str, Any]] = {
        pair(periods): {"periods": list(periods), "offsets": [0, 0], **both} for periods in data.TABLE_1
    }
    inputs |= {pair((3, 3), theta): {"periods": [3, 3], "offsets": [0, theta], **both} for theta in (1, 2)}
    inputs |= {case(name): CASES[name] for name in ("A", "B", "C")}
    designs = [
        Experiment(name=name, function=design, inputs={"plant": data.plant(), **rest}) for name, rest in inputs.items()
    ]
    norms = [
        Experiment(
            name=gain_set(equation),
            function=norm_of_gains,
            inputs={
                "plant": data.plant(),
                "periods": periods,
                "offsets": offsets,
                "gains": data.gains(printed),
                "rounding": HALF_UNIT_OF_GAINS,
            },
        )
        for equation, (periods, offsets, printed) in GAIN_SETS.items()
    ]
    return (*designs, *norms)
