"""H-infinity filters for nonuniformly sampled measurements: design, guarantees for every sampling sequence,
brackets."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.nonuniform.facade import analyse, design, design_stamped, simulate
    from replication.estimation.nonuniform.filters import Filter
    from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
    from replication.estimation.nonuniform.result import NonuniformResult, StampedResult
    from replication.estimation.nonuniform.stamped.design import StampedPlant
    from replication.estimation.nonuniform.stamped.extended import ExtendedKalman, NonlinearPlant
    from replication.estimation.nonuniform.stamped.kalman import NoisyPlant
    from replication.estimation.nonuniform.stamped.running import StampedKalman
else:
    from replication.estimation import lazy

    __getattr__ = lazy(__name__)

__all__ = [
    "ExtendedKalman", "Filter", "NoisyPlant", "NonlinearPlant", "NonuniformResult", "PeriodRange", "SampledPlant",
    "StampedKalman", "StampedPlant", "StampedResult", "analyse", "design", "design_stamped", "simulate",
]  # fmt: skip
