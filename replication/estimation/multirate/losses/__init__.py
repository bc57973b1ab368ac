"""Lost samples: levels under losses in a row, mean errors under random losses, and gains that know what came."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.multirate.losses.facade import analyse, design, simulate
    from replication.estimation.multirate.losses.models import InARow, Independent, Markov
    from replication.estimation.multirate.losses.result import LossResult
else:
    from replication.estimation.lazy import lazy

    __getattr__ = lazy(
        __name__,
        {"facade": "analyse design simulate", "models": "InARow Independent Markov", "result": "LossResult"},
    )

__all__ = ["InARow", "Independent", "LossResult", "Markov", "analyse", "design", "simulate"]
