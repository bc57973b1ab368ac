"""H∞-optimal observers for systems with several state delays: synthesis by sums of squares, gains, closed loop."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.conic.sdpa import SdpaOptions
    from replication.estimation.delay.exact.limit import Limit, limit
    from replication.estimation.delay.facade import analyse, design, simulate
    from replication.estimation.delay.general.observer import DelayObserver, exact_gain, worst_gain
    from replication.estimation.delay.plant import DelayPlant, delay_system
    from replication.estimation.delay.result import DelayAnalysis, DelayResult
    from replication.estimation.delay.sos.certificate import LeastGain, minimum_gain
    from replication.estimation.delay.sos.cone import DegreeRule
else:
    from replication.estimation import lazy

    __getattr__ = lazy(__name__)

__all__ = [
    "DegreeRule", "DelayAnalysis", "DelayObserver", "DelayPlant", "DelayResult", "LeastGain", "Limit", "SdpaOptions",
    "analyse", "delay_system", "design", "exact_gain", "limit", "minimum_gain", "simulate", "worst_gain",
]  # fmt: skip
