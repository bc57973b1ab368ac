"""The source papers: each module or package here holds one paper as `PAPER`, and is found by its name."""

from collections.abc import Iterable
from pathlib import Path

from replication.audit.parts import Paper
from replication.audit.project import find_project

_PROJECT = find_project(Path(__file__).parent)
KEYS = _PROJECT.keys


def load(keys: Iterable[str] = KEYS) -> tuple[Paper, ...]:
    """The papers of these keys, in the order of `KEYS`; raises AuditError as `Project.load` does."""
    return _PROJECT.load(keys)
