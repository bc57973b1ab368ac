"""One experiment, run: found by name, given its inputs, timed, its result as JSON text or its failure as a sentence."""

import contextlib
import functools
import json
import os
import pkgutil
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.model import Experiment
from replication.audit.run.chance import CLOCK, dates, shared_generators, shared_state
from replication.audit.run.tracing import labels, loose, others, ours, traced, untraced
from replication.audit.store.cache import Dependencies, encode
from replication.audit.store.provenance import THREADS
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError, ReplicationError
from replication.extras import told

LARGEST = 20_000_000
"""Characters of a result; ten times those of the largest one of this project."""

GRACE = 5.0
"""Seconds that an experiment has to end after its time-out, before its process is ended."""


class Task(msgspec.Struct, frozen=True):
    """An experiment in a form that any process reads, on this machine or another one.

    dependencies: all that it depends on, as it is where the run is. arguments: JSON text of what its function is given,
    which may hold places on this disk. packages: those of the project, with their folders.
    alone: whether it needs a process of its own, which shows what it imports by computed names.
    timeout: seconds after which it is ended.
    """

    name: str
    dependencies: Dependencies
    arguments: str
    packages: dict[str, str]
    alone: bool = False
    timeout: float | None = None


class Late(BaseException):
    """The time of an experiment is over; no `except Exception` of a paper stops it."""


class Answer(msgspec.Struct, frozen=True):
    """What came of a task: the result as JSON text, or None and the error; wall-clock seconds either way.

    data: the state of all that it read. untraced: what it did that cannot be followed.
    files: those that a command made, by name.
    """

    name: str
    text: str | None
    seconds: float
    error: str
    data: dict[str, str] = {}
    untraced: tuple[str, ...] = ()
    files: dict[str, str] = {}


def function_name(experiment: Experiment) -> str:
    """`module:name` under which a worker finds the function; AuditError if it cannot be found that way."""
    function: Any = experiment.function
    module, name = getattr(function, "__module__", ""), getattr(function, "__qualname__", "")
    if not module or not name or "<" in name:
        raise AuditError(
            f"experiment {experiment.name}: {function!r} has no name in a module; "
            "define it with def at module level and pass what varies as inputs"
        )
    return f"{module}:{name}"


def compute(task: Task) -> Answer:
    """Run a task with one BLAS thread. Whatever fails in it ends up in the answer, except an interruption."""
    tree = SourceTree({name: Path(folder) for name, folder in task.packages.items()})
    sources = task.dependencies.sources
    begin, function = time.perf_counter(), None
    try:
        with traced(tree.root) as trace:
            function = pkgutil.resolve_name(task.dependencies.function)
            begin = time.perf_counter()  # again: what Python needs to import is no time of the experiment
            # After the import, so that the linear algebra is loaded and obeys; the same in every kind of process.
            with (
                shared_state(loose, ours),
                _libraries(len(sys.modules)).limit(limits=THREADS),
                limited(task.timeout),
                shared_generators(loose),
            ):
                text = encode(f"the result of {task.name}", function(**json.loads(task.arguments)))
            if len(text) > LARGEST:
                raise AuditError(
                    f"the result of {task.name} has {len(text) / 1e6:.0f} MB, at most {LARGEST / 1e6:.0f} are kept; "
                    "return what is shown or judged"
                )
            if dates(function, ours):
                loose(CLOCK)
        more = others(tree, sources, task.dependencies.packages) if task.alone else set()
        data, unseen = labels(trace, tree, sources, more), untraced(trace, tree, {*sources, *more})
        return Answer(task.name, text, time.perf_counter() - begin, "", data, unseen, trace.files)
    except Late:
        error = f"it took longer than {task.timeout:g} s; find out why, or give it more time: timeout=..."
    except (Exception, SystemExit) as failure:  # noqa: BLE001 - the one place where failures become data
        error = describe(failure, tree, tree.location(function) if function else "")
    return Answer(task.name, None, time.perf_counter() - begin, error)


@functools.lru_cache(1)
def _libraries(modules: int) -> Any:
    """Those of linear algebra that are loaded; looked for again when this number of modules is another one."""
    import threadpoolctl

    return threadpoolctl.ThreadpoolController()


@contextlib.contextmanager
def limited(seconds: float | None) -> Iterator[None]:
    """Raise `Late` after so many seconds; what does not listen, such as a loop in C, ends with its process after."""
    if seconds is None or threading.current_thread() is not threading.main_thread():
        yield
        return

    def ring(number: int, frame: object) -> None:
        raise Late

    last = threading.Timer(seconds + GRACE, os._exit, [1])
    last.daemon = True
    before = signal.signal(signal.SIGALRM, ring)
    last.start()
    signal.setitimer(signal.ITIMER_REAL, seconds, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        last.cancel()


def describe(failure: BaseException, sources: SourceTree, place: str = "") -> str:
    """Type, message and the innermost line of the project of an exception, on one line.

    An error that we raise on account of a paper says the line of the paper; `place` if there is none in it.
    """
    message = told(failure)
    place = "" if f"{place}:" in message or place.startswith("replication/") else place
    where = sources.last_line(failure.__traceback__, of_papers=isinstance(failure, ReplicationError)) or place
    return f"{type(failure).__name__}{message and f': {message}'}{where and f' [{where}]'}"
