"""Lost samples: levels under losses in a row, mean errors under random losses, and gains that know what came."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.multirate.losses.facade import LossResult, analyse, design, simulate
    from replication.estimation.multirate.losses.models import InARow, Independent, Markov
else:
    from replication.estimation import lazy

    __getattr__ = lazy(__name__)

__all__ = ["InARow", "Independent", "LossResult", "Markov", "analyse", "design", "simulate"]
