"""How long a test waits for another process: so long that only a hang is told, and no slow machine."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
PATIENCE = 900
"""Seconds. No result of a test depends on it; it ends one that would wait for ever."""


def wait_for(condition: Callable[[], T], alive: Callable[[], bool] = lambda: True) -> T:
    """What the condition answers once that is true. Fails if it never is, or if what should bring it about has died."""
    end = time.monotonic() + PATIENCE
    while not (answer := condition()):
        if not alive() or time.monotonic() > end:
            raise AssertionError("what was waited for did not happen")
        time.sleep(0.02)
    return answer
