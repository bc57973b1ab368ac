"""How the tests are shared out among processes: those of a file stay together, and so do those of the one full run."""

from __future__ import annotations

import pytest


@pytest.hookimpl(tryfirst=True)  # before xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Name the group of each test for `--dist=loadgroup`, so that fixtures of a module or the session are made once."""
    for item in items:
        whole = "fresh_run" in getattr(item, "fixturenames", ())
        item.add_marker(pytest.mark.xdist_group("one full run" if whole else str(item.path)))
