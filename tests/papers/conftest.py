"""One audit of all papers, computed from nothing, shared by the tests that look at its outcome."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest

import papers
from replication.audit.run.runner import Outcome, run
from replication.audit.store.cache import Cache

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def fresh_run(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    """The outcome of a run of all papers that reads nothing from an earlier one.

    Processes that share the tests share its cache: the first one computes, the others wait and read what it left.
    """
    own = tmp_path_factory.getbasetemp()
    shared = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    with (shared / "fresh-run.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return run(papers.load(), cache=Cache(shared / "fresh-run"), root=ROOT)
