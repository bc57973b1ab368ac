"""H-infinity filters for nonuniformly sampled measurements: design, guarantees for every sampling sequence,
brackets."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.nonuniform.facade import analyse, design, simulate
    from replication.estimation.nonuniform.filters import Filter
    from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
    from replication.estimation.nonuniform.result import NonuniformResult
    from replication.estimation.nonuniform.stamped.facade import design_stamped
    from replication.estimation.nonuniform.stamped.kalman.noisy_plant import NoisyPlant
    from replication.estimation.nonuniform.stamped.kalman.running import StampedKalman
    from replication.estimation.nonuniform.stamped.result import StampedResult
    from replication.estimation.nonuniform.stamped.stamped_filter import StampedPlant
else:
    from replication.estimation.lazy import lazy

    __getattr__ = lazy(
        __name__,
        {
            "facade": "analyse design simulate",
            "filters": "Filter",
            "plant": "PeriodRange SampledPlant",
            "result": "NonuniformResult",
            "stamped.facade": "design_stamped",
            "stamped.kalman.noisy_plant": "NoisyPlant",
            "stamped.result": "StampedResult",
            "stamped.kalman.running": "StampedKalman",
            "stamped.stamped_filter": "StampedPlant",
        },
    )

__all__ = [
    "Filter",
    "NoisyPlant",
    "NonuniformResult",
    "PeriodRange",
    "SampledPlant",
    "StampedKalman",
    "StampedPlant",
    "StampedResult",
    "analyse",
    "design",
    "design_stamped",
    "simulate",
]
