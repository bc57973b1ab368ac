"""H-infinity filters for nonuniformly sampled measurements: design, guarantees for every sampling sequence,
brackets."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.nonuniform.facade import analyse, design, simulate
    from replication.estimation.nonuniform.filters import Filter
    from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
    from replication.estimation.nonuniform.result import NonuniformResult
else:
    from replication.estimation.lazy import lazy

    __getattr__ = lazy(
        __name__,
        {
            "facade": "analyse design simulate",
            "filters": "Filter",
            "plant": "PeriodRange SampledPlant",
            "result": "NonuniformResult",
        },
    )

__all__ = ["Filter", "NonuniformResult", "PeriodRange", "SampledPlant", "analyse", "design", "simulate"]
