"""Tasks in parallel processes, an answer also for one that kills its process; what was done about each."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Connection
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

from replication.audit.run.chance import kept_environment
from replication.audit.run.tracing import FIXED
from replication.audit.run.worker import GRACE, Answer, Task, compute
from replication.audit.store.cache import Dependencies, Entry
from replication.audit.store.provenance import THREADS
from replication.errors import AuditError

KILLED = (
    "the process was killed while it computed this, perhaps for want of memory or beyond its time-out, "
    "or compiled code crashed, or the code ended it"
)
_THREADS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), str(THREADS))
OF_PROCESSES = {**FIXED, **_THREADS, "PYTHONFAULTHANDLER": ""}
"""Variables of the environment of every process that computes."""


class Executor(Protocol):
    """What computes the tasks of a run: processes of this machine, or a cluster."""

    def compute(self, tasks: Sequence[Task]) -> Iterator[Answer]:
        """Yield the answer of each task, in the order in which they finish."""


@dataclass(frozen=True)
class Processes:
    """Processes of this machine, `jobs` of them, one per core if that is None; raises AuditError if it is below one.

    None of them is this one, which thus outlives all that a task may do. Each task has a process of its own, a copy of
    one that never ran any: so nothing that a task leaves behind, such as a setting of a package, reaches another one.
    """

    jobs: int | None = None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise AuditError(f"the number of jobs must be at least 1, got {self.jobs}; leave it out for one per core")

    def compute(self, tasks: Sequence[Task]) -> Iterator[Answer]:
        """Yield the answer of each task, in the order in which they finish, whatever is done with them meanwhile."""
        running, over = set[Any](), threading.Event()
        ask = partial(_answered, _copies(tasks), running, over)
        with ThreadPoolExecutor(self.jobs or os.cpu_count() or 1) as threads:
            try:
                for future in as_completed([threads.submit(ask, task) for task in tasks]):
                    yield future.result()
            finally:
                # Without waiting for a computation that an interruption has made useless.
                with _starting:
                    over.set()
                for process in list(running):
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(process.pid, signal.SIGALRM)  # as at the end of its time, so that it ends what it began
                    process.join(GRACE)
                    process.kill()


_starting = threading.Lock()


def _answered(copies: Any, running: set[Any], over: threading.Event, task: Task) -> Answer:
    """The answer of a task from a process of its own; running: those there are, until it is over."""
    ours, theirs = copies.Pipe(duplex=False)
    killed = Answer(task.name, None, 0.0, KILLED)
    with _starting, _without_script(), theirs:
        if over.is_set():
            return killed
        process = copies.Process(target=_answer, args=(theirs, task, dict(os.environ)))
        process.start()
        running.add(process)
    try:
        answer: Answer = ours.recv()
    except EOFError:
        answer = killed
    process.join(GRACE)
    process.kill()  # where a thread of the experiment goes on
    running.discard(process)
    return answer


def _copies(tasks: Sequence[Task]) -> Any:
    """What begins processes, as copies of one that has loaded what tasks import of this program, and no paper."""
    labels = sorted({label for task in tasks for label in task.dependencies.sources})
    own = [Path(label).with_suffix("") for label in labels if label.startswith("replication/")]
    modules = [".".join(path.parts) for path in own if path.name != "__init__"]
    copies = multiprocessing.get_context("forkserver")
    copies.set_forkserver_preload(["scipy.linalg", "scipy.optimize", "threadpoolctl", __name__, *modules])
    # Begun here: Python 3.11 lets all processes hear Ctrl-C again where it begins this with the first of them.
    resource_tracker.ensure_running()
    with _deaf_children():
        forkserver.ensure_running()
    return copies


@contextlib.contextmanager
def _without_script() -> Iterator[None]:
    """Processes begun meanwhile do not run the main script again."""
    main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _answer(told: Connection, task: Task, environment: Mapping[str, str]) -> None:
    """Compute a task in a process that has just begun; environment: that of the run now."""
    run = multiprocessing.parent_process()
    assert run is not None
    end_when(run.join)
    multiprocessing.set_start_method(None, force=True)  # an experiment that begins some has Python's usual ones
    os.environ.update({**environment, **OF_PROCESSES})
    with contextlib.suppress(BrokenPipeError):  # nobody waits any more
        told.send(compute(task))


@contextlib.contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes begun meanwhile never hear Ctrl-C, which reaches them too: this one decides, and ends them.

    Here it waits until the end at most; it would be lost if it were ignored. They have the language and the time zone
    of every experiment, and no handler that prints the stacks of all threads when one crashes, of which their parent
    says a line.
    """
    heard = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with kept_environment():
            os.environ.update(OF_PROCESSES)
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, heard)


def end_when(gone: Callable[[], object]) -> None:
    """End this process as soon as `gone` returns: nobody waits for the answer of an orphan."""

    def watch() -> None:
        gone()
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
