"""The axes of a picture: from numbers to a frame of 1000 by 1000, round ticks, and names that do not meet."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

FRAME = 1000
STEPS = (1.0, 2.0, 5.0, 10.0)
MOST_TICKS = 5

Scale = Callable[[float], float]


def scale_of(numbers: Sequence[float], log: bool, margin: float) -> Scale:
    """From a number to the frame, with some units left free at both ends."""
    moved = [math.log10(number) if log else number for number in numbers]
    low, span = min(moved), (max(moved) - min(moved)) or 1.0
    return lambda number: margin + (FRAME - 2 * margin) * ((math.log10(number) if log else number) - low) / span


def ticks(numbers: Sequence[float], log: bool, scale: Scale) -> tuple[tuple[float, float], ...]:
    """A few round numbers in the range, and where they stand."""
    low, high = min(numbers), max(numbers)
    if log:
        first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
        step = max(1, math.ceil((last - first + 1) / MOST_TICKS))
        round_ones = [10.0**power for power in range(first, last + 1, step)]
        if len(round_ones) < 2:
            round_ones = [low, high]
    else:
        size = (high - low) / MOST_TICKS or 1.0
        power = 10 ** math.floor(math.log10(size))
        step = next(step * power for step in STEPS if step * power >= size)
        round_ones = [n * step for n in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]
    return tuple((float(f"{number:.3g}"), round(scale(number), 1)) for number in round_ones)


def spread(heights: Sequence[float], sizes: Sequence[float]) -> list[float]:
    """The heights of names moved apart as little as keeps them from meeting, and all in the frame."""
    order = sorted(range(len(heights)), key=heights.__getitem__)
    placed = list(heights)
    for before, after in itertools.pairwise(order):
        placed[after] = max(placed[after], placed[before] + (sizes[before] + sizes[after]) / 2)
    limit = float(FRAME)
    for index in reversed(order):
        placed[index] = min(placed[index], limit - sizes[index] / 2)
        limit = placed[index] - sizes[index] / 2
    return [round(height) for height in placed]
