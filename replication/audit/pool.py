"""Tasks in parallel processes: the answers as they come, and an answer also for a task that kills its process."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

from replication.audit.provenance import THREADS
from replication.audit.worker import Answer, Task, compute

KILLED = "the process was killed while it computed this, perhaps for want of memory; run again with --jobs 1"


def compute_all(tasks: Sequence[Task], jobs: int) -> Iterator[Answer]:
    """Yield the answer of each task, in the order in which they finish.

    jobs: number of processes; with one, the tasks run here, one after the other, under the same limit of threads.
    If a process is killed, the tasks that were under way are repeated, each in a process of its own, so that the one
    to blame is found and no other one suffers.
    """
    if jobs == 1:
        yield from map(compute, tasks)
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
        yield from map(_compute_alone, suspects)


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
            backend="loky", inner_max_num_threads=THREADS, initializer=_end_with, initargs=(os.getpid(),)
        ):
            # One task at a time and none in advance, so that `begun` names little more than what is running.
            parallel = joblib.Parallel(jobs, return_as="generator_unordered", batch_size=1, pre_dispatch="n_jobs")
            with _deaf_children():
                answers = parallel(hand_out())
            yield from answers
    finally:
        # Idle processes would hold modules as they were now, and outlive an interruption.
        get_reusable_executor(reuse=True).shutdown(wait=True, kill_workers=True)


def _compute_alone(task: Task) -> Answer:
    context = get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context, initializer=_end_with, initargs=(os.getpid(),)) as executor:
        try:
            with _deaf_children():
                answer = executor.submit(compute, task)
            return answer.result()
        except BrokenProcessPool:
            return Answer(task.name, None, 0.0, KILLED)


@contextlib.contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes begun meanwhile ignore Ctrl-C, which reaches them too: this one decides, and ends them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


def _end_with(parent: int) -> None:
    """End this process soon after its parent: nobody would wait for the answer of an orphan."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
