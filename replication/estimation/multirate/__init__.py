"""Multi-rate observers: periodically time-varying gains for sensors with different periods (Okajima et al., 2023)."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.multirate.facade import analyse, design, simulate
    from replication.estimation.multirate.latency import ContinuousPlant
    from replication.estimation.multirate.optimum import search_timing
    from replication.estimation.multirate.plant import MultiratePlant
    from replication.estimation.multirate.result import KalmanResult, MultirateResult
    from replication.estimation.nonuniform.stamped.extended import ExtendedFilter
else:
    from replication.estimation import lazy

    __getattr__ = lazy(__name__)

__all__ = [
    "ContinuousPlant", "ExtendedFilter", "KalmanResult", "MultiratePlant", "MultirateResult", "analyse", "design",
    "search_timing", "simulate",
]  # fmt: skip
