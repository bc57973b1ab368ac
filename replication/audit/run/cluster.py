"""Experiments on a Dask cluster that already exists: the same tasks, the same answers, on other machines.

Each is computed by a fresh process beside its worker, with the sources on the disk now; one that ends, ends no worker.
"""

import importlib.util
import os
import platform
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.run.pool import KILLED, end_with
from replication.audit.run.tracing import FIXED
from replication.audit.run.worker import Answer, Task, compute
from replication.audit.store.cache import Dependencies
from replication.audit.store.provenance import kernel, plain, python_minor, read_packages
from replication.audit.store.sources import SourceTree, default_packages
from replication.errors import AuditError

KERNEL = "instruction set of the linear algebra (OPENBLAS_CORETYPE chooses it)"
TIMEOUT = 10
"""Seconds to wait for the scheduler, and then for a first worker."""


def on_cluster(address: str, tasks: Sequence[Task]) -> Iterator[Answer]:
    """The answers of the cluster whose scheduler is at `address`, for example `tcp://10.0.0.1:8786`, as they come.

    Its workers need this project at the same sources and the same versions of Python and packages; a worker that has
    others refuses the task. A task whose worker is lost goes to another one, as often as Dask is configured to try.
    Raises AuditError if Dask is not installed or no scheduler or no worker answers.
    """
    try:
        from distributed import as_completed
    except ModuleNotFoundError:
        raise AuditError("a cluster needs Dask: `pip install distributed`, or the extra `dask`") from None
    client = _connect(address)
    futures: dict[Any, str] = {}
    try:
        for task in tasks:
            futures[client.submit(compute_apart, msgspec.json.encode(task), pure=False)] = task.name
        for future in as_completed(futures, loop=client.loop):
            yield _answer(futures[future], future)
    finally:
        client.cancel(list(futures), force=True)
        client.close()


def compute_apart(task: bytes) -> bytes:
    """Compute a task in a fresh process on this machine; the JSON of an `Answer`."""
    process = subprocess.run(
        [sys.executable, "-m", "replication.audit.run.cluster", str(os.getpid())],
        input=task,
        stdout=subprocess.PIPE,
        env={**os.environ, **FIXED, "PYTHONPATH": os.pathsep.join(path or "." for path in sys.path)},
        check=False,
    )
    if process.returncode or not process.stdout:
        return msgspec.json.encode(Answer("", None, 0.0, KILLED))
    return process.stdout


def fulfil(task: Task) -> Answer:
    """Compute `task` in this process, unless this machine has other sources, Python or packages than it depends on."""
    try:
        packages = default_packages(_project(task.dependencies.function))
        refusal = _other(task.dependencies, SourceTree(packages))
    except AuditError as error:  # a module or package that only the sender has
        refusal = f"the worker on {os.uname().nodename}: {error}"
    if refusal:
        return Answer(task.name, None, 0.0, refusal)
    return compute(msgspec.structs.replace(task, packages={name: str(folder) for name, folder in packages.items()}))


def _project(function: str) -> Path:
    """The directory on this machine that holds the package of `function`."""
    package = function.partition(":")[0].partition(".")[0]
    spec = importlib.util.find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise AuditError(f"package {package} is not on this machine; install the project there")
    return Path(spec.submodule_search_locations[0]).resolve().parent


def _other(dependencies: Dependencies, sources: SourceTree) -> str:
    """What this machine has not as a task wants it, as a sentence; empty if all is there."""
    packages = plain(dependencies.packages)
    states = {**sources.files_of(dependencies.function.partition(":")[0]), **read_packages(packages)}
    states |= {"Python": python_minor(platform.python_version()), KERNEL: kernel() if dependencies.kernel else ""}
    expected = {**dependencies.sources, **packages, "Python": dependencies.python, KERNEL: dependencies.kernel}
    different = [name for name, value in expected.items() if states.get(name) != value]
    if not different:
        return ""
    listed = ", ".join(different[:4])
    return f"the worker on {os.uname().nodename} has not the same {listed}; install the same commit and lock there"


def _connect(address: str) -> Any:
    """A client of the scheduler, with at least one worker there."""
    from distributed import Client
    from distributed.comm import resolve_address

    try:
        resolve_address(address)
        client: Any = Client(address, timeout=TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise AuditError(f"no scheduler answers at {address!r} ({error}); start one with `dask scheduler`") from None
    try:
        client.wait_for_workers(1, timeout=TIMEOUT)
    except OSError:
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
    """Read a task on standard input, write the answer; what the computation prints goes to standard error."""
    end_with(int(sys.argv[1]))
    out = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    answer = fulfil(msgspec.json.decode(sys.stdin.buffer.read(), type=Task))
    with os.fdopen(out, "wb") as stream:
        stream.write(msgspec.json.encode(answer))


if __name__ == "__main__":
    _main()
