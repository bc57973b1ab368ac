"""For all tests: the longest files first, so that no core waits at the end; none writes into the tree; one browser."""

import gc
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from replication.cli import YOUNG

# As `make test` has it, before anything loads a BLAS: its threads gain nothing on small matrices, and round otherwise.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# As on the command line: looking for garbage among thousands of tests and modules, which stay, takes a tenth of a run.
gc.set_threshold(YOUNG)

# The same examples on every machine and run; `make search` draws new ones, and what it finds becomes a fixed case.
settings.register_profile("suite", derandomize=True, database=None, deadline=None)
settings.register_profile("search", deadline=None, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "suite"))

HERE = Path(__file__).parent
LONGEST = (
    "papers/test_committed.py",
    "verify/test_mutants.py",
    "audit/test_site.py",
    "papers/test_processors.py",
    "audit/test_stale.py",
    "machine/test_coq.py",
    "anywhere/test_journal.py",
    "test_docs.py",
    "audit/test_runner.py",
    "audit/test_cluster.py",
    "sceptic/test_sceptic.py",
    "test_notebooks.py",
    "verify/definitions/test_definitions.py",
    "papers/test_report_page.py",
    "audit/test_browser_access.py",
    "audit/test_browser.py",
    "verify/test_attacks.py",
)
"""Those of more than ten seconds. The first one computes what most tests of the papers read."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    first = {HERE / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: first.get(item.path, len(first)))
    if not gc.get_freeze_count():  # else this is a child of such a process, which shares its memory until it touches it
        gc.collect()
        gc.freeze()


def sources() -> set[str]:
    """The files of the tree, without what any run may leave there."""
    root, passing = HERE.parent, {"report", "build", "dist"}
    tops = [path for path in root.iterdir() if not path.name.startswith(".") and path.suffix != ".egg-info"]
    inside = (path for top in tops if top.name not in passing for path in (top, *top.rglob("*")))
    return {str(path.relative_to(root)) for path in inside if "__pycache__" not in path.parts}


@pytest.fixture(scope="session", autouse=True)
def the_tree_stays_as_it_is() -> Iterator[None]:
    """No test leaves a file among the sources: what is there is committed, packed and shown."""
    before = sources()
    yield
    assert sorted(sources() - before) == [], "a test wrote these into the tree; give it `tmp_path`"


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium without a window, one for all tests of a process."""
    if shutil.which("chromium") is None or shutil.which("chromedriver") is None:
        if os.environ.get("CI"):
            pytest.fail("Chromium or its driver is missing; install both (Debian: chromium chromium-driver)")
        pytest.skip("Chromium or its driver is missing; pages are tried where they are installed")
    from benchmarks.readme import started

    opened = started()
    yield opened
    opened.quit()
