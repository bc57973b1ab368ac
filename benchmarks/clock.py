"""Seconds of the processor. SDPA runs in a process of its own, which `time.process_time` leaves out."""

from __future__ import annotations

import os


def processor_seconds() -> float:
    """User and system time of this process and of the children that it has waited for."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system
