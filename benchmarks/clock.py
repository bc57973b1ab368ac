"""Seconds of the processor and its name, and records of what was measured: a line of JSON each, a table in Markdown."""

import json
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any


def processor_seconds() -> float:
    """User and system time of this process and of its children (SDPA is one), which `time.process_time` leaves out."""
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


def machine() -> str:
    """Name of the processor."""
    told = Path("/proc/cpuinfo")
    for line in told.read_text(encoding="utf-8").splitlines() if told.exists() else []:
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def rows_of(record: Path) -> list[dict[str, Any]]:
    """What was measured so far."""
    lines = record.read_text(encoding="utf-8").splitlines() if record.exists() else []
    return [json.loads(line) for line in lines]


def append(record: Path, row: dict[str, Any]) -> None:
    """Keep one more row, so that a run that was stopped goes on where it ended."""
    with record.open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(row) + "\n")


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]], rule: str = " --- ") -> list[str]:
    """The lines of a table; rule: how columns are aligned, of each or, with bars between, of all."""
    rules = rule if "|" in rule else "|".join([rule] * len(head))
    return [f"| {' | '.join(head)} |", f"|{rules}|", *(f"| {' | '.join(row)} |" for row in rows)]
