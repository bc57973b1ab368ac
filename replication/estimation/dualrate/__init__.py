"""Dual-rate output feedback: fast input, slow sensor; observers, exact analysis and simulation, readings of a text."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.dualrate.facade import analyse, compare, design, simulate
    from replication.estimation.dualrate.observers import OBSERVERS
    from replication.estimation.dualrate.problem import make_plant
    from replication.estimation.dualrate.result import DualRateResult
    from replication.estimation.dualrate.slow.result import SlowRateResult
else:
    from replication.estimation import lazy

    __getattr__ = lazy(__name__)

__all__ = [
    "OBSERVERS", "DualRateResult", "SlowRateResult", "analyse", "compare", "design", "make_plant", "simulate",
]  # fmt: skip
