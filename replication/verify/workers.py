"""The same check of many certificates in several processes: answers in the order of the list, whatever their number."""

import argparse
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TypeVar

Item = TypeVar("Item")
Answer = TypeVar("Answer")


def jobs(text: str) -> int:
    """A number of processes, for a parser of arguments."""
    if not text.isdecimal() or len(text) > 9 or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not a whole number of at least 1")
    return int(text)


def add_jobs(parser: argparse.ArgumentParser) -> None:
    """Add the option `--jobs`."""
    words = "processes (default: one per processor; 1: none beside this one; the answers do not depend on it)"
    parser.add_argument("--jobs", type=jobs, metavar="N", help=words)


def in_order(
    check: Callable[[Item], Answer], items: Sequence[Item], jobs: int | None, lost: Callable[[Item], Answer]
) -> Iterator[Answer]:
    """check(item) of each item, in their order; lost(item) where the process that checks it is killed, or crashes.

    check, items and answers must be such as can be sent to another process. jobs: as many processes; one per processor
    if None; 1 for none beside this one.
    """
    count = min(jobs or os.cpu_count() or 1, len(items))
    return map(check, items) if count <= 1 else _in_processes(check, items, count, lost)


def _in_processes(
    check: Callable[[Item], Answer], items: Sequence[Item], count: int, lost: Callable[[Item], Answer]
) -> Iterator[Answer]:
    from concurrent.futures import Future, ProcessPoolExecutor
    from concurrent.futures.process import BrokenProcessPool

    pool = ProcessPoolExecutor(count, initializer=_end_with_parent)
    waiting: list[Future[Answer]] = []
    try:
        # What breaks before all is handed over is found below; what had been handed over keeps its place.
        with suppress(BrokenProcessPool), heard_later():
            for item in items:
                waiting.append(pool.submit(check, item))
        for place in range(len(items)):
            try:
                if place >= len(waiting):
                    raise BrokenProcessPool
                yield waiting[place].result()
            except BrokenProcessPool:
                # Which of several processes broke is not told: this item is tried in one alone, and the rest anew.
                yield from [lost(items[place])] if count == 1 else _in_processes(check, [items[place]], 1, lost)
                yield from _in_processes(check, items[place + 1 :], count, lost)
                return
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def heard_later() -> Iterator[None]:
    """Ctrl-C waits until the end, and in the processes begun meanwhile until they hear it of themselves."""
    heard = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, heard)


def _end_with_parent() -> None:
    """Leave at once on Ctrl-C, and when the process that waits for the answers has gone."""
    from multiprocessing import parent_process

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})

    def follow() -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
