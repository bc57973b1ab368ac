"""Multi-rate observers between the least level and the least mean error; see `replication.estimation.api.tradeoff`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from replication.estimation.api import tradeoff as curve
from replication.estimation.linear.norms import l2_gain, white_noise_variance
from replication.estimation.multirate.kalman import RiccatiDesign, kalman_centre, kalman_design
from replication.estimation.multirate.optimum import DESIGN_MARGIN, Optimum, central
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array


def rms_error(problem: MultirateProblem, gains: Array) -> float:
    """Root of the mean square of W e over a period, for white noise of unit intensity; gains (N, n, q)."""
    return float(np.sqrt(white_noise_variance(problem.error_system(gains))))


def tradeoff(problem: MultirateProblem, best: Optimum, points: Any) -> curve.TradeOff:
    """Levels from the least one to infinity; raises InvalidInputError for another number of points."""
    _, measures = _designs(problem)
    return curve.tradeoff("multirate", "rms error", points, best.upper * (1 + DESIGN_MARGIN), measures)


def balanced(problem: MultirateProblem, best: Optimum) -> RiccatiDesign:
    """The central gains whose level and whose mean error exceed the least ones by the same share."""
    design, measures = _designs(problem)
    return design(curve.balanced(best.upper * (1 + DESIGN_MARGIN), best.value, measures))


def _designs(
    problem: MultirateProblem,
) -> tuple[Callable[[float], RiccatiDesign], Callable[[float], curve.Measures]]:
    """The central gains at a level, and their exact gain and rms error."""
    centre = kalman_centre(problem)

    def design(level: float) -> RiccatiDesign:
        return central(centre, level) if np.isfinite(level) else kalman_design(problem)

    def measures(level: float) -> curve.Measures:
        gains = design(level).gains
        return l2_gain(problem.error_system(gains)).upper, rms_error(problem, gains)

    return design, measures
