"""The states of a periodic Riccati recursion at all phases at once, from zero: fast, and checked by its user.

As `riccati.settled`, but only for what dies out: its limit is then the stabilising solution.
"""

from __future__ import annotations

import numpy as np

from replication.estimation.linear.riccati import STAGNATION, RiccatiMap, compose, down, symmetric, tree
from replication.estimation.validation import Array

DOUBLINGS, SETTLED = 30, 1e-6
"""A motion that has not died out to this share after so many doublings, a thousand million periods, counts as never."""


def from_zero(stages: RiccatiMap) -> Array | None:
    """The states (N, n, n) of the recursion with `stages` (N, n, n) that began with X = 0 long ago, or None.

    None if it does not settle, or if its own motion does not die out: its limit need not be the stabilising solution
    then.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            levels = tree(stages)
            X = _doubled(RiccatiMap(*(part[0] for part in levels[-1])))
            if X is None:
                return None
            states = down(levels, X)
        except np.linalg.LinAlgError:
            return None
    return states if np.all(np.isfinite(states)) else None


def _doubled(period: RiccatiMap) -> Array | None:
    for _ in range(DOUBLINGS):
        before, period = period.H, compose(period, period)
        size = np.abs(period.H).max()
        if not np.isfinite(size):
            return None
        if np.abs(period.H - before).max() <= STAGNATION * size and np.abs(period.A).max() <= SETTLED:
            return symmetric(period.H)
    return None
