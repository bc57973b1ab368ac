"""Experiments on a Dask cluster that already exists: the same tasks, the same answers, on other machines.

Dask hands out the tasks and finds out which worker died. The computing is done by a fresh process for each task beside
the worker: one that has run for weeks thus computes with the sources that lie on its disk now, and code that ends its
process ends no worker.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.run.pool import KILLED, end_with
from replication.audit.run.tracing import FIXED
from replication.audit.run.worker import Answer, Task, compute
from replication.audit.store.provenance import kernel, loaded, plain, read_environment, read_packages
from replication.audit.store.sources import SourceTree, default_packages, project_of
from replication.errors import AuditError

KERNEL = "instruction set of the linear algebra (OPENBLAS_CORETYPE chooses it)"
TIMEOUT = 10
"""Seconds to wait for the scheduler, and then for a first worker."""


class Order(msgspec.Struct, frozen=True, kw_only=True):
    """A task as it is sent to another machine, with what must be there: sources by SHA-256, Python, packages.

    alone, timeout: as for `Task`.
    """

    name: str
    function: str
    inputs: str
    sources: dict[str, str]
    python: str
    packages: dict[str, str]
    kernel: str
    alone: bool = False
    timeout: float | None = None


@dataclass(frozen=True)
class Cluster:
    """The cluster whose scheduler is at `address`, for example `tcp://10.0.0.1:8786`.

    Its workers need this project at the same sources and the same versions of Python and packages; a worker that has
    others refuses the task. A task whose worker is lost goes to another one, as often as Dask is configured to try.
    """

    address: str

    def compute(self, tasks: Sequence[Task]) -> Iterator[Answer]:
        """Yield the answer of each task as it comes.

        Raises AuditError if Dask is not installed or no scheduler or no worker answers.
        """
        try:
            from distributed import as_completed
        except ModuleNotFoundError:
            raise AuditError("a cluster needs Dask: `pip install distributed`, or the extra `dask`") from None
        client = _connect(self.address)
        futures: dict[Any, str] = {}
        try:
            for order in orders_of(tasks):
                futures[client.submit(compute_apart, msgspec.json.encode(order), pure=False)] = order.name
            for future in as_completed(futures, loop=client.loop):
                yield _answer(futures[future], future)
        finally:
            client.cancel(list(futures), force=True)
            client.close()


def orders_of(tasks: Sequence[Task]) -> Iterator[Order]:
    """What each of the tasks, all of one project, needs of the machine that computes it, as it is here."""
    packages = tasks[0].packages
    environment, sources = read_environment(project_of(packages) or Path()), SourceTree(packages)
    for task in tasks:
        yield Order(
            name=task.name,
            function=task.function,
            inputs=task.inputs,
            sources=sources.files_of(task.function.partition(":")[0]),
            python=environment.python,
            packages={**environment.packages, **plain(loaded(sources.installed_of(task.function.partition(":")[0])))},
            kernel=environment.kernel,
            alone=task.alone,
            timeout=task.timeout,
        )


def compute_apart(order: bytes) -> bytes:
    """Compute an order in a fresh process on this machine; the JSON of an `Answer`."""
    done = subprocess.run(
        [sys.executable, "-m", "replication.audit.run.cluster", str(os.getpid())],
        input=order,
        stdout=subprocess.PIPE,
        env={**os.environ, **FIXED, "PYTHONPATH": os.pathsep.join(path or "." for path in sys.path)},
        check=False,
    )
    if done.returncode or not done.stdout:
        return msgspec.json.encode(Answer("", None, 0.0, KILLED))
    return done.stdout


def fulfil(order: Order) -> Answer:
    """Compute `order` in this process, unless this machine has other sources, Python or packages than it asks for."""
    try:
        packages = default_packages(_project(order.function))
        refusal = _other(order, SourceTree(packages))
    except AuditError as error:  # a module or package that only the sender has
        refusal = f"the worker on {os.uname().nodename}: {error}"
    if refusal:
        return Answer(order.name, None, 0.0, refusal)
    named = tuple(order.sources), tuple(order.packages)
    return compute(Task(order.name, order.function, order.inputs, packages, *named, order.alone, order.timeout))


def _project(function: str) -> Path:
    """The directory on this machine that holds the package of `function`."""
    package = function.partition(":")[0].partition(".")[0]
    found = importlib.util.find_spec(package)
    if found is None or not found.submodule_search_locations:
        raise AuditError(f"package {package} is not on this machine; install the project there")
    return Path(found.submodule_search_locations[0]).resolve().parent


def _other(wanted: Order, sources: SourceTree) -> str:
    """What this machine has not as the order wants it, as a sentence; empty if all is there."""
    found = {**sources.files_of(wanted.function.partition(":")[0]), **read_packages(wanted.packages)}
    found |= {"Python": ".".join(map(str, sys.version_info[:2])), KERNEL: kernel()}
    expected = {**wanted.sources, **wanted.packages, "Python": wanted.python, KERNEL: wanted.kernel}
    different = [name for name, value in expected.items() if found.get(name) != value]
    if not different:
        return ""
    listed = ", ".join(different[:4])
    return f"the worker on {os.uname().nodename} has not the same {listed}; install the same commit and lock there"


def _connect(address: str) -> Any:
    """A client of the scheduler, with at least one worker there."""
    from distributed import Client
    from distributed.comm import resolve_address

    client: Any = None
    try:
        resolve_address(address)
        client = Client(address, timeout=TIMEOUT, set_as_default=False)
        client.wait_for_workers(1, timeout=TIMEOUT)
    except (OSError, ValueError) as error:
        if client is None:
            raise AuditError(
                f"no scheduler answers at {address!r} ({error}); start one with `dask scheduler`"
            ) from None
        client.close()
        raise AuditError(f"the scheduler at {address!r} has no worker; start some with `dask worker`") from None
    return client


def _answer(name: str, future: Any) -> Answer:
    """The answer that a future holds; the death of one worker after another over the same task is its failure."""
    from distributed.scheduler import KilledWorker

    try:
        answer = msgspec.json.decode(future.result(), type=Answer)
    except KilledWorker as error:
        return Answer(name, None, 0.0, f"{KILLED} ({error})")
    return msgspec.structs.replace(answer, name=name)


def _main() -> None:
    """Read an order on standard input, write the answer; what the computation prints goes to standard error."""
    end_with(int(sys.argv[1]))
    out = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    answer = fulfil(msgspec.json.decode(sys.stdin.buffer.read(), type=Order))
    with os.fdopen(out, "wb") as stream:
        stream.write(msgspec.json.encode(answer))


if __name__ == "__main__":
    _main()
