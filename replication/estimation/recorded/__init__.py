"""Recorded data: replay a filter over a log, and fit the noise of a plant to it.

`replay(observer, log)` judges a filter by its innovations; `fit(plant, log)` estimates variances, biases and latencies.
"""

from replication.estimation.recorded.fitting import Fit, fit
from replication.estimation.recorded.replaying import Replay, replay

__all__ = ["Fit", "Replay", "fit", "replay"]
