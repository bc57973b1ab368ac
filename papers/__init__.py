"""The source papers: each module or package here holds one paper as `PAPER`, and is found by its name."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable

from replication.audit.model import Paper
from replication.audit.names import one_of
from replication.errors import AuditError

KEYS: tuple[str, ...] = tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))
"""The papers there are, by module name, which is also `Paper.key`."""


def load(keys: Iterable[str] = KEYS) -> tuple[Paper, ...]:
    """The papers of these keys in the order of `KEYS`; raises AuditError for an unknown key, naming the nearest."""
    wanted = {one_of("paper", key, KEYS) for key in keys}
    return tuple(_load(key) for key in KEYS if key in wanted)


def _load(key: str) -> Paper:
    paper = getattr(importlib.import_module(f"papers.{key}"), "PAPER", None)
    if not isinstance(paper, Paper) or paper.key != key:
        raise AuditError(f"papers/{key} must define PAPER, a Paper whose key is {key!r}, got {paper!r:.80}")
    return paper
