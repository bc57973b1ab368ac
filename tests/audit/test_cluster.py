"""Runs on a Dask cluster of two workers: the same results as by processes, and nothing lost when a worker dies."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from distributed import Client, LocalCluster
from lab import Lab, make_lab
from test_runner import without_seconds

from tests.patience import PATIENCE, wait_for

pytestmark = pytest.mark.slow

ORDER = """
import msgspec, papers
from pathlib import Path
from replication.audit.store.cache import Cache
from replication.audit.run.worker import processes
from replication.audit.run.runner import run

def spy(tasks):
    (task,) = (task for task in tasks if task.name == "toy2020.square")
    print(msgspec.json.encode(task).decode())
    return processes(tasks, 1)

run(papers.load(papers.KEYS), cache=Cache(Path(".cache")), root=Path.cwd(), executor=spy)
"""


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return make_lab(tmp_path)


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Lab, Any]]:
    """A project, and a cluster that has its environment."""
    lab = make_lab(tmp_path_factory.mktemp("cluster"))
    with pytest.MonkeyPatch.context() as patch:
        for name, value in lab.environment().items():
            patch.setenv(name, value)
        patch.chdir(lab.root)
        with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
            yield lab, cluster


@pytest.fixture
def shared(running: tuple[Lab, Any], tmp_path: Path) -> Iterator[tuple[Lab, Any]]:
    """The same for one test after another; its papers are as they were again."""
    papers = running[0].path("")
    shutil.copytree(papers, tmp_path / "kept")
    yield running
    shutil.copytree(tmp_path / "kept", papers, dirs_exist_ok=True)


def results(lab: Lab) -> Any:
    return json.loads((lab.root / "report" / "results.json").read_text(encoding="utf-8"))


def on(cluster: Any) -> tuple[str, ...]:
    return "run", "--no-cache", "--scheduler", cluster.scheduler_address


def test_code_that_ends_its_process_is_an_error_and_no_dead_worker(shared: tuple[Lab, Any]) -> None:
    lab, cluster = shared
    lab.edit("toy2020/squares.py", "def square(", "import os\n\n\ndef square(")
    lab.edit("toy2020/squares.py", "    return", "    os._exit(7)\n    return")
    done = lab.cli(*on(cluster))
    assert done.returncode == 3
    errors = {record["name"]: record["error"] for record in results(lab)["experiments"] if record["error"]}
    assert list(errors) == ["toy2020.square"]
    assert "process was killed" in errors["toy2020.square"]


def test_two_workers_of_which_one_is_killed_give_what_one_process_gives(shared: tuple[Lab, Any]) -> None:
    lab, cluster = shared
    for label in "ab":
        lab.edit("toy2020/experiments.py", f'"seconds": 0.0, "label": "{label}"', f'"seconds": 2.0, "label": "{label}"')
    command = [sys.executable, "-m", "replication", *on(cluster)]
    run = subprocess.Popen(command, cwd=lab.root, env=lab.environment(), stdout=subprocess.PIPE, text=True)
    with Client(cluster) as client:
        victim = wait_for(lambda: busy(client))
        pid = client.run(os.getpid, workers=[victim])[victim]
    os.kill(pid, signal.SIGKILL)
    run.communicate(timeout=PATIENCE)
    assert run.returncode == 0
    killed = without_seconds(results(lab))
    assert lab.cli("run", "--jobs", "1", "--no-cache").returncode == 0
    assert killed == without_seconds(results(lab))


def test_worker_with_other_sources_refuses(lab: Lab) -> None:
    order = lab.python("-c", ORDER).stdout
    assert fulfilled(lab, order)["error"] == ""
    given = json.loads(order)
    other = json.dumps({**given, "dependencies": {**given["dependencies"], "kernel": "Z80"}})
    assert "has not the same instruction set of the linear algebra" in fulfilled(lab, other)["error"]
    lab.edit("toy2020/squares.py", "product", "multiple")
    assert "has not the same papers/toy2020/squares.py; install the same commit" in fulfilled(lab, order)["error"]
    lab.path("toy2020/squares.py").unlink()
    assert "papers.toy2020.squares is not a file" in fulfilled(lab, order)["error"]


SOON = """
import contextlib, io, json, sys
from replication.audit.run import worker
from replication.cli import main
assert worker.CONNECTING > 1
worker.CONNECTING = 1
for words in json.loads(sys.argv[1]):
    with contextlib.redirect_stderr(io.StringIO()) as told:
        code = main(["run", *words])
    print(json.dumps([code, told.getvalue()]))
"""
"""The command line, which waits a second alone for a scheduler."""
ADVICE = {
    ("--scheduler", "x://y", "--jobs", "2"): "--jobs is for processes of this machine",
    ("--scheduler", "x://y:1"): "no scheduler answers at 'x://y:1'",
    ("--scheduler", "tcp://127.0.0.1:1"): "start one with `dask scheduler`",
}


def test_wrong_options_say_what_to_do(lab: Lab) -> None:
    done = lab.python("-c", SOON, json.dumps([*ADVICE]))
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
    for advice, line in zip(ADVICE.values(), done.stdout.splitlines(), strict=True):
        code, told = json.loads(line)
        assert code == 2 and advice in told and "Traceback" not in told


def fulfilled(lab: Lab, order: str) -> Any:
    command = [sys.executable, "-m", "replication.audit.run.worker", str(os.getpid())]
    done = subprocess.run(command, cwd=lab.root, env=lab.environment(), input=order, capture_output=True, text=True)
    return json.loads(done.stdout)


def busy(client: Any) -> str | None:
    return next((worker for worker, tasks in client.processing().items() if tasks), None)
