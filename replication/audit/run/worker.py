"""Experiments, run: each found by name, given its inputs, timed, its result as JSON text or its failure as a sentence.

They run in parallel processes, with an answer also for one that kills its process. On a Dask cluster that already
exists they are the same tasks with the same answers, on other machines: each is computed by a fresh process beside its
worker, with the sources on the disk now; one that ends, ends no worker.
"""

import contextlib
import functools
import importlib.util
import json
import os
import pkgutil
import platform
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from enum import StrEnum
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.model import Experiment
from replication.audit.run.chance import CLOCK, dates, kept_environment, shared_generators, shared_state
from replication.audit.run.tracing import FIXED, loose, noted, others, ours, traced
from replication.audit.store.cache import Dependencies, Entry, encode
from replication.audit.store.provenance import THREADS, kernel, plain, python_minor, read_packages
from replication.audit.store.sources import SourceTree, default_packages
from replication.errors import AuditError, ReplicationError
from replication.extras import told
from replication.verify.workers import heard_later

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
        data, unseen = noted(trace, tree, sources, more)
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

    def __str__(self) -> str:
        text = f"{self.action} {self.name}"
        if self.action is not Action.REUSED:
            text += f" in {self.seconds:.1f} s"
        return f"{text} ({self.reason}){self.error and f': {self.error}'}"


KERNEL = "instruction set of the linear algebra (OPENBLAS_CORETYPE chooses it)"
CONNECTING = 10
"""Seconds to wait for the scheduler, and then for a first worker."""


def on_cluster(address: str, tasks: Sequence[Task]) -> Iterator[Answer]:
    """The answers of the cluster whose scheduler is at `address`, for example `tcp://10.0.0.1:8786`, as they come.

    Its workers need this project at the same sources and the same versions of Python and packages; a worker that has
    others refuses the task. A task whose worker is lost goes to another one, as often as Dask is configured to try.
    Raises AuditError if Dask is not installed or no scheduler or no worker answers.
    """
    try:
        from distributed import as_completed
        from distributed.scheduler import KilledWorker
    except ModuleNotFoundError:
        raise AuditError("a cluster needs Dask: `pip install distributed`, or the extra `dask`") from None
    client = _connect(address)
    futures: dict[Any, str] = {}
    try:
        for task in tasks:
            futures[client.submit(compute_apart, msgspec.json.encode(task), pure=False)] = task.name
        for future in as_completed(futures, loop=client.loop):
            try:
                answer = msgspec.json.decode(future.result(), type=Answer)
            except KilledWorker as error:  # one worker after another died over the same task
                answer = Answer("", None, 0.0, f"{KILLED} ({error})")
            yield msgspec.structs.replace(answer, name=futures[future])
    finally:
        client.cancel(list(futures), force=True)
        client.close()


def compute_apart(task: bytes) -> bytes:
    """Compute a task in a fresh process on this machine; the JSON of an `Answer`."""
    process = subprocess.run(
        [sys.executable, "-m", "replication.audit.run.worker", str(os.getpid())],
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
    package = task.dependencies.function.partition(":")[0].partition(".")[0]
    try:
        spec = importlib.util.find_spec(package)
        if spec is None or not spec.submodule_search_locations:
            raise AuditError(f"package {package} is not on this machine; install the project there")
        packages = default_packages(Path(spec.submodule_search_locations[0]).resolve().parent)
        refusal = _other(task.dependencies, SourceTree(packages))
    except AuditError as error:  # a module or package that only the sender has
        refusal = f"the worker on {os.uname().nodename}: {error}"
    if refusal:
        return Answer(task.name, None, 0.0, refusal)
    return compute(msgspec.structs.replace(task, packages={name: str(folder) for name, folder in packages.items()}))


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
        client: Any = Client(address, timeout=CONNECTING, set_as_default=False)
    except (OSError, ValueError) as error:
        raise AuditError(f"no scheduler answers at {address!r} ({error}); start one with `dask scheduler`") from None
    try:
        client.wait_for_workers(1, timeout=CONNECTING)
    except OSError:
        client.close()
        raise AuditError(f"the scheduler at {address!r} has no worker; start some with `dask worker`") from None
    return client


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
