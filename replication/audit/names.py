"""Names that a reader types: the one meant, or an error that names those nearest to it."""

from __future__ import annotations

import difflib
from collections.abc import Collection

from replication.errors import AuditError


def one_of(kind: str, name: str, known: Collection[str]) -> str:
    """Return `name` if it is known; raises AuditError that lists up to three similar names, or all if none is."""
    if name in known:
        return name
    near = difflib.get_close_matches(name, known, n=3, cutoff=0.5) or [k for k in known if name and name in k][:3]
    if near:
        raise AuditError(f"unknown {kind} {name!r}; did you mean {' or '.join(near)}?")
    listed = ", ".join(sorted(known)[:10]) or "none"
    raise AuditError(f"unknown {kind} {name!r}; there {'are' if len(known) != 1 else 'is'}: {listed}")
