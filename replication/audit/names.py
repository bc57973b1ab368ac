"""Names that a reader types: the one meant, or an error that names those nearest to it."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Sequence

from replication.errors import AuditError

LONGEST = 80
"""Characters that a message repeats of what was typed."""


SHOWN = 3
"""Names that a list of them shows; it counts the others."""


def listed(names: Sequence[str]) -> str:
    """The first names, and how many more there are."""
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return f"{', '.join(names[:SHOWN])}{more}"


def one_of(kind: str, name: str, known: Collection[str]) -> str:
    """Return `name` if it is known; raises AuditError that lists up to three similar names, or all if none is."""
    if name in known:
        return name
    raise AuditError(f"unknown {kind} {name[:LONGEST]!r}; {meant(name, known)}")


def meant(name: str, known: Collection[str]) -> str:
    """Up to three known names that are similar to one that is not, as a question; else all, up to ten of them."""
    shown = name[:LONGEST]
    near = difflib.get_close_matches(shown, known, n=3, cutoff=0.5) or [k for k in known if shown and shown in k][:3]
    if near:
        return f"did you mean {' or '.join(near)}?"
    return f"there {'are' if len(known) != 1 else 'is'}: {', '.join(sorted(known)[:10]) or 'none'}"
