"""One audit of all papers, computed from nothing, shared by the tests that look at its outcome."""

import fcntl
import os
from functools import partial
from pathlib import Path

import computed
import pytest

import papers
from replication.audit.run.runner import Outcome, run
from replication.audit.run.worker import processes
from replication.audit.store.cache import Cache


@pytest.fixture(scope="session", autouse=True)
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of all results that the tests compute; processes that share the tests share it."""
    own = tmp_path_factory.getbasetemp()
    shared = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    computed.STORE[:] = [Cache(shared / "fresh-run")]
    return shared


@pytest.fixture(scope="session")
def fresh_run(store: Path) -> Outcome:
    """The outcome of a run of all papers that reads nothing from an earlier one.

    The first process that asks computes it, in one more: each has to import all of the library. The others wait and
    read what it left.
    """
    with (store / "fresh-run.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return run(papers.load(), cache=computed.STORE[0], root=computed.ROOT, executor=partial(processes, jobs=1))
