"""H∞-optimal observers for systems with several state delays: synthesis by sums of squares, gains, closed loop."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.conic.sdpa import SdpaOptions
    from replication.estimation.delay.exact.limit import Limit, limit
    from replication.estimation.delay.exact.loop import exact_gain, worst_gain
    from replication.estimation.delay.facade import analyse, design, simulate
    from replication.estimation.delay.general.lines import DelayObserver
    from replication.estimation.delay.general.plant import DelayPlant
    from replication.estimation.delay.general.result import InnovationsResult
    from replication.estimation.delay.result import DelayAnalysis, DelayResult
    from replication.estimation.delay.sos.certificate import LeastGain, minimum_gain
    from replication.estimation.delay.sos.cone import DegreeRule
    from replication.estimation.delay.system import delay_system
else:
    from replication.estimation.lazy import lazy

    __getattr__ = lazy(
        __name__,
        {
            ".conic.sdpa": "SdpaOptions",
            "exact.limit": "Limit limit",
            "exact.loop": "exact_gain worst_gain",
            "facade": "analyse design simulate",
            "general.lines": "DelayObserver",
            "general.plant": "DelayPlant",
            "general.result": "InnovationsResult",
            "result": "DelayAnalysis DelayResult",
            "sos.certificate": "LeastGain minimum_gain",
            "sos.cone": "DegreeRule",
            "system": "delay_system",
        },
    )

__all__ = [
    "DegreeRule",
    "DelayAnalysis",
    "DelayObserver",
    "DelayPlant",
    "DelayResult",
    "InnovationsResult",
    "LeastGain",
    "Limit",
    "SdpaOptions",
    "analyse",
    "delay_system",
    "design",
    "exact_gain",
    "limit",
    "minimum_gain",
    "simulate",
    "worst_gain",
]
