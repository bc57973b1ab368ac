"""Tasks in parallel processes, an answer also for one that kills its process; what a run says meanwhile."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import shutil
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from enum import StrEnum
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol, Self, TextIO

from replication.audit.run.tracing import FIXED
from replication.audit.run.worker import Answer, Task, compute
from replication.audit.store.provenance import THREADS
from replication.errors import AuditError

if TYPE_CHECKING:
    from rich.console import Console


KILLED = (
    "the process was killed while it computed this, perhaps for want of memory or beyond its time-out, "
    "or compiled code crashed, or the code ended it"
)


class Executor(Protocol):
    """What computes the tasks of a run: processes of this machine, or a cluster."""

    def compute(self, tasks: Sequence[Task]) -> Iterator[Answer]:
        """Yield the answer of each task, in the order in which they finish."""


@dataclass(frozen=True)
class Processes:
    """Processes of this machine, `jobs` of them, one per core if that is None; raises AuditError if it is below one.

    None of them is this one, which thus outlives all that a task may do. If a process ends, the tasks that were under
    way are repeated one by one, so that the one to blame is found and no other one suffers.
    """

    jobs: int | None = None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise AuditError(f"the number of jobs must be at least 1, got {self.jobs}; leave it out for one per core")

    def compute(self, tasks: Sequence[Task]) -> Iterator[Answer]:
        """Yield the answer of each task, in the order in which they finish."""
        for task in tasks:
            if task.alone:
                yield from _one_by_one([task])
        tasks = [task for task in tasks if not task.alone]
        if not tasks:
            return
        jobs = min(self.jobs or os.cpu_count() or 1, len(tasks))
        if jobs <= 1:
            yield from _one_by_one(tasks)
            return
        waiting = list(tasks)
        while waiting:
            begun: list[Task] = []
            finished: set[str] = set()
            try:
                for answer in _in_parallel(waiting, jobs, begun):
                    finished.add(answer.name)
                    yield answer
                return
            except BrokenProcessPool:
                suspects = [task for task in begun if task.name not in finished]
            waiting = [task for task in waiting if task not in begun]
            yield from _one_by_one(suspects)


def _in_parallel(tasks: Sequence[Task], jobs: int, begun: list[Task]) -> Iterator[Answer]:
    """Run the tasks with joblib; `begun` receives each as it is handed to a process."""
    import joblib
    from joblib.externals.loky import get_reusable_executor

    def hand_out() -> Iterator[object]:
        for task in tasks:
            begun.append(task)
            yield joblib.delayed(compute)(task)

    try:
        with joblib.parallel_config(
            backend="loky", inner_max_num_threads=THREADS, initializer=end_with, initargs=(os.getpid(),)
        ):
            # One task at a time and none in advance, so that `begun` names little more than what is running.
            parallel = joblib.Parallel(jobs, return_as="generator_unordered", batch_size=1, pre_dispatch="n_jobs")
            with _deaf_children():
                answers = parallel(hand_out())
            yield from answers
    finally:
        # Idle processes would hold modules as they were now, and outlive an interruption.
        _end(get_reusable_executor(reuse=True))


def _one_by_one(tasks: Sequence[Task]) -> Iterator[Answer]:
    """Run the tasks in one process, with another one for the rest after a task that ended it."""
    waiting = list(tasks)
    while waiting:
        executor = _single_process()
        try:
            while waiting:
                task = waiting.pop(0)
                with _deaf_children():
                    answer = executor.submit(compute, task)
                yield answer.result()
        except BrokenProcessPool:
            yield Answer(task.name, None, 0.0, KILLED)
        finally:
            # Without waiting for a computation that an interruption has made useless.
            _end(executor)


def _end(executor: Any) -> None:
    """End its processes. joblib does so by psutil or `pgrep`, and would wait minutes where there is neither."""
    found = shutil.which("pgrep") or importlib.util.find_spec("psutil")
    for process in () if found else list((executor._processes or {}).values()):
        with contextlib.suppress(ProcessLookupError):
            os.kill(process.pid, signal.SIGKILL)
    executor.shutdown(wait=True, kill_workers=bool(found))


def _single_process() -> Any:
    """An executor of one process that does not import the main script again."""
    from joblib.externals.loky import ProcessPoolExecutor

    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), str(THREADS))
    return ProcessPoolExecutor(1, initializer=end_with, initargs=(os.getpid(),), env=threads)


@contextlib.contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes begun meanwhile never hear Ctrl-C, which reaches them too: this one decides, and ends them.

    Here it waits until the end at most; it would be lost if it were ignored. They have the language and the time zone
    of every experiment, and no handler that prints the stacks of all threads when one crashes, of which their parent
    says a line.
    """
    heard = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    settings = {**FIXED, "PYTHONFAULTHANDLER": ""}
    before = {name: os.environ.get(name) for name in settings}
    os.environ.update(settings)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        signal.pthread_sigmask(signal.SIG_SETMASK, heard)


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
    """One experiment of a run: what was done, why, how long it took when it ran, and the error if it failed."""

    name: str
    action: Action
    reason: str
    seconds: float
    error: str = ""

    def __str__(self) -> str:
        text = f"{self.action} {self.name}"
        if self.action is not Action.REUSED:
            text += f" in {self.seconds:.1f} s"
        return f"{text} ({self.reason}){self.error and f': {self.error}'}"


class Silent:
    """Follows a run as a context manager and says nothing of it; the others are made from this one."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Nothing to clean up."""

    def begin(self, total: int) -> None:
        """`total` experiments are going to be computed."""

    def step(self, step: Step) -> None:
        """One of them is done."""


def say(line: str, stream: TextIO) -> None:
    """Write a line at once. A reader who has left (`head`, a pager) ends no run: what follows goes nowhere."""
    try:
        print(line, file=stream, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


class Plain(Silent):
    """One line per computed experiment, for logs."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._total = 0
        self._done = 0

    def begin(self, total: int) -> None:
        """Start counting."""
        self._total, self._done = total, 0

    def step(self, step: Step) -> None:
        """Write the line at once, also into a pipe."""
        self._done += 1
        say(f"[{self._done}/{self._total}] {step}", self._stream)


class Bar(Silent):
    """A progress bar, with the finished experiments scrolling by above it."""

    def __init__(self, console: Console) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as RichProgress

        self._bar = RichProgress(
            TextColumn("experiments"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left:"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
        )
        self._task = self._bar.add_task("experiments", total=None)

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._bar.stop()

    def begin(self, total: int) -> None:
        """Set the length of the bar."""
        self._bar.update(self._task, total=total)

    def step(self, step: Step) -> None:
        """Advance the bar by one."""
        self._bar.console.print(str(step), markup=False, highlight=False)
        self._bar.advance(self._task)
