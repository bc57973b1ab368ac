"""One experiment, run: found by name, given its inputs, timed, its result as JSON text or its failure as a sentence."""

from __future__ import annotations

import importlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.model import Experiment
from replication.audit.run.tracing import checksums, data_tree, opened_files
from replication.audit.store.jsonvalues import encode
from replication.audit.store.provenance import THREADS
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError, ReplicationError
from replication.extras import told

LARGEST = 20_000_000
"""Characters of a result; ten times those of the largest one of this project."""


@dataclass(frozen=True)
class Task:
    """An experiment in a form that any process can read. inputs: JSON text. packages: those of the project."""

    name: str
    function: str
    inputs: str
    packages: Mapping[str, Path]


class Answer(msgspec.Struct, frozen=True):
    """What came of a task: the result as JSON text, or None and the error; wall-clock seconds either way.

    data: SHA-256 of the project's data files that it read.
    """

    name: str
    text: str | None
    seconds: float
    error: str
    data: dict[str, str] = {}


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
    import threadpoolctl

    begin = time.perf_counter()
    text, error, data = None, "", {}
    try:
        function = _find(task.function)
        begin = time.perf_counter()  # again: what Python needs to import is no time of the experiment
        # After the import, so that the linear algebra is loaded and obeys; the same in every kind of process.
        with threadpoolctl.threadpool_limits(THREADS), opened_files() as opened:
            text = _encoded(task.name, function(**json.loads(task.inputs)))
        data = checksums(opened, data_tree(task.packages))
    except (Exception, SystemExit) as failure:  # noqa: BLE001 - the one place where failures become data
        error = describe(failure, SourceTree(task.packages))
        text = None
    return Answer(task.name, text, time.perf_counter() - begin, error, data)


def _encoded(name: str, value: Any) -> str:
    text = encode(f"the result of {name}", value)
    if len(text) > LARGEST:
        size = f"{len(text) / 1e6:.0f} MB"
        raise AuditError(
            f"the result of {name} has {size}, at most {LARGEST / 1e6:.0f} are kept; return what is shown or judged"
        )
    return text


def describe(failure: BaseException, sources: SourceTree) -> str:
    """Type, message and the innermost line of the project of an exception, on one line.

    An error that we raise on account of a paper says the line of the paper.
    """
    message = told(failure)
    where = sources.last_line(failure.__traceback__, of_papers=isinstance(failure, ReplicationError))
    return f"{type(failure).__name__}{message and f': {message}'}{where and f' [{where}]'}"


def _find(name: str) -> Callable[..., Any]:
    module, _, path = name.partition(":")
    found: Any = importlib.import_module(module)
    for part in path.split("."):
        found = getattr(found, part)
    return found  # type: ignore[no-any-return]
