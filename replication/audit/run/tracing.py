"""Which data files of the project a computation reads: it depends on them, and nobody has to declare them.

What is read while a module is imported is seen in its source instead (`store.sources`); what another program reads that
a computation starts is not seen.
"""

from __future__ import annotations

import contextlib
import functools
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from replication.audit.store.sources import SourceTree, project_of

CODE = (".py", ".pyc", ".so")
_opened: list[str] | None = None


def data_tree(packages: Mapping[str, Path]) -> SourceTree:
    """The files that count as data: those of the packages, and of the project in which the papers lie."""
    root = project_of(packages)
    return SourceTree({**packages, **({} if root is None else {".": root})})


@contextlib.contextmanager
def opened_files() -> Iterator[list[str]]:
    """The paths that are opened for reading meanwhile."""
    global _opened
    _listen()
    found: list[str] = []
    _opened = found
    try:
        yield found
    finally:
        _opened = None


def checksums(paths: Iterable[str], tree: SourceTree) -> dict[str, str]:
    """SHA-256 by label of the data files among `paths`; code, hidden folders and installed packages are none."""
    labels = {tree.label(Path(path).resolve()) for path in paths if not path.endswith(CODE)}
    data = {label: tree.now(label) for label in sorted(labels) if not _foreign(label)}
    return {label: sha256 for label, sha256 in data.items() if sha256 is not None}


def _foreign(label: str) -> bool:
    inside = label.removeprefix("./").split("/")
    return not label or any(part.startswith(".") or part == "site-packages" for part in inside)


@functools.cache
def _listen() -> None:
    """Python keeps such a listener as long as the process lives."""
    sys.addaudithook(_hear)


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    if event != "open" or _opened is None or not isinstance(arguments[0], str | bytes):
        return
    if not (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR):
        _opened.append(os.path.abspath(os.fsdecode(arguments[0])))  # noqa: PTH100 - the folder may change later
