"""Seconds of the processor. SDPA runs in a process of its own, which `time.process_time` leaves out."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from typing import Any


def processor_seconds() -> float:
    """User and system time of this process and of the children that it has waited for."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def median_times(*works: Callable[[], Any], rounds: int) -> list[float]:
    """Of each, of this process alone, turn by turn, so that other work on the machine meets all alike."""
    times: list[list[float]] = [[] for _ in works]
    for _ in range(rounds):
        for work, taken in zip(works, times, strict=True):
            start = time.process_time()
            work()
            taken.append(time.process_time() - start)
    return [statistics.median(taken) for taken in times]
