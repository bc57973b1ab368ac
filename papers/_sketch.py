"""What the sketches of the papers have in common: one signal over time, and how it is drawn and measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from replication.audit.brief import Draws, Stroke

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
