"""Between the least level and the least mean error: the central gains at every level, with both measures exact.

The central solution at a level is the one of least entropy, a bound of the mean error variance; at an infinite level it
is the Kalman filter. Source: Mustafa and Glover, Minimum Entropy H-infinity Control (1990).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from replication.drawing.panel import Panel
from replication.estimation.api.shown import Shown, as_text
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate.kalman import KalmanCentre, RiccatiDesign, kalman_centre, kalman_design
from replication.estimation.multirate.optimum import DESIGN_MARGIN, Optimum, central
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.multirate.simulation import white_noise_variance
from replication.estimation.validation import Array

BALANCE = 1e-6
"""Width, on the way from the least level (0) to the Kalman filter (1), at which the search for the balance ends."""


@dataclass(frozen=True, eq=False, repr=False)
class TradeOff(Shown):
    """What each level costs in mean error, and the other way round.

    Attributes
    ----------
    level : array (M,)
        Levels of the design, from the least one to infinity (the Kalman filter).
    gain : array (M,)
        Gain of the error system, the upper end of its exact value; never above the level.
    rms : array (M,)
        Root of the mean square of W e for white noise of unit intensity, exact.
    """

    level: Array
    gain: Array
    rms: Array

    def rows(self) -> list[tuple[str, str, str]]:
        """One line for each level."""
        return [
            (
                f"designed for level {as_text(float(level)) if np.isfinite(level) else 'infinite'}",
                f"rms error {rms:.6g}",
                f"gain {gain:.6g}; both exact",
            )
            for level, gain, rms in zip(self.level, self.gain, self.rms, strict=True)
        ]

    def panels(self) -> tuple[Panel, ...]:
        """What is lost of the one measure for each loss of the other."""
        gain, rms = (100 * (measure / measure.min() - 1) for measure in (self.gain, self.rms))
        curves = {"from the least gain to the Kalman filter": rms}
        return (Panel(gain, "guaranteed gain above the least (%)", "rms error above the least (%)", curves, {}),)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values; the infinite level is null."""
        levels = [level if np.isfinite(level) else None for level in self.level.tolist()]
        return {"method": "multirate", "level": levels, "gain": self.gain.tolist(), "rms": self.rms.tolist()}


def rms_error(problem: MultirateProblem, gains: Array) -> float:
    """Root of the mean square of W e over a period, for white noise of unit intensity; gains (N, n, q)."""
    return float(np.sqrt(white_noise_variance(problem.error_system(gains))))


def tradeoff(problem: MultirateProblem, best: Optimum, points: int) -> TradeOff:
    """Levels from the least one to infinity, closer together where they change most."""
    centre = kalman_centre(problem)
    designs = [_between(centre, best, share) for share in np.linspace(0.0, 1.0, points)[:-1].tolist()]
    designs.append(kalman_design(problem))
    return TradeOff(
        np.array([design.level for design in designs]),
        np.array([l2_gain(problem.error_system(design.gains)).upper for design in designs]),
        np.array([rms_error(problem, design.gains) for design in designs]),
    )


def balanced(problem: MultirateProblem, best: Optimum) -> RiccatiDesign:
    """The central gains whose level and whose mean error exceed the least ones by the same share."""
    from scipy.optimize import brentq  # slow to load

    centre, kalman = kalman_centre(problem), kalman_design(problem)
    least = rms_error(problem, kalman.gains)

    def excess(share: float) -> float:
        """Of the rms error over that of the level."""
        design = _between(centre, best, share) if share < 1 else kalman
        return rms_error(problem, design.gains) / least - l2_gain(problem.error_system(design.gains)).upper / best.value

    if excess(0.0) <= 0:
        return _between(centre, best, 0.0)
    if excess(1.0) >= 0:
        return kalman
    return _between(centre, best, brentq(excess, 0.0, 1.0, xtol=BALANCE))


def _between(centre: KalmanCentre, best: Optimum, share: float) -> RiccatiDesign:
    """The central gains on the way from the least level (share 0) to an infinite one (1)."""
    level = best.upper * (1 + DESIGN_MARGIN) / np.sqrt(1 - share**2)
    return central(centre, float(level))
