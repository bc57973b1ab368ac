"""The order of the files: the longest first, so that no core waits for the other at the end."""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).parent
LONGEST = (
    "papers/test_committed.py",
    "recheck/test_both_agree.py",
    "audit/test_site.py",
    "estimation/multirate/test_multirate_optimum.py",
    "recheck/test_recheck.py",
    "verify/test_mutants.py",
    "test_cli.py",
    "verify/test_lines.py",
    "audit/test_runner.py",
)
"""The first one computes what most tests of the papers read."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    first = {HERE / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: first.get(item.path, len(first)))
