"""Tasks in parallel processes, an answer also for one that kills its process; what was done about each."""

import contextlib
import importlib.util
import os
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from enum import StrEnum
from multiprocessing import resource_tracker
from typing import Any

from replication.audit.run.chance import kept_environment
from replication.audit.run.tracing import FIXED
from replication.audit.run.worker import Answer, Task, compute
from replication.audit.store.cache import Dependencies, Entry
from replication.audit.store.provenance import THREADS
from replication.errors import AuditError
from replication.verify.workers import heard_later

KILLED = (
    "the process was killed while it computed this, perhaps for want of memory or beyond its time-out, "
    "or compiled code crashed, or the code ended it"
)
AHEAD = 4
"""Tasks that wait beside the processes, which thus compute on while their parent stores a result or draws a figure."""


Compute = Callable[[Sequence[Task]], Iterable[Answer]]
"""What computes the tasks of a run, here or on a cluster: the answer of each, in the order in which they end."""


def processes(tasks: Sequence[Task], jobs: int | None = None) -> Iterator[Answer]:
    """The answers of `jobs` processes of this machine, one per core if that is None; none of them is this one.

    If a process ends, the tasks under way or next are repeated one by one, so that the one to blame is found. Raises
    AuditError if there is to be less than one process.
    """
    if jobs is not None and jobs < 1:
        raise AuditError(f"the number of jobs must be at least 1, got {jobs}; leave it out for one per core")
    for task in tasks:
        if task.alone:
            yield from _computed([task], 1)
    yield from _computed([task for task in tasks if not task.alone], jobs or os.cpu_count() or 1)


def _computed(tasks: Sequence[Task], jobs: int) -> Iterator[Answer]:
    """The answers of so many processes; tasks that are under way or next when one ends are tried alone."""
    waiting = list(tasks)
    while waiting:
        executor, running = _executor(min(jobs, len(waiting))), dict[Future[Answer], Task]()
        try:
            while waiting or running:
                while waiting and len(running) < (jobs + AHEAD if jobs > 1 else 1):
                    with _deaf_children():
                        running[executor.submit(compute, waiting[0])] = waiting[0]
                    del waiting[0]
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    answer = future.result()
                    del running[future]
                    yield answer
        except BrokenProcessPool:
            alone = jobs == 1
            yield from (Answer(task.name, None, 0.0, KILLED) for task in running.values() if alone)
            yield from _computed([task for task in running.values() if not alone], 1)
        finally:
            # Without waiting for a computation that an interruption has made useless.
            _end(executor)


def _end(executor: Any) -> None:
    """End its processes. joblib does so by psutil or `pgrep`, and would wait minutes where there is neither."""
    tool = shutil.which("pgrep") or importlib.util.find_spec("psutil")
    for process in () if tool else list((executor._processes or {}).values()):
        with contextlib.suppress(ProcessLookupError):
            os.kill(process.pid, signal.SIGKILL)
    executor.shutdown(wait=True, kill_workers=bool(tool))


def _executor(jobs: int) -> Any:
    """An executor whose processes do not import the main script again; each computes with one thread."""
    from joblib.externals.loky import ProcessPoolExecutor

    # Begun here: Python 3.11 lets all processes hear Ctrl-C again where it begins this with the first of them.
    resource_tracker.ensure_running()
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), str(THREADS))
    return ProcessPoolExecutor(jobs, initializer=end_with, initargs=(os.getpid(),), env=threads)


@contextlib.contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes begun meanwhile have the usual language, and hear no Ctrl-C: this one decides, and ends them."""
    with heard_later(), kept_environment():
        os.environ.update({**FIXED, "PYTHONFAULTHANDLER": ""})
        yield


def end_with(parent: int) -> None:
    """End this process soon after its parent: nobody would wait for the answer of an orphan."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


class Action(StrEnum):
    """What was done about an experiment."""

    COMPUTED = "computed"
    REUSED = "reused"
    FAILED = "failed"


@dataclass(frozen=True)
class Step:
    """One experiment of a run: what was done, why, how long it took when it ran, and the error if it failed.

    dependencies: what it depended on. entry: with its result, unless it failed.
    """

    name: str
    action: Action
    reason: str
    seconds: float
    dependencies: Dependencies
    entry: Entry | None = None
    error: str = ""

    @property
    def untraced(self) -> tuple[str, ...]:
        """What it did that cannot be followed."""
        return self.entry.untraced if self.entry is not None else ()

    def __str__(self) -> str:
        text = f"{self.action} {self.name}"
        if self.action is not Action.REUSED:
            text += f" in {self.seconds:.1f} s"
        return f"{text} ({self.reason}){self.error and f': {self.error}'}"
