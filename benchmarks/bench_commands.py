"""Whole commands, from the start of Python to its end: a run with nothing computed before, and what follows it.

Beside the time: processor seconds, of which the time is a share, and the largest memory of all processes together, a
page that several share counted once. The unit of the ratio is a start of Python that imports numpy, in the same run.
"""

import contextlib
import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from benchmarks.clock import processor_seconds

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("replication", "papers", "figures", "certificates", "docs")
SAMPLED = 0.05
"""Seconds between two looks at the memory."""
ROUNDS = 5
WARM = {
    "run, nothing changed": ("-m", "replication", "run"),
    "list": ("-m", "replication", "list"),
    "show of a claim": ("-m", "replication", "show", "okajima2023.table1.n11"),
    "check": ("-m", "replication", "check"),
    "verify, all certificates": ("verify.py",),
}


def resident(parent: int) -> int:
    """Bytes in memory of all that a process started, each page once: proportional set sizes (PSS), summed."""
    total, waiting = 0, [parent]
    while waiting:
        for path in (Path("/proc") / str(waiting.pop()) / "task").glob("*/children"):
            with contextlib.suppress(OSError):  # it has ended meanwhile
                waiting += map(int, started := path.read_text(encoding="utf-8").split())
                for number in started:
                    lines = (Path("/proc") / number / "smaps_rollup").read_text(encoding="utf-8").splitlines()
                    total += next(1024 * int(line.split()[1]) for line in lines if line.startswith("Pss:"))
    return total


def measured(words: tuple[str, ...], folder: Path) -> dict[str, float]:
    """Run Python with these words: processor seconds, and the peak of the memory in MB."""
    before, peak, ended = processor_seconds(), 0, threading.Event()

    def watch() -> None:
        nonlocal peak
        while not ended.is_set():
            peak = max(peak, resident(os.getpid()))
            time.sleep(SAMPLED)

    watcher = threading.Thread(target=watch)
    watcher.start()
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    try:
        subprocess.run([sys.executable, *words], cwd=folder, env=environment, check=True, capture_output=True)
    finally:
        ended.set()
        watcher.join()
    return {"CPU_s": processor_seconds() - before, "peak_MB": peak / 1e6}


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources, with nothing computed."""
    target = tmp_path_factory.mktemp("project")
    for path in ROOT.iterdir():
        if path.is_dir() and path.name in FOLDERS:
            shutil.copytree(path, target / path.name, ignore=shutil.ignore_patterns("__pycache__"))
        elif path.is_file():
            shutil.copy(path, target)
    return target


@pytest.fixture(scope="module")
def start(project: Path) -> float:
    """Seconds of a start of Python with numpy."""
    times = []
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        measured(("-c", "import numpy"), project)
        times.append(time.perf_counter() - begun)
    return sorted(times)[ROUNDS // 2]


@pytest.mark.benchmark(group="Commands")
def test_run_with_nothing_computed(benchmark: Any, project: Path, start: float) -> None:
    found = benchmark.pedantic(measured, (("-m", "replication", "run"), project), rounds=1)
    seconds = benchmark.stats.stats.median
    benchmark.extra_info.update(found, wall_of_CPU=seconds / found["CPU_s"], starts=seconds / start)


@pytest.mark.benchmark(group="Commands")
@pytest.mark.parametrize("name", WARM)
def test_warm(benchmark: Any, name: str, project: Path, start: float) -> None:
    found = benchmark.pedantic(measured, (WARM[name], project), rounds=ROUNDS, warmup_rounds=1)
    benchmark.extra_info.update(found, starts=benchmark.stats.stats.median / start)
