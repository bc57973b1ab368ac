"""How far Table I moves, under its literal reading, while printed parameters move within their rounding."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from papers.shao import data
from papers.shao.method.motor import Feedforward, Motor, ReferenceTiming, tracking_command
from replication.audit.judge.perturb import Parameters, spread
from replication.estimation.dualrate.loop import close_loop
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import dual_rate_design
from replication.estimation.dualrate.tracking import tracking_error_ratio

PRINTS = {
    "resistance": data.RESISTANCE,
    "flux": data.FLUX,
    "inductance": data.INDUCTANCE,
    "friction": data.FRICTION,
    "inertia": data.INERTIA,
    "torque_constant": data.TORQUE_CONSTANT,
    "K": f"[{' '.join(data.FEEDBACK)}]",
    "L": f"[{'; '.join(data.INJECTION)}]",
    "T": data.PERIOD,
}
"""What Table I was computed from, as printed."""


def table(prints: Mapping[str, str], pole_pairs: int, ratio: int, cells: list[dict[str, Any]]) -> dict[str, Any]:
    """Percent errors of `cells` (observer, frequency, claim); prints: the motor's parameters, K, L and T."""

    def compute(numbers: Parameters) -> dict[str, float]:
        fields = ("resistance", "flux", "inductance", "friction", "inertia", "torque_constant")
        motor = Motor(pole_pairs=pole_pairs, **{name: numbers[name] for name in fields})
        design = dual_rate_design(
            motor.system(), feedback=numbers["K"], injection=numbers["L"], period=numbers["T"], ratio=ratio
        )
        held = Feedforward.PRINTED, ReferenceTiming.HELD
        return {
            cell["claim"]: 100
            * tracking_error_ratio(
                close_loop(
                    design,
                    OBSERVERS[cell["observer"]],
                    harmonic=tracking_command(motor, design, cell["frequency"], *held),
                )
            )
            for cell in cells
        }

    return spread(prints, compute)
