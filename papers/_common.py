"""What the papers share: one plant of ours for all estimators, and how a sketch draws one signal over time.

The plant is a damped oscillator whose position is measured through noise, in SI units; it stands for no device. Every
paper's estimator is tried on it with a sensor that is slower, less regular or later, and each result is compared with
that of the ideal sensor, which measures at every base period at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from replication.audit.brief import Draws, Stroke

PLANT: dict[str, Any] = {
    "A": [[0.0, 1.0], [-1.0, -0.6]],
    "B": [[0.0], [1.0]],
    "C": [[1.0, 0.0]],
    "noise": 0.1,
    "h": 0.2,
}
"""A damped oscillator, which stands for no device: position and speed; force per mass; sensor noise; base period in s.

Every paper's estimator is tried on it with a sensor that is slower, less regular or later, beside the ideal one, which
measures at every base period at once.
"""

MULTIPLES = (1, 2, 3, 4, 6, 8)
"""How many base periods: from one measurement to the next, at the most, or of lateness plus one."""

MINCX = 0.01
"""Relative accuracy, of what it minimises, at which mincx stops by default, says its documentation."""

INPUTS: dict[str, Any] = {"plant": PLANT, "multiples": list(MULTIPLES)}


FIRST, LAST = 8, 312
"""Where the signal begins and ends, in the frame of a sketch."""


def signal(x: float) -> float:
    """Its height at `x`, downwards."""
    return 64 - 26 * math.sin((x - 20) / 32) - 16 * math.sin((x + 4) / 57)


def curve(draws: Draws, height: Callable[[float], float] = signal, first: float = FIRST, last: float = LAST) -> Stroke:
    """A smooth line from `first` to `last`."""
    steps = max(2, round((last - first) / 5))
    xs = [first + (last - first) * step / steps for step in range(steps + 1)]
    return Stroke(draws=draws, points=tuple((round(x, 1), round(height(x), 1)) for x in xs))


def dots(draws: Draws, xs: Iterable[float], height: Callable[[float], float] = signal) -> Stroke:
    """A dot at each of `xs`."""
    return Stroke(draws=draws, points=tuple((round(x, 1), round(height(x), 1)) for x in xs))


def ticks(draws: Draws, xs: Iterable[float], y: float) -> Stroke:
    """A tick down to the height `y` at each of `xs`."""
    return Stroke(draws=draws, points=tuple((round(x, 1), y) for x in xs))


def label(text: str, x: float, y: float, draws: Draws = Draws.LABEL) -> Stroke:
    """A text that begins at `x`."""
    return Stroke(draws=draws, points=((x, y),), text=text)
