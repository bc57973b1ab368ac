"""Between the least worst case and the least mean: designs at every level, with both measures exact.

The central solution at a level is the one of least entropy, a bound of the mean square; at an infinite level it is that
of the Kalman filter. Source: Mustafa and Glover, Minimum Entropy H-infinity Control (1990).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError
from replication.estimation.api.shown import Shown, as_text
from replication.estimation.validation import Array, at_most

BALANCE = 1e-6
"""Width, on the way from the least level (0) to the Kalman design (1), at which the search for the balance ends."""
MOST_POINTS = 1000


class Goal(StrEnum):
    """What a design makes least: the worst-case gain, the mean square under white noise, or something of both."""

    HINF = "hinf"
    H2 = "h2"
    MIXED = "mixed"


Measures = tuple[float, float]
"""Exact gain and root mean square of a design."""


@dataclass(frozen=True, eq=False, repr=False)
class TradeOff(Shown):
    """What each level costs in mean error, and the other way round.

    Attributes
    ----------
    method : str
        Name of the method.
    what : str
        Of what the root mean square is.
    level : array (M,)
        Levels of the design, from the least one to infinity (the Kalman design).
    gain : array (M,)
        Gain of the design, the upper end of its exact value; never above the level.
    rms : array (M,)
        Root of the mean square for white noise, exact.
    """

    method: str
    what: str
    level: Array
    gain: Array
    rms: Array

    def rows(self) -> list[tuple[str, str, str]]:
        """One line for each level."""
        return [
            (
                f"designed for level {as_text(float(level)) if np.isfinite(level) else 'infinite'}",
                f"{self.what} {rms:.6g}",
                f"gain {gain:.6g}; both exact",
            )
            for level, gain, rms in zip(self.level, self.gain, self.rms, strict=True)
        ]

    def panels(self) -> tuple[Panel, ...]:
        """What is lost of the one measure for each loss of the other."""
        gain, rms = (100 * (measure / measure.min() - 1) for measure in (self.gain, self.rms))
        curves = {"from the least gain to the Kalman design": rms}
        return (Panel(gain, "guaranteed gain above the least (%)", f"{self.what} above the least (%)", curves, {}),)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values; the infinite level is null."""
        levels = [level if np.isfinite(level) else None for level in self.level.tolist()]
        return {"method": self.method, "level": levels, "gain": self.gain.tolist(), "rms": self.rms.tolist()}


def between(least: float, share: float) -> float:
    """The level on the way from the least one (share 0) to an infinite one (1); more of them where most changes."""
    return float(least / np.sqrt(1 - share**2)) if share < 1 else np.inf


def tradeoff(method: str, what: str, points: Any, least: float, measures: Callable[[float], Measures]) -> TradeOff:
    """The curve through `points` designs; `least`: the level of the first, `measures`: of the design at a level.

    Raises InvalidInputError unless `points` is a whole number from 2 to MOST_POINTS.
    """
    count = at_most("points", points, MOST_POINTS)
    if count < 2:
        raise InvalidInputError(f"points must be at least 2, the two ends, got {count}")
    levels = np.array([between(least, share) for share in np.linspace(0.0, 1.0, count).tolist()])
    gain, rms = np.array([measures(level) for level in levels.tolist()]).T
    return TradeOff(method, what, levels, gain, rms)


def balanced(least: float, least_gain: float, measures: Callable[[float], Measures]) -> float:
    """The level whose design has a gain and a mean that exceed the least ones by the same share."""
    from scipy.optimize import brentq  # slow to load

    least_rms = measures(np.inf)[1]

    def excess(share: float) -> float:
        """Of the mean over that of the gain."""
        gain, rms = measures(between(least, share))
        return rms / least_rms - gain / least_gain

    if excess(0.0) <= 0:
        return between(least, 0.0)
    if excess(1.0) >= 0:
        return np.inf
    return between(least, brentq(excess, 0.0, 1.0, xtol=BALANCE))
