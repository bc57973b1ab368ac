"""The order of the files: the longest first, so that no core waits for the other at the end."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# As `make test` has it, before anything loads a BLAS: its threads gain nothing on small matrices, and round otherwise.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

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
    "audit/test_runner.py",
    "test_cli.py",
    "sceptic/test_sceptic.py",
    "audit/test_cluster.py",
    "papers/test_report_page.py",
    "audit/test_browser_access.py",
    "audit/test_browser.py",
    "estimation/nonuniform/test_stamped_design.py",
    "machine/test_coq.py",
    "test_notebooks.py",
    "verify/test_attacks.py",
    "verify/test_arithmetics.py",
    "test_docs.py",
    "audit/test_report.py",
    "audit/test_mistakes.py",
    "estimation/multirate/test_multirate_optimum.py",
    "estimation/multirate/test_losses_c.py",
    "ownplant/test_design_variants.py",
)
"""Those of more than ten seconds. The first one computes what most tests of the papers read."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    first = {HERE / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: first.get(item.path, len(first)))
