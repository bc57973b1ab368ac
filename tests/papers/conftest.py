"""One audit of all papers, computed from nothing, shared by the tests that look at its outcome."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import papers
from replication.audit.cache import Cache
from replication.audit.runner import Outcome, run

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def fresh_run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Outcome]:
    """The outcome of a run of all papers that reads nothing from an earlier one."""
    yield run(papers.load(), cache=Cache(tmp_path_factory.mktemp("cache")), root=ROOT)
