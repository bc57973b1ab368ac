"""Algorithm 1: a grid of sampling periods whose small-gain intervals cover [h_l, h_u], literal and corrected.

Neither (9) nor alpha involves the filter, so the grid is found first; `filter_lmi.design_for_periods` is step 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from papers.mustafa.method.stability import Interval, UpperEnd, covered_interval, small_gain_alpha
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.validation import positive_integer

TOUCH = 1e-12
"""Gaps shorter than this, in seconds, are closed by a common end point."""


class End(StrEnum):
    """How the algorithm ended; the text is the advice."""

    COVERED = "the intervals cover [h_l, h_u]"
    STALLED = "step 4 adds nothing although step 3 fails: this reading of the algorithm cannot end"
    LIMIT = "the grid has reached the limit N_0 of step 1: no filter"


@dataclass(frozen=True)
class Reading:
    """How to read Algorithm 1. upper: case U3 of (9); root: sqrt(alpha) in step 4; union: no set-minus in step 4."""

    upper: UpperEnd
    root: bool
    union: bool

    @property
    def name(self) -> str:
        """The three choices in words, such as `corrected, alpha, set-minus`."""
        chosen = ("root" if self.root else "alpha", "union" if self.union else "set-minus")
        return ", ".join((self.upper.name.lower(), *chosen))


AS_PRINTED = Reading(UpperEnd.PRINTED, root=True, union=True)
WITH_SET_MINUS = Reading(UpperEnd.PRINTED, root=True, union=False)
CORRECT = Reading(UpperEnd.CORRECTED, root=False, union=False)


@dataclass(frozen=True)
class Grid:
    """periods: the grid, increasing (s); alphas: alpha_i; intervals: H(h_i, alpha_i); rounds: passes of steps 1-4."""

    periods: tuple[float, ...]
    alphas: tuple[float, ...]
    intervals: tuple[Interval, ...]
    end: End
    rounds: int


def build_grid(plant: SampledPlant, periods: PeriodRange, reading: Reading = CORRECT, *, limit: int = 64) -> Grid:
    """Steps 0, 1, 3 and 4 of Algorithm 1; ends when covered, when step 4 leaves the grid as it is, or at `limit` =
    N_0."""
    bound = positive_integer("limit", limit)
    grid = {periods.middle}
    alphas: dict[float, float] = {}
    rounds = 0
    while True:
        rounds += 1
        ordered = sorted(grid)
        alphas |= {h: small_gain_alpha(plant, h) for h in ordered if h not in alphas}
        covered = [covered_interval(plant, h, alphas[h], reading.upper) for h in ordered]
        if len(grid) >= bound:
            end = End.LIMIT
        elif not gaps(covered, periods):
            end = End.COVERED
        else:
            gains = [np.sqrt(alphas[h]) if reading.root else alphas[h] for h in ordered]
            marked = [covered_interval(plant, h, float(g), reading.upper) for h, g in zip(ordered, gains, strict=True)]
            # United with the intervals, (h_l, h_u) stays one piece; beyond it no sampling period occurs.
            open_ = [(periods.h_l, periods.h_u)] if reading.union else gaps(marked, periods)
            new = {(a + b) / 2 for a, b in open_}
            new = {h for h in new if min(abs(h - old) for old in grid) > TOUCH}
            if new:
                grid |= new
                continue
            end = End.STALLED
        return Grid(tuple(ordered), tuple(alphas[h] for h in ordered), tuple(covered), end, rounds)


def gaps(intervals: list[Interval], periods: PeriodRange) -> list[tuple[float, float]]:
    """The parts (L_j, U_j) of [h_l, h_u] that no interval covers: what step 4 must mean, with a set-minus.

    An end of the range that lies on the boundary of an open interval makes no gap of positive length and is ignored
    only within TOUCH.
    """
    found = []
    reached = periods.h_l
    for interval in sorted(intervals, key=lambda i: i.lower):
        if interval.upper <= interval.lower:
            continue
        if interval.lower > reached + TOUCH:
            found.append((reached, min(interval.lower, periods.h_u)))
        reached = max(reached, interval.upper)
        if reached > periods.h_u:
            break
    if reached + TOUCH < periods.h_u:
        found.append((reached, periods.h_u))
    return [(a, b) for a, b in found if b - a > TOUCH]
