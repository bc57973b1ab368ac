"""The source papers: each module or package here holds one paper as `PAPER`, and is found by its name."""

from __future__ import annotations

import importlib
import pkgutil
import traceback
from collections.abc import Iterable
from pathlib import Path

from replication.audit.names import one_of
from replication.audit.parts import Paper
from replication.errors import AuditError, ReplicationError

KEYS: tuple[str, ...] = tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))
"""The papers there are, by module name, which is also `Paper.key`."""


def load(keys: Iterable[str] = KEYS) -> tuple[Paper, ...]:
    """The papers of these keys in the order of `KEYS`; raises AuditError for an unknown key, naming the nearest."""
    wanted = {one_of("paper", key, KEYS) for key in keys}
    return tuple(_load(key) for key in KEYS if key in wanted)


def _load(key: str) -> Paper:
    try:
        paper = getattr(importlib.import_module(f"papers.{key}"), "PAPER", None)
    except Exception as error:  # noqa: BLE001 - a paper's modules may fail in any way; whose mistake it is must be said
        raise AuditError(f"papers/{key} cannot be loaded: {_told(error)}; correct it there") from None
    if not isinstance(paper, Paper) or paper.key != key:
        raise AuditError(f"papers/{key} must define PAPER, a Paper whose key is {key!r}, got {paper!r:.80}")
    return paper


def _told(error: Exception) -> str:
    """An error with file and line of the papers; its type only where no sentence of ours explains it."""
    here = Path(__file__).parent
    lines = [part for part in traceback.extract_tb(error.__traceback__) if Path(part.filename).is_relative_to(here)]
    at = [(Path(part.filename), part.lineno) for part in lines[1:]]
    if isinstance(error, SyntaxError) and error.filename:
        at.append((Path(error.filename), error.lineno))
    where = f" [papers/{at[-1][0].relative_to(here).as_posix()}:{at[-1][1]}]" if at else ""
    said = error.msg if isinstance(error, SyntaxError) else " ".join(str(error).split())
    return f"{'' if isinstance(error, ReplicationError) else f'{type(error).__name__}: '}{said}{where}"
